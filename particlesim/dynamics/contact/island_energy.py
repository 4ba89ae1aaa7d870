"""The energy of an island in a step, and how far its impulses may go so that none is gained.

A state of the members of an island is (impulse [N s], angular impulse [N m s], shift [m], turn [rad]) of the step, rows
of 12 numbers.
"""

from __future__ import annotations

import math

from particlesim.core.jit import kernel
from particlesim.core.math3d import (
    add,
    axpy,
    cross,
    dot,
    norm,
    quat_from_rotvec,
    quat_multiply,
    quat_normalize,
    scale,
    set_quat,
    set_vec3,
    sub,
    to_quat,
)
from particlesim.core.math3d import to_vec3 as vec
from particlesim.dynamics.settings import ENERGY_ROUNDING, ENERGY_STEPS
from particlesim.model.bodies import angular_velocity, angular_velocity_of
from particlesim.model.free_motion import free_rotation


@kernel
def free_state(system, mover, members, gravity, duration, state):
    """Write what becomes of members that nothing pushes."""
    for k in range(len(members)):
        velocity, before = system.body[members[k]].velocity, mover[members[k]].before
        for axis in range(3):
            state[k, axis] = state[k, 3 + axis] = 0.0
            state[k, 6 + axis] = (velocity[axis] + 0.5 * gravity[axis] * duration) * duration
            state[k, 9 + axis] = before[3 + axis] * duration


@kernel
def write_state(islands, mover, span, members, state):
    """Write the impulses that members have had, and their displacements."""
    for k in range(len(members)):
        m = mover[members[k]]
        for axis in range(3):
            state[k, axis] = state[k, 3 + axis] = 0.0
            state[k, 6 + axis], state[k, 9 + axis] = m.shift[axis], m.turn[axis]
    for k in range(span[0], span[1]):
        p, t = islands.points[k], islands.terms[k]
        impulse, turning = vec(t.impulse), vec(t.angular_impulse)
        of_a, of_b = mover[p.a].row, mover[p.b].row
        about = add(cross(vec(p.arm_a), impulse), turning)
        for axis in range(3):
            state[of_a, axis] -= impulse[axis]
            state[of_a, 3 + axis] -= about[axis]
        if of_b >= 0:
            about = add(cross(vec(p.arm_b), impulse), turning)
            for axis in range(3):
                state[of_b, axis] += impulse[axis]
                state[of_b, 3 + axis] += about[axis]


@kernel
def motion_after(b, gravity, duration, row):
    """Velocity and angular momentum of a body after the impulses of a row of a state."""
    fall = scale(gravity, duration)
    velocity = axpy(add(vec(b.velocity), fall), (row[0], row[1], row[2]), b.inverse_mass)
    return velocity, add(vec(b.angular_momentum), (row[3], row[4], row[5]))


@kernel
def extra_turn(b, momentum, turn, duration):
    """The rotation after that by its angular momentum that a body turned by ``turn`` [rad] in all has made."""
    spin = angular_velocity_of(to_quat(b.orientation), momentum, vec(b.principal_inertia))
    return quat_multiply(quat_from_rotvec(turn), quat_from_rotvec(scale(spin, -duration)))


@kernel
def orientation_after(orientation, extra):
    """An orientation turned by a small rotation more."""
    return quat_normalize(quat_multiply(extra, orientation))


@kernel
def _end(b, momentum, row, duration):
    """Where a body is in the end that has gone on to a row of a state: shift and orientation."""
    shift, orientation = (row[6], row[7], row[8]), to_quat(b.orientation)
    extra = extra_turn(b, momentum, (row[9], row[10], row[11]), duration)
    free = free_rotation(orientation, momentum, vec(b.principal_inertia), duration)
    return shift, orientation_after(free, extra)


@kernel
def _gain(b, gravity, velocity, momentum, end):
    """The energy that a body gains in the step by going on to an ``end`` (shift, orientation) [J]."""
    shift, orientation = end
    old, own = vec(b.velocity), vec(b.angular_momentum)
    gain = b.mass * (0.5 * dot(velocity, velocity) - 0.5 * dot(old, old) - dot(gravity, shift))
    gain += 0.5 * dot(momentum, angular_velocity_of(orientation, momentum, vec(b.principal_inertia)))
    return gain - 0.5 * dot(own, angular_velocity(b))


@kernel
def gain_of(system, members, gravity, duration, state):
    """The energy that members gain in the step by going on to a state [J]."""
    gain = 0.0
    for k in range(len(members)):
        b = system.body[members[k]]
        velocity, momentum = motion_after(b, gravity, duration, state[k])
        end = (state[k, 6], state[k, 7], state[k, 8]), to_quat(b.orientation)
        if b.isotropic_inertia == 0.0:
            end = _end(b, momentum, state[k], duration)
        gain += _gain(b, gravity, velocity, momentum, end)
    return gain


@kernel
def place_ahead(system, members, gravity, duration, state, ahead):
    """Write into ``ahead`` (n,) BODY where members are in the end that go on to a state, and how they move."""
    for k in range(len(members)):
        b, then = system.body[members[k]], ahead[members[k]]
        velocity, momentum = motion_after(b, gravity, duration, state[k])
        shift, orientation = _end(b, momentum, state[k], duration)
        ahead[members[k]] = b
        set_vec3(then.position, add(vec(b.position), shift))
        set_quat(then.orientation, orientation)
        set_vec3(then.velocity, velocity)
        set_vec3(then.angular_momentum, momentum)


@kernel
def gain_ahead(system, members, gravity, ahead):
    """The energy that members have gained in the end [J]."""
    gain = 0.0
    for i in members:
        b, then = system.body[i], ahead[i]
        end = sub(vec(then.position), vec(b.position)), to_quat(then.orientation)
        gain += _gain(b, gravity, vec(then.velocity), vec(then.angular_momentum), end)
    return gain


@kernel
def pay(members, ahead, gain):
    """Let members move the less against each other, and turn the less, the more energy they have gained [J].

    Their momentum stays as it is.
    """
    mass, total, energy = 0.0, (0.0, 0.0, 0.0), 0.0
    for i in members:
        b = ahead[i]
        mass, total = mass + b.mass, axpy(total, vec(b.velocity), b.mass)
        energy += 0.5 * b.mass * dot(vec(b.velocity), vec(b.velocity))
        energy += 0.5 * dot(vec(b.angular_momentum), angular_velocity(b))
    mean = scale(total, 1.0 / mass)
    energy -= 0.5 * dot(total, mean)
    left = math.sqrt(max(1.0 - gain / energy, 0.0)) if energy > 0.0 else 0.0
    for i in members:
        b = ahead[i]
        set_vec3(b.velocity, axpy(mean, sub(vec(b.velocity), mean), left))
        set_vec3(b.angular_momentum, scale(vec(b.angular_momentum), left))


@kernel
def sum_of_work(islands, span):
    """The work that obstacles do at the contact points of a span (first, last) [J]."""
    work = 0.0
    for k in range(span[0], span[1]):
        work += islands.terms[k].work
    return work


@kernel
def _add_impulses(members, change, share, ahead):
    """Give members a share of impulses (n, 6)."""
    for k in range(len(members)):
        b, row = ahead[members[k]], change[k]
        set_vec3(b.velocity, axpy(vec(b.velocity), (row[0], row[1], row[2]), share * b.inverse_mass))
        set_vec3(b.angular_momentum, axpy(vec(b.angular_momentum), (row[3], row[4], row[5]), share))


@kernel
def add_affordable(system, members, gravity, change, works, ahead):
    """Give members so much of impulses (n, 6) that they gain no energy but by work; returns the share, 0 to 1.

    ``works`` of obstacles [J] are those until now, and of all these impulses. The energy is quadratic in the share.
    """
    none = gain_ahead(system, members, gravity, ahead) - works[0]
    _add_impulses(members, change, 0.5, ahead)
    half = gain_ahead(system, members, gravity, ahead) - works[0] - 0.5 * works[1]
    _add_impulses(members, change, 0.5, ahead)
    whole = gain_ahead(system, members, gravity, ahead) - works[0] - works[1]
    most, share = max(none, 0.0), 1.0
    if whole > most:
        curvature = 2.0 * (none - 2.0 * half + whole)
        slope = whole - none - curvature
        root = slope * slope - 4.0 * curvature * (none - most)
        share = min(max((math.sqrt(max(root, 0.0)) - slope) / (2.0 * curvature), 0.0), 1.0)
        _add_impulses(members, change, share - 1.0, ahead)
    return share


@kernel
def between(low, high, share, state):
    """Write the state a share of the way from one to another."""
    for k in range(low.shape[0]):
        for column in range(low.shape[1]):
            state[k, column] = low[k, column] + share * (high[k, column] - low[k, column])


@kernel
def affordable(system, members, gravity, duration, states, work, rounding):
    """How far to go from the first of ``states`` towards the second so that no energy is gained, 0 to 1.

    But for as much of the ``work`` [J] that obstacles do on the whole way. The third becomes what is reached. On the
    way from the first, which gains none, energy falls and then rises.
    """
    low, high, state = states
    between(low, high, 1.0, state)
    of_high = gain_of(system, members, gravity, duration, state) - work
    if of_high <= rounding:
        return 1.0
    share, far = 0.0, 1.0
    of_share = 0.0
    for step in range(ENERGY_STEPS):
        middle = 0.5 * (share + far)
        if step > 0 and of_share < 0.0:
            middle = share + 0.99 * (far - share) * of_share / (of_share - of_high)
        between(low, high, middle, state)
        gain = gain_of(system, members, gravity, duration, state) - middle * work
        if gain <= 0.0:
            share, of_share = middle, gain
        else:
            far, of_high = middle, gain
    between(low, high, share, state)
    return share


@kernel
def rounding_of_energy(system, mover, members):
    """Energies that are rounding among the members of an island [J]."""
    energy = 0.0
    for i in members:
        b, before = system.body[i], mover[i].before
        speed2 = before[0] * before[0] + before[1] * before[1] + before[2] * before[2]
        energy += b.mass * (norm(vec(mover[i].pull)) * b.radius + 0.5 * speed2)
        energy += 0.5 * dot(vec(b.angular_momentum), (before[3], before[4], before[5]))
    return ENERGY_ROUNDING * energy
