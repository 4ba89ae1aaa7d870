"""Counting sort by a digit: the first step of putting AABBs in the order of the grid's cells or the octree's codes."""

from __future__ import annotations

import numpy as np

from particlesim.core.jit import entry_kernel
from particlesim.core.parallel import ThreadTeam


@entry_kernel
def _count(first, last, keys, shift, counts):
    for slot in range(first, last):
        counts[np.uint64(keys[slot] >> shift)] += 1


@entry_kernel
def _scan(counts, starts):
    """Counts (threads, buckets) become the places where each thread's part of each bucket starts."""
    total = 0
    for bucket in range(counts.shape[1]):
        starts[bucket] = total
        for thread in range(counts.shape[0]):
            size = counts[thread, bucket]
            counts[thread, bucket] = total
            total += size
    starts[counts.shape[1]] = total


@entry_kernel
def _place(first, last, keys, order, shift, cursors, keys_out, order_out):
    for slot in range(first, last):
        bucket = np.uint64(keys[slot] >> shift)
        place = np.uint64(cursors[bucket])
        cursors[bucket] = place + np.uint64(1)
        keys_out[place] = keys[slot]
        order_out[place] = order[slot]


def counting_sort(
    keys: np.ndarray, order: np.ndarray, buckets: int, team: ThreadTeam, *, shift: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Sort by the bucket ``key >> shift``, below ``buckets``, of which there are few; equal ones stay in order.

    ``keys`` (n,) integers and ``order`` (n,) int32 move together.  Returns both, sorted, and where each bucket starts
    (buckets + 1,) int32.  Each thread counts and places a range of its own, so the result is the same for any number
    of threads.
    """
    counts = np.zeros((team.threads, buckets), dtype=np.int32)
    starts = np.empty(buckets + 1, dtype=np.int32)
    keys_out, order_out = np.empty_like(keys), np.empty_like(order)

    def count(thread: int, first: int, last: int) -> None:
        _count(first, last, keys, shift, counts[thread])

    def place(thread: int, first: int, last: int) -> None:
        _place(first, last, keys, order, shift, counts[thread], keys_out, order_out)

    team.each(count, len(keys))
    _scan(counts, starts)
    team.each(place, len(keys))
    return keys_out, order_out, starts
