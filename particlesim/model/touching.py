"""Which of the candidate pairs, and which particles and walls, touch or overlap."""

from __future__ import annotations

import numpy as np

from particlesim.core.constants import MAX_MANIFOLD, WALL
from particlesim.core.jit import kernel
from particlesim.core.math3d import dot, load_quat, load_vec3, sub
from particlesim.core.parallel import ThreadTeam
from particlesim.geometry.narrow_phase.half_space import wall_contact, wall_normal
from particlesim.geometry.narrow_phase.pair import nearest_image, pair_contact, pair_overlaps
from particlesim.geometry.shape_table import ShapeTable
from particlesim.model.bodies import Constants, State, World


@kernel
def wall_as_partner(wall):
    """Walls 0 to 5 stand in a list of contacts as partners -1 to -6."""
    return -1 - wall


@kernel
def wall_of_partner(partner):
    """The wall that a partner below 0 stands for."""
    return -1 - partner


@kernel(inline=True)
def contact_now(table, world, constants, state, i, j, points):
    """Separation, normal, offset and number of contact points of particle i and partner j where they are now.

    The normal and the offset point from i to j, points are relative to i's centroid; a wall has offset 0.
    """
    position, turn = load_vec3(state.position, i), load_quat(state.orientation, i)
    if j < 0:
        wall = wall_of_partner(j)
        separation, count = wall_contact(
            table, world, wall, constants.shape[i], constants.size[i], turn, position, points
        )
        normal, offset = wall_normal(wall), (0.0, 0.0, 0.0)
    else:
        offset = nearest_image(sub(load_vec3(state.position, j), position), world.period)
        separation, normal, count = pair_contact(
            table,
            constants.shape[i],
            constants.size[i],
            turn,
            constants.shape[j],
            constants.size[j],
            load_quat(state.orientation, j),
            offset,
            points,
        )
    return separation, normal, offset, count


@kernel
def _mark_touching(table, world, constants, state, pairs, touches, first, last):
    """Mark which of the candidate pairs ``first .. last`` touch or overlap."""
    points = np.empty((MAX_MANIFOLD, 3))
    # Taken out of their structs once: each access counts references, which costs more than the arithmetic.
    position, orientation, period = state.position, state.orientation, world.period
    shape, size, radius = constants.shape, constants.size, constants.radius
    for k in range(first, last):
        i, j = pairs[k, 0], pairs[k, 1]
        touches[k] = False
        offset = nearest_image(sub(load_vec3(position, j), load_vec3(position, i)), period)
        reach = radius[i] + radius[j]
        if dot(offset, offset) <= reach * reach:
            touches[k] = pair_overlaps(
                table,
                shape[i],
                size[i],
                load_quat(orientation, i),
                shape[j],
                size[j],
                load_quat(orientation, j),
                offset,
                points,
            )


def touching_pairs(
    table: ShapeTable, world: World, constants: Constants, state: State, pairs: np.ndarray
) -> np.ndarray:
    """The candidate pairs (m, 2) that touch or overlap, in the order of ``pairs``."""
    touches = np.empty(len(pairs), dtype=np.bool_)
    crew = ThreadTeam(len(pairs))
    crew.each(
        lambda _, first, last: _mark_touching(table, world, constants, state, pairs, touches, first, last),
        len(pairs),
    )
    return pairs[touches]


@kernel
def _near_wall(lower, upper, boundary, position, radius, wall):
    """Whether a sphere reaches a wall of the world with these bounds."""
    axis = wall // 2
    room = upper[axis] - position[axis] if wall % 2 else position[axis] - lower[axis]
    return boundary[axis] == WALL and room <= radius


@kernel
def touching_walls(table, world, constants, state):
    """Particles that touch or cross a wall, (m, 2): the particle and the wall as partner."""
    # Taken out of their structs once: each access counts references, which costs more than the arithmetic.
    position, orientation = state.position, state.orientation
    shape, size, radius = constants.shape, constants.size, constants.radius
    lower, upper, boundary = world.lower, world.upper, world.boundary
    points = np.empty((MAX_MANIFOLD, 3))
    found = np.empty((64, 2), dtype=np.int64)
    count = 0
    for i in range(len(radius)):
        where = load_vec3(position, i)
        for wall in range(6):
            if not _near_wall(lower, upper, boundary, where, radius[i], wall):
                continue
            turn = load_quat(orientation, i)
            separation, _ = wall_contact(table, world, wall, shape[i], size[i], turn, where, points)
            if separation <= 0.0:
                if count == len(found):
                    found = np.concatenate((found, np.empty_like(found)))
                found[count, 0], found[count, 1] = i, wall_as_partner(wall)
                count += 1
    return found[:count]


@kernel
def _deepest_of(table, world, constants, state, contacts):
    """The largest overlap among contacts [m]."""
    points = np.empty((MAX_MANIFOLD, 3))
    deepest = 0.0
    for k in range(len(contacts)):
        i, j = contacts[k, 0], contacts[k, 1]
        separation, _, _, _ = contact_now(table, world, constants, state, i, j, points)
        deepest = max(deepest, -separation)
    return deepest


def deepest_overlap(table: ShapeTable, world: World, constants: Constants, state: State, pairs: np.ndarray) -> float:
    """The largest overlap among candidate pairs and with walls [m]; 0 if nothing overlaps."""
    where = table, world, constants, state
    touching = touching_pairs(*where, pairs), touching_walls(*where)
    return max(_deepest_of(*where, contacts) for contacts in touching)
