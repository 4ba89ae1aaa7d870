"""The impulses that answer impacts at one moment.

Every impulse acts equally and oppositely at one point, so momentum and angular momentum are kept whatever its size;
its size keeps the kinetic energy when the restitution is 1. Contacts of one moment that share particles are answered
together: each gets the impulse that would stop its own approach, and all are stretched by one factor, so that the
energy is what the restitution says. What is symmetric stays symmetric, and where only one contact approaches (a row
of balls) it is answered by itself, one after the other.
"""

import math

import numpy as np

from particlesim.core.constants import (
    APPROACH_TOLERANCE,
    MAX_MANIFOLD,
    MAX_PATCH_IMPULSES,
    RESTITUTION_THRESHOLD_HEIGHT,
    WALL,
)
from particlesim.core.jit import kernel
from particlesim.core.math3d import add, axpy, cross, dot, load_quat, load_vec3, norm, scale, store_vec3, sub, to_vec3
from particlesim.geometry.narrow_phase.half_space import wall_normal
from particlesim.model.free_motion import particle_spin, spin_of
from particlesim.model.touching import contact_now, wall_of_partner

# What came of contacts: they did not approach, met fast, met slowly and rebounded in full until they come to rest, or
# met slowly and are both held, which is left to the next stretch.
NOTHING, STRUCK, REBOUNDED, LEFT = 0, 1, 2, 3

# Columns of an island's tally: impacts, the virial, then the impulse on each of six walls.
IMPACTS, VIRIAL, WALLS = 0, 1, 2
TALLY = 8


# ---- one impulse -------------------------------------------------------------------------------------------------


@kernel
def _point_velocity(constants, state, i, arm):
    """Velocity of the point of particle ``i`` at ``arm`` from its centroid."""
    return add(load_vec3(state.velocity, i), cross(particle_spin(constants, state, i), arm))


@kernel
def _inverse_mass_at(constants, state, i, arm, normal):
    """How much speed along ``normal`` a unit impulse along it gives the point at ``arm`` [1/kg].

    1/m + n . ((I^-1 (r x n)) x r) (D. Baraff, SIGGRAPH 1997 course notes, Rigid Body Simulation II, eq. 8-18)
    """
    twist = cross(arm, normal)
    spin = spin_of(load_quat(state.orientation, i), twist, load_vec3(constants.inertia, i))
    return dot(normal, normal) / constants.mass[i] + dot(twist, spin)


@kernel
def approach(still, constants, state, i, j, point, offset, normal):
    """Speed at which the partners part at a point (negative: they approach), and the speed that counts as none."""
    of_i = _point_velocity(constants, state, i, point)
    parting = -dot(of_i, normal)
    speed = norm(of_i)
    if j >= 0:
        of_j = _point_velocity(constants, state, j, sub(point, offset))
        parting += dot(of_j, normal)
        speed += norm(of_j)
    return parting, APPROACH_TOLERANCE * speed + still


@kernel
def _resting_speed(world, constants, i):
    """Speed below which an impact under gravity keeps its energy (see RESTITUTION_THRESHOLD_HEIGHT) [m/s]."""
    g = norm(to_vec3(world.gravity))
    return math.sqrt(2.0 * g * RESTITUTION_THRESHOLD_HEIGHT * constants.inradius[i])


@kernel
def restitution_of(world, constants, i, j):
    """Of a pair: the smaller one; and the speed below which it does not count."""
    if j < 0:
        return min(constants.restitution[i], world.restitution), _resting_speed(world, constants, i)
    resting = min(_resting_speed(world, constants, i), _resting_speed(world, constants, j))
    return min(constants.restitution[i], constants.restitution[j]), resting


# ---- contacts of one moment ----------------------------------------------------------------------------------------


@kernel
def _middle(points, count):
    total = (0.0, 0.0, 0.0)
    for k in range(count):
        total = add(total, load_vec3(points, k))
    return scale(total, 1.0 / count)


@kernel
def _point_to_answer(still, constants, state, i, j, points, count, offset, normal):
    """Where a contact is answered next, and how fast it parts there; 0 if it approaches nowhere.

    First in the middle of its patch, then where it approaches fastest: a face that lands flat is thus pushed in its
    middle and does not start to spin.
    """
    point = _middle(points, count)
    parting, tolerance = approach(still, constants, state, i, j, point, offset, normal)
    if parting >= -tolerance:
        parting = 0.0
        for k in range(count):
            at_corner, small = approach(still, constants, state, i, j, load_vec3(points, k), offset, normal)
            if at_corner < parting and at_corner < -small:
                parting, point = at_corner, load_vec3(points, k)
    return point, parting


@kernel
def _stretch(constants, state, whom, size, push, twist, gain):
    """The factor on all impulses that leaves the energy which the restitutions say.

    Along the impulses the kinetic energy is a parabola. Its lowest point is a fully inelastic impact, the mirror image
    of where it started an elastic one. ``gain`` is what the impulses, each with its own restitution, would take and
    give back if they did not act on the same bodies.
    """
    growth = 0.0
    for k in range(size):
        i = whom[k]
        change = load_vec3(push, k)
        momentum = load_vec3(twist, k)
        spin = spin_of(load_quat(state.orientation, i), momentum, load_vec3(constants.inertia, i))
        growth += dot(change, change) / constants.mass[i] + dot(momentum, spin)
    return gain / growth


@kernel
def _slot(whom, size, i):
    """Where particle ``i`` stands among those of the moment."""
    for k in range(size):
        if whom[k] == i:
            return k
    return -1


@kernel
def _tell(tally, j, impulse, offset, normal):
    """Book an impulse between a particle and partner j."""
    if j >= 0:
        tally[VIRIAL] += impulse * dot(offset, normal)
    else:
        tally[WALLS + wall_of_partner(j)] += impulse


@kernel
def is_held(acceleration, i):
    """Whether particle ``i`` is held for the present stretch of time (see resting.py); walls are."""
    return i < 0 or (acceleration[i, 0] == 0.0 and acceleration[i, 1] == 0.0 and acceleration[i, 2] == 0.0)


@kernel
def let_go(world, constants, acceleration, i, left, tally):
    """Let gravity act again on particle ``i``, which was struck with ``left`` [s] of the stretch to go.

    If it was held, it has had its share of gravity for the whole stretch. What it weighs is no longer borne by the
    walls that gravity presses against.
    """
    gravity = to_vec3(world.gravity)
    if is_held(acceleration, i):
        for wall in range(6):
            pull = dot(wall_normal(wall), gravity)
            if world.boundary[wall // 2] == WALL and pull > 0.0:
                tally[WALLS + wall] -= constants.mass[i] * pull * left
    store_vec3(acceleration, i, gravity)


@kernel
def _turns_slowly(constants, state, i, speed):
    """Whether rotation moves no point of particle ``i`` faster than ``speed`` [m/s]; walls do not turn."""
    return i < 0 or norm(particle_spin(constants, state, i)) * constants.radius[i] <= speed


@kernel
def _bounce(world, constants, state, acceleration, i, j, speed):
    """What comes of partners that approach at a ``speed`` [m/s], and the factor on the impulse that would stop them."""
    restitution, resting = restitution_of(world, constants, i, j)
    if restitution == 1.0 or speed > resting:
        return STRUCK, 1.0 + restitution
    held = is_held(acceleration, i) and is_held(acceleration, j)
    if held and _turns_slowly(constants, state, i, resting) and _turns_slowly(constants, state, j, resting):
        return LEFT, 0.0
    return REBOUNDED, 2.0


@kernel
def answer(table, world, constants, state, acceleration, contacts, count, whom, size, leave_slow, struck, tally):
    """Answer ``count`` contacts (particle, partner) of one moment until nothing in them approaches.

    ``whom`` lists the ``size`` particles in them; with ``leave_slow`` those that may come to rest are left to
    the next stretch of time. Adds to ``tally``, and 1 for each contact to both its particles' rows of ``struck`` (n,),
    and returns what came of it: NOTHING if nothing approached, else
    STRUCK if that happened anywhere, or REBOUNDED.
    """
    points = np.empty((count, MAX_MANIFOLD, 3))
    corners = np.empty(count, dtype=np.int64)
    normals, offsets = np.empty((count, 3)), np.empty((count, 3))
    impulse = np.empty(count)
    answered = np.empty(count, dtype=np.bool_)
    push, twist = np.empty((size, 3)), np.empty((size, 3))
    for c in range(count):
        i, j = contacts[c, 0], contacts[c, 1]
        _, normal, offset, corners[c] = contact_now(table, world, constants, state, i, j, points[c])
        store_vec3(normals, c, normal)
        store_vec3(offsets, c, offset)
        answered[c] = False
    outcome = NOTHING
    for _ in range(MAX_PATCH_IMPULSES):
        for k in range(size):
            store_vec3(push, k, (0.0, 0.0, 0.0))
            store_vec3(twist, k, (0.0, 0.0, 0.0))
        gain = 0.0
        for c in range(count):
            i, j = contacts[c, 0], contacts[c, 1]
            normal, offset = load_vec3(normals, c), load_vec3(offsets, c)
            point, parting = _point_to_answer(
                world.still, constants, state, i, j, points[c], corners[c], offset, normal
            )
            impulse[c] = 0.0
            if parting < 0.0:
                inverse_mass = _inverse_mass_at(constants, state, i, point, normal)
                if j >= 0:
                    inverse_mass += _inverse_mass_at(constants, state, j, sub(point, offset), normal)
                stop = -parting / inverse_mass
                what, bounce = _bounce(world, constants, state, acceleration, i, j, -parting)
                if what == LEFT or (leave_slow and what != STRUCK):
                    continue
                outcome = what if outcome == NOTHING else min(outcome, what)
                impulse[c] = bounce * stop
                gain += bounce * bounce * stop * -parting
                slot = _slot(whom, size, i)
                store_vec3(push, slot, axpy(load_vec3(push, slot), normal, -impulse[c]))
                store_vec3(twist, slot, axpy(load_vec3(twist, slot), cross(point, normal), -impulse[c]))
                if j >= 0:
                    slot = _slot(whom, size, j)
                    store_vec3(push, slot, axpy(load_vec3(push, slot), normal, impulse[c]))
                    store_vec3(twist, slot, axpy(load_vec3(twist, slot), cross(sub(point, offset), normal), impulse[c]))
        if gain == 0.0:
            break
        factor = 1.0 if count == 1 else _stretch(constants, state, whom, size, push, twist, gain)
        for k in range(size):
            i = whom[k]
            store_vec3(
                state.velocity, i, axpy(load_vec3(state.velocity, i), load_vec3(push, k), factor / constants.mass[i])
            )
            store_vec3(
                state.angular_momentum, i, axpy(load_vec3(state.angular_momentum, i), load_vec3(twist, k), factor)
            )
        for c in range(count):
            if impulse[c] > 0.0:
                answered[c] = True
                _tell(tally, contacts[c, 1], factor * impulse[c], load_vec3(offsets, c), load_vec3(normals, c))
    for c in range(count):
        if answered[c]:
            tally[IMPACTS] += 1
            for i in contacts[c]:
                if i >= 0:
                    struck[i] += 1
    return outcome
