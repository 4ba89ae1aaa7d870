"""Impacts: the impulses that resolve the contacts of one moment.

Every impulse acts equally and oppositely at one point, so momentum and angular momentum are kept whatever its size;
its size keeps the kinetic energy when the restitution is 1. Contacts of one moment that share particles are resolved
together: each gets the impulse that would stop its own approach, and all are scaled by one factor, so that the energy
is what the restitution says. What is symmetric stays symmetric, and where only one contact approaches (a row of balls)
it is resolved by itself, one after the other.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from particlesim.core.constants import MAX_MANIFOLD
from particlesim.core.jit import kernel
from particlesim.core.math3d import add, axpy, cross, dot, load_vec3, norm, scale, set_vec3, sub, to_vec3
from particlesim.dynamics.contact.booking import IMPACTS, book_contact
from particlesim.dynamics.contact.contact import (
    CONTACT,
    inverse_mass_at,
    normal_velocity_at,
    work_of_obstacle,
)
from particlesim.dynamics.contact.law import has_friction, rest_threshold, restitution_of, surface_velocity
from particlesim.dynamics.contact.part_contacts import find_contacts
from particlesim.dynamics.contact.rough_impact import rough_impulse
from particlesim.dynamics.settings import APPROACH_TOLERANCE, MAX_MANIFOLD_IMPULSES
from particlesim.model.bodies import BODY, DYNAMIC, KINEMATIC, angular_velocity, angular_velocity_change, per_mass

# What became of contacts: they did not approach; they approached fast; slowly, and rebounded in full until they come to
# rest; or slowly with both bodies resting, which is left to the next substep.
NOTHING, STRUCK, REBOUNDED, LEFT = 0, 1, 2, 3

# Contacts and bodies of one moment; more that are simultaneous are resolved one after the other.
MAX_CONTACTS = 64


class Moment(NamedTuple):
    """Room for what happens at one moment: bodies are copies of their records, advanced to it."""

    pair: np.ndarray  # (c, 2) int64, the bodies of each contact
    contact: np.ndarray  # (c,) CONTACT
    points: np.ndarray  # (c, MAX_MANIFOLD, 3) of each contact, from a's position [m]
    indices: np.ndarray  # (m,) int64, the bodies that take part
    actor: np.ndarray  # (m,) BODY, their records
    struck: np.ndarray  # (m,) int64, how many impacts each has had
    push: np.ndarray  # (m, 6) impulse [N s] and angular impulse [N m s] of the present round
    friction: np.ndarray | None  # the contact laws; None where no pair has any friction


@kernel
def new_moment(friction):
    """Room for MAX_CONTACTS contacts, with the contact laws if there is friction, or None."""
    bodies = 2 * MAX_CONTACTS
    return Moment(
        np.empty((MAX_CONTACTS, 2), dtype=np.int64),
        np.empty(MAX_CONTACTS, dtype=CONTACT),
        np.empty((MAX_CONTACTS, MAX_MANIFOLD, 3)),
        np.empty(bodies, dtype=np.int64),
        np.empty(bodies, dtype=BODY),
        np.empty(bodies, dtype=np.int64),
        np.empty((bodies, 6)),
        friction,
    )


# ---- contacts of one moment ----------------------------------------------------------------------------------------


@kernel
def is_resting(b):
    """Whether resting contacts carry a body through the present substep; what cannot be pushed always rests."""
    return b.kind != DYNAMIC or b.resting != 0


@kernel
def _middle(points, count):
    total = (0.0, 0.0, 0.0)
    for k in range(count):
        total = add(total, load_vec3(points, k))
    return scale(total, 1.0 / count)


@kernel
def _point_to_resolve(rest_speed, a, b, contact, points):
    """Where a contact is resolved next, and its normal velocity there; 0 if it approaches nowhere.

    First in the middle of its manifold, then where it approaches fastest: a face that lands flat is thus pushed in its
    middle and does not start to spin.
    """
    normal, offset = to_vec3(contact.normal), to_vec3(contact.offset)
    point = _middle(points, contact.count)
    speed, scale_of_speed = normal_velocity_at(a, b, point, offset, normal)
    if speed >= -(APPROACH_TOLERANCE * scale_of_speed + rest_speed):
        speed = 0.0
        for k in range(contact.count):
            corner = load_vec3(points, k)
            at_corner, scale_of_speed = normal_velocity_at(a, b, corner, offset, normal)
            if at_corner < speed and at_corner < -(APPROACH_TOLERANCE * scale_of_speed + rest_speed):
                speed, point = at_corner, corner
    return point, speed


@kernel
def _turns_slowly(b, speed):
    """Whether rotation moves no point of a body faster than ``speed`` [m/s]; what cannot be pushed does not count."""
    return b.kind != DYNAMIC or norm(angular_velocity(b)) * b.radius <= speed


@kernel
def _rebound(system, a, b, speed):
    """What comes of bodies that approach at a ``speed`` [m/s], and the factor on the impulse that would stop them."""
    restitution, threshold = restitution_of(system, a, b), rest_threshold(system, a, b)
    if restitution == 1.0 or speed > threshold:
        return STRUCK, 1.0 + restitution
    if is_resting(a) and is_resting(b) and _turns_slowly(a, threshold) and _turns_slowly(b, threshold):
        return LEFT, 0.0
    return REBOUNDED, 2.0


@kernel
def _add_push(push, impulse, angular_impulse):
    """Add an impulse and an angular impulse to what a body gets in the present round."""
    for axis in range(3):
        push[axis] += impulse[axis]
        push[3 + axis] += angular_impulse[axis]


@kernel
def _add_push_at(push, impulse, lever_arm, normal):
    """Add an impulse along ``normal`` at ``lever_arm`` to what a body gets in the present round."""
    _add_push(push, scale(normal, impulse), scale(cross(lever_arm, normal), impulse))


@kernel
def _common_factor(moment, size, gain):
    """The factor on all impulses that leaves the energy which the restitutions say.

    Along the impulses the kinetic energy is a parabola. Its lowest point is a fully inelastic impact, the mirror image
    of where it started an elastic one. ``gain`` is what the impulses, each with its own restitution, would take and
    give back if they did not act on the same bodies.
    """
    growth = 0.0
    for k in range(size):
        b, p = moment.actor[k], moment.push[k]
        impulse, angular = (p[0], p[1], p[2]), (p[3], p[4], p[5])
        growth += per_mass(b, dot(impulse, impulse)) + dot(angular, angular_velocity_change(b, angular))
    return gain / growth


@kernel
def _propose(system, moment, c, leave_slow, friction):
    """The impulse that contact ``c`` is to get in the present round; what becomes of it, and the energy it takes.

    Where there is no ``friction`` (None) nothing of it is compiled.
    """
    contact = moment.contact[c]
    a, b = moment.actor[contact.a], moment.actor[contact.b]
    normal, offset = to_vec3(contact.normal), to_vec3(contact.offset)
    contact.impulse = contact.work = 0.0
    if contact.count == 0:
        return NOTHING, 0.0
    point, speed = _point_to_resolve(system.domain[0].rest_speed, a, b, contact, moment.points[c])
    if speed >= 0.0:
        return NOTHING, 0.0
    what, factor = _rebound(system, a, b, -speed)
    if what == LEFT or (leave_slow and what != STRUCK):
        return NOTHING, 0.0
    if friction is not None and has_friction(system, a, b):
        own = to_vec3(b.velocity)
        if b.kind == KINEMATIC:
            # A conveyor rubs as if it went along with its surface.
            set_vec3(b.velocity, add(own, surface_velocity(system, b, normal)))
        impulse, turned_a, turned_b, energy = rough_impulse(
            system, a, b, contact, moment.points[c], point, factor - 1.0
        )
        if b.kind == KINEMATIC:
            contact.work = work_of_obstacle(b, impulse, turned_b)
            set_vec3(b.velocity, own)
        _add_push(moment.push[contact.a], scale(impulse, -1.0), turned_a)
        _add_push(moment.push[contact.b], impulse, turned_b)
        return what, energy
    stop = -speed / (inverse_mass_at(a, point, normal) + inverse_mass_at(b, sub(point, offset), normal))
    contact.impulse = factor * stop
    energy = factor * factor * stop * -speed
    contact.lost[0] = 0.5 * (2.0 / factor - 1.0) * energy
    if b.kind == KINEMATIC:
        contact.work = work_of_obstacle(
            b, scale(normal, contact.impulse), scale(cross(sub(point, offset), normal), contact.impulse)
        )
    _add_push_at(moment.push[contact.a], -contact.impulse, point, normal)
    _add_push_at(moment.push[contact.b], contact.impulse, sub(point, offset), normal)
    return what, energy


@kernel
def _apply(moment, size, factor):
    """Give all bodies their impulses of the present round."""
    for k in range(size):
        b, p = moment.actor[k], moment.push[k]
        if b.kind == DYNAMIC:
            set_vec3(b.velocity, axpy(to_vec3(b.velocity), (p[0], p[1], p[2]), per_mass(b, factor)))
            set_vec3(b.angular_momentum, axpy(to_vec3(b.angular_momentum), (p[3], p[4], p[5]), factor))


@kernel
def _book_round(moment, count, factor, accumulator):
    """Book the impulses of a round."""
    for c in range(count):
        contact = moment.contact[c]
        if contact.impulse > 0.0:
            contact.resolved = 1
            book_contact(accumulator, moment.actor[contact.b], contact, factor)


@kernel
def _count_impacts(moment, count, accumulator):
    for c in range(count):
        contact = moment.contact[c]
        if contact.resolved:
            accumulator[IMPACTS] += 1
            moment.struck[contact.a] += 1
            moment.struck[contact.b] += 1


@kernel
def resolve_contacts(system, moment, count, size, leave_slow, accumulator):
    """Resolve ``count`` contacts between ``size`` bodies of one moment until nothing in them approaches.

    With ``leave_slow`` those that may come to rest are left to the next substep. Changes the actors' velocities and
    counts their impacts, adds to ``accumulator``, and returns what came of it: NOTHING if nothing approached, else
    STRUCK if that happened anywhere, or REBOUNDED.
    """
    for k in range(size):
        moment.struck[k] = 0
    count = find_contacts(system, system.meshes, moment, count)
    for c in range(count):
        contact = moment.contact[c]
        contact.resolved = 0
        set_vec3(contact.shear, (0.0, 0.0, 0.0))
        set_vec3(contact.lost, (0.0, 0.0, 0.0))
    outcome = NOTHING
    for _ in range(MAX_MANIFOLD_IMPULSES):
        moment.push[:size] = 0.0
        gain = 0.0
        for c in range(count):
            what, energy = _propose(system, moment, c, leave_slow, moment.friction)
            gain += energy
            if what != NOTHING:
                outcome = what if outcome == NOTHING else min(outcome, what)
        if gain == 0.0:
            break
        factor = 1.0 if count == 1 else _common_factor(moment, size, gain)
        _apply(moment, size, factor)
        _book_round(moment, count, factor, accumulator)
    _count_impacts(moment, count, accumulator)
    return outcome
