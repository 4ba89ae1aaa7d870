"""Axis-aligned bounding boxes of shapes, exact for every shape."""

import math

import numpy as np

from particlesim.core.jit import entry_kernel, kernel, without_refcounts
from particlesim.core.math3d import axpy, dot, load_quat, load_vec3, quat_to_matrix, store_vec3
from particlesim.geometry.shape_table import ShapeTable
from particlesim.geometry.support import is_half_space, is_sphere, rounding_of, support_vertex

_ALL = (math.inf, math.inf, math.inf)


@kernel
def _reach(table, placed, row):
    """How far a core reaches along minus and plus a direction in body axes, such as a row of its rotation matrix."""
    back = -row[0], -row[1], -row[2]
    low = dot(load_vec3(table.vertex, support_vertex(table, placed[0], back)), row)
    high = dot(load_vec3(table.vertex, support_vertex(table, placed[0], row)), row)
    return low * placed[1], high * placed[1]


@kernel
def core_aabb(table, placed):
    """Lower and upper corner of the bounding box of a core, from the centroid, in world axes [m]."""
    m = quat_to_matrix(placed[2])
    x0, x1 = _reach(table, placed, (m[0], m[1], m[2]))
    y0, y1 = _reach(table, placed, (m[3], m[4], m[5]))
    z0, z1 = _reach(table, placed, (m[6], m[7], m[8]))
    return (x0, y0, z0), (x1, y1, z1)


@kernel
def shape_aabb(table, placed):
    """Lower and upper corner of the bounding box of a placed shape, from its centroid, in world axes [m].

    That of a half-space is all of space.
    """
    r = rounding_of(table, placed)
    lower, upper = (-r, -r, -r), (r, r, r)
    if is_half_space(table, placed[0]):
        lower, upper = axpy(lower, _ALL, -1.0), axpy(upper, _ALL, 1.0)
    elif not is_sphere(table, placed[0]):
        low, high = core_aabb(table, placed)
        lower, upper = axpy(low, (r, r, r), -1.0), axpy(high, (r, r, r), 1.0)
    return lower, upper


@entry_kernel
def _write_aabbs(table, shape, size, orientation, lower, upper):
    table, shape, size, orientation, lower, upper = without_refcounts((table, shape, size, orientation, lower, upper))
    for i in range(len(shape)):
        low, high = shape_aabb(table, (shape[i], size[i], load_quat(orientation, i)))
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
