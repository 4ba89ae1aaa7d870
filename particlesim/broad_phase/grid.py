"""A uniform grid of cells, and tests between AABBs in near cells only.

S. Goodwin, "Analysis of Efficient Collision Detection using Pre-Processing Data Structures", section II, where it is
called boxing.  AABBs are counted into the cells of their centres and stored in the order of the cells, x fastest, so
that neighbouring cells of a row are one range of AABBs.  An AABB is tested against those after it in its own row and
against the rows after its own that it can reach: half of the neighbourhood, which tests each pair once.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from particlesim.broad_phase.aabb_statistics import aabb_statistics
from particlesim.broad_phase.aabb_test import BATCH, Aabbs, StoredAabbs, append_overlaps, collect, load_aabb
from particlesim.broad_phase.counting_sort import counting_sort
from particlesim.broad_phase.grid_layout import buckets_of_aabb, fill_keys, lay_out
from particlesim.broad_phase.pair_sort import sort_pairs
from particlesim.core.jit import entry_kernel, kernel
from particlesim.core.parallel import ThreadTeam

# Ranges of candidates that are listed before they are tested, or as many as one AABB has: 192 kB.
_RANGES = 16384

# Bands of buckets, 2**9 at most; up to _FEW AABBs are one band.
_BAND_BITS = 9
_FEW = 4096


class Cells(NamedTuple):
    """AABBs in the order of their buckets."""

    stored: StoredAabbs
    bucket: np.ndarray  # (n,) int32, of each AABB
    start: np.ndarray  # (buckets + 2,) int32, where each bucket starts; the last one holds what is too large


@kernel
def _fill_band(band, keyed, numbers, aabbs, cells):
    """Sort a band by bucket; where its buckets start, and the AABBs in their order.

    ``band``: first and last place, first and last bucket.  ``keyed``: the bucket and the index of the AABB at each
    place.  ``numbers``: of each AABB in the caller's arrays.
    """
    first, last, first_bucket, stop_bucket = band
    keys, indices = keyed
    lower, upper, _ = aabbs
    (bounds, order, _), buckets, starts = cells
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
        bounds[slot, 0] = lower[index, 0]
        bounds[slot, 1] = lower[index, 1]
        bounds[slot, 2] = lower[index, 2]
        bounds[slot, 3] = upper[index, 0]
        bounds[slot, 4] = upper[index, 1]
        bounds[slot, 5] = upper[index, 2]


@entry_kernel
def _fill_bands(first, last, shift, places, keyed, numbers, aabbs, cells):
    """Sort bands ``first .. last`` of 2**shift buckets each, which start at ``places``."""
    total = cells.start.size - 1
    for number in range(first, last):
        stop = min((number + 1) << shift, total)
        _fill_band((places[number], places[number + 1], number << shift, stop), keyed, numbers, aabbs, cells)


@kernel
def _wrapped_bucket(bucket, axis, grid):
    """The number of a bucket along an axis, brought into range; -1 outside an axis that does not wrap."""
    buckets = grid.buckets[axis]
    if 0 <= bucket < buckets:
        return bucket
    return bucket % buckets if grid.wraps[axis] else -1


@kernel
def _rows_after(row, grid, rows):
    """First buckets of the rows that the AABBs in ``row`` reach, half of the neighbourhood; how many."""
    along_x, along_y = grid.buckets[0], grid.buckets[1]
    reach = grid.reach[1]
    y = row // along_x % along_y
    z = row // (along_x * along_y)
    size = 0
    for layer in range(grid.reach[2] + 1):
        near_z = _wrapped_bucket(z + layer, 2, grid)
        if near_z < 0:
            break
        for line in range(-reach if layer > 0 else 1, reach + 1):
            near_y = _wrapped_bucket(y + line, 1, grid)
            if near_y >= 0:
                rows[size] = (near_z * along_y + near_y) * along_x
                size += 1
    return size


@kernel
def _add_ranges(first, last, grid, buckets, starts, rows, ranges):
    """The candidates of AABBs ``first .. last``, as rows (index, start, stop) of ``ranges``; how many rows."""
    length = grid.buckets[0]
    reach = grid.reach[0]
    wraps = grid.wraps[0]
    row = -length
    near_rows = 0
    size = np.uint64(0)
    for index in range(first, last):
        bucket = np.int64(buckets[index])
        if bucket - row >= length:
            row = bucket - bucket % length
            near_rows = _rows_after(row, grid, rows)
        left = bucket - row - reach
        right = bucket - row + reach
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
            size = _add_ranges_around(index, (left, right, length), row, rows[:near_rows], starts, ranges, size)
    return np.int64(size)


@kernel
def _add_ranges_around(index, span, row, near_rows, starts, ranges, size):
    """What AABB ``index`` reaches across the end of the rows; ``span``: from where, to where, length of a row."""
    left, right, length = span
    for near in range(-1, near_rows.size):  # -1: its own row, of which only the later part is still to be tested
        place = row if near < 0 else near_rows[near]
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
def _append_ranges(ranges, number, candidates, stored, keys, found):
    """Test AABBs against their ranges, the first ``number`` rows (index, start, stop); the new found, and tests."""
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
                found = append_overlaps(candidates, np.int64(size), stored, keys, found)
                size = np.uint64(0)
            if stop - start <= np.uint64(4):
                break
            start += np.uint64(4)
    return append_overlaps(candidates, np.int64(size), stored, keys, found), tested


@entry_kernel
def _search_cells(first, last, grids, cells, keys):
    """Pairs of AABBs in the cells, the earlier of which lies in ``first .. last``: (found, tested)."""
    grid = grids[0]
    stored, buckets, starts = cells
    rows = np.empty((grid.reach[2] + 1) * (2 * grid.reach[1] + 1), dtype=np.int64)
    most_ranges = 2 * rows.size + 2
    at_once = max(1, _RANGES // most_ranges)
    ranges = np.empty((at_once * most_ranges, 3), dtype=np.uint32)
    candidates = np.empty((2, BATCH), dtype=np.uint32)
    found = 0
    tested = 0
    for start in range(first, last, at_once):
        stop = min(last, start + at_once)
        number = _add_ranges(start, stop, grid, buckets, starts, rows, ranges)
        found, tests = _append_ranges(ranges, number, candidates, stored, keys, found)
        tested += tests
    return found, tested


@kernel
def _add_row(index, row, left, number, length, starts, ranges, size):
    """Add the AABBs in ``number`` buckets of a row from ``left`` on, in two parts if they go around its end."""
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


@entry_kernel
def _search_large(first, last, grids, cells, keys):
    """Pairs of AABBs ``first .. last``, which are too large for the cells, with those in the cells."""
    grid = grids[0]
    stored, _, starts = cells
    along_x, along_y, along_z = grid.buckets[0], grid.buckets[1], grid.buckets[2]
    ranges = np.empty((_RANGES, 3), dtype=np.uint32)
    candidates = np.empty((2, BATCH), dtype=np.uint32)
    size = 0
    found = 0
    tested = 0
    for index in range(first, last):
        aabb = load_aabb(stored.bounds, index)
        x, number_x = buckets_of_aabb(aabb, 0, grid)
        y, number_y = buckets_of_aabb(aabb, 1, grid)
        z, number_z = buckets_of_aabb(aabb, 2, grid)
        for layer in range(number_z):
            near_z = (z + layer) % along_z
            for line in range(number_y):
                row = (near_z * along_y + (y + line) % along_y) * along_x
                size = _add_row(index, row, x, number_x, along_x, starts, ranges, size)
                if size > _RANGES - 2:
                    found, tests = _append_ranges(ranges, size, candidates, stored, keys, found)
                    tested += tests
                    size = 0
    found, tests = _append_ranges(ranges, size, candidates, stored, keys, found)
    return found, tested + tests


def _sorted_into_buckets(aabbs: Aabbs, numbers: np.ndarray, grids: np.ndarray, team: ThreadTeam) -> Cells:
    """AABBs, which have ``numbers`` in the caller's arrays, in the order of their buckets.

    First into bands of consecutive buckets, few enough to be written to alternately, then by bucket within each band,
    which stays in the cache.
    """
    count = len(numbers)
    total = int(grids["buckets"].prod()) + 1
    keys, indices = np.empty((2, count), dtype=np.int32)
    team.each(lambda _, first, last: fill_keys(first, last, aabbs, grids, keys, indices), count)
    shift = max(0, total.bit_length() - _BAND_BITS) if count > _FEW else total.bit_length()
    bands = ((total - 1) >> shift) + 1
    places = np.array([0, count], dtype=np.int32)
    if bands > 1:
        keys, indices, places = counting_sort(keys, indices, bands, team, shift=shift)
    order, buckets = np.empty((2, count), dtype=np.int32)
    stored = StoredAabbs(np.empty((count, 6)), order, aabbs.period)
    cells = Cells(stored, buckets, np.zeros(total + 1, dtype=np.int32))
    keyed = keys, indices
    team.each(
        lambda _, first, last: _fill_bands(first, last, shift, places, keyed, numbers, aabbs, cells),
        bands,
        8 * team.threads,
    )
    return cells


def _search(
    aabbs: Aabbs, numbers: np.ndarray, given: int, team: ThreadTeam
) -> tuple[list[np.ndarray], int, np.ndarray]:
    """Pairs of which at least one AABB fits the cells, tests, and the ``numbers`` of the AABBs that do not."""
    count = len(numbers)
    grids = lay_out(aabb_statistics(aabbs, team), aabbs.period, count, given)
    cells = _sorted_into_buckets(aabbs, numbers, grids, team)
    fitting = int(cells.start[-2])
    lists, tested = collect(
        lambda first, last, keys: _search_cells(first, last, grids, cells, keys), fitting, team, 2 * fitting
    )
    large = count - fitting
    if large:
        more, tested_more = collect(
            lambda first, last, keys: _search_large(fitting + first, fitting + last, grids, cells, keys),
            large,
            team,
            32 * large,
        )
        lists += more
        tested += tested_more
    return lists, tested, cells.stored.order[fitting:]


def grid_pairs(
    lower: np.ndarray,
    upper: np.ndarray,
    period: np.ndarray,
    *,
    cells: int | None = None,
    threads: int | None = None,
) -> tuple[np.ndarray, int]:
    """Pairs (m, 2) int64 and the number of AABB tests.  Arguments as checked by ``find_pairs``.

    ``cells``: so many along each axis of the region the AABBs take up (halved while there are more than
    ``MOST_CELLS``).  If None, chosen from the sizes and the number of the AABBs: cells are as wide as the widest AABB
    along each axis, which leaves the fewest tests; where that makes more cells than ``PER_AABB`` times as many as
    AABBs, those that are equally many apart along the axes share a bucket.  So memory grows with the AABBs only, and
    crowded places are divided as finely as if the whole region were.  The region is that of most centres; the few
    outside are counted into the cells at its edge.  AABBs much larger than most (``LARGE``) are tested against the
    cells that they touch, and among each other in a coarser grid of their own.

    Raises ``ValueError`` for ``cells`` below 1.
    """
    if cells is not None and cells < 1:
        raise ValueError(f"grid: cells must be at least 1, got {cells}")
    count = len(lower)
    if count == 0:
        return np.empty((0, 2), dtype=np.int64), 0
    left = np.arange(count, dtype=np.int32)
    lists: list[np.ndarray] = []
    tested = 0
    team = ThreadTeam(count, threads)
    given = cells or 0
    aabbs = Aabbs(lower, upper, period)
    while len(left):
        found, tests, left = _search(aabbs, left, given, team)
        lists += found
        tested += tests
        aabbs, given = Aabbs(lower[left], upper[left], period), 0
    return sort_pairs(lists, count, team), tested
