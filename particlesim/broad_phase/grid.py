"""Boxing: a uniform grid of cells, and tests between boxes in near cells only.

S. Goodwin, "Analysis of Efficient Collision Detection using Pre-Processing Data Structures", section II.  Boxes are
counted into the cells of their centres and stored in the order of the cells, x fastest, so that neighbouring cells
of a row are one range of boxes.  A box is tested against those after it in its own row and against the rows after
its own that it can reach: half of the neighbourhood, which meets each pair once.
"""

from __future__ import annotations

import numpy as np

from particlesim.broad_phase.counting import counting_sort
from particlesim.broad_phase.layout import Layout, cells_of_box, fill_cell_keys, lay_out
from particlesim.broad_phase.pairs import (
    any_wraps,
    append_overlaps,
    canonical,
    collect,
    column_of,
    gathered,
)
from particlesim.broad_phase.survey import survey
from particlesim.crew import Crew
from particlesim.jit import kernel


@kernel
def _folded(cell, cells, period):
    """A cell's number with whole periods taken off; -1 outside an axis that does not wrap."""
    if 0 <= cell < cells:
        return cell
    return cell % cells if period > 0.0 else -1


@kernel
def _add_range(ranges, size, start, stop):
    ranges[size, 0] = start
    ranges[size, 1] = stop
    return size + 1 if start < stop else size


@kernel
def _add_row(ranges, size, starts, row, left, right, cells, period):
    """Add the boxes in the cells ``left .. right`` of a row (in two parts if they wrap); the new ``size``."""
    if period > 0.0:
        if left < 0:
            size = _add_range(ranges, size, starts[row + left + cells], starts[row + cells])
        if right >= cells:
            size = _add_range(ranges, size, starts[row], starts[row + right - cells + 1])
    return _add_range(ranges, size, starts[row + max(left, 0)], starts[row + min(right, cells - 1) + 1])


@kernel
def _ranges_after(cell, starts, shape, reach, period, ranges):
    """Ranges of boxes to test a box in ``cell`` against; number 0 is its own row from its own cell on."""
    x = cell % shape[0]
    y = cell // shape[0] % shape[1]
    z = cell // (shape[0] * shape[1])
    right = x + reach[0]
    size = _add_range(ranges, 0, starts[cell], starts[cell - x + min(right, shape[0] - 1) + 1])
    if period[0] > 0.0 and right >= shape[0]:
        size = _add_range(ranges, size, starts[cell - x], starts[cell - x + right - shape[0] + 1])
    for layer in range(reach[2] + 1):
        near_z = _folded(z + layer, shape[2], period[2])
        if near_z < 0:
            break
        for line in range(-reach[1] if layer > 0 else 1, reach[1] + 1):
            near_y = _folded(y + line, shape[1], period[1])
            if near_y >= 0:
                row = (near_z * shape[1] + near_y) * shape[0]
                size = _add_row(ranges, size, starts, row, x - reach[0], right, shape[0], period[0])
    return size


@kernel
def _search_cells(first, last, boxes, order, cells, starts, shape, reach, period, keys):
    """Pairs of boxes in the cells, the earlier of which lies in ``first .. last``: (found, tested)."""
    wraps = any_wraps(period)
    ranges = np.empty((2 * (reach[2] + 1) * (2 * reach[1] + 1) + 2, 2), dtype=np.int64)
    size = 0
    current = -1
    found = 0
    tested = 0
    for index in range(first, last):
        if cells[index] != current:
            current = cells[index]
            size = _ranges_after(current, starts, shape, reach, period, ranges)
        ranges[0, 0] = index + 1
        for near in range(size):
            start = ranges[near, 0]
            stop = ranges[near, 1]
            tested += stop - start
            found = append_overlaps(boxes, order, index, start, stop, period, wraps, keys, found)
    return found, tested


@kernel
def _search_large(first, last, boxes, order, starts, shape, origin, inverse, width, period, keys):
    """Pairs of boxes ``first .. last``, which are too large for the cells, with those in the cells."""
    wraps = any_wraps(period)
    ranges = np.empty((3, 2), dtype=np.int64)
    found = 0
    tested = 0
    for index in range(first, last):
        box = column_of(boxes, index)
        x, number_x = cells_of_box(box, 0, period, shape, origin, inverse, width)
        y, number_y = cells_of_box(box, 1, period, shape, origin, inverse, width)
        z, number_z = cells_of_box(box, 2, period, shape, origin, inverse, width)
        for layer in range(number_z):
            near_z = (z + layer) % shape[2]
            for line in range(number_y):
                row = (near_z * shape[1] + (y + line) % shape[1]) * shape[0]
                size = _add_row(ranges, 0, starts, row, x, x + number_x - 1, shape[0], period[0])
                for near in range(size):
                    start = ranges[near, 0]
                    stop = ranges[near, 1]
                    tested += stop - start
                    found = append_overlaps(boxes, order, index, start, stop, period, wraps, keys, found)
    return found, tested


def _sorted_into_cells(
    lower: np.ndarray, upper: np.ndarray, period: np.ndarray, plan: Layout, crew: Crew
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The cell of each box in the order of the cells, the order, and where each cell starts."""
    count = len(lower)
    cells, order = np.empty(count, dtype=np.int64), np.empty(count, dtype=np.int32)

    def fill(_: int, first: int, last: int) -> None:
        fill_cell_keys(
            first, last, lower, upper, period, plan.shape, plan.origin, plan.inverse, plan.limit, cells, order
        )

    crew.each(fill, count)
    return counting_sort(cells, order, int(plan.shape.prod()) + 1, crew)


def _search(
    lower: np.ndarray, upper: np.ndarray, numbers: np.ndarray, period: np.ndarray, cells: int, crew: Crew
) -> tuple[list[np.ndarray], int, np.ndarray]:
    """Pairs of which at least one box fits the cells, tests, and the ``numbers`` of the boxes that do not."""
    plan = lay_out(survey(lower, upper, period, crew), period, len(lower), cells)
    sorted_cells, order, starts = _sorted_into_cells(lower, upper, period, plan, crew)
    boxes = gathered(lower, upper, order, crew)
    order = numbers[order]
    fitting = int(starts[-2])
    large = len(lower) - fitting

    def among(first: int, last: int, keys: np.ndarray) -> tuple[int, int]:
        return _search_cells(first, last, boxes, order, sorted_cells, starts, plan.shape, plan.reach, period, keys)

    def across(first: int, last: int, keys: np.ndarray) -> tuple[int, int]:
        return _search_large(
            fitting + first, fitting + last, boxes, order, starts,
            plan.shape, plan.origin, plan.inverse, plan.width, period, keys,
        )  # fmt: skip

    lists, tested = collect(among, fitting, crew, 4 * fitting)
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
    ``MOST_CELLS``).  If None, chosen from the number and the sizes of the boxes: cells are cubes about as large as
    leave ``PER_CELL`` boxes to a cell, but no narrower than the widest box along any axis; so there are never much
    more cells than boxes.  The region is that of most centres; the few outside are counted into the cells at its
    edge.  Boxes much larger than most (``LARGE``) are tested against the cells that they touch, and among each other
    in a coarser grid of their own.

    Raises ``ValueError`` for ``cells`` below 1.
    """
    if cells is not None and cells < 1:
        raise ValueError(f"grid: cells must be at least 1, got {cells}")
    count = len(lower)
    numbers = np.arange(count, dtype=np.int32)
    lists: list[np.ndarray] = []
    tested = 0
    with Crew(count) as crew:
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
