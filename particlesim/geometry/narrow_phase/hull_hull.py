"""Hull against hull: exact distance outside, exact depth inside, and the contact patch."""

import numpy as np

from particlesim.core.constants import MAX_MANIFOLD, PARALLEL_TOLERANCE
from particlesim.core.jit import kernel
from particlesim.core.math3d import add, norm, quat_to_matrix, scale
from particlesim.geometry.narrow_phase.contact_manifold import hull_patch
from particlesim.geometry.narrow_phase.gjk import NO_CORNERS, hull_distance, hulls_apart
from particlesim.geometry.narrow_phase.separating_axis import hull_depth

# Hulls nearer than this fraction of their sizes count as touching.
_TOUCHING = 1e-10

# Nearer than this fraction of their sizes, the distance is rounding; the separating axis test takes over.
_JOINED = 1e-13


@kernel(inline=True)
def _vertices(table, shape):
    """The vertices of a shape of size 1, a view (v, 3)."""
    return table.vertex[table.vertex_start[shape] : table.vertex_start[shape + 1]]


@kernel(inline=True)
def hulls_nearer(table, shape_a, size_a, turn_a, shape_b, size_b, turn_b, offset, distance):
    """Whether two hulls are nearer than ``distance`` [m]; 0 asks whether they touch or overlap."""
    touching = distance + _TOUCHING * (table.radius[shape_a] * size_a + table.radius[shape_b] * size_b)
    return not hulls_apart(
        _vertices(table, shape_a),
        size_a,
        quat_to_matrix(turn_a),
        _vertices(table, shape_b),
        size_b,
        quat_to_matrix(turn_b),
        offset,
        touching,
    )


@kernel(inline=True)
def hull_separation(table, shape_a, size_a, matrix_a, shape_b, size_b, matrix_b, offset, known):
    """Separation, normal from a to b and half way between the nearest points, of hull b at ``offset`` from hull a.

    And the corners that these were found from; ``known`` are corners to begin with (see hull_distance).
    """
    joined = _JOINED * (table.radius[shape_a] * size_a + table.radius[shape_b] * size_b)
    separation, apart, point_a, point_b, corners = hull_distance(
        _vertices(table, shape_a),
        size_a,
        matrix_a,
        _vertices(table, shape_b),
        size_b,
        matrix_b,
        offset,
        joined,
        False,
        known,
    )
    if separation > 0.0:
        normal = scale(apart, 1.0 / norm(apart))
    else:
        separation, normal = hull_depth(table, shape_a, size_a, matrix_a, shape_b, size_b, matrix_b, offset)
    return separation, normal, scale(add(point_a, point_b), 0.5), corners


@kernel(inline=True)
def hull_hull(table, shape_a, size_a, turn_a, shape_b, size_b, turn_b, offset, points):
    """Separation, normal from a to b and number of contact points of hull b at ``offset`` from hull a."""
    gaps = np.empty(MAX_MANIFOLD)
    matrix_a, matrix_b = quat_to_matrix(turn_a), quat_to_matrix(turn_b)
    separation, normal, middle, _ = hull_separation(
        table, shape_a, size_a, matrix_a, shape_b, size_b, matrix_b, offset, NO_CORNERS
    )
    count = hull_patch(
        table, shape_a, size_a, matrix_a, shape_b, size_b, matrix_b,
        offset, normal, separation, middle, PARALLEL_TOLERANCE, 0.0, points, gaps,
    )  # fmt: skip
    return separation, normal, count
