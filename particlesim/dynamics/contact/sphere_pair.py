"""Two spheres that meet each other and nothing else: most islands in a gas of spheres.

They need no list of impacts in the order of time, as there is one. What it does to them is worked out here on plain
numbers, by the formulas of ``response.answer`` in the same order: the result is the same to the last bit. Without it
all islands of a gas of spheres take two to three times as long.
"""

from __future__ import annotations

import math

from particlesim.core.constants import APPROACH_TOLERANCE, SPHERE, WALL
from particlesim.core.jit import kernel
from particlesim.core.math3d import (
    add,
    axpy,
    cross,
    dot,
    load_quat,
    load_vec3,
    norm,
    scale,
    store_quat,
    store_vec3,
    sub,
    to_vec3,
)
from particlesim.dynamics.ccd.time_of_impact import sphere_meets_wall
from particlesim.dynamics.contact.impact import IMPACTS, VIRIAL
from particlesim.dynamics.events.paths import NOTHING_MET, UNCHAINED, write_piece
from particlesim.geometry.narrow_phase.pair import nearest_image
from particlesim.model.free_motion import free_rotation, spin_of


@kernel
def meet_alone(kind, world, shape, met, first_met, i, j):
    """Whether the members of an island are spheres, without gravity, on whose paths there is one impact."""
    k = first_met[i]
    only_impact = k >= 0 and met[k, 1] == j and (k + 1 == len(met) or met[k + 1, 0] != i) and first_met[j] < 0
    gravity = to_vec3(world.gravity)
    return only_impact and kind[shape[i]] == SPHERE and kind[shape[j]] == SPHERE and dot(gravity, gravity) == 0.0


@kernel
def _meets_a_wall(world, position, velocity, radius, duration):
    """Whether a sphere without acceleration meets any wall."""
    meets = False
    for wall in range(6):
        axis = wall // 2
        if world.boundary[axis] == WALL:
            room = (world.upper[axis] - position[axis] if wall % 2 else position[axis] - world.lower[axis]) - radius
            speed = velocity[axis] if wall % 2 else -velocity[axis]
            meets = meets or sphere_meets_wall(room, speed, 0.0, duration) < math.inf
    return meets


@kernel
def _inverse_mass(mass, moments, turn, arm, normal):
    """How much speed along ``normal`` a unit impulse along it gives the point at ``arm`` (see response.py) [1/kg]."""
    twist = cross(arm, normal)
    return dot(normal, normal) / mass + dot(twist, spin_of(turn, twist, moments))


@kernel
def _arrived(state, inertia, i, time):
    """Position, orientation and moments of a particle without acceleration that has flown for ``time`` [s]."""
    moments = load_vec3(inertia, i)
    position = axpy(load_vec3(state.position, i), load_vec3(state.velocity, i), time)
    return (
        position,
        free_rotation(load_quat(state.orientation, i), load_vec3(state.angular_momentum, i), moments, time),
        moments,
    )


@kernel
def _enter(state, course, piece, particle, index, i, time, after):
    """Write the two pieces of path of a particle with one impact at ``time``, and its state just ``after`` it."""
    write_piece(piece, index, 0.0, state, course.acceleration, i)
    position, turn, velocity, momentum = after
    store_vec3(state.position, i, position)
    store_quat(state.orientation, i, turn)
    store_vec3(state.velocity, i, velocity)
    store_vec3(state.angular_momentum, i, momentum)
    write_piece(piece, index + 1, time, state, course.acceleration, i)
    particle[index, 0] = particle[index + 1, 0] = i
    course.head[i], course.clock[i], course.stamp[i], course.impacts[i] = UNCHAINED, time, 1, 1


@kernel
def answer_two(world, constants, state, course, i, j, time, duration, tally, piece, particle, pieces):
    """Answer the one impact of two spheres at ``time`` [s], and write their paths from row ``pieces`` on.

    False, with nothing changed, if that may not be all that happens to them within ``duration`` [s].
    """
    x_i, turn_i, moments_i = _arrived(state, constants.inertia, i, time)
    x_j, turn_j, moments_j = _arrived(state, constants.inertia, j, time)
    v_i, v_j = load_vec3(state.velocity, i), load_vec3(state.velocity, j)
    momentum_i, momentum_j = load_vec3(state.angular_momentum, i), load_vec3(state.angular_momentum, j)
    offset = nearest_image(sub(x_j, x_i), world.period)
    distance = norm(offset)
    if distance == 0.0 or course.head[i] != NOTHING_MET or course.head[j] != NOTHING_MET:
        return False
    normal = scale(offset, 1.0 / distance)
    separation = distance - 0.5 * (constants.size[i] + constants.size[j])
    arm_i = scale(normal, 0.5 * (constants.size[i] + separation))
    arm_j = sub(arm_i, offset)
    of_i = add(v_i, cross(spin_of(turn_i, momentum_i, moments_i), arm_i))
    of_j = add(v_j, cross(spin_of(turn_j, momentum_j, moments_j), arm_j))
    parting = -dot(of_i, normal) + dot(of_j, normal)
    if parting >= -(APPROACH_TOLERANCE * (norm(of_i) + norm(of_j)) + world.still):
        return False
    inverse_mass = _inverse_mass(constants.mass[i], moments_i, turn_i, arm_i, normal)
    inverse_mass += _inverse_mass(constants.mass[j], moments_j, turn_j, arm_j, normal)
    bounce = 1.0 + min(constants.restitution[i], constants.restitution[j])
    impulse = bounce * (-parting / inverse_mass)
    v_i = axpy(v_i, scale(normal, -impulse), 1.0 / constants.mass[i])
    v_j = axpy(v_j, scale(normal, impulse), 1.0 / constants.mass[j])
    left = duration - time
    if (
        dot(sub(v_j, v_i), normal) <= -1e-3 * parting
        or _meets_a_wall(world, x_i, v_i, constants.radius[i], left)
        or _meets_a_wall(world, x_j, v_j, constants.radius[j], left)
    ):
        return False
    momentum_i = axpy(momentum_i, scale(cross(arm_i, normal), -impulse), 1.0)
    momentum_j = axpy(momentum_j, scale(cross(arm_j, normal), impulse), 1.0)
    _enter(state, course, piece, particle, pieces, i, time, (x_i, turn_i, v_i, momentum_i))
    _enter(state, course, piece, particle, pieces + 2, j, time, (x_j, turn_j, v_j, momentum_j))
    tally[VIRIAL] += impulse * dot(offset, normal)
    tally[IMPACTS] += 1
    return True
