"""The points where two bodies of the active set may touch, and what is known of each.

Between two bodies every corner of the manifold that may close within the substep is a contact point, with the gap that
is left there. A manifold is what is nearly level; the nearest points of two polyhedra are among its corners always.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from particlesim.core.constants import MAX_MANIFOLD
from particlesim.core.jit import entry_kernel, kernel, without_refcounts
from particlesim.core.math3d import cross, dot, load_vec3, norm, set_vec3, store_vec3, sub, to_vec3
from particlesim.core.records import record
from particlesim.dynamics.contact.curvature_margin import bend
from particlesim.dynamics.contact.law import rest_threshold, restitution_of, tangent_of
from particlesim.dynamics.settings import (
    LOSSLESS_REST,
    MANIFOLD_MARGIN,
    MAX_PARALLEL_TOLERANCE,
    RESTING_PARALLEL_TOLERANCE,
    RESTITUTION_THRESHOLD_HEIGHT,
    SPEED_MARGIN,
)
from particlesim.dynamics.standing import FREE, LOOSE, SETTLES
from particlesim.geometry.narrow_phase.pair import pair_manifold
from particlesim.model.bodies import angular_velocity_change, per_mass, placed
from particlesim.model.domain import nearest_image

CONTACT_POINT = record(
    [
        ("a", "i8"),  # particle
        ("b", "i8"),  # body
        ("normal", "f8", (3,)),  # from a to b
        ("tangent", "f8", (3,)),  # with normal x tangent the basis in which friction acts
        ("lever_a", "f8", (3,)),  # what a unit impulse does to the two angular momenta [m]
        ("lever_b", "f8", (3,)),
        ("twist_a", "f8", (3,)),  # and to the two angular velocities [1/(kg m)]
        ("twist_b", "f8", (3,)),
        ("effective_mass", "f8"),  # [kg]
        ("gap", "f8"),  # [m]
        ("normal_velocity", "f8"),  # before they settle; below 0 they approach [m/s]
        ("restitution", "f8"),
        ("threshold", "f8"),  # normal speed below which they come to rest [m/s]
        ("inradius", "f8"),  # the smaller inscribed radius [m]
        ("distance", "f8"),  # of the positions along the normal [m]
        ("bend", "f8"),  # how far turning may close the gap; a gap that turning may close is opened at once [m]
    ]
)


class Motion(NamedTuple):
    """How bodies move in a substep, and how fast they may become."""

    spin: np.ndarray  # (n, 3) angular velocities [rad/s]
    speed: np.ndarray  # (n,) bounds of surface speeds [m/s]
    duration: float  # [s]


class Room(NamedTuple):
    """Where the points of one pair are worked out."""

    points: np.ndarray  # (MAX_MANIFOLD, 3) from a's position [m]
    gaps: np.ndarray  # (MAX_MANIFOLD,) [m]


@kernel
def _with_nearest(room, count, nearest, gap, tolerance):
    """Add the ``nearest`` point of two polyhedra, and its ``gap``, to a manifold that has none as near; how many."""
    points, gaps = room
    least = gaps[0]
    for k in range(1, count):
        least = min(least, gaps[k])
    if least <= gap + tolerance:
        return count
    slot = min(count, MAX_MANIFOLD - 1)
    store_vec3(points, slot, nearest)
    gaps[slot] = gap
    return slot + 1


@kernel
def _pair_points(system, a, b, reach, tilt, room):
    """Contact points of two bodies within ``reach``, and the gaps there: (normal, offset, how many, least gap)."""
    offset = nearest_image(sub(to_vec3(b.position), to_vec3(a.position)), system.domain[0].period)
    gap = norm(offset) - a.radius - b.radius
    if gap > reach:
        return (0.0, 0.0, 0.0), offset, 0, gap
    border = MANIFOLD_MARGIN * min(a.inradius, b.inradius)
    limits = reach, tilt, min(reach, border)
    gap, normal, middle, count = pair_manifold(
        system.shapes, placed(a), placed(b), offset, limits, room.points, room.gaps
    )
    if count > 0:
        count = _with_nearest(room, count, middle, gap, RESTITUTION_THRESHOLD_HEIGHT * border)
    return normal, offset, count, gap


@kernel
def normal_velocity_of(p, velocity_a, spin_a, velocity_b, spin_b):
    """Normal velocity at contact point ``p`` of bodies that move and turn like this [m/s]."""
    normal = to_vec3(p.normal)
    of_a = -dot(normal, velocity_a) - dot(to_vec3(p.lever_a), spin_a)
    return of_a + (dot(normal, velocity_b) + dot(to_vec3(p.lever_b), spin_b))


@kernel
def normal_velocity_in(body, spin, p):
    """Normal velocity at contact point ``p`` with the velocities of bodies and their ``spin`` (n, 3) [m/s]."""
    velocity_a, velocity_b = to_vec3(body[p.a].velocity), to_vec3(body[p.b].velocity)
    return normal_velocity_of(p, velocity_a, load_vec3(spin, p.a), velocity_b, load_vec3(spin, p.b))


@kernel
def write_point(p, a, b, normal, offset, lever_arm):
    """Write where contact point ``p`` of two bodies is, and what an impulse there does."""
    set_vec3(p.normal, normal)
    set_vec3(p.tangent, tangent_of(normal))
    lever_a, lever_b = cross(lever_arm, normal), cross(sub(lever_arm, offset), normal)
    twist_a, twist_b = angular_velocity_change(a, lever_a), angular_velocity_change(b, lever_b)
    set_vec3(p.lever_a, lever_a)
    set_vec3(p.twist_a, twist_a)
    set_vec3(p.lever_b, lever_b)
    set_vec3(p.twist_b, twist_b)
    inverse_mass = per_mass(a, 1.0) + dot(lever_a, twist_a)
    inverse_mass += per_mass(b, 1.0) + dot(lever_b, twist_b)
    p.effective_mass, p.distance = 1.0 / inverse_mass, dot(offset, normal)


@kernel
def _reach_of(system, a, b, displacement):
    """How near two bodies come that move by a displacement against each other in the substep, as contacts see it.

    Returns the largest gap and inclination of features that are a contact, the smaller inscribed radius, the normal
    speed below which they come to rest, and whether they rebound in full.
    """
    inradius = min(a.inradius, b.inradius)
    threshold = rest_threshold(system, a, b)
    height = RESTITUTION_THRESHOLD_HEIGHT * inradius
    if restitution_of(system, a, b) == 1.0:
        return LOSSLESS_REST * height, RESTING_PARALLEL_TOLERANCE, inradius, LOSSLESS_REST * threshold, True
    # A corner that is turned by so much comes down on a face within the substep.
    tilt = min(max(RESTING_PARALLEL_TOLERANCE, displacement / inradius), MAX_PARALLEL_TOLERANCE)
    return height + displacement, tilt, inradius, threshold, False


@kernel
def add_contact(system, motion, pair, clear, room, point, size):
    """Add the points of a pair of bodies (i, j) that may close.

    Returns how many there are then, what the bodies are and how far apart they are at least, which is ``clear`` or
    more. They are FREE if they cannot touch, SETTLES if they may, LOOSE if they may but must collide as others do: what
    rebounds in full settles only where it is quite still. ``point`` must have room for MAX_MANIFOLD more.
    """
    i, j = pair
    a, b = system.body[i], system.body[j]
    displacement = SPEED_MARGIN * (motion.speed[i] + motion.speed[j]) * motion.duration
    reach, tilt, inradius, threshold, lossless = _reach_of(system, a, b, displacement)
    what = LOOSE if lossless else SETTLES
    if clear > reach:
        return size, LOOSE if lossless else FREE, clear
    normal, offset, count, clear = _pair_points(system, a, b, reach, tilt, room)
    for k in range(count):
        p = point[size + k]
        lever_arm = load_vec3(room.points, k)
        p.a, p.b, p.inradius, p.threshold = i, j, inradius, threshold
        p.restitution = restitution_of(system, a, b)
        write_point(p, a, b, normal, offset, lever_arm)
        p.normal_velocity = normal_velocity_in(system.body, motion.spin, p)
        if lossless and abs(p.normal_velocity) > threshold:
            return size, LOOSE, clear
        p.gap = room.gaps[k]
        p.bend = bend(system, motion, p, offset, lever_arm)
    return size + count, what if lossless or count > 0 else FREE, clear


@entry_kernel
def handed_down(point, order, first, last, memory):
    """Forces (m,) at contact points: each force of the substep before at the point that is nearest to where it was.

    The contact of force ``k`` of ``memory`` (FORCE) now has the points ``order[first[k]:last[k]]``.
    """
    point, order, memory = without_refcounts((point, order, memory))
    forces = np.zeros(len(point))
    for k in range(len(memory)):
        nearest, least = -1, np.inf
        for place in range(first[k], last[k]):
            shift = sub(to_vec3(point[order[place]].lever_a), to_vec3(memory[k].lever))
            if dot(shift, shift) < least:
                nearest, least = order[place], dot(shift, shift)
        if nearest >= 0:
            forces[nearest] += memory[k].force
    return forces
