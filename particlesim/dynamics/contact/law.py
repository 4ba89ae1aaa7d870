"""The contact law of a pair of bodies: what their materials do, for impacts and resting contacts alike.

Friction belongs here: its coefficients are further fields of CONTACT_LAW, and the tangents of a contact are those of
``tangent_of``.
"""

import math

from particlesim.core.jit import kernel
from particlesim.core.math3d import axpy, cross, dot, norm, scale, to_vec3
from particlesim.dynamics.settings import RESTITUTION_THRESHOLD_HEIGHT


@kernel
def restitution_of(system, a, b):
    """The restitution of an impact of two bodies."""
    return system.law[a.material, b.material].restitution


@kernel
def has_friction(system, a, b):
    """Whether two bodies rub against each other where they touch."""
    return system.law[a.material, b.material].friction > 0.0


@kernel
def surface_velocity(system, b, normal):
    """The velocity of a kinematic body's surface against the body, across a normal: that of a conveyor [m/s]."""
    running = to_vec3(system.motion[b.motion].surface_velocity)
    return axpy(running, normal, -dot(running, normal))


@kernel
def rest_speed(acceleration, inradius):
    """Normal speed below which impacts under an acceleration end in rest (see RESTITUTION_THRESHOLD_HEIGHT) [m/s]."""
    return math.sqrt(2.0 * acceleration * RESTITUTION_THRESHOLD_HEIGHT * inradius)


@kernel
def rest_threshold(system, a, b):
    """Normal speed below which an impact of two bodies under gravity ends in rest [m/s]."""
    return rest_speed(norm(to_vec3(system.domain[0].gravity)), min(a.inradius, b.inradius))


@kernel
def tangent_of(normal):
    """A unit tangent of a contact; the second one is ``normal x tangent``, and no direction is preferred by it."""
    x, y, z = abs(normal[0]), abs(normal[1]), abs(normal[2])
    axis = (1.0, 0.0, 0.0) if x <= y and x <= z else ((0.0, 1.0, 0.0) if y <= z else (0.0, 0.0, 1.0))
    across = cross(normal, axis)
    return scale(across, 1.0 / norm(across))
