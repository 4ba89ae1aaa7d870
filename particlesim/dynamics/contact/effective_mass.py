"""How two bodies give way to impulses where they touch; the second may be held, and gives way to none."""

from __future__ import annotations

import numpy as np

from particlesim.core.jit import kernel
from particlesim.core.math3d import add, cross, dot
from particlesim.dynamics.contact.law import tangent_of
from particlesim.model.bodies import angular_velocity_change, per_mass


@kernel
def response(a, b, held, arm_a, arm_b, impulse):
    """The change of the velocity of b against a at a point by an impulse on b, which may be held, and on a."""
    of_a = add(
        (per_mass(a, impulse[0]), per_mass(a, impulse[1]), per_mass(a, impulse[2])),
        cross(angular_velocity_change(a, cross(arm_a, impulse)), arm_a),
    )
    if held:
        return of_a
    of_b = add(
        (per_mass(b, impulse[0]), per_mass(b, impulse[1]), per_mass(b, impulse[2])),
        cross(angular_velocity_change(b, cross(arm_b, impulse)), arm_b),
    )
    return add(of_a, of_b)


@kernel
def tangential_mass(a, b, held, arm_a, arm_b, normal):
    """The smallest effective mass across the normal: 1 / the larger eigenvalue of the inverse mass there."""
    first = tangent_of(normal)
    second = cross(normal, first)
    of_first, of_second = response(a, b, held, arm_a, arm_b, first), response(a, b, held, arm_a, arm_b, second)
    p, q, r = dot(of_first, first), dot(of_second, second), dot(of_first, second)
    return 1.0 / (0.5 * (p + q) + np.sqrt(0.25 * (p - q) * (p - q) + r * r))


@kernel
def rolling_mass(a, b, held):
    """The smallest effective moment of inertia of two bodies, of which b may be held, against each other [kg m^2]."""
    of_a, of_b = a.inverse_inertia, b.inverse_inertia
    return 1.0 / (max(of_a[0], of_a[1], of_a[2]) + (0.0 if held else max(of_b[0], of_b[1], of_b[2])))
