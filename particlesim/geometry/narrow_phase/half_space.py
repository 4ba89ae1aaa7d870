"""A particle against the walls of the world: planes across the axes."""

import math

import numpy as np

from particlesim.core.constants import MAX_MANIFOLD, PARALLEL_TOLERANCE, SPHERE
from particlesim.core.jit import kernel
from particlesim.core.math3d import dot, load_vec3, mat_vec, quat_to_matrix, scale, store_vec3
from particlesim.geometry.narrow_phase.contact_manifold import MAX_CORNERS, facing_feature


@kernel
def wall_normal(wall):
    """Outward normal of wall 0 to 5 (-x, +x, -y, +y, -z, +z): from a particle inside to the wall."""
    sign = 2.0 * (wall % 2) - 1.0
    axis = wall // 2
    return (sign if axis == 0 else 0.0), (sign if axis == 1 else 0.0), (sign if axis == 2 else 0.0)


@kernel(inline=True)
def wall_separation(table, lower, upper, wall, shape, size, turn, position):
    """Separation of a particle from a wall of the world with these bounds."""
    axis, sign = wall // 2, 2.0 * (wall % 2) - 1.0
    room = sign * ((upper[axis] if wall % 2 else lower[axis]) - position[axis])
    if table.kind[shape] == SPHERE:
        reach = 0.5
    else:
        matrix = quat_to_matrix(turn)
        outwards = wall_normal(wall)
        vertex = table.vertex
        reach = -math.inf
        for v in range(table.vertex_start[shape], table.vertex_start[shape + 1]):
            reach = max(reach, dot(outwards, mat_vec(matrix, load_vec3(vertex, v))))
    return room - size * reach


@kernel
def wall_contact(table, world, wall, shape, size, turn, position, points):
    """Separation of a particle from a wall and number of contact points, relative to the particle's centroid.

    The points are those of the particle: the corners of the face, edge or vertex that faces the wall.
    """
    separation = wall_separation(table, world.lower, world.upper, wall, shape, size, turn, position)
    outwards = wall_normal(wall)
    if table.kind[shape] == SPHERE:
        store_vec3(points, 0, scale(outwards, 0.5 * size))
        return separation, 1
    feature = np.empty((MAX_CORNERS, 3))
    count, _ = facing_feature(
        table, shape, size, quat_to_matrix(turn), (0.0, 0.0, 0.0), outwards, PARALLEL_TOLERANCE, feature
    )
    kept = min(count, MAX_MANIFOLD)
    for k in range(kept):
        store_vec3(points, k, load_vec3(feature, k * count // kept))
    return separation, kept
