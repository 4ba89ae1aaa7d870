"""A particle against the walls of the world: planes across the axes."""

import math

from particlesim.constants import MAX_MANIFOLD, PATCH_TOLERANCE, SPHERE
from particlesim.jit import kernel
from particlesim.vec import apply, matrix_of, put, row, scaled


@kernel
def wall_normal(wall):
    """Outward normal of wall 0 to 5 (-x, +x, -y, +y, -z, +z): from a particle inside to the wall."""
    sign = 2.0 * (wall % 2) - 1.0
    axis = wall // 2
    return (sign if axis == 0 else 0.0), (sign if axis == 1 else 0.0), (sign if axis == 2 else 0.0)


@kernel
def wall_contact(table, world, wall, shape, size, turn, position, points):
    """Separation of a particle from a wall and number of contact points, relative to the particle's centroid.

    The points are those of the particle, all as deep as the deepest within PATCH_TOLERANCE: the corners of the face,
    edge or vertex that touches.
    """
    axis, sign = wall // 2, 2.0 * (wall % 2) - 1.0
    plane = world.upper[axis] if wall % 2 else world.lower[axis]
    room = sign * (plane - position[axis])
    if table.kind[shape] == SPHERE:
        put(points, 0, scaled(wall_normal(wall), 0.5 * size))
        return room - 0.5 * size, 1
    matrix = matrix_of(turn)
    first, last = table.vertex_start[shape], table.vertex_start[shape + 1]
    farthest = -math.inf
    for v in range(first, last):
        farthest = max(farthest, sign * size * apply(matrix, row(table.vertex, v))[axis])
    count = 0
    for v in range(first, last):
        corner = scaled(apply(matrix, row(table.vertex, v)), size)
        near = sign * corner[axis] >= farthest - PATCH_TOLERANCE * table.radius[shape] * size
        if near and count < MAX_MANIFOLD:
            put(points, count, corner)
            count += 1
    return room - farthest, count
