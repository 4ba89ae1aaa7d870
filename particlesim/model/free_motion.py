"""Free motion between impacts: the parabola, and the free rotation of any rigid body.

The state holds the angular momentum, which stays the same to the last bit until an impact; the angular velocity
follows from it and the orientation.
"""

import math

from particlesim.core.jit import kernel
from particlesim.core.math3d import (
    add,
    axpy,
    cross,
    dot,
    inverse_rotate,
    norm,
    quat_from_rotvec,
    quat_multiply,
    quat_normalize,
    rotate,
    scale,
    set_quat,
    set_vec3,
    to_quat,
    to_vec3,
)
from particlesim.core.quadrature import STAGES, WEIGHTS
from particlesim.model.bodies import DYNAMIC, EQUAL_MOMENTS, KINEMATIC, angular_velocity
from particlesim.model.prescribed_motion import NO_SWING, swing_of, swing_shift

# An asymmetric body turns by at most this angle [rad] in one stage of the quadrature, whose error falls as its
# seventh power: about 1e-13 rad.
_MAX_TURN = 0.05


@kernel
def _equal(a, b):
    return abs(a - b) <= EQUAL_MOMENTS * (a + b)


@kernel
def _unique_axis(principal_inertia):
    """Axis of a symmetric top, 3 for a body without preferred axis, -1 for an asymmetric one."""
    if _equal(principal_inertia[0], principal_inertia[1]):
        return 3 if _equal(principal_inertia[1], principal_inertia[2]) else 2
    if _equal(principal_inertia[1], principal_inertia[2]):
        return 0
    return 1 if _equal(principal_inertia[0], principal_inertia[2]) else -1


@kernel
def angular_speed(b):
    """How fast a body turns [rad/s]; one without preferred axis turns about its angular momentum."""
    if b.isotropic_inertia > 0.0:
        return norm(to_vec3(b.angular_momentum)) / b.isotropic_inertia
    return norm(angular_velocity(b))


@kernel
def _symmetric_top(orientation, momentum, principal_inertia, axis, time):
    """Orientation of a symmetric top after ``time``.

    It turns about its angular momentum L at L / I and about its own axis at (1 / I_axis - 1 / I) L_axis, both
    steady (L. D. Landau, E. M. Lifshitz, Mechanics, 3rd ed., section 33).
    """
    across = principal_inertia[0] if axis != 0 else principal_inertia[1]
    own = inverse_rotate(orientation, momentum)
    spin = (1.0 / principal_inertia[axis] - 1.0 / across) * own[axis] * time
    about_axis = (
        spin if axis == 0 else 0.0,
        spin if axis == 1 else 0.0,
        spin if axis == 2 else 0.0,
    )
    orientation = quat_multiply(orientation, quat_from_rotvec(about_axis))
    return quat_normalize(quat_multiply(quat_from_rotvec(scale(momentum, time / across)), orientation))


@kernel
def _rates(q, m, inverse):
    """Time derivatives of the orientation and of the angular momentum in body axes (Euler's equations)."""
    spin = (m[0] * inverse[0], m[1] * inverse[1], m[2] * inverse[2])
    half = quat_multiply(q, (0.0, 0.5 * spin[0], 0.5 * spin[1], 0.5 * spin[2]))
    return half, cross(m, spin)


@kernel
def _stage(q, m, rates_q, rates_m, weights, time):
    """The state reached from (q, m) under the weighted sum of three rates."""
    for k in range(3):
        w = weights[k] * time
        r = rates_q[k]
        q = (q[0] + w * r[0], q[1] + w * r[1], q[2] + w * r[2], q[3] + w * r[3])
        m = axpy(m, rates_m[k], w)
    return q, m


@kernel
def _asymmetric_turn(orientation, body_momentum, principal_inertia, time):
    """Orientation and angular momentum in body axes after a short ``time``, by one step of Gauss-Legendre.

    It keeps the energy and the length of the angular momentum, which are quadratic.
    """
    inverse = (1.0 / principal_inertia[0], 1.0 / principal_inertia[1], 1.0 / principal_inertia[2])
    q0, m0 = _rates(orientation, body_momentum, inverse)
    rates_q, rates_m = (q0, q0, q0), (m0, m0, m0)
    # The stages are implicit: iterated until they repeat. Each round gains a factor of the angle turned.
    limit = 1e-16 * norm(body_momentum) * norm(m0)
    for _ in range(40):
        qa, ma = _stage(orientation, body_momentum, rates_q, rates_m, STAGES[0], time)
        qb, mb = _stage(orientation, body_momentum, rates_q, rates_m, STAGES[1], time)
        qc, mc = _stage(orientation, body_momentum, rates_q, rates_m, STAGES[2], time)
        qa, ma = _rates(qa, ma, inverse)
        qb, mb = _rates(qb, mb, inverse)
        qc, mc = _rates(qc, mc, inverse)
        change = norm(axpy(ma, rates_m[0], -1.0)) + norm(axpy(mc, rates_m[2], -1.0))
        change_q = abs(qc[0] - rates_q[2][0]) + abs(qc[1] - rates_q[2][1]) + abs(qc[2] - rates_q[2][2])
        rates_q, rates_m = (qa, qb, qc), (ma, mb, mc)
        if change * norm(body_momentum) <= limit and change_q * time <= 1e-16:
            break
    orientation, body_momentum = _stage(orientation, body_momentum, rates_q, rates_m, WEIGHTS, time)
    return quat_normalize(orientation), body_momentum


@kernel
def _asymmetric_top(orientation, momentum, principal_inertia, time):
    """Orientation of a body with three different principal moments after ``time``."""
    own = inverse_rotate(orientation, momentum)
    fastest = norm(momentum) / min(principal_inertia[0], principal_inertia[1], principal_inertia[2])
    parts = max(1, math.ceil(fastest * abs(time) / _MAX_TURN))
    for _ in range(parts):
        orientation, own = _asymmetric_turn(orientation, own, principal_inertia, time / parts)
    # The quadrature keeps the energy and the length of the momentum; this nudge keeps its direction in space.
    drifted = rotate(orientation, own)
    nudge = quat_from_rotvec(scale(cross(drifted, momentum), 1.0 / dot(momentum, momentum)))
    return quat_normalize(quat_multiply(nudge, orientation))


@kernel
def isotropic_rotation(orientation, momentum, inertia, time):
    """Orientation after ``time`` [s] of a free body without preferred axis: it turns about its angular momentum."""
    step = quat_from_rotvec(scale(momentum, time / inertia))
    return quat_normalize(quat_multiply(step, orientation))


@kernel
def free_rotation(orientation, momentum, principal_inertia, time):
    """Orientation of a free body with the given angular momentum (world axes) after ``time`` [s], of either sign.

    Closed forms for spheres, cubes and every symmetric top; Gauss-Legendre of order 6 for the rest.
    """
    if dot(momentum, momentum) == 0.0:
        return orientation
    axis = _unique_axis(principal_inertia)
    if axis == 3:
        return isotropic_rotation(orientation, momentum, principal_inertia[0], time)
    if axis >= 0:
        return _symmetric_top(orientation, momentum, principal_inertia, axis, time)
    return _asymmetric_top(orientation, momentum, principal_inertia, time)


# ---- paths ---------------------------------------------------------------------------------------------------------
# A path says where a body is and how it moves at one moment, and so at any other as long as nothing strikes it:
# (position, orientation, velocity, angular momentum, acceleration, swing).


@kernel
def free_acceleration(system, b):
    """The acceleration of a body that nothing strikes: gravity, or none of what rests and of obstacles [m/s^2]."""
    if b.kind != DYNAMIC or b.resting != 0:
        return 0.0, 0.0, 0.0
    return to_vec3(system.domain[0].gravity)


@kernel
def path_of_body(system, i):
    """The path that body ``i`` is on as its record has it."""
    b = system.body[i]
    swing = NO_SWING
    if b.kind == KINEMATIC:
        swing = swing_of(system.motion[b.motion])
    return (
        to_vec3(b.position),
        to_quat(b.orientation),
        to_vec3(b.velocity),
        to_vec3(b.angular_momentum),
        free_acceleration(system, b),
        swing,
    )


@kernel
def place_on_path(path, principal_inertia, time):
    """Position, orientation and velocity on a path after ``time`` [s] of either sign."""
    position, orientation, velocity, momentum, acceleration, swing = path
    position = axpy(axpy(position, velocity, time), acceleration, 0.5 * time * time)
    velocity = axpy(velocity, acceleration, time)
    if swing[1] != 0.0:
        shift, change = swing_shift(swing, time)
        position, velocity = add(position, shift), add(velocity, change)
    return position, free_rotation(orientation, momentum, principal_inertia, time), velocity


@kernel
def advance_path(path, principal_inertia, time):
    """The path as seen ``time`` seconds later."""
    if time == 0.0:
        return path
    position, orientation, velocity = place_on_path(path, principal_inertia, time)
    amplitude, frequency, angle, across = path[5]
    return position, orientation, velocity, path[3], path[4], (amplitude, frequency, angle + frequency * time, across)


@kernel
def set_pose(b, position, orientation, velocity):
    """Put a body somewhere, at a velocity."""
    set_vec3(b.position, position)
    set_quat(b.orientation, orientation)
    set_vec3(b.velocity, velocity)
