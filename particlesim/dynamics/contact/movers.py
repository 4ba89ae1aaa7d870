"""Movers: bodies as an island's step sees them, and the gaps between them as they move and turn."""

from __future__ import annotations

from particlesim.core.jit import kernel
from particlesim.core.math3d import add, axpy, cross, dot, scale, set_vec3, sub, to_quat
from particlesim.core.math3d import to_vec3 as vec
from particlesim.dynamics.contact.contact_records import OF_A, OF_B, OF_EDGES
from particlesim.dynamics.settings import SMALL_TURN
from particlesim.model.bodies import angular_velocity

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
        m.shift[axis] = m.turn[axis] = 0.0


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


@kernel
def gap_now(p, t, a, b, time):
    """The gap at a contact point after the displacements of two movers in a time [s] since the start [m].

    Returns how much of it there is because bodies have turned, too: the normal with the face that it belongs to.
    """
    shift_b, turn_b = vec(b.shift), vec(b.turn)
    if b.row < 0:
        shift_b, turn_b = scale(vec(b.velocity), time), scale(vec(b.spin), time)
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
