"""What is kept of a point where two bodies are in lasting contact."""

from __future__ import annotations

from particlesim.core.jit import kernel
from particlesim.core.math3d import axpy, dot
from particlesim.core.math3d import to_vec3 as vec
from particlesim.core.records import record

# All that a sweep over contact points reads and writes: three cache lines.
CONTACT_POINT = record(
    [
        ("a", "i4"),  # particle
        ("b", "i4"),  # body
        ("normal", "f8", (3,)),  # from a to b
        ("arm_a", "f8", (3,)),  # from the positions of the two bodies [m]
        ("arm_b", "f8", (3,)),
        ("response", "f8", (3,)),  # change of the velocity of b against a there by a unit impulse along the normal
        ("normal_mass", "f8"),  # effective, along the normal [kg]
        ("tangential_mass", "f8"),  # and the smallest across it [kg]
        ("friction", "f8"),
        ("static_friction", "f8"),
        ("wanted", "f8", (3,)),  # velocity of b against a, along the normal at least [m/s]
        ("push", "f8"),  # impulse along the normal [N s]
        ("drag", "f8", (3,)),  # and across it
    ]
)

# What else is known of a contact point.
CONTACT_TERMS = record(
    [
        ("gap", "f8"),  # at the start of the step [m]
        ("separation", "f8"),  # of the two bodies then [m]
        ("slack", "f8"),  # of the gap, that is not closed [m]
        ("inradius", "f8"),  # the smaller inscribed radius [m]
        ("restitution", "f8"),
        ("threshold", "f8"),  # normal speed below which they come to rest [m/s]
        ("approach", "f8"),  # normal velocity before the step; below 0 they approach [m/s]
        ("parting", "f8"),  # normal velocity by which it is to part, if there is room to, for all have turned [m/s]
        ("rolling_friction", "f8"),  # [m]
        ("rolling_mass", "f8"),  # the smallest effective moment of inertia [kg m^2]
        ("roll", "f8", (3,)),  # angular impulse against rolling [N m s]
        ("pushed", "f8"),  # impulse along the normal in the whole step [N s]
        ("impulse", "f8", (3,)),  # and all of it
        ("angular_impulse", "f8", (3,)),  # against rolling [N m s]
        ("force", "f8", (3,)),  # at the end of the step [N]
        ("torque", "f8", (3,)),  # against rolling [N m]
        ("rubbed", "f8"),  # energy that friction takes [J]
        ("rolled", "f8"),  # and rolling friction
        ("work", "f8"),  # that an obstacle does by moving [J]
        ("owner", "i2"),  # whose face the normal turns with: NOBODY, OF_A, OF_B or OF_EDGES
        ("round_a", "i2"),  # whether a body is a sphere
        ("round_b", "i2"),
        ("edge_a", "f8", (3,)),  # where two edges cross: their directions, and how the normal turns with each of them
        ("edge_b", "f8", (3,)),
        ("with_a", "f8", (3,)),
        ("with_b", "f8", (3,)),
    ]
)


NOBODY, OF_A, OF_B, OF_EDGES = 0, 1, 2, 3


@kernel
def along_normal(p, vector):
    """The part of a vector along the normal of a contact point, and what is left across it."""
    along = dot(vec(p.normal), vector)
    return along, axpy(vector, vec(p.normal), -along)
