"""Movers: bodies as an island's step sees them, and the gaps between them as they move and turn."""

from __future__ import annotations

from particlesim.core.jit import kernel
from particlesim.core.math3d import add, axpy, cross, dot, scale, set_vec3, sub, to_quat
from particlesim.core.math3d import to_vec3 as vec
from particlesim.dynamics.contact.contact_records import OF_A, OF_B, OF_EDGES, along_normal
from particlesim.dynamics.contact.law import surface_velocity
from particlesim.dynamics.settings import SMALL_TURN
from particlesim.model.bodies import KINEMATIC, angular_velocity
from particlesim.model.prescribed_motion import swing_of, swing_shift

_STILL = (0.0, 0.0, 0.0)


@kernel
def _world_inverse_inertia(b):
    """The inverse inertia of a body in world axes (see MOVER)."""
    q, i = to_quat(b.orientation), b.inverse_inertia
    w, x, y, z = q
    rows = (
        (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
        (2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)),
        (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)),
    )
    p, r, s = rows
    return (
        i[0] * p[0] * p[0] + i[1] * p[1] * p[1] + i[2] * p[2] * p[2],
        i[0] * r[0] * r[0] + i[1] * r[1] * r[1] + i[2] * r[2] * r[2],
        i[0] * s[0] * s[0] + i[1] * s[1] * s[1] + i[2] * s[2] * s[2],
        i[0] * r[0] * s[0] + i[1] * r[1] * s[1] + i[2] * r[2] * s[2],
        i[0] * s[0] * p[0] + i[1] * s[1] * p[1] + i[2] * s[2] * p[2],
        i[0] * p[0] * r[0] + i[1] * p[1] * r[1] + i[2] * p[2] * r[2],
    )


@kernel
def write_mover(m, b, row):
    """Write a body as the sweeps see it at the start of a step."""
    velocity, spin = vec(b.velocity), angular_velocity(b)
    set_vec3(m.velocity, velocity)
    set_vec3(m.spin, spin)
    m.row, m.inverse_mass = row, b.inverse_mass
    inverse = _world_inverse_inertia(b)
    for k in range(6):
        m.inverse_inertia[k] = inverse[k]
    for axis in range(3):
        m.before[axis], m.before[3 + axis] = velocity[axis], spin[axis]
        m.average[axis], m.average[3 + axis] = velocity[axis], spin[axis]
        m.shift[axis] = m.turn[axis] = 0.0


@kernel
def take_back(m, lead):
    """Take back a velocity that fields have given a mover ahead of time."""
    set_vec3(m.velocity, sub(vec(m.velocity), lead))
    for axis in range(3):
        m.before[axis] -= lead[axis]


@kernel
def change_of(m):
    """By how much velocity and angular velocity of a mover have changed in the step; not at all of an obstacle."""
    if m.row < 0:
        return _STILL, _STILL
    before = m.before
    return (
        sub(vec(m.velocity), (before[0], before[1], before[2])),
        sub(vec(m.spin), (before[3], before[4], before[5])),
    )


@kernel
def closing(p, of_a, of_b):
    """How fast a gap grows between bodies with these (velocity, angular velocity)."""
    there = sub(add(of_b[0], cross(of_b[1], vec(p.arm_b))), add(of_a[0], cross(of_a[1], vec(p.arm_a))))
    return dot(vec(p.normal), there)


@kernel
def _turned(vector, turn):
    """A vector turned by a rotation vector [rad], to second order."""
    across = cross(turn, vector)
    return add(vector, add(across, scale(cross(turn, across), 0.5)))


@kernel
def _turns(p, t, a, b, turn_b):
    """How the normal and the two arms of a contact point turn: with bodies, those of spheres with the normal."""
    of_normal = vec(a.turn) if t.owner == OF_A else (turn_b if t.owner == OF_B else _STILL)
    return of_normal, of_normal if t.round_a else vec(a.turn), of_normal if t.round_b else turn_b


@kernel
def _across_edges(p, t, turn_a, turn_b):
    """The normal of two edges that cross after their bodies have turned, to first order."""
    normal = vec(p.normal)
    change = scale(vec(t.with_a), dot(cross(turn_a, normal), vec(t.edge_a)))
    return add(normal, axpy(change, vec(t.with_b), dot(cross(turn_b, normal), vec(t.edge_b))))


# ---- moving obstacles ------------------------------------------------------------------------------------------------


@kernel
def moves(system, i):
    """Whether a body is an obstacle with a prescribed motion, or whose surface runs."""
    return system.body[i].kind == KINEMATIC


@kernel
def obstacle_shift(system, i, time):
    """How far an obstacle goes in a time [s] from the start of the step, and how much faster it then is than there."""
    b = system.body[i]
    shift = scale(vec(b.velocity), time)
    if not moves(system, i):
        return shift, _STILL
    swung, faster = swing_shift(swing_of(system.motion[b.motion]), time)
    return add(shift, swung), faster


@kernel
def surface_gain(system, p, b, shift_a, time):
    """How much faster the surface of obstacle ``b`` goes at a contact point, a time [s] later, than the mover does.

    The point goes along with particle ``a``, which is shifted by then; a conveyor's surface runs.
    """
    shift, faster = obstacle_shift(system, p.b, time)
    carried = cross(vec(b.spin), sub(shift_a, shift))
    return add(add(faster, carried), surface_velocity(system, system.body[p.b], vec(p.normal)))


@kernel
def seek(system, p, mover, closing_speed, time, duration):
    """Let a contact point seek a normal velocity, and no sliding, at the end of a part (time, duration) of the step."""
    wanted = scale(vec(p.normal), closing_speed)
    if moves(system, p.b):
        a, b = mover[p.a], mover[p.b]
        shift_a = axpy(vec(a.shift), (a.average[0], a.average[1], a.average[2]), duration)
        wanted = sub(wanted, surface_gain(system, p, b, shift_a, time + duration))
    set_vec3(p.wanted, wanted)


# ---- what impulses take ----------------------------------------------------------------------------------------------


@kernel
def begin_means(mover, members):
    """Remember the velocities of members as a part of the step begins."""
    for i in members:
        m = mover[i]
        for axis in range(3):
            m.average[axis], m.average[3 + axis] = m.velocity[axis], m.spin[axis]


@kernel
def end_means(mover, members):
    """Write the means of the velocities that members began a part of the step with, and have now."""
    for i in members:
        m = mover[i]
        for axis in range(3):
            m.average[axis] = 0.5 * (m.average[axis] + m.velocity[axis])
            m.average[3 + axis] = 0.5 * (m.average[3 + axis] + m.spin[axis])


@kernel
def _mean_at(m, arm):
    """The mean velocity of a mover at an arm from its position."""
    return add((m.average[0], m.average[1], m.average[2]), cross((m.average[3], m.average[4], m.average[5]), arm))


@kernel
def book(system, mover, p, t, impulse, angular_impulse, interval):
    """Book what an impulse and one against rolling took in an interval (time, duration), and an obstacle's work.

    An impulse works as much as it would on what goes at the mean of old and new velocities.
    """
    a, b = mover[p.a], mover[p.b]
    of_b = _mean_at(b, vec(p.arm_b))
    if moves(system, p.b):
        time, duration = interval
        then = surface_gain(system, p, b, vec(a.shift), time + duration)
        earlier = surface_gain(system, p, b, axpy(vec(a.shift), vec(a.velocity), -duration), time)
        of_b = axpy(of_b, add(earlier, then), 0.5)
        t.work -= dot(impulse, of_b) + dot(angular_impulse, vec(b.spin))
    if p.static_friction > 0.0:
        _, drag = along_normal(p, impulse)
        t.rubbed -= dot(drag, sub(of_b, _mean_at(a, vec(p.arm_a))))
    if t.rolling_friction > 0.0:
        turning = sub((b.average[3], b.average[4], b.average[5]), (a.average[3], a.average[4], a.average[5]))
        t.rolled -= dot(angular_impulse, turning)


# ---- gaps ------------------------------------------------------------------------------------------------------------


@kernel
def gap_now(system, p, t, a, b, time):
    """The gap at a contact point after the displacements of two movers in a time [s] since the start [m].

    Returns how much of it there is because bodies have turned, too: the normal with the face that it belongs to.
    """
    shift_b, turn_b = vec(b.shift), vec(b.turn)
    if b.row < 0:
        shift_b, turn_b = obstacle_shift(system, p.b, time)[0], scale(vec(b.spin), time)
    straight = t.gap + closing(p, (vec(a.shift), vec(a.turn)), (shift_b, turn_b))
    if dot(vec(a.turn), vec(a.turn)) + dot(turn_b, turn_b) < SMALL_TURN * SMALL_TURN:
        return straight, 0.0
    of_normal, of_a, of_b = _turns(p, t, a, b, turn_b)
    arm_a, arm_b = vec(p.arm_a), vec(p.arm_b)
    normal = _turned(vec(p.normal), of_normal)
    if t.owner == OF_EDGES:
        normal = _across_edges(p, t, vec(a.turn), turn_b)
    apart = sub(shift_b, vec(a.shift))
    apart = add(apart, sub(sub(_turned(arm_b, of_b), arm_b), sub(_turned(arm_a, of_a), arm_a)))
    gap = t.gap + dot(normal, apart)
    return gap, gap - straight
