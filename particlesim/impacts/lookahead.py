"""A look at where bodies that settle are at the end of the stretch: nothing may have sunk in there, however it turned.

Contact points close steadily in the eyes of those who settle them, along normals that stand. At the end of the stretch
the bodies' exact separations are looked at. Where two have sunk in, the points where they touch then are added to those
there are, with the gaps that close to what was found: Newton's method on the separations at the end.
"""

from __future__ import annotations

import numpy as np

from particlesim.constants import MAX_MANIFOLD
from particlesim.impacts.contact_points import (
    BEND,
    COLUMNS,
    GAP,
    INRADIUS,
    PARTING,
    RESTITUTION,
    SLOW,
    parting_at,
    write,
)
from particlesim.jit import borrowed, kernel
from particlesim.motion import free_path
from particlesim.narrow_phase.contacts import contact_now
from particlesim.narrow_phase.pair import nearest_image
from particlesim.vec import add, grown, norm, put, put4, row, row4, sub

# Bodies settle anew that end up sunk in by this fraction of the inscribed radius, and by the second more than they are:
# that is more than those who settled them let them sink in a stretch.
_SUNK = 1e-4
_SINKING = 4e-5

# Gaps differ from what was thought by less than this fraction of the way that surfaces move against each other: that
# is more than what features of a patch are inclined by, and more than bodies turn by in a stretch.
_MISJUDGED = 0.3


@kernel
def fly(constants, state, acceleration, duration, ahead):
    """Write into ``ahead``, another state, where bodies on free paths are after ``duration`` [s], and how fast."""
    for i in range(len(constants.mass)):
        position, turn, velocity = free_path(
            row(state.position, i), row4(state.orientation, i), row(state.velocity, i), row(state.angular_momentum, i),
            row(constants.inertia, i), row(acceleration, i), duration,
        )  # fmt: skip
        put(ahead.position, i, position)
        put4(ahead.orientation, i, turn)
        put(ahead.velocity, i, velocity)


@kernel
def _way(constants, velocity, spin, i, j, duration):
    """How far points of particle i and partner j move against each other at the most [m]."""
    speed = norm(row(spin, i)) * constants.radius[i]
    passing = row(velocity, i)
    if j >= 0:
        passing = sub(row(velocity, j), passing)
        speed += norm(row(spin, j)) * constants.radius[j]
    return (norm(passing) + speed) * duration


@kernel
def sunk_points(table, world, constants, state, ahead, spin, before, partner, point, duration):
    """Contact points (m, COLUMNS) of bodies that have sunk in where they are ``ahead`` and were not to.

    Those looked at are the partners of the points that there are, which they have in a row. ``spin`` (n, 3) are the
    angular velocities in ``state``, ``before`` the velocities and angular velocities before they settled. Returns the
    points, their partners (m, 2), and before which of the points that there are they belong (m,).
    """
    table, world, constants, state, ahead = borrowed((table, world, constants, state, ahead))
    spin, before, partner, point = borrowed((spin, before, partner, point))
    points, spare = np.empty((MAX_MANIFOLD, 3)), np.empty((MAX_MANIFOLD, 3))
    more_partner, more = np.empty((MAX_MANIFOLD, 2), dtype=np.int64), np.empty((MAX_MANIFOLD, COLUMNS))
    where = np.empty((MAX_MANIFOLD, 1), dtype=np.int64)
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
        gap, normal, _, count = contact_now(table, world, constants, ahead, i, j, points)
        if gap >= -_SUNK * inradius:
            continue
        present, _, _, _ = contact_now(table, world, constants, state, i, j, spare)
        if gap >= present - _SINKING * inradius:
            continue
        offset = (0.0, 0.0, 0.0)
        if j >= 0:
            offset = nearest_image(sub(row(state.position, j), row(state.position, i)), world.period)
        way = sub(row(ahead.position, i), row(state.position, i))
        while size + count > len(more):
            more_partner, more, where = grown(more_partner), grown(more), grown(where)
        for m in range(size, size + count):
            arm = add(row(points, m - size), way)
            write(constants, state, i, j, normal, offset, arm, inradius, restitution, slow, m, more_partner, more)
            where[m, 0] = k
            more[m, PARTING] = parting_at(before[0], before[1], i, j, more, m)
            # What closes at the speed of now has this gap in the end; one below 0 counts as turning that closes it.
            room = gap - parting_at(ahead.velocity, spin, i, j, more, m) * duration
            more[m, GAP], more[m, BEND] = max(room, 0.0), max(-room, 0.0)
        size += count
    return more[:size], more_partner[:size], where[:size, 0]
