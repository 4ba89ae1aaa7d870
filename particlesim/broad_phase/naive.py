"""Every pair: the reference that the other methods are held to, n (n - 1) / 2 tests."""

from __future__ import annotations

import numpy as np

from particlesim.broad_phase.aabb_test import BATCH, StoredAabbs, append_overlaps, collect
from particlesim.broad_phase.pair_sort import sort_pairs
from particlesim.broad_phase.soa_aabb import LANES, load_soa, lowest, overlap_bits
from particlesim.core.jit import entry_kernel
from particlesim.core.parallel import ThreadTeam

# AABBs that are tested against a whole range before the next is taken: 24 kB, which stay in the fastest cache.
TILE = 1024


@entry_kernel
def _search(first, last, soa, stored, keys):
    """All pairs whose smaller number lies in ``first .. last``: (found, tested)."""
    count = stored.order.size
    candidates = np.empty((2, BATCH), dtype=np.uint32)
    size = 0
    found = 0
    tested = 0
    for tile in range(first, count, TILE):
        for index in range(first, min(last, tile + TILE)):
            aabb = load_soa(soa, index)
            start = max(tile, index + 1)
            stop = min(count, tile + TILE)
            tested += stop - start
            for base in range(start, stop, LANES):
                bits = overlap_bits(soa, np.uint64(base), aabb) & ((1 << min(LANES, stop - base)) - 1)
                while bits:
                    candidates[0, size] = index
                    candidates[1, size] = np.uint64(base) + lowest(bits)
                    bits &= bits - 1
                    size += 1
                if size > BATCH - LANES:
                    found = append_overlaps(candidates, size, stored, keys, found)
                    size = 0
    return append_overlaps(candidates, size, stored, keys, found), tested


def naive_pairs(
    lower: np.ndarray, upper: np.ndarray, period: np.ndarray, *, threads: int | None = None
) -> tuple[np.ndarray, int]:
    """Pairs (m, 2) int64 and the number of AABB tests.  Arguments as checked by ``find_pairs``."""
    count = len(lower)
    stored = StoredAabbs(np.concatenate([lower, upper], axis=1), np.arange(count, dtype=np.int32), period)
    soa = np.zeros((6, count + LANES), dtype=np.float32)
    with np.errstate(over="ignore"):  # beyond float32 is infinity, which overlaps as it should
        soa[:, :count] = stored.bounds.T
    for axis in np.flatnonzero(period > 0.0):
        soa[axis], soa[axis + 3] = -np.inf, np.inf  # the exact test alone knows of images
    team = ThreadTeam(count, threads)
    lists, tested = collect(lambda first, last, keys: _search(first, last, soa, stored, keys), count, team, 4 * count)
    return sort_pairs(lists, count, team), tested
