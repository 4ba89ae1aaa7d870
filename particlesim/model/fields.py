"""Fields of force: what they do to the velocities of particles in a short time in which these do not move."""

from __future__ import annotations

import math

from particlesim.core.jit import entry_kernel, kernel, without_refcounts
from particlesim.core.math3d import add, axpy, cross, dot, scale, set_vec3, sub, to_vec3
from particlesim.core.records import record

UNIFORM, CENTRAL, VORTEX, DRAG = 0, 1, 2, 3
EVERYWHERE, IN_BOX, IN_ELLIPSOID = 0, 1, 2

FIELD = record(
    [
        ("kind", "i8"),  # UNIFORM, CENTRAL, VORTEX or DRAG
        ("where", "i8"),  # EVERYWHERE, IN_BOX or IN_ELLIPSOID
        ("lower", "f8", (3,)),  # of its region [m]
        ("upper", "f8", (3,)),
        ("vector", "f8", (3,)),  # acceleration [m/s^2], unit vector along the axis, or velocity of the medium [m/s]
        ("centre", "f8", (3,)),  # [m]
        ("strength", "f8"),  # acceleration at 1 m [m/s^2], of a vortex per metre [1/s^2], of drag [kg/s]
        ("exponent", "f8"),
        ("softening", "f8"),  # [m]
    ]
)


@kernel
def _acts_at(field, position):
    """Whether a position is in a field's region."""
    if field.where == EVERYWHERE:
        return True
    lower, upper = to_vec3(field.lower), to_vec3(field.upper)
    square, inside = 0.0, True
    for axis in range(3):
        half = 0.5 * (upper[axis] - lower[axis])
        place = (position[axis] - lower[axis]) / half - 1.0
        square += place * place
        inside = inside and abs(place) <= 1.0
    return square <= 1.0 if field.where == IN_ELLIPSOID else inside


@kernel
def _acceleration(field, position):
    """The acceleration of a field that is none of drag [m/s^2]."""
    if field.kind == UNIFORM:
        return to_vec3(field.vector)
    arm = sub(position, to_vec3(field.centre))
    if field.kind == VORTEX:
        return scale(cross(to_vec3(field.vector), arm), field.strength)
    square = dot(arm, arm) + field.softening * field.softening
    if square == 0.0:  # in the centre itself there is no direction
        return 0.0, 0.0, 0.0
    return scale(arm, -field.strength * square ** (0.5 * (field.exponent - 1.0)))


@kernel
def _velocity_after(field, b, time):
    """The velocity of a particle where a field has acted on it, in place, for a time [s]: exact for each field."""
    velocity = to_vec3(b.velocity)
    if field.kind == DRAG:
        medium = to_vec3(field.vector)
        left = math.exp(-field.strength * b.inverse_mass * time)
        return add(medium, scale(sub(velocity, medium), left))
    return axpy(velocity, _acceleration(field, to_vec3(b.position)), time)


@entry_kernel
def kick(system, fields, how, block_size, work, first, last):
    """Let fields (f,) FIELD act on particles in place; ``how``: for which time [s], and whether the last one first.

    ``work`` (blocks,) [J] gets what that does to blocks ``first .. last`` of ``block_size`` particles.
    """
    system, fields, work = without_refcounts((system, fields, work))
    time, backwards = how
    for block in range(first, last):
        total = 0.0
        for i in range(block * block_size, min((block + 1) * block_size, system.particles)):
            b = system.body[i]
            before, position = to_vec3(b.velocity), to_vec3(b.position)
            for k in range(len(fields)):
                field = fields[len(fields) - 1 - k if backwards else k]
                if _acts_at(field, position):
                    set_vec3(b.velocity, _velocity_after(field, b, time))
            after = to_vec3(b.velocity)
            total += 0.5 * b.mass * (dot(after, after) - dot(before, before))
        work[block] = total
