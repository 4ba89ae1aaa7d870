"""Boxing: a uniform grid of cells, and tests between boxes in near cells only.

S. Goodwin, "Analysis of Efficient Collision Detection using Pre-Processing Data Structures", section II.  Boxes are
counted into the cells of their centres and stored in the order of the cells, x fastest, so that neighbouring cells
of a row are one range of boxes.  A box is tested against those after it in its own row and against the rows after
its own that it can reach: half of the neighbourhood, which meets each pair once.
"""

from __future__ import annotations

import numpy as np

from particlesim.broad_phase.aabb_statistics import survey
from particlesim.broad_phase.aabb_test import BATCH, any_wraps, append_overlaps, collect, row_of
from particlesim.broad_phase.counting_sort import counting_sort
from particlesim.broad_phase.grid_layout import Layout, buckets_of_box, fill_keys, lay_out
from particlesim.broad_phase.pair_sort import canonical
from particlesim.core.jit import kernel
from particlesim.core.parallel import ThreadTeam

# Ranges of candidates that are listed before they are tested, or as many as one box has: 192 kB.
_RANGES = 16384

# Bands of buckets, 2**9 at most; up to _FEW boxes are one band.
_BAND_BITS = 9
_FEW = 4096


@kernel
def _fill_band(first, last, first_bucket, stop_bucket, keys, indices, numbers, lower, upper, starts, order, buckets,
               boxes):  # fmt: skip
    """Sort a band, places ``first .. last``, by bucket; where its buckets start, and the boxes in their order."""
    for bucket in range(first_bucket, stop_bucket):
        starts[bucket + 1] = 0
    for slot in range(first, last):
        starts[np.uint64(keys[slot] + 1)] += 1
    # While a band is filled its places start one bucket to the right; the band before owns the first of them.
    place = first
    for bucket in range(first_bucket, stop_bucket):
        size = starts[bucket + 1]
        starts[bucket + 1] = place
        place += size
    for slot in range(first, last):
        key = np.uint64(keys[slot])
        spot = np.uint64(starts[key + np.uint64(1)])
        starts[key + np.uint64(1)] = spot + np.uint64(1)
        order[spot] = indices[slot]
        buckets[spot] = key
    for slot in range(first, last):
        index = np.uint64(order[slot])
        order[slot] = numbers[index]
        boxes[slot, 0] = lower[index, 0]
        boxes[slot, 1] = lower[index, 1]
        boxes[slot, 2] = lower[index, 2]
        boxes[slot, 3] = upper[index, 0]
        boxes[slot, 4] = upper[index, 1]
        boxes[slot, 5] = upper[index, 2]


@kernel
def _folded(bucket, shape, wraps):
    """A bucket's number once around; -1 outside an axis that does not wrap."""
    if 0 <= bucket < shape:
        return bucket
    return bucket % shape if wraps else -1


@kernel
def _rows_after(row, shape, reach, wraps, rows):
    """First buckets of the rows that the boxes in ``row`` reach, half of the neighbourhood; how many."""
    y = row // shape[0] % shape[1]
    z = row // (shape[0] * shape[1])
    size = 0
    for layer in range(reach[2] + 1):
        near_z = _folded(z + layer, shape[2], wraps[2])
        if near_z < 0:
            break
        for line in range(-reach[1] if layer > 0 else 1, reach[1] + 1):
            near_y = _folded(y + line, shape[1], wraps[1])
            if near_y >= 0:
                rows[size] = (near_z * shape[1] + near_y) * shape[0]
                size += 1
    return size


@kernel
def _add_ranges(first, last, buckets, starts, shape, reach, around, rows, ranges):
    """The candidates of boxes ``first .. last``, as rows (box, start, stop) of ``ranges``; how many rows."""
    length = shape[0]
    reach_x = reach[0]
    wraps = around[0]
    row = -length
    near_rows = 0
    size = np.uint64(0)
    for index in range(first, last):
        bucket = np.int64(buckets[index])
        if bucket - row >= length:
            row = bucket - bucket % length
            near_rows = _rows_after(row, shape, reach, around, rows)
        left = bucket - row - reach_x
        right = bucket - row + reach_x
        start = max(left, 0)
        stop = min(right, length - 1) + 1
        ranges[size, 0] = index
        ranges[size, 1] = index + 1
        ranges[size, 2] = starts[np.uint64(row + stop)]
        size += np.uint64(1)
        for near in range(near_rows):
            place = rows[near]
            ranges[size, 0] = index
            ranges[size, 1] = starts[np.uint64(place + start)]
            ranges[size, 2] = starts[np.uint64(place + stop)]
            size += np.uint64(1)
        if wraps and (left < 0 or right >= length):
            size = _add_ranges_around(index, left, right, length, row, rows, near_rows, starts, ranges, size)
    return np.int64(size)


@kernel
def _add_ranges_around(index, left, right, length, row, rows, near_rows, starts, ranges, size):
    """What box ``index`` reaches across the end of the rows."""
    for near in range(-1, near_rows):  # -1: its own row, of which only the later part has not met it yet
        place = row if near < 0 else rows[near]
        if right >= length:
            ranges[size, 0] = index
            ranges[size, 1] = starts[place]
            ranges[size, 2] = starts[place + right - length + 1]
            size += np.uint64(1)
        if left < 0 and near >= 0:
            ranges[size, 0] = index
            ranges[size, 1] = starts[place + left + length]
            ranges[size, 2] = starts[place + length]
            size += np.uint64(1)
    return size


@kernel
def _append_ranges(ranges, number, candidates, boxes, order, period, wraps, keys, found):
    """Test boxes against their ranges, the first ``number`` rows (box, start, stop); the new found, and tests."""
    size = np.uint64(0)
    tested = 0
    for slot in range(np.uint64(number)):
        index = ranges[slot, 0]
        start = np.uint64(ranges[slot, 1])
        stop = np.uint64(ranges[slot, 2])
        tested += int(stop - start)
        while True:
            # Four at a time, with no branch for each: most ranges are as short, and the next overwrites what is over.
            for lane in range(np.uint64(4)):
                candidates[0, size + lane] = index
                candidates[1, size + lane] = start + lane
            size += min(stop - start, np.uint64(4))
            if size > np.uint64(BATCH - 4):
                found = append_overlaps(candidates, np.int64(size), boxes, order, period, wraps, keys, found)
                size = np.uint64(0)
            if stop - start <= np.uint64(4):
                break
            start += np.uint64(4)
    return append_overlaps(candidates, np.int64(size), boxes, order, period, wraps, keys, found), tested


@kernel
def _search_cells(first, last, boxes, order, buckets, starts, shape, reach, around, period, keys):
    """Pairs of boxes in the cells, the earlier of which lies in ``first .. last``: (found, tested)."""
    wraps = any_wraps(period)
    rows = np.empty((reach[2] + 1) * (2 * reach[1] + 1), dtype=np.int64)
    most_ranges = 2 * rows.size + 2
    at_once = max(1, _RANGES // most_ranges)
    ranges = np.empty((at_once * most_ranges, 3), dtype=np.uint32)
    candidates = np.empty((2, BATCH), dtype=np.uint32)
    found = 0
    tested = 0
    for start in range(first, last, at_once):
        stop = min(last, start + at_once)
        number = _add_ranges(start, stop, buckets, starts, shape, reach, around, rows, ranges)
        found, tests = _append_ranges(ranges, number, candidates, boxes, order, period, wraps, keys, found)
        tested += tests
    return found, tested


@kernel
def _add_row(index, row, left, number, length, starts, ranges, size):
    """Add the boxes in ``number`` buckets of a row from ``left`` on, in two parts if they go around its end."""
    right = left + number
    ranges[size, 0] = index
    ranges[size, 1] = starts[row + left]
    ranges[size, 2] = starts[row + min(right, length)]
    if right <= length:
        return size + 1
    ranges[size + 1, 0] = index
    ranges[size + 1, 1] = starts[row]
    ranges[size + 1, 2] = starts[row + right - length]
    return size + 2


@kernel
def _search_large(first, last, boxes, order, starts, cells, shape, origin, inverse, width, period, keys):
    """Pairs of boxes ``first .. last``, which are too large for the cells, with those in the cells."""
    wraps = any_wraps(period)
    ranges = np.empty((_RANGES, 3), dtype=np.uint32)
    candidates = np.empty((2, BATCH), dtype=np.uint32)
    size = 0
    found = 0
    tested = 0
    for index in range(first, last):
        box = row_of(boxes, index)
        x, number_x = buckets_of_box(box, 0, period, cells, shape, origin, inverse, width)
        y, number_y = buckets_of_box(box, 1, period, cells, shape, origin, inverse, width)
        z, number_z = buckets_of_box(box, 2, period, cells, shape, origin, inverse, width)
        for layer in range(number_z):
            near_z = (z + layer) % shape[2]
            for line in range(number_y):
                row = (near_z * shape[1] + (y + line) % shape[1]) * shape[0]
                size = _add_row(index, row, x, number_x, shape[0], starts, ranges, size)
                if size > _RANGES - 2:
                    found, tests = _append_ranges(ranges, size, candidates, boxes, order, period, wraps, keys, found)
                    tested += tests
                    size = 0
    found, tests = _append_ranges(ranges, size, candidates, boxes, order, period, wraps, keys, found)
    return found, tested + tests


def _sorted_into_buckets(
    lower: np.ndarray, upper: np.ndarray, numbers: np.ndarray, period: np.ndarray, plan: Layout, crew: ThreadTeam
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Rows of boxes in the order of their buckets, their numbers and buckets, and where each bucket starts.

    First into bands of consecutive buckets, few enough to be written to by turns, then by bucket within each band,
    which stays in the cache.
    """
    count = len(lower)
    total = int(plan.shape.prod()) + 1
    keys, indices = np.empty((2, count), dtype=np.int32)

    def fill(_: int, first: int, last: int) -> None:
        fill_keys(
            first, last, lower, upper, period,
            plan.cells, plan.shape, plan.origin, plan.inverse, plan.limit, keys, indices,
        )  # fmt: skip

    crew.each(fill, count)
    shift = max(0, total.bit_length() - _BAND_BITS) if count > _FEW else total.bit_length()
    bands = ((total - 1) >> shift) + 1
    band_starts = np.array([0, count])
    if bands > 1:
        keys, indices, band_starts = counting_sort(keys, indices, bands, crew, shift=shift)
    starts = np.zeros(total + 1, dtype=np.int32)
    order, buckets = np.empty((2, count), dtype=np.int32)
    boxes = np.empty((count, 6))

    def settle(_: int, first: int, last: int) -> None:
        for band in range(first, last):
            _fill_band(
                int(band_starts[band]), int(band_starts[band + 1]), band << shift, min((band + 1) << shift, total),
                keys, indices, numbers, lower, upper, starts, order, buckets, boxes,
            )  # fmt: skip

    crew.each(settle, bands, 8 * crew.threads)
    return boxes, order, buckets, starts


def _search(
    lower: np.ndarray, upper: np.ndarray, numbers: np.ndarray, period: np.ndarray, cells: int, crew: ThreadTeam
) -> tuple[list[np.ndarray], int, np.ndarray]:
    """Pairs of which at least one box fits the cells, tests, and the ``numbers`` of the boxes that do not."""
    plan = lay_out(survey(lower, upper, period, crew), period, len(lower), cells)
    boxes, order, buckets, starts = _sorted_into_buckets(lower, upper, numbers, period, plan, crew)
    fitting = int(starts[-2])
    large = len(lower) - fitting

    def among(first: int, last: int, keys: np.ndarray) -> tuple[int, int]:
        return _search_cells(
            first, last, boxes, order, buckets, starts, plan.shape, plan.reach, plan.wraps, period, keys
        )

    def across(first: int, last: int, keys: np.ndarray) -> tuple[int, int]:
        return _search_large(
            fitting + first, fitting + last, boxes, order, starts,
            plan.cells, plan.shape, plan.origin, plan.inverse, plan.width, period, keys,
        )  # fmt: skip

    lists, tested = collect(among, fitting, crew, 2 * fitting)
    if large:
        more, tested_more = collect(across, large, crew, 32 * large)
        lists += more
        tested += tested_more
    return lists, tested, order[fitting:]


def grid_pairs(
    lower: np.ndarray, upper: np.ndarray, period: np.ndarray, cells: int | None = None
) -> tuple[np.ndarray, int]:
    """Pairs (m, 2) int64 and the number of box tests.  Arguments as checked by ``find_pairs``.

    ``cells``: so many along each axis of the region the boxes take up (halved while there are more than
    ``MOST_CELLS``).  If None, chosen from the sizes and the number of the boxes: cells are as wide as the widest box
    along each axis, which leaves the fewest tests; where that makes more cells than ``PER_BOX`` times as many as
    boxes, those that are equally many apart along the axes share a bucket.  So memory grows with the boxes only, and
    crowded places are divided as finely as if the whole region were.  The region is that of most centres; the few
    outside are counted into the cells at its edge.  Boxes much larger than most (``LARGE``) are tested against the
    cells that they touch, and among each other in a coarser grid of their own.

    Raises ``ValueError`` for ``cells`` below 1.
    """
    if cells is not None and cells < 1:
        raise ValueError(f"grid: cells must be at least 1, got {cells}")
    count = len(lower)
    if count == 0:
        return np.empty((0, 2), dtype=np.int64), 0
    numbers = np.arange(count, dtype=np.int32)
    lists: list[np.ndarray] = []
    tested = 0
    crew = ThreadTeam(count)
    left, wanted = numbers, cells or 0
    while len(left):
        all_left = len(left) == count
        found, tests, left = _search(
            lower if all_left else lower[left],
            upper if all_left else upper[left],
            left,
            period,
            wanted,
            crew,
        )
        lists += found
        tested += tests
        wanted = 0
    return canonical(lists, count, crew), tested
