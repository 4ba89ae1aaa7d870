"""Axis-aligned bounding boxes of particles, exact for every shape."""

import math

import numpy as np

from particlesim.core.constants import SPHERE
from particlesim.core.jit import kernel
from particlesim.core.math3d import load_quat, load_vec3, mat_vec, quat_to_matrix, store_vec3
from particlesim.geometry.shape_table import ShapeTable


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


@kernel
def _write_aabbs(table, shape, size, orientation, lower, upper):
    kind, vertices, start = table.kind, table.vertex, table.vertex_start
    for i in range(len(shape)):
        low, high = particle_extent(kind, vertices, start, shape[i], size[i], load_quat(orientation, i))
        store_vec3(lower, i, low)
        store_vec3(upper, i, high)


def aabbs_of(
    table: ShapeTable, shape: np.ndarray, size: np.ndarray, orientation: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper corners (n, 3) [m] of the AABBs of particles, relative to their centroids.

    Parameters
    ----------
    table : ShapeTable
        The shapes that the rows of ``shape`` refer to.
    shape, size, orientation : numpy.ndarray (n,) int64, (n,) float64 and (n, 4) float64
        Row of the table, factor on the shape of size 1, and unit quaternion of each particle.
    """
    lower, upper = np.empty((2, len(shape), 3))
    _write_aabbs(table, shape, size, orientation, lower, upper)
    return lower, upper
