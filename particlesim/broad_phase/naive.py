"""Every pair: the reference that the other methods are held to, n (n - 1) / 2 tests."""

from __future__ import annotations

import numpy as np

from particlesim.broad_phase.pairs import any_wraps, append_overlaps, canonical, collect, gathered
from particlesim.crew import Crew
from particlesim.jit import kernel

# Boxes that are tested against a whole range before the next is taken: 48 kB, which stay in the fastest cache.
TILE = 1024


@kernel
def _search(first, last, boxes, order, period, keys):
    """All pairs whose smaller number lies in ``first .. last``: (found, tested)."""
    wraps = any_wraps(period)
    count = order.size
    found = 0
    tested = 0
    for tile in range(first, count, TILE):
        for index in range(first, min(last, tile + TILE)):
            start = max(tile, index + 1)
            stop = min(count, tile + TILE)
            found = append_overlaps(boxes, order, index, start, stop, period, wraps, keys, found)
            tested += stop - start
    return found, tested


def naive_pairs(lower: np.ndarray, upper: np.ndarray, period: np.ndarray) -> tuple[np.ndarray, int]:
    """Pairs (m, 2) int64 and the number of box tests.  Arguments as checked by ``find_pairs``."""
    count = len(lower)
    order = np.arange(count, dtype=np.int32)
    with Crew(count) as crew:
        boxes = gathered(lower, upper, order, crew)
        lists, tested = collect(
            lambda first, last, keys: _search(first, last, boxes, order, period, keys), count, crew, 4 * count
        )
        return canonical(lists, count, crew), tested
