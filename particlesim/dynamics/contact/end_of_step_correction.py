"""End-of-step correction: where bodies that settle are at the end of the substep, nothing may have sunk in there."""

from __future__ import annotations

import numpy as np

from particlesim.core.constants import MAX_MANIFOLD
from particlesim.core.jit import entry_kernel, kernel, without_refcounts
from particlesim.core.math3d import (
    add,
    grow,
    grow_records,
    load_vec3,
    norm,
    scale,
    store_vec3,
    sub,
    to_vec3,
)
from particlesim.dynamics.contact.contact_points import (
    CONTACT_POINT,
    normal_velocity_in,
    normal_velocity_of,
    write_point,
)
from particlesim.dynamics.settings import CORRECTED_PENETRATION, CORRECTED_SINKING, GAP_MISJUDGED
from particlesim.dynamics.standing import FREE
from particlesim.geometry.narrow_phase.pair import pair_contact
from particlesim.geometry.support import is_half_space, is_sphere
from particlesim.model.bodies import placed
from particlesim.model.domain import nearest_image
from particlesim.model.free_motion import path_of_body, place_on_path, set_pose


@entry_kernel
def place_ahead(system, standing, duration, ahead):
    """Write into ``ahead`` (n,) BODY where bodies that settle are, and how they move, after ``duration`` [s]."""
    system, standing, ahead = without_refcounts((system, standing, ahead))
    for i in range(len(system.body)):
        if standing[i] != FREE or i >= system.particles:
            b = system.body[i]
            ahead[i] = b
            set_pose(ahead[i], *place_on_path(path_of_body(system, i), to_vec3(b.principal_inertia), duration))


@kernel
def _displacement(ahead, spin, p, duration):
    """How far the surfaces of two bodies move against each other at most within ``duration`` [m]."""
    a, b = ahead[p.a], ahead[p.b]
    speed = norm(load_vec3(spin, p.a)) * a.radius
    turning = norm(load_vec3(spin, p.b))
    speed += turning * b.radius if turning > 0.0 else 0.0
    return (norm(sub(to_vec3(b.velocity), to_vec3(a.velocity))) + speed) * duration


@kernel
def _separation_in(system, body, p, points):
    """Separation, normal, offset and number of points of the bodies of contact point ``p`` as records have them."""
    a, b = body[p.a], body[p.b]
    offset = nearest_image(sub(to_vec3(b.position), to_vec3(a.position)), system.domain[0].period)
    separation, normal, count = pair_contact(system.shapes, placed(a), placed(b), offset, points)
    return separation, normal, offset, count


@kernel
def _touch(system, ahead, p, points):
    """Where bodies touch that are ``ahead``, as seen now: (gap, normal, offset, shift of the points, how many).

    The impulses at a contact must have one line of action in the end, where they are found, and now, where they act.
    Halfway between, each polyhedron is off by half of what the two move against each other. That of a sphere goes
    through its centre, lest it begin to spin: the polyhedron has all of it. Two spheres touch along the normal of now.
    """
    gap, normal, then, count = _separation_in(system, ahead, p, points)
    a, b = system.body[p.a], system.body[p.b]
    offset = nearest_image(sub(to_vec3(b.position), to_vec3(a.position)), system.domain[0].period)
    shift = (0.0, 0.0, 0.0)
    if is_half_space(system.shapes, b.shape_row):
        return gap, normal, offset, shift, count
    sphere_a, sphere_b = is_sphere(system.shapes, a.shape_row), is_sphere(system.shapes, b.shape_row)
    if sphere_a and sphere_b:
        normal = scale(offset, 1.0 / norm(offset))
        store_vec3(points, 0, scale(normal, a.radius))
    elif not sphere_a:
        shift = scale(sub(offset, then), 1.0 if sphere_b else 0.5)
    return gap, normal, offset, shift, count


@kernel
def _least_gap_left(ahead, spin, point, first, last, duration):
    """The least gap that is left at points ``first .. last`` of a pair, as their normal velocities say."""
    left = np.inf
    for k in range(first, last):
        left = min(left, point[k].gap + normal_velocity_in(ahead, spin, point[k]) * duration)
    return left


@kernel
def _has_sunk(system, ahead, p, gap, spare):
    """Whether bodies that are ``gap`` apart in the end overlap there, and by more than they do now."""
    if gap >= -CORRECTED_PENETRATION * p.inradius:
        return False
    present, _, _, _ = _separation_in(system, system.body, p, spare)
    return gap < present - CORRECTED_SINKING * p.inradius


@kernel
def _write_sunk(system, ahead, spins, like, touch, arm, duration, p):
    """Write a contact point of a pair that has sunk in: like one that there is, with the gap that closes to ``touch``.

    ``spins`` are the velocities (n, 3) and angular velocities before they settled, and the angular velocities since.
    """
    gap, normal, offset = touch
    before, spin_before, spin = spins
    p.a, p.b, p.inradius, p.restitution, p.threshold = like.a, like.b, like.inradius, like.restitution, like.threshold
    write_point(p, system.body[p.a], system.body[p.b], normal, offset, arm)
    p.normal_velocity = normal_velocity_of(
        p, load_vec3(before, p.a), load_vec3(spin_before, p.a), load_vec3(before, p.b), load_vec3(spin_before, p.b)
    )
    # What is not pressed falls by half of what gravity adds to its speed, by all of it once it is pressed.
    at_last = normal_velocity_in(ahead, spin, p)
    on_average = 0.5 * (at_last + normal_velocity_in(system.body, spin, p))
    # Closed at this speed for the substep, it leaves what was found. Below 0 it is opened at once.
    room = gap - max(at_last, on_average) * duration
    p.gap, p.bend = max(room, 0.0), max(-room, 0.0)


@entry_kernel
def sunk_points(system, ahead, spins, point, duration):
    """Contact points (m,) of bodies that have sunk in where they are ``ahead`` and were not to.

    Those looked at are the pairs of the points that there are, which they have in a row. ``spins`` are the velocities
    (n, 3) and angular velocities before they settled, and the angular velocities since. Returns the points, and before
    which of the points that there are they belong (m,).
    """
    system, ahead, spins, point = without_refcounts((system, ahead, spins, point))
    points, spare = np.empty((MAX_MANIFOLD, 3)), np.empty((MAX_MANIFOLD, 3))
    more, place = np.empty(MAX_MANIFOLD, dtype=CONTACT_POINT), np.empty((MAX_MANIFOLD, 1), dtype=np.int64)
    size = k = 0
    while k < len(point):
        first, like = k, point[k]
        while k < len(point) and point[k].a == like.a and point[k].b == like.b:
            k += 1
        left = _least_gap_left(ahead, spins[2], point, first, k, duration)
        if left > GAP_MISJUDGED * _displacement(ahead, spins[2], like, duration):
            continue
        gap, normal, offset, shift, count = _touch(system, ahead, like, points)
        if not _has_sunk(system, ahead, like, gap, spare):
            continue
        while size + count > len(more):
            more, place = grow_records(more), grow(place)
        for m in range(size, size + count):
            arm = add(load_vec3(points, m - size), shift)
            _write_sunk(system, ahead, spins, like, (gap, normal, offset), arm, duration, more[m])
            place[m, 0] = k
        size += count
    return more[:size], place[:size, 0]
