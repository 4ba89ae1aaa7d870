"""The cells of a uniform grid: how many, how large, how far boxes in them can reach."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from particlesim.broad_phase.survey import Survey, wrapped_centre
from particlesim.jit import kernel

# Mean number of boxes in a cell where the boxes are small against their distances: fewer cost empty cells, more
# cost tests.
PER_CELL = 2.0

# Boxes more than LARGE times the typical edge are searched for apart, if there are any: a size that all cells are
# laid out for must not come from a few.  Then the limit is MARGIN times the typical edge.
LARGE = 4.0
MARGIN = 2.0

# Cells given by the caller are halved along each axis until there are no more than this: 64 MB of counters a thread.
MOST_CELLS = 2**24

# Cells along an axis when they are chosen: a line of particles is no reason for more.
_MOST_ALONG = 1e6

# Rounding of a position counted in cells, of which there are at most MOST_CELLS along an axis.
CELL_SLACK = 1e-7


class Layout(NamedTuple):
    """Each (3,): cells, int64; lower corner [m]; cells per metre; reach [cells], int64; widths of boxes [m].

    ``limit`` [m] is a float: boxes with a longer edge are not in the cells.
    """

    shape: np.ndarray
    origin: np.ndarray
    inverse: np.ndarray
    reach: np.ndarray
    width: np.ndarray  # of the widest box in the cells, rounding included
    limit: float


@kernel
def _shape_by_edge(extent, width, edge, shape):
    """Cells with at least this ``edge``, and at least the width of the widest box; their number."""
    total = 1
    for axis in range(3):
        # A millionth more: the box reaches the next cell, never the one after, whatever the rounding.
        longest = max(edge, width[axis] * 1.000001)
        shape[axis] = max(1, int(min(extent[axis] / longest, _MOST_ALONG))) if longest > 0.0 else 1
        total *= shape[axis]
    return total


@kernel
def _choose_shape(extent, width, wanted, shape):
    """Shrink the edge until there are the wanted number of cells, or the boxes forbid more."""
    edge = max(extent[0], extent[1], extent[2])
    finest = max(edge / _MOST_ALONG, min(width[0], width[1], width[2]))
    total = _shape_by_edge(extent, width, edge, shape)
    while total < wanted and edge > finest:
        edge *= 0.9
        total = _shape_by_edge(extent, width, edge, shape)


@kernel
def _settle(extent, width, period, shape, inverse, reach):
    """Cells per metre and the reach.  A periodic axis on which the reach would meet itself gets one cell."""
    for axis in range(3):
        inverse[axis] = shape[axis] / extent[axis] if shape[axis] > 1 else 0.0
        reach[axis] = int(np.ceil(min(width[axis] * inverse[axis], 1e9) + CELL_SLACK))
        if period[axis] > 0.0 and 2 * reach[axis] + 1 > shape[axis]:
            shape[axis] = 1
            inverse[axis] = 0.0
        reach[axis] = min(reach[axis], shape[axis] - 1)


@kernel
def _lay_out(region_lower, region_upper, widest, slack, period, limit, count, cells, shape, inverse, reach, width):
    extent = np.empty(3)
    for axis in range(3):
        width[axis] = min(widest[axis], limit) * (1.0 + 1e-9) + slack[axis]
        extent[axis] = region_upper[axis] - region_lower[axis]
        if extent[axis] <= max(slack[axis], 1e-300):
            extent[axis] = 0.0
        shape[axis] = cells if extent[axis] > 0.0 else 1
    if cells == 0:
        _choose_shape(extent, width, count / PER_CELL, shape)
    while float(shape[0]) * shape[1] * shape[2] > MOST_CELLS:
        for axis in range(3):
            shape[axis] = (shape[axis] + 1) // 2
    _settle(extent, width, period, shape, inverse, reach)


def lay_out(seen: Survey, period: np.ndarray, count: int, cells: int) -> Layout:
    """The grid for ``count`` boxes as seen by ``survey``; ``cells`` along each axis, or 0: see ``grid_pairs``."""
    widest = float(seen.widest.max())
    limit = MARGIN * seen.typical if widest > LARGE * seen.typical else widest
    shape, reach = np.empty(3, dtype=np.int64), np.empty(3, dtype=np.int64)
    inverse, width = np.empty(3), np.empty(3)
    _lay_out(
        seen.region_lower, seen.region_upper, seen.widest, seen.slack, period, limit, count, cells,
        shape, inverse, reach, width,
    )  # fmt: skip
    return Layout(shape, seen.region_lower, inverse, reach, width, limit)


@kernel
def _cell_of(position, origin, inverse, cells):
    """Cell along an axis; what lies outside the region is in the cell at its edge."""
    return int(min(max((position - origin) * inverse, 0.0), cells - 1.0))


@kernel
def fill_cell_keys(first, last, lower, upper, period, shape, origin, inverse, limit, keys, order):
    """``keys``: the cell of each box's centre, x fastest, or one past the last cell for a box above the limit."""
    for index in range(first, last):
        key = 0
        large = False
        for axis in range(2, -1, -1):
            low = lower[index, axis]
            high = upper[index, axis]
            large |= high - low > limit
            centre = wrapped_centre(low, high, period[axis])
            key = key * shape[axis] + _cell_of(centre, origin[axis], inverse[axis], shape[axis])
        keys[index] = shape[0] * shape[1] * shape[2] if large else key
        order[index] = index


@kernel
def cells_of_box(box, axis, period, shape, origin, inverse, width):
    """First cell along an axis, and how many from there on, in which centres of boxes that meet ``box`` may lie."""
    cells = shape[axis]
    centre = wrapped_centre(box[axis], box[axis + 3], period[axis])
    half = 0.5 * (box[axis + 3] - box[axis] + width[axis])
    if period[axis] > 0.0:
        low = np.floor((centre - half) * inverse[axis] - CELL_SLACK)
        number = np.floor((centre + half) * inverse[axis] + CELL_SLACK) - low + 1.0
        if number >= cells or cells == 1:
            return 0, cells
        return int(low) % cells, int(number)
    first = _cell_of(centre - half, origin[axis], inverse[axis], cells)
    return first, _cell_of(centre + half, origin[axis], inverse[axis], cells) - first + 1
