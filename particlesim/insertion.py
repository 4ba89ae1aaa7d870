"""Random sequential insertion: putting particles one by one where they meet nobody, in time linear in their number."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from particlesim.bounds import particle_extent
from particlesim.constants import MAX_MANIFOLD
from particlesim.jit import kernel
from particlesim.narrow_phase.pair import nearest_image, pair_overlaps
from particlesim.state import Constants, ShapeTable, World
from particlesim.vec import norm, put, row, row4, sub


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
    level = np.floor(np.log2(radius / radius.min())).astype(np.int64)
    widths = np.array([2.0 * radius[level == k].max(initial=radius.min()) for k in range(level.max() + 1)])
    edges = world.upper - world.lower
    return Placed(
        position=np.zeros((total, 3)),
        orientation=np.zeros((total, 4)),
        level=level,
        head=np.full(1 << (2 * total).bit_length(), -1, dtype=np.int64),
        behind=np.full(total, -1, dtype=np.int64),
        cells=np.maximum(np.floor(edges / widths[:, None]), 1.0).astype(np.int64),
    )


@kernel
def _write_extents(table, shape, size, orientation, below, above):
    kind, vertices, start = table.kind, table.vertex, table.vertex_start
    for i in range(len(shape)):
        lower, upper = particle_extent(kind, vertices, start, shape[i], size[i], row4(orientation, i))
        put(below, i, lower)
        put(above, i, upper)


@kernel
def _bucket(level, x, y, z, buckets):
    """A bucket for a cell: its numbers times large primes, mixed (M. Teschner et al., VMV 2003, 47-54)."""
    mixed = (x * 73856093) ^ (y * 19349663) ^ (z * 83492791) ^ (level * 2654435761)
    return mixed & (buckets - 1)


@kernel
def _cell_range(world, cells, axis, coordinate, reach):
    """First and last cell along an axis within ``reach`` of a coordinate; each cell of a periodic axis once."""
    per_metre = cells / (world.upper[axis] - world.lower[axis])
    first = math.floor((coordinate - reach - world.lower[axis]) * per_metre)
    last = math.floor((coordinate + reach - world.lower[axis]) * per_metre)
    if world.period[axis] > 0.0 and last - first >= cells:
        return 0, cells - 1
    return first, last


@kernel
def _wrapped(world, cells, axis, number):
    return number % cells if world.period[axis] > 0.0 else number


@kernel
def _bucket_of(world, placed, level, x, y, z):
    cells = placed.cells[level]
    x, y, z = _wrapped(world, cells[0], 0, x), _wrapped(world, cells[1], 1, y), _wrapped(world, cells[2], 2, z)
    return _bucket(level, x, y, z, len(placed.head))


@kernel
def _meets_any(table, world, constants, placed, i, points):
    """Whether particle i, where it stands in ``placed``, touches anybody put in place before."""
    x, y, z = row(placed.position, i)
    for level in range(len(placed.cells)):
        cells = placed.cells[level]
        # A particle is in the cell of its centre and no wider than a cell: half a cell is as far as it reaches.
        wide = 0.5 * (world.upper - world.lower) / cells + constants.radius[i]
        x0, x1 = _cell_range(world, cells[0], 0, x, wide[0])
        y0, y1 = _cell_range(world, cells[1], 1, y, wide[1])
        z0, z1 = _cell_range(world, cells[2], 2, z, wide[2])
        for cx in range(x0, x1 + 1):
            for cy in range(y0, y1 + 1):
                for cz in range(z0, z1 + 1):
                    j = placed.head[_bucket_of(world, placed, level, cx, cy, cz)]
                    while j >= 0:
                        offset = nearest_image(sub(row(placed.position, j), (x, y, z)), world.period)
                        near = norm(offset) <= constants.radius[i] + constants.radius[j]
                        if near and pair_overlaps(
                            table,
                            constants.shape[i],
                            constants.size[i],
                            row4(placed.orientation, i),
                            constants.shape[j],
                            constants.size[j],
                            row4(placed.orientation, j),
                            offset,
                            points,
                        ):
                            return True
                        j = placed.behind[j]
    return False


@kernel
def put_in_place(world, placed, i):
    """Count particle i as in place where it stands in ``placed``."""
    level = placed.level[i]
    cells = placed.cells[level]
    x, _ = _cell_range(world, cells[0], 0, placed.position[i, 0], 0.0)
    y, _ = _cell_range(world, cells[1], 1, placed.position[i, 1], 0.0)
    z, _ = _cell_range(world, cells[2], 2, placed.position[i, 2], 0.0)
    bucket = _bucket_of(world, placed, level, x, y, z)
    placed.behind[i] = placed.head[bucket]
    placed.head[bucket] = i


@kernel
def try_in_place(table, world, constants, placed, who, proposals):
    """Put each particle of ``who`` (m,) where ``proposals`` (m, 3) says if it meets nobody there: whether, (m,)."""
    points = np.empty((MAX_MANIFOLD, 3))
    fits = np.zeros(len(who), dtype=np.bool_)
    for k in range(len(who)):
        put(placed.position, who[k], row(proposals, k))
        if not _meets_any(table, world, constants, placed, who[k], points):
            put_in_place(world, placed, who[k])
            fits[k] = True
    return fits
