"""Random sequential insertion: putting particles one by one where they meet nobody, in time linear in their number."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from particlesim.core.constants import MAX_MANIFOLD, SPHERE
from particlesim.core.jit import kernel
from particlesim.core.math3d import dot, load_quat, load_vec3, store_vec3, sub
from particlesim.geometry.aabb import particle_extent
from particlesim.geometry.narrow_phase.pair import nearest_image, pair_overlaps
from particlesim.geometry.shape_table import ShapeTable
from particlesim.model.bodies import Constants, World

# Cells along an axis: enough for any number of particles, few enough for whole numbers.
_MOST_CELLS = 2**20


class Placed(NamedTuple):
    """Particles already in place, found again by a hash of the cell they are in."""

    position: np.ndarray  # (n, 3)
    orientation: np.ndarray  # (n, 4)
    level: np.ndarray  # (n,) int64: particles of one level differ in size by less than a factor of 2
    head: np.ndarray  # (buckets,) int64: last particle put in the bucket, -1 if none
    behind: np.ndarray  # (n,) int64: the one before it in its bucket, -1 if none
    cells: np.ndarray  # (levels, 3) int64: cells along each axis of the world; each as wide as its largest particle


def extents(table: ShapeTable, constants: Constants, orientation: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper corners of the particles' boxes relative to their centroids, (n, 3) each [m]."""
    below, above = np.empty((len(orientation), 3)), np.empty((len(orientation), 3))
    _write_extents(table, constants.shape, constants.size, orientation, below, above)
    return below, above


def empty_space(constants: Constants, world: World, total: int) -> Placed:
    """A world with nobody in it yet, made for ``total`` particles of these sizes."""
    radius = constants.radius
    least = radius.min(initial=math.inf)
    level = np.floor(np.log2(radius / least)).astype(np.int64)
    widths = np.array([2.0 * radius[level == k].max(initial=least) for k in range(level.max(initial=-1) + 1)])
    edges = world.upper - world.lower
    return Placed(
        position=np.zeros((total, 3)),
        orientation=np.zeros((total, 4)),
        level=level,
        head=np.full(1 << (2 * total).bit_length(), -1, dtype=np.int64),
        behind=np.full(total, -1, dtype=np.int64),
        cells=np.clip(np.floor(edges / widths[:, None]), 1.0, _MOST_CELLS).astype(np.int64),
    )


@kernel
def _write_extents(table, shape, size, orientation, below, above):
    kind, vertices, start = table.kind, table.vertex, table.vertex_start
    for i in range(len(shape)):
        lower, upper = particle_extent(kind, vertices, start, shape[i], size[i], load_quat(orientation, i))
        store_vec3(below, i, lower)
        store_vec3(above, i, upper)


@kernel
def _bucket(level, x, y, z, buckets):
    """A bucket for a cell: its numbers times large primes, mixed (M. Teschner et al., VMV 2003, 47-54)."""
    mixed = (x * 73856093) ^ (y * 19349663) ^ (z * 83492791) ^ (level * 2654435761)
    return mixed & (buckets - 1)


@kernel
def _cell_range(lower, upper, period, cells, coordinate, reach):
    """First and last cell along an axis within ``reach`` of a coordinate; each cell of a periodic axis once."""
    per_metre = cells / (upper - lower)
    first = math.floor((coordinate - reach - lower) * per_metre)
    last = math.floor((coordinate + reach - lower) * per_metre)
    if period > 0.0 and last - first >= cells:
        return 0, cells - 1
    return first, last


@kernel(inline=True)
def _cells_about(lower, upper, period, cells, level, axis, coordinate, radius):
    """First and last cell of a level along an axis with anything that a particle of ``radius`` may touch."""
    # A particle is in the cell of its centre and no wider than a cell: half a cell is as far as it reaches.
    reach = radius + 0.5 * (upper[axis] - lower[axis]) / cells[level, axis]
    return _cell_range(lower[axis], upper[axis], period[axis], cells[level, axis], coordinate, reach)


@kernel(inline=True)
def _bucket_at(lower, upper, period, cells, level, point, buckets):
    """The bucket of the cell of a level that a point is in."""
    x, _ = _cell_range(lower[0], upper[0], period[0], cells[level, 0], point[0], 0.0)
    y, _ = _cell_range(lower[1], upper[1], period[1], cells[level, 1], point[1], 0.0)
    z, _ = _cell_range(lower[2], upper[2], period[2], cells[level, 2], point[2], 0.0)
    return _wrapped_bucket(period, cells, level, x, y, z, buckets)


@kernel(inline=True)
def _wrapped_bucket(period, cells, level, x, y, z, buckets):
    """The bucket of a cell, whose numbers may have run past the ends of a periodic axis."""
    x = x % cells[level, 0] if period[0] > 0.0 else x
    y = y % cells[level, 1] if period[1] > 0.0 else y
    z = z % cells[level, 2] if period[2] > 0.0 else z
    return _bucket(level, x, y, z, buckets)


@kernel
def put_in_place(world, placed, who):
    """Count the particles of ``who`` (m,) as in place where they stand in ``placed``."""
    lower, upper, period, cells = world.lower, world.upper, world.period, placed.cells
    for i in who:
        bucket = _bucket_at(
            lower, upper, period, cells, placed.level[i], load_vec3(placed.position, i), len(placed.head)
        )
        placed.behind[i] = placed.head[bucket]
        placed.head[bucket] = i


@kernel(inline=True)
def _meets_any(
    table, kind, shape, size, radius, lower, upper, period, position, orientation, head, behind, cells, i, point, points
):
    """Whether particle i at ``point`` touches anybody put in place before; the arrays are those of the structs."""
    for level in range(len(cells)):
        x0, x1 = _cells_about(lower, upper, period, cells, level, 0, point[0], radius[i])
        y0, y1 = _cells_about(lower, upper, period, cells, level, 1, point[1], radius[i])
        z0, z1 = _cells_about(lower, upper, period, cells, level, 2, point[2], radius[i])
        wide, deep = x1 - x0 + 1, y1 - y0 + 1
        # The cell of the point comes first: in a crowd most proposals fail there.
        bucket = _bucket_at(lower, upper, period, cells, level, point, len(head))
        for cell in range(wide * deep * (z1 - z0 + 1) + 1):
            j = head[bucket]
            while j >= 0:
                offset = nearest_image(sub(load_vec3(position, j), point), period)
                reach = radius[i] + radius[j]
                if dot(offset, offset) <= reach * reach:
                    if kind[shape[i]] == SPHERE and kind[shape[j]] == SPHERE:
                        return True
                    turn, other = load_quat(orientation, i), load_quat(orientation, j)
                    if pair_overlaps(table, shape[i], size[i], turn, shape[j], size[j], other, offset, points):
                        return True
                j = behind[j]
            x, y, z = x0 + cell % wide, y0 + cell // wide % deep, z0 + cell // (wide * deep)
            bucket = _wrapped_bucket(period, cells, level, x, y, z, len(head))
    return False


@kernel
def try_in_place(table, world, constants, placed, who, proposals):
    """Put each particle of ``who`` (m,) at the first of its ``proposals`` (m, tries, 3) where it meets nobody.

    Returns whether there was one, (m,).
    """
    points = np.empty((MAX_MANIFOLD, 3))
    fits = np.zeros(len(who), dtype=np.bool_)
    # Taken out of their structs once: each access counts references, which costs more than the arithmetic.
    lower, upper, period, kind = world.lower, world.upper, world.period, table.kind
    shape, size, radius = constants.shape, constants.size, constants.radius
    position, orientation, level, head, behind, cells = placed
    for k in range(len(who)):
        i = who[k]
        for attempt in range(proposals.shape[1]):
            point = proposals[k, attempt, 0], proposals[k, attempt, 1], proposals[k, attempt, 2]
            if not _meets_any(
                table, kind, shape, size, radius, lower, upper, period,
                position, orientation, head, behind, cells, i, point, points,
            ):  # fmt: skip
                store_vec3(position, i, point)
                bucket = _bucket_at(lower, upper, period, cells, level[i], point, len(head))
                behind[i] = head[bucket]
                head[bucket] = i
                fits[k] = True
                break
    return fits
