"""What every broad phase shares: the box test, the list of found pairs, the canonical order.

While a method searches, boxes lie in columns ``(lower x y z, upper x y z)`` of a (6, n + LANES) float64 array, in
the order that suits the method, and ``order`` (n,) int32 gives the number of each in the caller's arrays.  A found
pair is one int64 key, ``i << 32 | j`` with i < j.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from particlesim.crew import Crew
from particlesim.jit import kernel

# Candidates are taken in portions of this many, the bits of a number; a list of pairs has room for one portion more
# than it holds, so that a portion is stored without a check at each candidate.
PORTION = 32

# Boxes tested at once: a whole number of vectors of four or eight float64.  Boxes are stored with so many unused ones
# at the end, for the last vector of all.
LANES = 8

# Blocks a search is cut into for each thread: the work in a block is uneven.
BLOCKS_PER_THREAD = 16

# Rounding of coordinates and of their differences, relative to the largest coordinate: 32 units in the last place.
# Wherever a method sorts boxes by rounded numbers, it widens its reach by this.
SLACK = 2.0**-47

_LOW_HALF = 0xFFFFFFFF


@kernel
def box_of(boxes, index):
    """Row ``index`` of an (n, 6) array as a tuple, which stays in registers."""
    return (
        boxes[index, 0], boxes[index, 1], boxes[index, 2], boxes[index, 3], boxes[index, 4], boxes[index, 5]
    )  # fmt: skip


@kernel
def column_of(boxes, index):
    """Column ``index`` of a (6, n) array as a tuple."""
    return (
        boxes[0, index], boxes[1, index], boxes[2, index], boxes[3, index], boxes[4, index], boxes[5, index]
    )  # fmt: skip


@kernel
def intervals_overlap(lower_a, upper_a, lower_b, upper_b, period):
    """Whether two closed intervals overlap, on a line (``period`` 0) or on a circle of length ``period``.

    On a circle the nearest image of b is tested; no other image is nearer.  The two differences are compared with the
    shift, not shifted themselves: the answer is then the same to the last bit with a and b exchanged.
    """
    shift = 0.0
    if period > 0.0:
        shift = period * np.rint(0.5 * ((lower_b + upper_b) - (lower_a + upper_a)) / period)
    return (lower_a - upper_b <= -shift) & (lower_b - upper_a <= shift)


@kernel
def boxes_overlap(a, b, period, wraps):
    """The box test of every method.  ``period`` (3,) [m], 0 on axes that do not wrap; ``wraps``: any does."""
    if wraps:
        return (
            intervals_overlap(a[0], a[3], b[0], b[3], period[0])
            & intervals_overlap(a[1], a[4], b[1], b[4], period[1])
            & intervals_overlap(a[2], a[5], b[2], b[5], period[2])
        )
    return (a[0] <= b[3]) & (b[0] <= a[3]) & (a[1] <= b[4]) & (b[1] <= a[4]) & (a[2] <= b[5]) & (b[2] <= a[5])


@kernel
def any_wraps(period):
    """Whether any axis is periodic."""
    return period[0] > 0.0 or period[1] > 0.0 or period[2] > 0.0


@kernel
def append_overlaps(boxes, order, index, first, last, period, wraps, keys, found):
    """Test box ``index`` against boxes ``first .. last``, store overlaps from ``keys[found]``; the new ``found``.

    Where ``keys`` has no room for another portion, overlaps are counted and not stored: the list is whole if the
    final ``found`` leaves room for a portion (``collect`` sees to it).

    The inner loops have no branch, unsigned indices (which spare the check for negative ones) and, where nothing
    wraps, a length that is a multiple of ``LANES``: the compiler then tests a vector of boxes at once.
    """
    box = column_of(boxes, index)
    number = np.int64(order[index])
    for start in range(first, last, PORTION):
        span = min(last - start, PORTION)
        base = np.uint64(start)
        bits = np.int64(0)  # bit k: the box overlaps box start + k
        if wraps:
            for lane in range(span):
                other = column_of(boxes, base + np.uint64(lane))
                bits |= np.int64(boxes_overlap(box, other, period, True)) << lane
        else:
            for lane in range((span + LANES - 1) & -LANES):
                other = column_of(boxes, base + np.uint64(lane))
                bits |= np.int64(boxes_overlap(box, other, period, False)) << lane
            bits &= (1 << span) - 1
        if bits:
            if found + PORTION <= keys.size:
                fill = np.uint64(found)
                for lane in range(span):
                    near = np.int64(order[base + np.uint64(lane)])
                    keys[fill] = min(number, near) << 32 | max(number, near)  # overwritten unless the bit is set
                    fill += np.uint64(bits >> lane & 1)
                found = np.int64(fill)
            else:
                for lane in range(span):
                    found += bits >> lane & 1
    return found


@kernel
def gather_boxes(first, last, lower, upper, order, boxes):
    """Fill columns ``first .. last`` of ``boxes`` with the boxes that ``order`` names."""
    for place in range(first, last):
        source = order[place]
        for axis in range(3):
            boxes[axis, place] = lower[source, axis]
            boxes[axis + 3, place] = upper[source, axis]


def gathered(lower: np.ndarray, upper: np.ndarray, order: np.ndarray, crew: Crew) -> np.ndarray:
    """The boxes that ``order`` (n,) int32 names, as (6, n + LANES) float64."""
    boxes = np.zeros((6, len(order) + LANES))
    crew.each(lambda _, first, last: gather_boxes(first, last, lower, upper, order, boxes), len(order))
    return boxes


def collect(
    search: Callable[[int, int, np.ndarray], tuple[int, int]], count: int, crew: Crew, expected: int
) -> tuple[list[np.ndarray], int]:
    """Run ``search(first, last, keys) -> (found, tested)`` over ``0 .. count``; the lists of keys and tests made.

    ``expected`` pairs in all are given room at first; a block that finds more is searched again with room for all.
    """

    def block(_: int, first: int, last: int) -> tuple[np.ndarray, int]:
        keys = np.empty(expected * (last - first) // max(count, 1) + 16 * PORTION, dtype=np.int64)
        found, tested = search(first, last, keys)
        if found + PORTION > keys.size:
            keys = np.empty(found + PORTION, dtype=np.int64)
            found, tested = search(first, last, keys)
        return keys[:found], tested

    results = crew.each(block, count, BLOCKS_PER_THREAD * crew.threads)
    return [keys for keys, _ in results], sum(tested for _, tested in results)


@kernel
def _count_rows(keys, first, last, ends):
    for slot in range(keys.size):
        row = keys[slot] >> 32
        if first <= row < last:
            ends[row] += 1


@kernel
def _fill_rows(keys, first, last, cursors, columns):
    for slot in range(keys.size):
        row = keys[slot] >> 32
        if first <= row < last:
            columns[cursors[row]] = keys[slot] & _LOW_HALF
            cursors[row] += 1


@kernel
def _sort_row(columns, start, stop):
    """Shell's sort with the gaps of Knuth (The Art of Computer Programming 3, 5.2.1); insertion for short rows."""
    gap = 1
    while 3 * gap + 1 < (stop - start) // 3:
        gap = 3 * gap + 1
    while gap > 0:
        for slot in range(start + gap, stop):
            value = columns[slot]
            hole = slot
            while hole >= start + gap and columns[hole - gap] > value:
                columns[hole] = columns[hole - gap]
                hole -= gap
            columns[hole] = value
        gap //= 3


@kernel
def _write_rows(first, last, ends, columns, pairs):
    for row in range(first, last):
        start = ends[row - 1] if row > 0 else 0
        _sort_row(columns, start, ends[row])
        for slot in range(start, ends[row]):
            pairs[slot, 0] = row
            pairs[slot, 1] = columns[slot]


def canonical(lists: list[np.ndarray], count: int, crew: Crew) -> np.ndarray:
    """All keys of ``lists`` as (m, 2) int64 pairs sorted by (i, j), among ``count`` boxes.

    Each thread takes a range of rows i and picks its keys from all lists: counted, placed by row, rows sorted.
    """
    sizes = np.zeros(count, dtype=np.int64)
    total = sum(keys.size for keys in lists)

    def count_block(_: int, first: int, last: int) -> None:
        for keys in lists:
            _count_rows(keys, first, last, sizes)

    crew.each(count_block, count)
    # A row's cursor starts where the row starts and, the row filled, stands where it ends.
    cursors = np.cumsum(sizes)
    cursors -= sizes
    columns = np.empty(total, dtype=np.int32)
    pairs = np.empty((total, 2), dtype=np.int64)

    def write_block(_: int, first: int, last: int) -> None:
        for keys in lists:
            _fill_rows(keys, first, last, cursors, columns)

    crew.each(write_block, count)
    crew.each(lambda _, first, last: _write_rows(first, last, cursors, columns, pairs), count)
    return pairs
