"""Axis-aligned bounding boxes of particles, exact for every shape."""

import math

from particlesim.core.constants import SPHERE
from particlesim.core.jit import kernel
from particlesim.core.math3d import load_vec3, mat_vec, quat_to_matrix


@kernel
def hull_extent(vertices, first, last, size, turn):
    """Lower and upper corner of a hull's box, relative to its centroid, in world axes."""
    matrix = quat_to_matrix(turn)
    x0 = y0 = z0 = math.inf
    x1 = y1 = z1 = -math.inf
    for v in range(first, last):
        x, y, z = mat_vec(matrix, load_vec3(vertices, v))
        x0, y0, z0 = min(x0, x), min(y0, y), min(z0, z)
        x1, y1, z1 = max(x1, x), max(y1, y), max(z1, z)
    return (x0 * size, y0 * size, z0 * size), (x1 * size, y1 * size, z1 * size)


@kernel(inline=True)
def particle_extent(kind, vertices, vertex_start, shape, size, turn):
    """Lower and upper corner of a particle's box, relative to its centroid; the arrays are those of the shape table."""
    r = 0.5 * size
    below, above = (-r, -r, -r), (r, r, r)
    if kind[shape] != SPHERE:
        below, above = hull_extent(vertices, vertex_start[shape], vertex_start[shape + 1], size, turn)
    return below, above
