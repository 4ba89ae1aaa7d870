"""The cells of a uniform grid: how many, how large, how far boxes in them can reach, and which share a bucket."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from particlesim.broad_phase.aabb_statistics import Survey, wrapped_centre
from particlesim.core.jit import kernel

# Buckets for each box where the cells are chosen.  Cells as wide as the boxes are about 2.5 for each box at a fill of
# 0.2.  Where the boxes are further apart there are more, and cells share buckets.
PER_BOX = 3.0

# Boxes more than LARGE times the typical edge are searched for apart, if there are any: a size that all cells are
# laid out for must not come from a few.  Then the limit is MARGIN times the typical edge.
LARGE = 4.0
MARGIN = 2.0

# Cells given by the caller are halved along each axis until there are no more than this: 64 MB of counters a thread.
MOST_CELLS = 2**24

# Cells along an axis when they are chosen.
_MOST_ALONG = 2.0**26

# Rounding of a position counted in cells, of which there are at most 2**26 along an axis.
_CELL_SLACK = 1e-7


class Layout(NamedTuple):
    """Each (3,): cells, int64; lower corner [m]; cells per metre; reach [cells], int64; widths of boxes [m].

    ``shape``, int64: the buckets that boxes are counted into.  Cells whose numbers differ by a multiple of it share
    one.  ``wraps``, bool: the first bucket comes after the last one, as on periodic axes and where buckets are
    shared.  ``limit`` [m] is a float: boxes with a longer edge are not in the cells.
    """

    cells: np.ndarray
    shape: np.ndarray
    wraps: np.ndarray
    origin: np.ndarray
    inverse: np.ndarray
    reach: np.ndarray
    width: np.ndarray  # of the widest box in the cells, rounding included
    limit: float


@kernel
def _choose_cells(extent, width, cells):
    """As narrow as the widest box allows."""
    for axis in range(3):
        # A millionth more: the box reaches the next cell, never the one after, whatever the rounding.
        narrowest = max(width[axis] * 1.000001, extent[axis] / _MOST_ALONG)
        cells[axis] = max(1, int(extent[axis] / narrowest)) if extent[axis] > 0.0 else 1


@kernel
def _share_buckets(wanted, period, cells, shape):
    """At most about ``wanted`` buckets, equally many along each axis that has so many cells."""
    longest = max(cells[0], cells[1], cells[2])
    while longest > 3 and min(cells[0], longest) * 1.0 * min(cells[1], longest) * min(cells[2], longest) > wanted:
        longest -= 1 + longest // 16
    for axis in range(3):
        shape[axis] = min(cells[axis], max(longest, 3))
        if period[axis] > 0.0:
            cells[axis] -= cells[axis] % shape[axis]


@kernel
def _settle(extent, width, period, cells, shape, inverse, reach, wraps):
    """Cells per metre and the reach.  An axis that wraps, on which the reach would meet itself, gets one cell."""
    for axis in range(3):
        wraps[axis] = period[axis] > 0.0 or shape[axis] < cells[axis]
        inverse[axis] = cells[axis] / extent[axis] if cells[axis] > 1 else 0.0
        reach[axis] = int(np.ceil(min(width[axis] * inverse[axis], 1e9) + _CELL_SLACK))
        if wraps[axis] and 2 * reach[axis] + 1 > shape[axis]:
            cells[axis] = 1
            shape[axis] = 1
            inverse[axis] = 0.0
        reach[axis] = min(reach[axis], shape[axis] - 1)


@kernel
def _lay_out(
    region_lower, region_upper, widest, slack, period, limit, count, given,
    cells, shape, wraps, inverse, reach, width,
):  # fmt: skip
    extent = np.empty(3)
    for axis in range(3):
        width[axis] = min(widest[axis], limit) * (1.0 + 1e-9) + slack[axis]
        extent[axis] = region_upper[axis] - region_lower[axis]
        if extent[axis] <= max(slack[axis], 1e-300):
            extent[axis] = 0.0
        cells[axis] = given if extent[axis] > 0.0 else 1
    if given == 0:
        _choose_cells(extent, width, cells)
        _share_buckets(PER_BOX * count, period, cells, shape)
    else:
        while float(cells[0]) * cells[1] * cells[2] > MOST_CELLS:
            for axis in range(3):
                cells[axis] = (cells[axis] + 1) // 2
        shape[:] = cells
    _settle(extent, width, period, cells, shape, inverse, reach, wraps)


def lay_out(seen: Survey, period: np.ndarray, count: int, given: int) -> Layout:
    """The grid for ``count`` boxes as seen by ``survey``; ``given`` cells along each axis, or 0: see ``grid_pairs``."""
    widest = float(seen.widest.max())
    limit = MARGIN * seen.typical if widest > LARGE * seen.typical else widest
    cells, shape, reach = np.empty((3, 3), dtype=np.int64)
    inverse, width = np.empty((2, 3))
    wraps = np.empty(3, dtype=np.bool_)
    _lay_out(
        seen.region_lower, seen.region_upper, seen.widest, seen.slack, period, limit, count, given,
        cells, shape, wraps, inverse, reach, width,
    )  # fmt: skip
    return Layout(cells, shape, wraps, seen.region_lower, inverse, reach, width, limit)


@kernel
def _cell_of(position, origin, inverse, cells):
    """Cell along an axis; what lies outside the region is in the cell at its edge."""
    return np.uint64(min(max((position - origin) * inverse, 0.0), cells - 1.0))


@kernel
def _bucket_of(lower, upper, period, cells, shape, origin, inverse):
    """Bucket along an axis of an interval's centre."""
    cell = _cell_of(wrapped_centre(lower, upper, period), origin, inverse, cells)
    return cell % np.uint64(shape) if shape < cells else cell


@kernel
def fill_keys(first, last, lower, upper, period, cells, shape, origin, inverse, limit, keys, order):
    """``keys``: the bucket of each box's centre, x fastest, or one past the last for a box above the limit."""
    period_x, period_y, period_z = period[0], period[1], period[2]
    cells_x, cells_y, cells_z = cells[0], cells[1], cells[2]
    shape_x, shape_y, shape_z = shape[0], shape[1], shape[2]
    origin_x, origin_y, origin_z = origin[0], origin[1], origin[2]
    inverse_x, inverse_y, inverse_z = inverse[0], inverse[1], inverse[2]
    for index in range(first, last):
        a, b, c = lower[index, 0], lower[index, 1], lower[index, 2]
        d, e, f = upper[index, 0], upper[index, 1], upper[index, 2]
        x = _bucket_of(a, d, period_x, cells_x, shape_x, origin_x, inverse_x)
        y = _bucket_of(b, e, period_y, cells_y, shape_y, origin_y, inverse_y)
        z = _bucket_of(c, f, period_z, cells_z, shape_z, origin_z, inverse_z)
        key = (z * np.uint64(shape_y) + y) * np.uint64(shape_x) + x
        large = max(d - a, e - b, f - c) > limit
        keys[index] = np.uint64(shape_x * shape_y * shape_z) if large else key
        order[index] = index


@kernel
def buckets_of_box(box, axis, period, cells, shape, origin, inverse, width):
    """First bucket along an axis, and how many from there on, in which centres of boxes that meet ``box`` may lie."""
    centre = wrapped_centre(box[axis], box[axis + 3], period[axis])
    half = 0.5 * (box[axis + 3] - box[axis] + width[axis])
    if period[axis] > 0.0:
        low = np.floor((centre - half) * inverse[axis] - _CELL_SLACK)
        number = np.floor((centre + half) * inverse[axis] + _CELL_SLACK) - low + 1.0
        if number >= shape[axis] or shape[axis] == 1:
            return 0, shape[axis]
        return int(low) % shape[axis], int(number)
    first = np.int64(_cell_of(centre - half, origin[axis], inverse[axis], cells[axis]))
    last = np.int64(_cell_of(centre + half, origin[axis], inverse[axis], cells[axis]))
    if last - first + 1 >= shape[axis]:
        return 0, shape[axis]
    return first % shape[axis], last - first + 1
