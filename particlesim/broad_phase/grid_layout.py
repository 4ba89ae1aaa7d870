"""The cells of a uniform grid: how many, how large, how far AABBs in them can reach, and which share a bucket."""

from __future__ import annotations

import numpy as np

from particlesim.broad_phase.aabb_statistics import wrapped_centre
from particlesim.core.jit import entry_kernel, kernel
from particlesim.core.records import record

# Buckets for each AABB where the cells are chosen.  Cells as wide as the AABBs are about 2.5 for each at a fill of
# 0.2.  Where the AABBs are further apart there are more, and cells share buckets.
PER_AABB = 3.0

# AABBs more than LARGE times the typical edge are searched for apart, if there are any: a size that all cells are
# laid out for must not come from a few.  Then the limit is MARGIN times the typical edge.
LARGE = 4.0
MARGIN = 2.0

# Cells given by the caller are halved along each axis until there are no more than this: 64 MB of counters a thread.
MOST_CELLS = 2**24

# Cells along an axis when they are chosen.
_MOST_ALONG = 2.0**26

# Rounding of a position counted in cells, of which there are at most 2**26 along an axis.
_CELL_SLACK = 1e-7

# The grid, axis by axis.  Cells whose numbers differ by a multiple of ``buckets`` share a bucket.
GRID = record(
    [
        ("cells", "i8", (3,)),
        ("buckets", "i8", (3,)),  # that AABBs are counted into
        ("reach", "i8", (3,)),  # [cells] between the centres of AABBs that overlap
        ("wraps", "i8", (3,)),  # whether the first bucket comes after the last: periodic axes, and shared buckets
        ("period", "f8", (3,)),  # [m], 0 on axes that do not wrap
        ("origin", "f8", (3,)),  # lower corner [m]
        ("per_metre", "f8", (3,)),  # cells
        ("width", "f8", (3,)),  # of the widest AABB in the cells, rounding included [m]
        ("limit", "f8"),  # AABBs with a longer edge are not in the cells [m]
    ]
)


@kernel
def _choose_cells(extent, grid):
    """As narrow as the widest AABB allows."""
    for axis in range(3):
        # A millionth more: the AABB reaches the next cell, never the one after, whatever the rounding.
        narrowest = max(grid.width[axis] * 1.000001, extent[axis] / _MOST_ALONG)
        grid.cells[axis] = max(1, int(extent[axis] / narrowest)) if extent[axis] > 0.0 else 1


@kernel
def _share_buckets(wanted, grid):
    """At most about ``wanted`` buckets, equally many along each axis that has so many cells."""
    x, y, z = grid.cells[0], grid.cells[1], grid.cells[2]
    longest = max(x, y, z)
    while longest > 3 and min(x, longest) * 1.0 * min(y, longest) * min(z, longest) > wanted:
        longest -= 1 + longest // 16
    for axis in range(3):
        grid.buckets[axis] = min(grid.cells[axis], max(longest, 3))
        if grid.period[axis] > 0.0:
            grid.cells[axis] -= grid.cells[axis] % grid.buckets[axis]


@kernel
def _take_cells(given, extent, grid):
    """``given`` cells along each axis, a bucket each, or fewer where that is too many."""
    for axis in range(3):
        grid.cells[axis] = given if extent[axis] > 0.0 else 1
    while float(grid.cells[0]) * grid.cells[1] * grid.cells[2] > MOST_CELLS:
        for axis in range(3):
            grid.cells[axis] = (grid.cells[axis] + 1) // 2
    for axis in range(3):
        grid.buckets[axis] = grid.cells[axis]


@kernel
def _set_reach(extent, grid):
    """Cells per metre and the reach.  An axis that wraps, on which the reach would overlap itself, gets one cell."""
    for axis in range(3):
        cells = grid.cells[axis]
        grid.wraps[axis] = int(grid.period[axis] > 0.0 or grid.buckets[axis] < cells)
        grid.per_metre[axis] = cells / extent[axis] if cells > 1 else 0.0
        reach = int(np.ceil(min(grid.width[axis] * grid.per_metre[axis], 1e9) + _CELL_SLACK))
        if grid.wraps[axis] and 2 * reach + 1 > grid.buckets[axis]:
            grid.cells[axis] = 1
            grid.buckets[axis] = 1
            grid.per_metre[axis] = 0.0
        grid.reach[axis] = min(reach, grid.buckets[axis] - 1)


@entry_kernel
def _lay_out(statistics, period, count, given, grids):
    grid, known = grids[0], statistics[0]
    grid.limit = MARGIN * known.typical if known.longest > LARGE * known.typical else known.longest
    extent = np.empty(3)
    for axis in range(3):
        slack = known.slack[axis]
        grid.period[axis] = period[axis]
        grid.origin[axis] = known.region_lower[axis]
        grid.width[axis] = min(known.widest[axis], grid.limit) * (1.0 + 1e-9) + slack
        extent[axis] = known.region_upper[axis] - known.region_lower[axis]
        if extent[axis] <= max(slack, 1e-300):
            extent[axis] = 0.0
    if given == 0:
        _choose_cells(extent, grid)
        _share_buckets(PER_AABB * count, grid)
    else:
        _take_cells(given, extent, grid)
    _set_reach(extent, grid)


def lay_out(statistics: np.ndarray, period: np.ndarray, count: int, given: int) -> np.ndarray:
    """The grid, ``GRID`` (1,), for ``count`` AABBs; ``given`` cells along each axis, or 0: see ``grid_pairs``."""
    grids = np.empty(1, dtype=GRID)
    _lay_out(statistics, period, count, given, grids)
    return grids


@kernel
def _axis_of(grid, axis):
    """What ``_bucket_of`` needs of an axis, as a tuple, which stays in registers."""
    return grid.period[axis], grid.cells[axis], grid.buckets[axis], grid.origin[axis], grid.per_metre[axis]


@kernel
def _cell_of(position, origin, per_metre, cells):
    """Cell along an axis; what lies outside the region is in the cell at its edge."""
    return np.uint64(min(max((position - origin) * per_metre, 0.0), cells - 1.0))


@kernel
def _bucket_of(lower, upper, along):
    """Bucket along an axis of an interval's centre."""
    period, cells, buckets, origin, per_metre = along
    cell = _cell_of(wrapped_centre(lower, upper, period), origin, per_metre, cells)
    return cell % np.uint64(buckets) if buckets < cells else cell


@entry_kernel
def fill_keys(first, last, aabbs, grids, keys, order):
    """``keys``: the bucket of each AABB's centre, x fastest, or one past the last for an AABB above the limit."""
    lower, upper, _ = aabbs
    grid = grids[0]
    along_x, along_y, along_z = _axis_of(grid, 0), _axis_of(grid, 1), _axis_of(grid, 2)
    buckets_x, buckets_y, buckets_z = along_x[2], along_y[2], along_z[2]
    limit = grid.limit
    for index in range(first, last):
        a, b, c = lower[index, 0], lower[index, 1], lower[index, 2]
        d, e, f = upper[index, 0], upper[index, 1], upper[index, 2]
        x = _bucket_of(a, d, along_x)
        y = _bucket_of(b, e, along_y)
        z = _bucket_of(c, f, along_z)
        key = (z * np.uint64(buckets_y) + y) * np.uint64(buckets_x) + x
        large = max(d - a, e - b, f - c) > limit
        keys[index] = np.uint64(buckets_x * buckets_y * buckets_z) if large else key
        order[index] = index


@kernel
def buckets_of_aabb(aabb, axis, grid):
    """First bucket along an axis, and how many from there on, with centres of all AABBs that may overlap ``aabb``."""
    period, cells, buckets, origin, per_metre = _axis_of(grid, axis)
    centre = wrapped_centre(aabb[axis], aabb[axis + 3], period)
    half = 0.5 * (aabb[axis + 3] - aabb[axis] + grid.width[axis])
    if period > 0.0:
        low = np.floor((centre - half) * per_metre - _CELL_SLACK)
        number = np.floor((centre + half) * per_metre + _CELL_SLACK) - low + 1.0
        if number >= buckets or buckets == 1:
            return 0, buckets
        return int(low) % buckets, int(number)
    first = np.int64(_cell_of(centre - half, origin, per_metre, cells))
    last = np.int64(_cell_of(centre + half, origin, per_metre, cells))
    if last - first + 1 >= buckets:
        return 0, buckets
    return first % buckets, last - first + 1
