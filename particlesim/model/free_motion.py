"""Free motion between impacts: the parabola, and the free rotation of any rigid body.

The state holds the angular momentum, which stays the same to the last bit until an impact; the angular velocity
follows from it and the orientation.
"""

import math

import numpy as np

from particlesim.core.jit import kernel
from particlesim.core.math3d import (
    axpy,
    cross,
    dot,
    inverse_rotate,
    load_quat,
    load_vec3,
    norm,
    quat_from_rotvec,
    quat_multiply,
    quat_normalize,
    rotate,
    scale,
    store_vec3,
)

# Moments of inertia closer than this fraction of each other are equal: the body is a symmetric top.
_EQUAL_MOMENTS = 1e-12

# An asymmetric body turns by at most this angle [rad] in one stage of the quadrature, whose error falls as its
# seventh power: about 1e-13 rad.
_MAX_TURN = 0.05

# Gauss-Legendre quadrature with three stages, order 6 (E. Hairer, C. Lubich, G. Wanner, Geometric Numerical
# Integration, 2nd ed., II.1.3, table 1.2). Such methods keep quadratic invariants (IV.2, theorem 2.1): here the
# energy and the length of the angular momentum.
_S = math.sqrt(15.0)
_GAUSS = (
    (5.0 / 36.0, 2.0 / 9.0 - _S / 15.0, 5.0 / 36.0 - _S / 30.0),
    (5.0 / 36.0 + _S / 24.0, 2.0 / 9.0, 5.0 / 36.0 - _S / 24.0),
    (5.0 / 36.0 + _S / 30.0, 2.0 / 9.0 + _S / 15.0, 5.0 / 36.0),
)
_WEIGHTS = (5.0 / 18.0, 4.0 / 9.0, 5.0 / 18.0)


@kernel
def _equal(a, b):
    return abs(a - b) <= _EQUAL_MOMENTS * (a + b)


@kernel
def _unique_axis(moments):
    """Axis of a symmetric top, 3 for a body without preferred axis, -1 for an asymmetric one."""
    if _equal(moments[0], moments[1]):
        return 3 if _equal(moments[1], moments[2]) else 2
    if _equal(moments[1], moments[2]):
        return 0
    return 1 if _equal(moments[0], moments[2]) else -1


@kernel
def spin_of(turn, momentum, moments):
    """Angular velocity of a body with the given angular momentum about its centroid, both in world axes."""
    body = inverse_rotate(turn, momentum)
    return rotate(turn, (body[0] / moments[0], body[1] / moments[1], body[2] / moments[2]))


@kernel
def spin_rate(turn, momentum, moments):
    """How fast a body turns [rad/s]; one without preferred axis turns about its angular momentum."""
    if _unique_axis(moments) == 3:
        return norm(momentum) / moments[0]
    return norm(spin_of(turn, momentum, moments))


@kernel
def particle_spin(constants, state, i):
    """Angular velocity of particle ``i``, world axes [rad/s]."""
    return spin_of(
        load_quat(state.orientation, i), load_vec3(state.angular_momentum, i), load_vec3(constants.inertia, i)
    )


@kernel
def spins(constants, state):
    """Angular velocities of all particles, (n, 3), world axes [rad/s]."""
    out = np.empty_like(state.angular_momentum)
    for i in range(len(out)):
        store_vec3(out, i, particle_spin(constants, state, i))
    return out


@kernel
def _symmetric_top(turn, momentum, moments, axis, time):
    """Orientation of a symmetric top after ``time``.

    It turns about its angular momentum L at L / I and about its own axis at (1 / I_axis - 1 / I) L_axis, both
    steady (L. D. Landau, E. M. Lifshitz, Mechanics, 3rd ed., section 33).
    """
    across = moments[0] if axis != 0 else moments[1]
    body = inverse_rotate(turn, momentum)
    spin = (1.0 / moments[axis] - 1.0 / across) * body[axis] * time
    about_axis = (
        spin if axis == 0 else 0.0,
        spin if axis == 1 else 0.0,
        spin if axis == 2 else 0.0,
    )
    turn = quat_multiply(turn, quat_from_rotvec(about_axis))
    return quat_normalize(quat_multiply(quat_from_rotvec(scale(momentum, time / across)), turn))


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
def _asymmetric_turn(turn, body_momentum, moments, time):
    """Orientation and angular momentum in body axes after a short ``time``, by one step of Gauss-Legendre."""
    inverse = (1.0 / moments[0], 1.0 / moments[1], 1.0 / moments[2])
    q0, m0 = _rates(turn, body_momentum, inverse)
    rates_q, rates_m = (q0, q0, q0), (m0, m0, m0)
    # The stages are implicit: iterated until they repeat. Each round gains a factor of the angle turned.
    limit = 1e-16 * norm(body_momentum) * norm(m0)
    for _ in range(40):
        qa, ma = _stage(turn, body_momentum, rates_q, rates_m, _GAUSS[0], time)
        qb, mb = _stage(turn, body_momentum, rates_q, rates_m, _GAUSS[1], time)
        qc, mc = _stage(turn, body_momentum, rates_q, rates_m, _GAUSS[2], time)
        qa, ma = _rates(qa, ma, inverse)
        qb, mb = _rates(qb, mb, inverse)
        qc, mc = _rates(qc, mc, inverse)
        change = norm(axpy(ma, rates_m[0], -1.0)) + norm(axpy(mc, rates_m[2], -1.0))
        change_q = abs(qc[0] - rates_q[2][0]) + abs(qc[1] - rates_q[2][1]) + abs(qc[2] - rates_q[2][2])
        rates_q, rates_m = (qa, qb, qc), (ma, mb, mc)
        if change * norm(body_momentum) <= limit and change_q * time <= 1e-16:
            break
    turn, body_momentum = _stage(turn, body_momentum, rates_q, rates_m, _WEIGHTS, time)
    return quat_normalize(turn), body_momentum


@kernel
def _asymmetric_top(turn, momentum, moments, time):
    """Orientation of a body with three different moments after ``time``."""
    body = inverse_rotate(turn, momentum)
    fastest = norm(momentum) / min(moments[0], moments[1], moments[2])
    parts = max(1, math.ceil(fastest * abs(time) / _MAX_TURN))
    for _ in range(parts):
        turn, body = _asymmetric_turn(turn, body, moments, time / parts)
    # The quadrature keeps the energy and the length of the momentum; this nudge keeps its direction in space.
    drifted = rotate(turn, body)
    nudge = quat_from_rotvec(scale(cross(drifted, momentum), 1.0 / dot(momentum, momentum)))
    return quat_normalize(quat_multiply(nudge, turn))


@kernel
def free_rotation(turn, momentum, moments, time):
    """Orientation of a free body with the given angular momentum (world axes) after ``time`` [s], of either sign.

    Closed forms for spheres, cubes and every symmetric top; Gauss-Legendre of order 6 for the rest.
    """
    if dot(momentum, momentum) == 0.0:
        return turn
    axis = _unique_axis(moments)
    if axis == 3:
        step = quat_from_rotvec(scale(momentum, time / moments[0]))
        return quat_normalize(quat_multiply(step, turn))
    if axis >= 0:
        return _symmetric_top(turn, momentum, moments, axis, time)
    return _asymmetric_top(turn, momentum, moments, time)


@kernel
def free_path(position, turn, velocity, momentum, moments, gravity, time):
    """Position, orientation and velocity of a particle after ``time`` [s] of either sign."""
    position = axpy(axpy(position, velocity, time), gravity, 0.5 * time * time)
    return position, free_rotation(turn, momentum, moments, time), axpy(velocity, gravity, time)
