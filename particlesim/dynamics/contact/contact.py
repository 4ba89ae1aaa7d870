"""The contact of two bodies: where they touch, how fast the points move there, and how an impulse changes that."""

from __future__ import annotations

from particlesim.core.jit import kernel
from particlesim.core.math3d import add, axpy, cross, dot, norm, set_vec3, sub, to_vec3
from particlesim.core.records import record
from particlesim.dynamics.contact.law import tangent_of
from particlesim.geometry.narrow_phase.pair import pair_contact
from particlesim.model.bodies import angular_velocity, angular_velocity_change, per_mass, placed
from particlesim.model.domain import nearest_image

CONTACT = record(
    [
        ("normal", "f8", (3,)),  # from a to b
        ("tangent", "f8", (3,)),  # with normal x tangent the basis in which friction acts
        ("offset", "f8", (3,)),  # b's position from a's [m]
        ("count", "i8"),  # of the points
        ("impulse", "f8"),  # of the present round, along the normal on b [N s]
        ("shear", "f8", (3,)),  # and across it
        ("lost", "f8", (3,)),  # what of the energy it takes by restitution, friction and rolling friction [J]
        ("work", "f8"),  # and what it gives, as b moves whatever pushes it [J]
        ("resolved", "i8"),  # whether it has had any impulse
        ("a", "i8"),  # actors
        ("b", "i8"),
    ]
)


@kernel
def write_contact(contact, normal, offset, count):
    """Write what is known of a contact that has so many points."""
    set_vec3(contact.normal, normal)
    set_vec3(contact.tangent, tangent_of(normal))
    set_vec3(contact.offset, offset)
    contact.count = count


@kernel
def find_contact(system, a, b, contact, points):
    """Fill in the contact of two convex bodies where they are now, and its points; returns their separation."""
    offset = nearest_image(sub(to_vec3(b.position), to_vec3(a.position)), system.domain[0].period)
    separation, normal, count = pair_contact(system.shapes, placed(a), placed(b), offset, points)
    write_contact(contact, normal, offset, count)
    return separation


@kernel
def _point_velocity(b, lever_arm):
    """Velocity of the point of a body at ``lever_arm`` from its position."""
    return add(to_vec3(b.velocity), cross(angular_velocity(b), lever_arm))


@kernel
def normal_velocity_at(a, b, lever_arm, offset, normal):
    """Normal velocity of two bodies at a point (negative: they approach), and the sum of the speeds there [m/s]."""
    of_a, of_b = _point_velocity(a, lever_arm), _point_velocity(b, sub(lever_arm, offset))
    return -dot(of_a, normal) + dot(of_b, normal), norm(of_a) + norm(of_b)


@kernel
def inverse_mass_at(b, lever_arm, normal):
    """How much speed along ``normal`` a unit impulse along it gives the point at ``lever_arm`` [1/kg].

    1/m + n . ((I^-1 (r x n)) x r) (D. Baraff, SIGGRAPH 1997 course notes, Rigid Body Simulation II, eq. 8-18)
    """
    lever = cross(lever_arm, normal)
    return per_mass(b, dot(normal, normal)) + dot(lever, angular_velocity_change(b, lever))


@kernel
def work_of_obstacle(b, impulse, turned):
    """The work that an obstacle does by an impulse [N s] and an angular impulse [N m s] on it, as it goes on [J]."""
    return -dot(to_vec3(b.velocity), impulse) - dot(angular_velocity(b), turned)


@kernel
def basis_of(contact):
    """The directions of a contact: its normal and two tangents."""
    normal, tangent = to_vec3(contact.normal), to_vec3(contact.tangent)
    return normal, tangent, cross(normal, tangent)


@kernel
def components(basis, v):
    """A vector by its components along a basis."""
    return dot(basis[0], v), dot(basis[1], v), dot(basis[2], v)


@kernel
def combined(basis, v):
    """The vector that has the components ``v`` along a basis."""
    x, y, z = basis[0], basis[1], basis[2]
    return axpy(axpy((v[0] * x[0], v[0] * x[1], v[0] * x[2]), y, v[1]), z, v[2])


@kernel
def contact_velocity(a, b, lever_arm, offset, basis):
    """Velocity of b against a at a point, by components [m/s]."""
    apart = sub(_point_velocity(b, sub(lever_arm, offset)), _point_velocity(a, lever_arm))
    return components(basis, apart)


@kernel
def velocity_change(b, lever_arm, direction, at):
    """How a unit impulse along ``direction`` at ``lever_arm`` changes the velocity of a body at another point."""
    turning = angular_velocity_change(b, cross(lever_arm, direction))
    straight = per_mass(b, 1.0)
    return axpy(cross(turning, at), direction, straight)
