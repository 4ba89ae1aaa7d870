"""What one contact with friction does in an impact: the impulses at its points, and what they take."""

from __future__ import annotations

import numpy as np

from particlesim.core.jit import kernel
from particlesim.core.math3d import add, axpy, cross, dot, load_vec3, norm, scale, set_vec3, sub, to_vec3
from particlesim.dynamics.contact.contact import (
    basis_of,
    combined,
    components,
    contact_velocity,
    inverse_mass_at,
    velocity_change,
)
from particlesim.dynamics.contact.patch_impact import patch_impulses
from particlesim.dynamics.contact.point_impact import point_impulse, sphere_impulse, work_of
from particlesim.geometry.support import is_sphere, rounding_of
from particlesim.model.bodies import DYNAMIC, angular_velocity, angular_velocity_change, per_mass, placed


@kernel
def _is_decoupled(system, b):
    """Whether impulses along and across the normal do not see each other in a body: a sphere, or what stays."""
    return b.kind != DYNAMIC or is_sphere(system.shapes, b.shape_row)


@kernel
def _inverse_mass(a, b, arm, offset, basis):
    """How the velocity of b against a at a point changes by an impulse on b there, nine numbers by rows [1/kg]."""
    of_b = sub(arm, offset)
    rows = (
        components(basis, add(velocity_change(a, arm, basis[0], arm), velocity_change(b, of_b, basis[0], of_b))),
        components(basis, add(velocity_change(a, arm, basis[1], arm), velocity_change(b, of_b, basis[1], of_b))),
        components(basis, add(velocity_change(a, arm, basis[2], arm), velocity_change(b, of_b, basis[2], of_b))),
    )
    # It is symmetric but for rounding.
    n1, n2, a12 = rows[0][1], rows[0][2], rows[1][2]
    return rows[0][0], n1, n2, n1, rows[1][1], a12, n2, a12, rows[2][2]


@kernel
def _at_point(system, a, b, contact, arm, restitution, law):
    """The impulse on b, by components, of an impact in one point, and what restitution and friction took [J]."""
    basis, offset = basis_of(contact), to_vec3(contact.offset)
    velocity = contact_velocity(a, b, arm, offset, basis)
    if _is_decoupled(system, a) and _is_decoupled(system, b):
        normal, tangent, of_b = basis[0], basis[1], sub(arm, offset)
        along = inverse_mass_at(a, arm, normal) + inverse_mass_at(b, of_b, normal)
        across = inverse_mass_at(a, arm, tangent) + inverse_mass_at(b, of_b, tangent)
        impulse, rubbed = sphere_impulse((along, across), velocity, restitution, law)
        return impulse, -0.5 * (1.0 - restitution) * impulse[0] * velocity[0], rubbed
    inverse_mass = _inverse_mass(a, b, arm, offset, basis)
    impulse, rubbed = point_impulse(inverse_mass, velocity, restitution, law)
    return impulse, -work_of(inverse_mass, velocity, impulse) - rubbed, rubbed


@kernel
def _rolling_couple(a, b, contact, turned, law):
    """The couple on b against the rolling of two bodies that are to be ``turned``, and what it takes [J].

    It is at most the rolling friction times the normal impulse, and turns nothing back.
    """
    normal = to_vec3(contact.normal)
    of_a = add(angular_velocity(a), angular_velocity_change(a, turned[0]))
    of_b = add(angular_velocity(b), angular_velocity_change(b, turned[1]))
    turning = sub(of_b, of_a)
    rolling = axpy(turning, normal, -dot(turning, normal))
    speed = norm(rolling)
    if speed == 0.0:
        return (0.0, 0.0, 0.0), 0.0
    axis = scale(rolling, 1.0 / speed)
    response = dot(axis, add(angular_velocity_change(a, axis), angular_velocity_change(b, axis)))
    couple = min(law.rolling_friction * contact.impulse, speed / response)
    return scale(axis, -couple), couple * (speed - 0.5 * response * couple)


@kernel
def _is_rounded(system, b):
    return rounding_of(system.shapes, placed(b)) > 0.0


@kernel
def _in_point(system, a, b, contact, point, restitution, law):
    """The impulse of a contact in one point; as ``_over_patch``."""
    basis, offset = basis_of(contact), to_vec3(contact.offset)
    total, by_restitution, by_friction = _at_point(system, a, b, contact, point, restitution, law)
    impulse = combined(basis, total)
    return (
        (total, scale(cross(point, impulse), -1.0), cross(sub(point, offset), impulse)),
        (by_restitution, by_friction),
        True,
    )


@kernel
def _over_patch(a, b, contact, points, restitution, law):
    """The impulse of a contact at all its points.

    Returns the impulse on b by components with the angular impulses on a and on b; what restitution and what friction
    took [J]; and whether there is an answer.
    """
    basis, offset = basis_of(contact), to_vec3(contact.offset)
    each = np.empty(3 * contact.count)
    by_restitution, by_friction, answered = patch_impulses(a, b, contact, points, restitution, law, each)
    total = turned_a = turned_b = (0.0, 0.0, 0.0)
    for k in range(contact.count):
        arm, pushed = load_vec3(points, k), (each[3 * k], each[3 * k + 1], each[3 * k + 2])
        total, impulse = add(total, pushed), combined(basis, pushed)
        turned_a = sub(turned_a, cross(arm, impulse))
        turned_b = add(turned_b, cross(sub(arm, offset), impulse))
    return (total, turned_a, turned_b), (by_restitution, by_friction), answered


@kernel
def _twice_kinetic(a, b, impulse, turned_a, turned_b):
    """Twice the kinetic energy that bodies at rest have after an impulse and angular impulses [J]."""
    straight = dot(impulse, impulse)
    energy = per_mass(a, straight) + per_mass(b, straight)
    energy += dot(turned_a, angular_velocity_change(a, turned_a))
    return energy + dot(turned_b, angular_velocity_change(b, turned_b))


@kernel
def rough_impulse(system, a, b, contact, points, point, restitution):
    """Fill in the impulse of a contact with friction, and what it takes.

    It acts at all of the contact's ``points`` at once. If there is but one, or no such answer, it acts in the ``point``
    where they approach.

    Returns the impulse on b [N s], the angular impulses on a and on b [N m s], and twice the kinetic energy that all
    these give to bodies at rest [J].
    """
    law = system.law[a.material, b.material]
    answered = False
    if contact.count > 1:
        (total, turned_a, turned_b), lost, answered = _over_patch(a, b, contact, points, restitution, law)
    if not answered:
        (total, turned_a, turned_b), lost, answered = _in_point(system, a, b, contact, point, restitution, law)
    basis = basis_of(contact)
    contact.impulse = total[0]
    set_vec3(contact.shear, combined(basis, (0.0, total[1], total[2])))
    by_rolling = 0.0
    if law.rolling_friction > 0.0 and (_is_rounded(system, a) or _is_rounded(system, b)):
        couple, by_rolling = _rolling_couple(a, b, contact, (turned_a, turned_b), law)
        turned_a, turned_b = sub(turned_a, couple), add(turned_b, couple)
    set_vec3(contact.lost, (lost[0], lost[1], by_rolling))
    impulse = combined(basis, total)
    return impulse, turned_a, turned_b, _twice_kinetic(a, b, impulse, turned_a, turned_b)
