"""Which of the candidate pairs, and which particles and walls, touch or overlap."""

import numpy as np
from numba import prange

from particlesim.constants import MAX_MANIFOLD, SERIAL_BELOW, WALL
from particlesim.jit import kernel
from particlesim.narrow_phase.pair import nearest_image, pair_contact, pair_overlaps
from particlesim.narrow_phase.walls import wall_contact, wall_normal
from particlesim.vec import row, row4, sub


@kernel
def wall_as_partner(wall):
    """Walls 0 to 5 stand in a list of contacts as partners -1 to -6."""
    return -1 - wall


@kernel
def contact_between(table, world, constants, i, j, position_i, turn_i, position_j, turn_j, points):
    """Separation, normal, offset and number of contact points of particle i and partner j at the given poses.

    The normal and the offset point from i to j, points are relative to i's centroid; a wall has offset 0 and no pose.
    """
    if j < 0:
        separation, count = wall_contact(
            table, world, -1 - j, constants.shape[i], constants.size[i], turn_i, position_i, points
        )
        return separation, wall_normal(-1 - j), (0.0, 0.0, 0.0), count
    offset = nearest_image(sub(position_j, position_i), world.period)
    separation, normal, count = pair_contact(
        table,
        constants.shape[i],
        constants.size[i],
        turn_i,
        constants.shape[j],
        constants.size[j],
        turn_j,
        offset,
        points,
    )
    return separation, normal, offset, count


@kernel
def contact_now(table, world, constants, state, i, j, points):
    """The contact of particle i and partner j where they are now (see contact_between)."""
    other = max(j, 0)
    return contact_between(
        table,
        world,
        constants,
        i,
        j,
        row(state.position, i),
        row4(state.orientation, i),
        row(state.position, other),
        row4(state.orientation, other),
        points,
    )


@kernel
def _overlaps(table, world, constants, state, i, j, points):
    """Whether particles i and j touch or overlap."""
    return pair_overlaps(
        table,
        constants.shape[i],
        constants.size[i],
        row4(state.orientation, i),
        constants.shape[j],
        constants.size[j],
        row4(state.orientation, j),
        nearest_image(sub(row(state.position, j), row(state.position, i)), world.period),
        points,
    )


@kernel(parallel=True)
def touching_pairs(table, world, constants, state, pairs, moved):
    """The candidate pairs that touch or overlap, (m, 2), in the order of ``pairs``.

    Only pairs with a particle marked in ``moved`` (n,) are looked at.
    """
    touches = np.zeros(len(pairs), dtype=np.bool_)
    if len(pairs) < SERIAL_BELOW:
        points = np.empty((MAX_MANIFOLD, 3))
        for k in range(len(pairs)):
            i, j = pairs[k, 0], pairs[k, 1]
            if moved[i] or moved[j]:
                touches[k] = _overlaps(table, world, constants, state, i, j, points)
    else:
        for k in prange(len(pairs)):
            i, j = pairs[k, 0], pairs[k, 1]
            if moved[i] or moved[j]:
                touches[k] = _overlaps(table, world, constants, state, i, j, np.empty((MAX_MANIFOLD, 3)))
    return pairs[touches]


@kernel
def _near_wall(world, wall, position, radius):
    """Whether a sphere touches or crosses a wall."""
    axis = wall // 2
    if world.boundary[axis] != WALL:
        return False
    if wall % 2:
        return position[axis] + radius >= world.upper[axis]
    return position[axis] - radius <= world.lower[axis]


@kernel
def touching_walls(table, world, constants, state, moved):
    """Particles marked in ``moved`` that touch or cross a wall, (m, 2): the particle and the wall as partner."""
    found = np.empty((64, 2), dtype=np.int64)
    count = 0
    points = np.empty((MAX_MANIFOLD, 3))
    for i in range(len(constants.mass)):
        if not moved[i]:
            continue
        position = row(state.position, i)
        for wall in range(6):
            if not _near_wall(world, wall, position, constants.radius[i]):
                continue
            partner = wall_as_partner(wall)
            separation, _, _, _ = contact_now(table, world, constants, state, i, partner, points)
            if separation <= 0.0:
                if count == len(found):
                    found = np.concatenate((found, np.empty_like(found)))
                found[count, 0], found[count, 1] = i, partner
                count += 1
    return found[:count]


@kernel
def deepest_overlap(table, world, constants, state, pairs):
    """The largest overlap among candidate pairs and with walls [m]; 0 if nothing overlaps."""
    everyone = np.ones(len(constants.mass), dtype=np.bool_)
    points = np.empty((MAX_MANIFOLD, 3))
    deepest = 0.0
    for contacts in (
        touching_pairs(table, world, constants, state, pairs, everyone),
        touching_walls(table, world, constants, state, everyone),
    ):
        for k in range(len(contacts)):
            i, j = contacts[k, 0], contacts[k, 1]
            separation, _, _, _ = contact_now(table, world, constants, state, i, j, points)
            deepest = max(deepest, -separation)
    return deepest
