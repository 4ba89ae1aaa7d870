"""Random sequential insertion: particles one by one where they overlap no other, in time linear in their number.

Particles in place are found again by the cells they are in: a grid for each level of sizes, whose cells are as wide as
its largest particle, hashed, so that empty cells take no memory. Particles are inserted from the largest level down.
While those of one level are, all that are finer and in place already (from lists and lattices) are found by the cells
of that level: no cell smaller than a particle is ever looked into, and no level without particles.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from particlesim.core.constants import MAX_MANIFOLD
from particlesim.core.jit import entry_kernel, kernel, without_refcounts
from particlesim.core.math3d import dot, sub, to_vec3
from particlesim.core.records import record
from particlesim.geometry.narrow_phase.pair import pair_overlaps
from particlesim.geometry.narrow_phase.parts import parts_separation
from particlesim.geometry.support import has_parts, is_sphere
from particlesim.model.bodies import placed
from particlesim.model.domain import nearest_image
from particlesim.model.overlap import overlaps_any
from particlesim.setup.space import Crowd, Space

# Cells along an axis: enough for any number of particles, few enough for whole numbers.
_MOST_CELLS = 2**20

# A particle that is in place, or waits to be.
INSERTED = record(
    [
        ("position", "f8", (3,)),  # [m]
        ("radius", "f8"),  # bounding sphere [m]
        ("next", "i8"),  # in its bucket, -1 if none
        ("shape_row", "i8"),
        ("scale", "f8"),
        ("level", "i8"),  # of its size: particles of one level differ by less than a factor of 2
        ("orientation", "f8", (4,)),
    ]
)

# The cells of one level of sizes.
LEVEL = record([("cells", "i8", (3,)), ("in_place", "i8")])

# The space that is filled.
SPACE = record([("lower", "f8", (3,)), ("upper", "f8", (3,)), ("period", "f8", (3,))])


class Insertion(NamedTuple):
    """Particles already in place, and how they are found again."""

    space: np.ndarray  # (1,) SPACE
    body: np.ndarray  # (n,) INSERTED
    level: np.ndarray  # (levels,) LEVEL, the finest first
    bucket: np.ndarray  # (buckets,) int64: a particle in the bucket, -1 if there is none


def levels_of(radius: np.ndarray) -> np.ndarray:
    """Levels (n,) int64 of bounding radii (n,): 0 for the smallest, without gaps."""
    octave = np.floor(np.log2(radius / radius.min(initial=math.inf))).astype(np.int64)
    return ((np.bincount(octave) > 0).cumsum() - 1)[octave]


def empty_space(crowd: Crowd, space: Space, orientation: np.ndarray) -> Insertion:
    """A space without particles yet, made for particles of these sizes and orientations (n, 4)."""
    total = len(crowd.radius)
    extent, body = np.zeros(1, dtype=SPACE), np.zeros(total, dtype=INSERTED)
    extent["lower"], extent["upper"], extent["period"] = space.lower, space.upper, space.period
    body["orientation"], body["scale"] = orientation, crowd.size
    body["radius"], body["shape_row"] = crowd.radius, crowd.shape
    body["level"] = levels_of(crowd.radius)
    level = np.zeros(body["level"].max(initial=-1) + 1, dtype=LEVEL)
    widths = np.zeros(len(level))
    np.maximum.at(widths, body["level"], 2.0 * crowd.radius)
    level["cells"] = np.clip(np.floor((space.upper - space.lower) / widths[:, None]), 1.0, _MOST_CELLS)
    return Insertion(extent, body, level, np.full(1 << (2 * total).bit_length(), -1, dtype=np.int64))


@kernel
def _bucket_of(level, cell, buckets):
    """A bucket for a cell: its numbers times large primes, mixed (M. Teschner et al., VMV 2003, 47-54)."""
    mixed = (cell[0] * 73856093) ^ (cell[1] * 19349663) ^ (cell[2] * 83492791) ^ (level * 2654435761)
    return mixed & (buckets - 1)


@kernel
def _cell_range(space, axis, cells, coordinate, reach):
    """First and last cell along an axis within ``reach`` of a coordinate; each cell of a periodic axis once."""
    lower = space.lower[axis]
    per_metre = cells / (space.upper[axis] - lower)
    first = math.floor((coordinate - reach - lower) * per_metre)
    last = math.floor((coordinate + reach - lower) * per_metre)
    if space.period[axis] > 0.0 and last - first >= cells:
        return 0, cells - 1
    return first, last


@kernel
def _cells_about(space, axis, cells, coordinate, radius):
    """First and last cell along an axis with the centre of anything that a particle of ``radius`` may overlap."""
    # A particle is in the cell of its centre and no wider than a cell: half a cell is as far as it reaches.
    half = 0.5 * (space.upper[axis] - space.lower[axis]) / cells
    return _cell_range(space, axis, cells, coordinate, radius + half)


@kernel
def _wrapped(space, cells, cell):
    """A cell, whose numbers may have run past the ends of periodic axes."""
    x = cell[0] % cells[0] if space.period[0] > 0.0 else cell[0]
    y = cell[1] % cells[1] if space.period[1] > 0.0 else cell[1]
    z = cell[2] % cells[2] if space.period[2] > 0.0 else cell[2]
    return x, y, z


@kernel
def _cell_at(space, cells, point):
    """The cell that a point is in."""
    x, _ = _cell_range(space, 0, cells[0], point[0], 0.0)
    y, _ = _cell_range(space, 1, cells[1], point[1], 0.0)
    z, _ = _cell_range(space, 2, cells[2], point[2], 0.0)
    return _wrapped(space, cells, (x, y, z))


@kernel
def _file(insertion, i, number):
    """Count particle i, where it is, among those in place that are found by the cells of level ``number``."""
    space, body, level, buckets = insertion
    cell = _cell_at(space[0], to_vec3(level[number].cells), to_vec3(body[i].position))
    bucket = _bucket_of(number, cell, len(buckets))
    body[i].next = buckets[bucket]
    buckets[bucket] = i
    level[number].in_place += 1


@entry_kernel
def refile(insertion, indices, number):
    """Find the particles ``indices`` (m,), all that are in place, by the cells of their level or of ``number``.

    The coarser of the two: nothing finer is looked for from now on.
    """
    insertion.bucket[:] = -1
    for k in range(len(insertion.level)):
        insertion.level[k].in_place = 0
    for i in indices:
        _file(insertion, i, max(insertion.body[i].level, number))


@kernel
def _overlap(table, meshes, a, b, offset, points):
    """Whether two particles whose bounding spheres overlap do; the centroid of b is at ``offset`` from that of a."""
    if meshes is not None and (has_parts(table, a.shape_row) or has_parts(table, b.shape_row)):
        return parts_separation(table, meshes, placed(a), placed(b), offset, points)[0] <= 0.0
    if is_sphere(table, a.shape_row) and is_sphere(table, b.shape_row):
        return True
    return pair_overlaps(table, placed(a), placed(b), offset, points)


@kernel
def _overlaps_in(shapes, insertion, j, i, point, points):
    """Whether particle i at ``point`` overlaps one in a bucket, of which j is the first.

    ``shapes`` are the tables of shapes and of meshes.
    """
    body = insertion.body
    period = to_vec3(insertion.space[0].period)
    radius = body[i].radius
    while j >= 0:
        other = body[j]
        offset = nearest_image(sub(to_vec3(other.position), point), period)
        reach = radius + other.radius
        if dot(offset, offset) <= reach * reach and _overlap(shapes[0], shapes[1], body[i], other, offset, points):
            return True
        j = other.next
    return False


@kernel
def _overlaps_on(shapes, insertion, number, i, point, points):
    """Whether particle i at ``point`` overlaps one that is found by the cells of level ``number``."""
    space, cells = insertion.space[0], to_vec3(insertion.level[number].cells)
    buckets = insertion.bucket
    # The cell of the point comes first: in a crowd most proposals fail there.
    first = buckets[_bucket_of(number, _cell_at(space, cells, point), len(buckets))]
    if first >= 0 and _overlaps_in(shapes, insertion, first, i, point, points):
        return True
    radius = insertion.body[i].radius
    x0, x1 = _cells_about(space, 0, cells[0], point[0], radius)
    y0, y1 = _cells_about(space, 1, cells[1], point[1], radius)
    z0, z1 = _cells_about(space, 2, cells[2], point[2], radius)
    for x in range(x0, x1 + 1):
        for y in range(y0, y1 + 1):
            for z in range(z0, z1 + 1):
                first = buckets[_bucket_of(number, _wrapped(space, cells, (x, y, z)), len(buckets))]
                # Most are empty, and a call that hands a table of shapes over takes longer than a look.
                if first >= 0 and _overlaps_in(shapes, insertion, first, i, point, points):
                    return True
    return False


@kernel
def _overlaps_any(shapes, insertion, i, point, points):
    """Whether particle i at ``point`` overlaps any in place, those that are finer by the cells of its level."""
    for number in range(insertion.body[i].level, len(insertion.level)):
        if insertion.level[number].in_place > 0 and _overlaps_on(shapes, insertion, number, i, point, points):
            return True
    return False


@entry_kernel
def try_in_place(known, insertion, indices, proposals):
    """Put each particle of ``indices`` (m,), all of one level, at the first of its ``proposals`` where it is free.

    ``known`` are the tables of shapes and of meshes, and the obstacles (k,) BODY.
    ``proposals`` (m, tries, 3) [m].  Returns whether there was one, (m,).  All that are finer and in place must have
    been filed under this level (see ``refile``).
    """
    (table, meshes, obstacles), insertion = without_refcounts(known), without_refcounts(insertion)
    points, period = np.empty((MAX_MANIFOLD, 3)), to_vec3(insertion.space[0].period)
    fits = np.zeros(len(indices), dtype=np.bool_)
    for k in range(len(indices)):
        i = indices[k]
        for attempt in range(proposals.shape[1]):
            point = to_vec3(proposals[k, attempt])
            if not (
                _overlaps_any((table, meshes), insertion, i, point, points)
                or overlaps_any(table, meshes, insertion.body[i], point, obstacles, period, points)
            ):
                for axis in range(3):
                    insertion.body[i].position[axis] = point[axis]
                _file(insertion, i, insertion.body[i].level)
                fits[k] = True
                break
    return fits
