"""Prescribed motion: where a kinematic body is at any time, whatever strikes it.

It drifts steadily, turns steadily about its position, and swings to and fro along a line:
x(t) = origin + v t + A sin(w t + phase).
"""

from __future__ import annotations

import math

from particlesim.core.jit import entry_kernel, kernel, without_refcounts
from particlesim.core.math3d import axpy, dot, quat_from_rotvec, quat_multiply, quat_normalize, scale, to_quat, to_vec3
from particlesim.core.records import record

MOTION = record(
    [
        ("origin", "f8", (3,)),  # position at time 0 but for the swing [m]
        ("orientation", "f8", (4,)),  # at time 0
        ("velocity", "f8", (3,)),  # [m/s]
        ("angular_velocity", "f8", (3,)),  # world axes [rad/s]
        ("amplitude", "f8", (3,)),  # [m]
        ("angular_frequency", "f8"),  # [rad/s]
        ("phase", "f8"),  # at time 0 [rad]
        ("angle", "f8"),  # phase at the start of the present substep [rad]
    ]
)

# The swing of what does not swing: amplitude [m], angular frequency [rad/s], phase [rad].
NO_SWING = ((0.0, 0.0, 0.0), 0.0, 0.0)


@kernel
def swing_shift(swing, time):
    """What a swing adds to a straight path within ``time`` [s]: shift [m] and change of velocity [m/s]."""
    amplitude, frequency, angle = swing
    if frequency == 0.0:
        return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    then = angle + frequency * time
    shift = math.sin(then) - math.sin(angle) - frequency * time * math.cos(angle)
    return scale(amplitude, shift), scale(amplitude, frequency * (math.cos(then) - math.cos(angle)))


@kernel
def swing_acceleration(swing):
    """The largest acceleration of a swing [m/s^2]."""
    amplitude, frequency, _ = swing
    return math.sqrt(dot(amplitude, amplitude)) * frequency * frequency


@entry_kernel
def place_kinematic(body, motion, time):
    """Put the bodies that have a prescribed motion where they are at ``time`` [s], moving as they do then."""
    body, motion = without_refcounts((body, motion))
    for k in range(len(body)):
        b = body[k]
        if b.motion < 0:
            continue
        m = motion[b.motion]
        m.angle = (m.phase + m.angular_frequency * time) % (2.0 * math.pi)
        turned = quat_multiply(quat_from_rotvec(scale(to_vec3(m.angular_velocity), time)), to_quat(m.orientation))
        turned = quat_normalize(turned)
        amplitude = to_vec3(m.amplitude)
        position = axpy(to_vec3(m.origin), to_vec3(m.velocity), time)
        position = axpy(position, amplitude, math.sin(m.angle))
        velocity = axpy(to_vec3(m.velocity), amplitude, m.angular_frequency * math.cos(m.angle))
        for axis in range(3):
            b.position[axis], b.velocity[axis] = position[axis], velocity[axis]
            # Of inertia 1: its angular momentum is its angular velocity, and it turns steadily for ever.
            b.angular_momentum[axis] = m.angular_velocity[axis]
        for axis in range(4):
            b.orientation[axis] = turned[axis]
