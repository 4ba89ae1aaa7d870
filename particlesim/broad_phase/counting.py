"""Counting sort of int64 keys: the order of the particles in the grid, and a digit of the octree's codes."""

from __future__ import annotations

import numpy as np

from particlesim.crew import Crew
from particlesim.jit import kernel

# Digits of a radix sort [bits]: counters of one digit stay in the fast cache, a few keys do not clear thousands.
DIGIT = 11
DIGIT_FEW = 8
FEW = 4096


@kernel
def _count(first, last, keys, shift, mask, counts):
    for slot in range(first, last):
        counts[(keys[slot] >> shift) & mask] += 1


@kernel
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


@kernel
def _place(first, last, keys, order, shift, mask, cursors, keys_out, order_out):
    for slot in range(first, last):
        bucket = (keys[slot] >> shift) & mask
        place = cursors[bucket]
        cursors[bucket] = place + 1
        keys_out[place] = keys[slot]
        order_out[place] = order[slot]


def counting_sort(
    keys: np.ndarray, order: np.ndarray, buckets: int, crew: Crew, *, shift: int = 0, mask: int = -1
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Sort by the bucket ``(key >> shift) & mask``, below ``buckets``; equal ones stay in order.

    ``keys`` (n,) int64 and ``order`` (n,) int32 move together.  Returns both, sorted, and where each bucket starts
    (buckets + 1,) int32.  Each thread counts and places a range of its own, so the result is the same for any number
    of threads.
    """
    counts = np.zeros((crew.threads, buckets), dtype=np.int32)
    starts = np.empty(buckets + 1, dtype=np.int32)
    keys_out, order_out = np.empty_like(keys), np.empty_like(order)

    def count(thread: int, first: int, last: int) -> None:
        _count(first, last, keys, shift, mask, counts[thread])

    def place(thread: int, first: int, last: int) -> None:
        _place(first, last, keys, order, shift, mask, counts[thread], keys_out, order_out)

    crew.each(count, len(keys))
    _scan(counts, starts)
    crew.each(place, len(keys))
    return keys_out, order_out, starts


def radix_sort(keys: np.ndarray, order: np.ndarray, low: int, high: int, crew: Crew) -> tuple[np.ndarray, np.ndarray]:
    """Sort non-negative ``keys`` (n,) int64 with their ``order`` (n,) int32 by the bits ``low .. high`` of the keys.

    One counting sort a digit, from the lowest; digits in which no two keys differ are left out.
    """
    differing = int(np.bitwise_or.reduce(keys ^ keys[0]))
    digit = DIGIT if len(keys) > FEW else DIGIT_FEW
    for shift in range(low, high, digit):
        bits = min(digit, high - shift)
        if (differing >> shift) & ((1 << bits) - 1):
            mask = (1 << bits) - 1
            keys, order, _ = counting_sort(keys, order, 1 << bits, crew, shift=shift, mask=mask)
    return keys, order
