"""What rests, and all that may meet it: the bodies that settle together, and the points where they may touch.

A cluster begins with bodies that touch, slowly, a wall that gravity presses against. All that may reach one of its
bodies within the stretch of time belongs to it, whether it rests there, rocks or arrives. Between two of its bodies,
or one and a wall, every corner of the patch that may close is a contact point, with the gap that is left there.
"""

from __future__ import annotations

import numpy as np

from particlesim.constants import FREE, HULL, LOOSE, MAX_MANIFOLD, RESTING_DROP, RESTING_TILT, SETTLES, STILL, WALL
from particlesim.impacts.bending import bend
from particlesim.impacts.response import restitution_of
from particlesim.impacts.sieve import grown
from particlesim.jit import borrowed, kernel
from particlesim.motion import spin_of
from particlesim.narrow_phase.contacts import wall_as_partner, wall_of_partner
from particlesim.narrow_phase.gjk import NO_CORNERS
from particlesim.narrow_phase.hull_hull import hull_separation
from particlesim.narrow_phase.manifold import hull_patch
from particlesim.narrow_phase.pair import nearest_image, pair_contact
from particlesim.narrow_phase.walls import wall_normal
from particlesim.vec import (
    apply,
    conjugate,
    cross,
    dot,
    matrix_of,
    norm,
    put,
    put4,
    quaternion_product,
    row,
    row4,
    scaled,
    sub,
    vector,
)

# Columns of a contact point: normal, what a unit impulse does to the two angular momenta and the two spins, effective
# mass, gap [m], how fast the partners part [m/s], their restitution, the speed below which they come to rest, the
# smaller inscribed radius, how far apart the centroids are along the normal, how far turning may close the gap [m], and
# where the point is from the first centroid.
NORMAL, LEVER_I, LEVER_J, TWIST_I, TWIST_J = 0, 3, 6, 9, 12
MASS, GAP, PARTING, RESTITUTION, SLOW, INRADIUS, APART, BEND, ARM = 15, 16, 17, 18, 19, 20, 21, 22, 23
COLUMNS = 26

# Contact points are as far ahead as bodies come that are this much faster than they are thought to be.
FASTER = 2.0

# The fraction of a neighbour's speed that a body is expected to take on. With FASTER nearly all are foreseen; the rest
# costs a second look at everything.
_HANDED_ON = 0.3

# Inclined by more than this [sine of the angle], features are no patch, however fast they turn.
_MOST_TILT = 0.2

# Bodies that sink in farther than this fraction of the inscribed radius, as they turn by what they have been given, are
# given it anew, if what turning closes has grown by this factor.
_SUNK = 1e-4
_GROWN = 1.1

# Faces and edges reach this fraction of the inscribed radius over their ends at the most, for what may slide there.
_BORDER = 0.02


@kernel
def column(array, k, first):
    """The vector in three columns of row ``k``."""
    return array[k, first], array[k, first + 1], array[k, first + 2]


@kernel
def _put_column(array, k, first, v):
    array[k, first], array[k, first + 1], array[k, first + 2] = v


@kernel
def _wall_points(table, world, constants, state, i, wall, reach, points, gaps):
    """The corners of particle ``i`` that are nearest to a wall, within ``reach``, and their gaps; returns how many."""
    axis, sign = wall // 2, 2.0 * (wall % 2) - 1.0
    room = sign * ((world.upper[axis] if wall % 2 else world.lower[axis]) - state.position[i, axis])
    normal = wall_normal(wall)
    shape, size = constants.shape[i], constants.size[i]
    count = 0
    if table.kind[shape] != HULL:
        if room - constants.radius[i] <= reach:
            put(points, 0, scaled(normal, constants.radius[i]))
            gaps[0] = room - constants.radius[i]
            count = 1
    elif room - constants.radius[i] <= reach:
        matrix = matrix_of(row4(state.orientation, i))
        vertex = table.vertex
        for v in range(table.vertex_start[shape], table.vertex_start[shape + 1]):
            corner = apply(matrix, scaled(row(vertex, v), size))
            gap = room - dot(normal, corner)
            if gap > reach:
                continue
            slot = count
            if count == MAX_MANIFOLD:
                slot = 0
                for k in range(1, count):
                    slot = k if gaps[k] > gaps[slot] else slot
                if gaps[slot] <= gap:
                    continue
            else:
                count += 1
            put(points, slot, corner)
            gaps[slot] = gap
    return normal, (0.0, 0.0, 0.0), count


@kernel
def _with_nearest(points, gaps, count, nearest, gap, tolerance):
    """Add the ``nearest`` point of two hulls, and its ``gap``, to a patch that has none as near; returns how many."""
    least = gaps[0]
    for k in range(1, count):
        least = min(least, gaps[k])
    if least <= gap + tolerance:
        return count
    slot = min(count, MAX_MANIFOLD - 1)
    put(points, slot, nearest)
    gaps[slot] = gap
    return slot + 1


@kernel
def _pair_points(table, world, constants, state, i, j, reach, tilt, points, gaps):
    """Contact points of two particles within ``reach``, and the gaps there: (normal, offset, how many, least gap)."""
    offset = nearest_image(sub(row(state.position, j), row(state.position, i)), world.period)
    gap = norm(offset) - constants.radius[i] - constants.radius[j]
    normal, count = (0.0, 0.0, 0.0), 0
    if gap > reach:
        return normal, offset, count, gap
    shape_i, size_i, turn_i = constants.shape[i], constants.size[i], row4(state.orientation, i)
    shape_j, size_j, turn_j = constants.shape[j], constants.size[j], row4(state.orientation, j)
    if table.kind[shape_i] == HULL and table.kind[shape_j] == HULL:
        matrix_i, matrix_j = matrix_of(turn_i), matrix_of(turn_j)
        border = _BORDER * min(constants.inradius[i], constants.inradius[j])
        gap, normal, middle, _ = hull_separation(
            table, shape_i, size_i, matrix_i, shape_j, size_j, matrix_j, offset, NO_CORNERS
        )
        if gap <= reach:
            count = hull_patch(
                table, shape_i, size_i, matrix_i, shape_j, size_j, matrix_j,
                offset, normal, gap, middle, tilt, min(reach, border), points, gaps,
            )  # fmt: skip
            count = _with_nearest(points, gaps, count, middle, gap, RESTING_DROP * border)
    else:
        gap, normal, count = pair_contact(table, shape_i, size_i, turn_i, shape_j, size_j, turn_j, offset, points)
        gaps[0] = gap
    return normal, offset, count if gap <= reach else 0, gap


@kernel
def _parting(state, spin, i, j, point, k):
    """How fast particle ``i`` and partner ``j`` part at contact point ``k`` at the velocities and spins given [m/s]."""
    normal = column(point, k, NORMAL)
    parting = -dot(normal, row(state.velocity, i)) - dot(column(point, k, LEVER_I), row(spin, i))
    if j >= 0:
        parting += dot(normal, row(state.velocity, j)) + dot(column(point, k, LEVER_J), row(spin, j))
    return parting


@kernel
def _write(table, constants, state, spin, i, j, normal, offset, arm, duration, m, partner, point):
    """Write contact point ``m``, but for its gap and what its partners are made of; returns how fast they part."""
    partner[m, 0], partner[m, 1] = i, j
    _put_column(point, m, NORMAL, normal)
    _put_column(point, m, ARM, arm)
    lever = cross(arm, normal)
    twist = spin_of(row4(state.orientation, i), lever, row(constants.inertia, i))
    _put_column(point, m, LEVER_I, lever)
    _put_column(point, m, TWIST_I, twist)
    _put_column(point, m, LEVER_J, (0.0, 0.0, 0.0))
    _put_column(point, m, TWIST_J, (0.0, 0.0, 0.0))
    inverse_mass = 1.0 / constants.mass[i] + dot(lever, twist)
    if j >= 0:
        lever = cross(sub(arm, offset), normal)
        twist = spin_of(row4(state.orientation, j), lever, row(constants.inertia, j))
        _put_column(point, m, LEVER_J, lever)
        _put_column(point, m, TWIST_J, twist)
        inverse_mass += 1.0 / constants.mass[j] + dot(lever, twist)
    parting = _parting(state, spin, i, j, point, m)
    point[m, BEND] = bend(table, constants, state, spin, i, j, normal, offset, arm, duration)
    point[m, MASS], point[m, PARTING], point[m, APART] = 1.0 / inverse_mass, parting, dot(offset, normal)
    return parting


@kernel
def _add_contact(table, world, constants, state, spin, pace, duration, i, j, clear, points, gaps, partner, point, size):
    """Add the points of particle i and partner j that may close.

    Returns how many there are then, what they are and how far apart the partners are at least, which is ``clear`` or
    more. They are FREE if they cannot meet, SETTLES if they may, LOOSE if they may but must meet as others do: what
    rebounds in full settles only where it is quite still. ``points`` and ``gaps`` are room to work in; ``partner`` and
    ``point`` must have room for MAX_MANIFOLD more.
    """
    restitution, slow = restitution_of(world, constants, i, j)
    inradius = constants.inradius[i]
    speed = pace[i]
    if j >= 0:
        inradius = min(inradius, constants.inradius[j])
        speed += pace[j]
    lossless = restitution == 1.0
    way = FASTER * speed * duration
    # A corner that is turned by so much comes down on a face within the stretch.
    tilt = RESTING_TILT if lossless else min(max(RESTING_TILT, way / inradius), _MOST_TILT)
    reach = RESTING_DROP * inradius + way
    if lossless:
        slow, reach = STILL * slow, STILL * RESTING_DROP * inradius
    what = LOOSE if lossless else SETTLES
    if clear > reach:
        return size, LOOSE if lossless else FREE, clear
    if j < 0:
        normal, offset, count = _wall_points(table, world, constants, state, i, wall_of_partner(j), reach, points, gaps)
    else:
        normal, offset, count, clear = _pair_points(table, world, constants, state, i, j, reach, tilt, points, gaps)
    for k in range(count):
        m = size + k
        arm = row(points, k)
        parting = _write(table, constants, state, spin, i, j, normal, offset, arm, duration, m, partner, point)
        if lossless and abs(parting) > slow:
            return size, LOOSE, clear
        point[m, GAP], point[m, RESTITUTION], point[m, SLOW], point[m, INRADIUS] = gaps[k], restitution, slow, inradius
    return size + count, what if lossless or count > 0 else FREE, clear


@kernel
def bend_more(table, world, constants, state, spin, partner, point, duration):
    """Let gaps close by as much as turning closes them at the velocities and spins of now, where that matters.

    That is where bodies that go on like this for ``duration`` [s] sink in. Returns whether it is anywhere.
    """
    table, world, constants, state = borrowed((table, world, constants, state))
    anywhere = False
    for k in range(len(point)):
        i, j = partner[k, 0], partner[k, 1]
        normal = column(point, k, NORMAL)
        offset = (0.0, 0.0, 0.0)
        if j >= 0:
            offset = nearest_image(sub(row(state.position, j), row(state.position, i)), world.period)
        way = bend(table, constants, state, spin, i, j, normal, offset, column(point, k, ARM), duration)
        sunk = point[k, GAP] + _parting(state, spin, i, j, point, k) * duration - way < -_SUNK * point[k, INRADIUS]
        if sunk and way > _GROWN * point[k, BEND]:
            point[k, BEND] = way
            anywhere = True
    return anywhere


@kernel
def _rests(point, first, last):
    """Whether partners hardly move against each other at one of these contact points, and touch there."""
    for k in range(first, last):
        near = RESTING_DROP * point[k, INRADIUS] * (STILL if point[k, RESTITUTION] == 1.0 else 1.0)
        if point[k, GAP] <= near and abs(point[k, PARTING]) <= point[k, SLOW]:
            return True
    return False


@kernel
def _pressed(world, wall):
    """Whether gravity presses against a wall."""
    return world.boundary[wall // 2] == WALL and dot(wall_normal(wall), vector(world.gravity)) > 0.0


@kernel
def surface_paces(constants, state, spin):
    """How fast the surface of each particle moves at most, (n,) [m/s]."""
    pace = np.empty(len(constants.radius))
    for i in range(len(pace)):
        pace[i] = norm(row(state.velocity, i)) + norm(row(spin, i)) * constants.radius[i]
    return pace


@kernel
def expected_paces(pace, lists, least):
    """How fast surfaces that move at ``pace`` may become (n,) [m/s]: ``least`` faster, or as neighbours push them."""
    particle, start, other = lists.particle, lists.start, lists.other
    expected = np.empty(len(pace))
    for p in range(len(pace)):
        i = particle[p]
        expected[i] = pace[i]
        for near in range(start[p], start[p + 1]):
            expected[i] = max(expected[i], _HANDED_ON * pace[particle[other[near]]])
        expected[i] += least
    return expected


@kernel
def walk(constants, state, period, position, orientation, way):
    """Add to ``way`` (n,) how far surfaces are from where they were at ``position`` and ``orientation`` [m].

    These become the present ones.
    """
    constants, state, period = borrowed((constants, state, period))
    for i in range(len(way)):
        x, q = row(state.position, i), row4(state.orientation, i)
        half = quaternion_product(q, conjugate(row4(orientation, i)))
        turn = 2.0 * constants.radius[i] * norm((half[1], half[2], half[3]))
        way[i] += norm(nearest_image(sub(x, row(position, i)), period)) + turn
        put(position, i, x)
        put4(orientation, i, q)


@kernel
def find_cluster(table, world, constants, state, spin, lists, duration, pace, way, clearance, standing):
    """Contact points (m, COLUMNS) of all clusters for a stretch of ``duration`` [s], and their partners (m, 2).

    ``pace`` (n,) bounds the speeds of surfaces [m/s], ``way`` (n,) how far they have come [m]. ``clearance`` (m,)
    beside ``lists.other`` is how far apart neighbours were at least, with the ways they had come then, and is kept
    up to date. Fills in the ``standing`` (n,) of each particle: FREE, SETTLES or LOOSE.
    """
    table, world, constants, state = borrowed((table, world, constants, state))
    spin, lists, pace, standing = borrowed((spin, lists, pace, standing))
    way, clearance = borrowed((way, clearance))
    start, other = lists.start, lists.other
    position, radius = state.position, constants.radius
    count = len(radius)
    points, gaps = np.empty((MAX_MANIFOLD, 3)), np.empty(MAX_MANIFOLD)
    partner, point = np.empty((64, 2), dtype=np.int64), np.empty((64, COLUMNS))
    waiting = np.empty(count, dtype=np.int64)
    gathered = np.zeros(count, dtype=np.bool_)
    found = size = 0
    for i in range(count):
        standing[i] = FREE
        for wall in range(6):
            if standing[i] != FREE or not _pressed(world, wall):
                continue
            axis = wall // 2
            room = world.upper[axis] - position[i, axis] if wall % 2 else position[i, axis] - world.lower[axis]
            if room <= radius[i] * (1.0 + RESTING_DROP):
                j = wall_as_partner(wall)
                last, _, _ = _add_contact(
                    table, world, constants, state, spin, pace, duration, i, j, -np.inf, points, gaps, partner, point, 0
                )
                if _rests(point, 0, last):
                    standing[i] = SETTLES
                    waiting[found] = i
                    found += 1
    next_one = 0
    while next_one < found:
        i = waiting[next_one]
        next_one += 1
        gathered[i] = True
        place = lists.place[i]
        while size + MAX_MANIFOLD * (6 + start[place + 1] - start[place]) > len(partner):
            partner, point = grown(partner), grown(point)
        for wall in range(6):
            if world.boundary[wall // 2] == WALL:
                j = wall_as_partner(wall)
                size, what, _ = _add_contact(
                    table, world, constants, state, spin, pace, duration, i, j, -np.inf, points, gaps, partner, point,
                    size,
                )  # fmt: skip
                if what == LOOSE:
                    standing[i] = LOOSE
        for near in range(start[place], start[place + 1]):
            j = lists.particle[other[near]]
            if gathered[j]:
                continue
            a, b = min(i, j), max(i, j)
            before = size
            come = way[i] + way[j]
            size, what, clear = _add_contact(
                table, world, constants, state, spin, pace, duration, a, b, clearance[near] - come, points, gaps,
                partner, point, size,
            )  # fmt: skip
            clearance[near] = clear + come
            if size > before and standing[j] == FREE:
                standing[j] = SETTLES
                waiting[found] = j
                found += 1
            if what == LOOSE:
                standing[i] = LOOSE
                standing[j] = LOOSE if standing[j] != FREE else FREE
    return partner[:size], point[:size]


@kernel
def handed_down(point, order, first, last, lever, force):
    """Forces (m,) at contact points: each ``force`` of before at the point that is nearest to where it was.

    Force ``k`` had the ``lever`` (k, 3), the LEVER_I of its point; its contact now has the points
    ``order[first[k]:last[k]]``.
    """
    forces = np.zeros(len(point))
    for k in range(len(force)):
        nearest, least = -1, np.inf
        for place in range(first[k], last[k]):
            way = sub(column(point, order[place], LEVER_I), row(lever, k))
            if dot(way, way) < least:
                nearest, least = order[place], dot(way, way)
        if nearest >= 0:
            forces[nearest] += force[k]
    return forces
