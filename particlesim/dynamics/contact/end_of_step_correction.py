"""A look at where bodies that settle are at the end of the stretch: nothing may have sunk in there, however it turned.

Contact points close steadily in the eyes of those who settle them, along normals that stand. At the end of the stretch
the bodies' exact separations are looked at. Where two have sunk in, the points where they touch then are added to those
there are, with the gaps that close to what was found: Newton's method on the separations at the end.
"""

from __future__ import annotations

import numpy as np

from particlesim.core.constants import FREE, MAX_MANIFOLD, SPHERE
from particlesim.core.jit import kernel, without_refcounts
from particlesim.core.math3d import add, grow, load_quat, load_vec3, norm, scale, store_quat, store_vec3, sub
from particlesim.dynamics.contact.contact_points import (
    BEND,
    COLUMNS,
    GAP,
    INRADIUS,
    PARTING,
    RESTITUTION,
    SLOW,
    parting_at,
    write_point,
)
from particlesim.geometry.narrow_phase.pair import nearest_image
from particlesim.model.free_motion import free_path
from particlesim.model.touching import contact_now

# Bodies settle anew that end up sunk in by this fraction of the inscribed radius, and by the second more than they are:
# what has sunk in already is commonly let sink by less than that in a stretch.
_SUNK = 1e-4
_SINKING = 4e-5

# Gaps differ from what was thought by less than this fraction of the way that surfaces move against each other: that
# is more than what features of a patch are inclined by, and commonly more than bodies turn by in a stretch.
_MISJUDGED = 0.3


@kernel
def fly(constants, state, acceleration, standing, duration, ahead):
    """Write into ``ahead`` the position, orientation and velocity, after ``duration`` [s], of all but what is FREE."""
    for i in range(len(constants.mass)):
        if standing[i] == FREE:
            continue
        position, turn, velocity = free_path(
            load_vec3(state.position, i), load_quat(state.orientation, i), load_vec3(state.velocity, i),
            load_vec3(state.angular_momentum, i), load_vec3(constants.inertia, i),
            load_vec3(acceleration, i), duration,
        )  # fmt: skip
        store_vec3(ahead.position, i, position)
        store_quat(ahead.orientation, i, turn)
        store_vec3(ahead.velocity, i, velocity)


@kernel
def _way(constants, velocity, spin, i, j, duration):
    """How far points of particle i and partner j move against each other at the most [m]."""
    speed = norm(load_vec3(spin, i)) * constants.radius[i]
    passing = load_vec3(velocity, i)
    if j >= 0:
        passing = sub(load_vec3(velocity, j), passing)
        speed += norm(load_vec3(spin, j)) * constants.radius[j]
    return (norm(passing) + speed) * duration


@kernel
def _touch(table, world, constants, state, ahead, i, j, points):
    """Where partners touch that are ``ahead``, as seen now: (gap, normal, offset, shift of the points, how many).

    The impulses at a contact must have one line of action in the end, where they are found, and now, where they act.
    Halfway between, each hull is off by half of what the two move against each other. That of a sphere goes through
    its centre, lest it begin to spin: the hull has all of it. Two spheres touch along the normal of now.
    """
    gap, normal, then, count = contact_now(table, world, constants, ahead, i, j, points)
    shift = (0.0, 0.0, 0.0)
    if j < 0:
        return gap, normal, then, shift, count
    offset = nearest_image(sub(load_vec3(state.position, j), load_vec3(state.position, i)), world.period)
    sphere_i, sphere_j = table.kind[constants.shape[i]] == SPHERE, table.kind[constants.shape[j]] == SPHERE
    if sphere_i and sphere_j:
        normal = scale(offset, 1.0 / norm(offset))
        store_vec3(points, 0, scale(normal, constants.radius[i]))
    elif not sphere_i:
        shift = scale(sub(offset, then), 1.0 if sphere_j else 0.5)
    return gap, normal, offset, shift, count


@kernel
def sunk_points(table, world, constants, state, ahead, spin, before, partner, point, duration):
    """Contact points (m, COLUMNS) of bodies that have sunk in where they are ``ahead`` and were not to.

    Those looked at are the partners of the points that there are, which they have in a row. ``spin`` (n, 3) are the
    angular velocities in ``state``, ``before`` the velocities and angular velocities before they settled. Returns the
    points, their partners (m, 2), and before which of the points that there are they belong (m,).
    """
    table, world, constants, state, ahead = without_refcounts((table, world, constants, state, ahead))
    spin, before, partner, point = without_refcounts((spin, before, partner, point))
    points, spare = np.empty((MAX_MANIFOLD, 3)), np.empty((MAX_MANIFOLD, 3))
    more_partner, more = np.empty((MAX_MANIFOLD, 2), dtype=np.int64), np.empty((MAX_MANIFOLD, COLUMNS))
    place = np.empty((MAX_MANIFOLD, 1), dtype=np.int64)
    size = k = 0
    while k < len(point):
        first, i, j = k, partner[k, 0], partner[k, 1]
        left = np.inf
        while k < len(point) and partner[k, 0] == i and partner[k, 1] == j:
            left = min(left, point[k, GAP] + parting_at(ahead.velocity, spin, i, j, point, k) * duration)
            k += 1
        inradius, restitution, slow = point[first, INRADIUS], point[first, RESTITUTION], point[first, SLOW]
        if left > _MISJUDGED * _way(constants, ahead.velocity, spin, i, j, duration):
            continue
        gap, normal, offset, shift, count = _touch(table, world, constants, state, ahead, i, j, points)
        if gap >= -_SUNK * inradius:
            continue
        present, _, _, _ = contact_now(table, world, constants, state, i, j, spare)
        if gap >= present - _SINKING * inradius:
            continue
        while size + count > len(more):
            more_partner, more, place = grow(more_partner), grow(more), grow(place)
        for m in range(size, size + count):
            arm = add(load_vec3(points, m - size), shift)
            write_point(constants, state, i, j, normal, offset, arm, inradius, restitution, slow, m, more_partner, more)
            place[m, 0] = k
            more[m, PARTING] = parting_at(before[0], before[1], i, j, more, m)
            # What is not pressed falls by half of what gravity adds to its speed, by all of it once it is pressed.
            at_last = parting_at(ahead.velocity, spin, i, j, more, m)
            on_average = 0.5 * (at_last + parting_at(state.velocity, spin, i, j, more, m))
            # Closed at this speed for the stretch, it leaves what was found. Below 0 it is opened at once.
            room = gap - max(at_last, on_average) * duration
            more[m, GAP], more[m, BEND] = max(room, 0.0), max(-room, 0.0)
        size += count
    return more[:size], more_partner[:size], place[:size, 0]
