"""The points where two bodies of a cluster, or one and a wall, may touch, and what is known of each.

Between two bodies every corner of the patch that may close within the stretch of time is a contact point, with the gap
that is left there. A patch is what is nearly level; the nearest points of two hulls are among its corners always.
"""

from __future__ import annotations

import numpy as np

from particlesim.core.constants import (
    FREE,
    HULL,
    LOOSE,
    MAX_MANIFOLD,
    RESTING_PARALLEL_TOLERANCE,
    RESTITUTION_THRESHOLD_HEIGHT,
    SETTLES,
    STILL,
)
from particlesim.core.jit import kernel
from particlesim.core.math3d import (
    cross,
    dot,
    load_quat,
    load_vec3,
    mat_vec,
    norm,
    quat_to_matrix,
    scale,
    store_vec3,
    sub,
)
from particlesim.dynamics.contact.curvature_margin import bend
from particlesim.dynamics.contact.impact import restitution_of
from particlesim.geometry.narrow_phase.contact_manifold import hull_patch
from particlesim.geometry.narrow_phase.gjk import NO_CORNERS
from particlesim.geometry.narrow_phase.half_space import wall_normal
from particlesim.geometry.narrow_phase.hull_hull import hull_separation
from particlesim.geometry.narrow_phase.pair import nearest_image, pair_contact
from particlesim.model.free_motion import spin_of
from particlesim.model.touching import wall_of_partner

# Columns of a contact point: normal, what a unit impulse does to the two angular momenta and the two spins, effective
# mass, gap [m], how fast the partners part [m/s], their restitution, the speed below which they come to rest, the
# smaller inscribed radius, how far apart the centroids are along the normal, how far turning may close the gap [m].
# A gap that turning may close is opened at once.
NORMAL, LEVER_I, LEVER_J, TWIST_I, TWIST_J = 0, 3, 6, 9, 12
MASS, GAP, PARTING, RESTITUTION, SLOW, INRADIUS, APART, BEND = 15, 16, 17, 18, 19, 20, 21, 22
COLUMNS = 23

# Contact points are as far ahead as bodies come that are this much faster than they are thought to be.
FASTER = 2.0

# Inclined by more than this [sine of the angle], features are no patch, however fast they turn.
_MOST_TILT = 0.2

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
            store_vec3(points, 0, scale(normal, constants.radius[i]))
            gaps[0] = room - constants.radius[i]
            count = 1
    elif room - constants.radius[i] <= reach:
        matrix = quat_to_matrix(load_quat(state.orientation, i))
        vertex = table.vertex
        for v in range(table.vertex_start[shape], table.vertex_start[shape + 1]):
            corner = mat_vec(matrix, scale(load_vec3(vertex, v), size))
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
            store_vec3(points, slot, corner)
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
    store_vec3(points, slot, nearest)
    gaps[slot] = gap
    return slot + 1


@kernel
def _pair_points(table, world, constants, state, i, j, reach, tilt, points, gaps):
    """Contact points of two particles within ``reach``, and the gaps there: (normal, offset, how many, least gap)."""
    offset = nearest_image(sub(load_vec3(state.position, j), load_vec3(state.position, i)), world.period)
    gap = norm(offset) - constants.radius[i] - constants.radius[j]
    normal, count = (0.0, 0.0, 0.0), 0
    if gap > reach:
        return normal, offset, count, gap
    shape_i, size_i, turn_i = constants.shape[i], constants.size[i], load_quat(state.orientation, i)
    shape_j, size_j, turn_j = constants.shape[j], constants.size[j], load_quat(state.orientation, j)
    if table.kind[shape_i] == HULL and table.kind[shape_j] == HULL:
        matrix_i, matrix_j = quat_to_matrix(turn_i), quat_to_matrix(turn_j)
        border = _BORDER * min(constants.inradius[i], constants.inradius[j])
        gap, normal, middle, _ = hull_separation(
            table, shape_i, size_i, matrix_i, shape_j, size_j, matrix_j, offset, NO_CORNERS
        )
        if gap <= reach:
            count = hull_patch(
                table, shape_i, size_i, matrix_i, shape_j, size_j, matrix_j,
                offset, normal, gap, middle, tilt, min(reach, border), points, gaps,
            )  # fmt: skip
            count = _with_nearest(points, gaps, count, middle, gap, RESTITUTION_THRESHOLD_HEIGHT * border)
    else:
        gap, normal, count = pair_contact(table, shape_i, size_i, turn_i, shape_j, size_j, turn_j, offset, points)
        gaps[0] = gap
    return normal, offset, count if gap <= reach else 0, gap


@kernel
def parting_at(velocity, spin, i, j, point, k):
    """How fast particle ``i`` and partner ``j`` part at contact point ``k`` at these velocities and spins [m/s]."""
    normal = column(point, k, NORMAL)
    parting = -dot(normal, load_vec3(velocity, i)) - dot(column(point, k, LEVER_I), load_vec3(spin, i))
    if j >= 0:
        parting += dot(normal, load_vec3(velocity, j)) + dot(column(point, k, LEVER_J), load_vec3(spin, j))
    return parting


@kernel
def write_point(constants, state, i, j, normal, offset, arm, inradius, restitution, slow, m, partner, point):
    """Write contact point ``m`` of particle i and partner j, but for its gap and how fast it parts and may bend."""
    partner[m, 0], partner[m, 1] = i, j
    _put_column(point, m, NORMAL, normal)
    lever = cross(arm, normal)
    twist = spin_of(load_quat(state.orientation, i), lever, load_vec3(constants.inertia, i))
    _put_column(point, m, LEVER_I, lever)
    _put_column(point, m, TWIST_I, twist)
    _put_column(point, m, LEVER_J, (0.0, 0.0, 0.0))
    _put_column(point, m, TWIST_J, (0.0, 0.0, 0.0))
    inverse_mass = 1.0 / constants.mass[i] + dot(lever, twist)
    if j >= 0:
        lever = cross(sub(arm, offset), normal)
        twist = spin_of(load_quat(state.orientation, j), lever, load_vec3(constants.inertia, j))
        _put_column(point, m, LEVER_J, lever)
        _put_column(point, m, TWIST_J, twist)
        inverse_mass += 1.0 / constants.mass[j] + dot(lever, twist)
    point[m, MASS], point[m, APART] = 1.0 / inverse_mass, dot(offset, normal)
    point[m, INRADIUS], point[m, RESTITUTION], point[m, SLOW] = inradius, restitution, slow


@kernel
def add_contact(table, world, constants, state, spin, pace, duration, i, j, clear, points, gaps, partner, point, size):
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
    tilt = RESTING_PARALLEL_TOLERANCE if lossless else min(max(RESTING_PARALLEL_TOLERANCE, way / inradius), _MOST_TILT)
    reach = RESTITUTION_THRESHOLD_HEIGHT * inradius + way
    if lossless:
        slow, reach = STILL * slow, STILL * RESTITUTION_THRESHOLD_HEIGHT * inradius
    what = LOOSE if lossless else SETTLES
    if clear > reach:
        return size, LOOSE if lossless else FREE, clear
    if j < 0:
        normal, offset, count = _wall_points(table, world, constants, state, i, wall_of_partner(j), reach, points, gaps)
    else:
        normal, offset, count, clear = _pair_points(table, world, constants, state, i, j, reach, tilt, points, gaps)
    for k in range(count):
        m = size + k
        arm = load_vec3(points, k)
        write_point(constants, state, i, j, normal, offset, arm, inradius, restitution, slow, m, partner, point)
        parting = parting_at(state.velocity, spin, i, j, point, m)
        if lossless and abs(parting) > slow:
            return size, LOOSE, clear
        point[m, GAP], point[m, PARTING] = gaps[k], parting
        point[m, BEND] = bend(table, constants, state, spin, i, j, normal, offset, arm, duration)
    return size + count, what if lossless or count > 0 else FREE, clear


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
            way = sub(column(point, order[place], LEVER_I), load_vec3(lever, k))
            if dot(way, way) < least:
                nearest, least = order[place], dot(way, way)
        if nearest >= 0:
            forces[nearest] += force[k]
    return forces
