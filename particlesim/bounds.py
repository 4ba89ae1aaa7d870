"""Axis-aligned bounding boxes of particles, exact for every shape."""

import math

from particlesim.constants import SPHERE
from particlesim.jit import kernel
from particlesim.vec import apply, matrix_of, row, row4


@kernel
def particle_extent(table, shape, size, turn):
    """Lower and upper corner of a particle's box, relative to its centroid, in world axes."""
    if table.kind[shape] == SPHERE:
        r = 0.5 * size
        return (-r, -r, -r), (r, r, r)
    matrix = matrix_of(turn)
    x0 = y0 = z0 = math.inf
    x1 = y1 = z1 = -math.inf
    for v in range(table.vertex_start[shape], table.vertex_start[shape + 1]):
        x, y, z = apply(matrix, row(table.vertex, v))
        x0, y0, z0 = min(x0, x), min(y0, y), min(z0, z)
        x1, y1, z1 = max(x1, x), max(y1, y), max(z1, z)
    return (x0 * size, y0 * size, z0 * size), (x1 * size, y1 * size, z1 * size)


@kernel
def write_box(table, shape, size, position, orientation, index, margin, lower, upper):
    """Write the box of particle ``index``, wider by ``margin`` [m] on all sides, to ``lower`` and ``upper``."""
    below, above = particle_extent(table, shape, size, row4(orientation, index))
    for axis in range(3):
        lower[index, axis] = position[index, axis] + below[axis] - margin
        upper[index, axis] = position[index, axis] + above[axis] + margin
