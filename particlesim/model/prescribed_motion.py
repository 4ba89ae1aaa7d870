"""Prescribed motion: where a kinematic body is at any time, whatever strikes it.

It is made of pieces, each from its start until the next one's. In each the body drifts steadily, turns steadily about
its position, and swings along a line or round an ellipse:
x = origin + v t + A sin(w t + phase) + B cos(w t + phase), where t is the time since the start of the piece.
"""

from __future__ import annotations

import math

import numpy as np

from particlesim.core.jit import entry_kernel, kernel, without_refcounts
from particlesim.core.math3d import axpy, dot, quat_from_rotvec, quat_multiply, quat_normalize, scale, to_quat, to_vec3
from particlesim.core.records import record

# A piece of a motion; those of one body follow each other.
MOTION = record(
    [
        ("start", "f8"),  # the time that it is counted from [s]
        ("until", "f8"),  # when the next piece begins; infinite of the last one [s]
        ("origin", "f8", (3,)),  # position at the start but for the swing [m]
        ("orientation", "f8", (4,)),  # at the start
        ("velocity", "f8", (3,)),  # [m/s]
        ("angular_velocity", "f8", (3,)),  # world axes [rad/s]
        ("amplitude", "f8", (3,)),  # A [m]
        ("across", "f8", (3,)),  # B, a quarter of a period ahead [m]
        ("angular_frequency", "f8"),  # [rad/s]
        ("phase", "f8"),  # at the start [rad]
        ("angle", "f8"),  # phase at the start of the present substep [rad]
        ("surface_velocity", "f8", (3,)),  # of a conveyor's surface against its body, world axes [m/s]
    ]
)

# The swing of what does not swing: A [m], angular frequency [rad/s], phase [rad], B [m].
NO_SWING = ((0.0, 0.0, 0.0), 0.0, 0.0, (0.0, 0.0, 0.0))


@kernel
def swing_of(m):
    """The swing of a piece of a motion, as it is in the present substep."""
    return to_vec3(m.amplitude), m.angular_frequency, m.angle, to_vec3(m.across)


@kernel
def swing_shift(swing, time):
    """What a swing adds to a straight path within ``time`` [s]: shift [m] and change of velocity [m/s]."""
    amplitude, frequency, angle, across = swing
    if frequency == 0.0:
        return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    then = angle + frequency * time
    sine, cosine = math.sin(then) - math.sin(angle), math.cos(then) - math.cos(angle)
    straight = frequency * time
    shift = axpy(scale(amplitude, sine - straight * math.cos(angle)), across, cosine + straight * math.sin(angle))
    return shift, axpy(scale(amplitude, frequency * cosine), across, -frequency * sine)


@kernel
def swing_acceleration(swing):
    """The largest acceleration of a swing [m/s^2]."""
    amplitude, frequency, _, across = swing
    # Half the longer axis of the ellipse.
    a, b, both = dot(amplitude, amplitude), dot(across, across), dot(amplitude, across)
    longest = 0.5 * (a + b) + math.sqrt(0.25 * (a - b) * (a - b) + both * both)
    return math.sqrt(longest) * frequency * frequency


@entry_kernel
def place_kinematic(body, motion, time):
    """Put the bodies that have a prescribed motion where they are at ``time`` [s], moving as they do then.

    Where one piece of a motion ends and the next begins, they move as in the next.
    """
    body, motion = without_refcounts((body, motion))
    for k in range(len(body)):
        b = body[k]
        if b.motion < 0:
            continue
        while time >= motion[b.motion].until:
            b.motion += 1
        m = motion[b.motion]
        t = time - m.start
        m.angle = (m.phase + m.angular_frequency * t) % (2.0 * math.pi)
        turned = quat_multiply(quat_from_rotvec(scale(to_vec3(m.angular_velocity), t)), to_quat(m.orientation))
        turned = quat_normalize(turned)
        amplitude, frequency, angle, across = swing_of(m)
        position = axpy(to_vec3(m.origin), to_vec3(m.velocity), t)
        position = axpy(axpy(position, amplitude, math.sin(angle)), across, math.cos(angle))
        velocity = axpy(to_vec3(m.velocity), amplitude, frequency * math.cos(angle))
        velocity = axpy(velocity, across, -frequency * math.sin(angle))
        for axis in range(3):
            b.position[axis], b.velocity[axis] = position[axis], velocity[axis]
            # Of inertia 1: its angular momentum is its angular velocity, and it turns steadily for ever.
            b.angular_momentum[axis] = m.angular_velocity[axis]
        for axis in range(4):
            b.orientation[axis] = turned[axis]


def changes_within(motion: np.ndarray, begin: float, end: float) -> list[float]:
    """The times between ``begin`` and ``end`` [s] at which a piece of a motion (k,) MOTION gives way to the next."""
    until = motion["until"]
    return np.unique(until[(until > begin) & (until < end)]).tolist()
