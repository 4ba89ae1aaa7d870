"""Lasting contacts: the points where bodies touch or may come to touch within a step, and what is known of each.

Between two bodies every corner of the manifold that may close within the step is a contact point, with the gap that is
left there. A manifold is what is nearly level; the nearest points of two polyhedra are among its corners always.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from particlesim.core.constants import MAX_MANIFOLD
from particlesim.core.jit import entry_kernel, kernel, without_refcounts
from particlesim.core.math3d import (
    add,
    axpy,
    cross,
    dot,
    grow_records,
    load_vec3,
    norm,
    scale,
    set_vec3,
    store_vec3,
    sub,
)
from particlesim.core.math3d import to_vec3 as vec
from particlesim.dynamics.contact.clearance import turning_speed
from particlesim.dynamics.contact.contact_records import CONTACT_POINT, CONTACT_TERMS, OF_B, OF_EDGES
from particlesim.dynamics.contact.effective_mass import response, rolling_mass, tangential_mass
from particlesim.dynamics.contact.law import rest_speed, rest_threshold, restitution_of
from particlesim.dynamics.contact.normal_owner import normal_owner, write_edges
from particlesim.dynamics.contact.part_patches import (
    MAX_PATCH_POINTS,
    SEARCH_MARGIN,
    gather_patches,
    new_patches,
    patch_corners,
)
from particlesim.dynamics.settings import (
    LOSSLESS_REST,
    MANIFOLD_MARGIN,
    MAX_PARALLEL_TOLERANCE,
    MAX_TURNING_SLACK,
    REST_SLACK,
    RESTING_PARALLEL_TOLERANCE,
    RESTING_SUBSTEPS,
    RESTITUTION_THRESHOLD_HEIGHT,
    SAME_PATCH_SINE,
)
from particlesim.dynamics.solver_state import SolverState
from particlesim.geometry.narrow_phase.pair import pair_manifold
from particlesim.geometry.support import has_parts, is_half_space, is_sphere
from particlesim.model.bodies import BODY, placed
from particlesim.model.domain import nearest_image


class Motion(NamedTuple):
    """How bodies move at the start of a step, and by how much that may change in it."""

    spin: np.ndarray  # (n, 3) angular velocities [rad/s]
    change: np.ndarray  # (n,) by how much surface velocities may change [m/s]
    held: np.ndarray  # (n,) bool, what stays where it is: particles that sleep, and obstacles that do not move
    duration: float  # [s]


class Search(NamedTuple):
    """How far the search for contacts has come, and what is remembered of how near bodies are."""

    round: np.ndarray  # (n,) int64, in which contacts of a body are searched, -1 before
    loose: np.ndarray  # (n,) int64, whether a body has neighbours that it must collide with as others do
    displacement: np.ndarray  # (n,) how far surfaces have come [m]
    clearance: np.ndarray  # beside ``neighbours.other``: how far apart they were, plus displacements [m]


def new_search(state: SolverState, bodies: int) -> Search:
    """A search that has found nothing yet."""
    rounds, loose = np.full(bodies, -1, dtype=np.int64), np.zeros(bodies, dtype=np.int64)
    return Search(rounds, loose, state.displacement, state.clearance)


class _Room(NamedTuple):
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
    offset = nearest_image(sub(vec(b.position), vec(a.position)), system.domain[0].period)
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
def _displacement(system, motion, i, j):
    """How far the surfaces of two bodies may move against each other in the step [m]."""
    a, b, turning = system.body[i], system.body[j], norm(load_vec3(motion.spin, j))
    speed = norm(sub(vec(b.velocity), vec(a.velocity))) + motion.change[i] + motion.change[j]
    speed += turning_speed(system, motion.spin, i) + turning_speed(system, motion.spin, j)
    if j >= system.bounded and turning > 0.0:
        offset = nearest_image(sub(vec(a.position), vec(b.position)), system.domain[0].period)
        speed += turning * (norm(offset) + a.radius)
    return speed * motion.duration


@kernel
def reach_of(system, motion, i, j):
    """How far bodies may be apart that may come to touch in the step, as contacts see it.

    Returns the largest gap and inclination of features that are a contact, and whether they rebound in full.
    """
    a, b = system.body[i], system.body[j]
    inradius = min(a.inradius, b.inradius)
    height = RESTITUTION_THRESHOLD_HEIGHT * inradius
    if restitution_of(system, a, b) == 1.0:
        return LOSSLESS_REST * height, RESTING_PARALLEL_TOLERANCE, True
    displacement = _displacement(system, motion, i, j)
    # A corner that is turned by so much comes down on a face within the step.
    tilt = min(max(RESTING_PARALLEL_TOLERANCE, displacement / inradius), MAX_PARALLEL_TOLERANCE)
    return height + displacement, tilt, False


@kernel
def _turning_slack(system, motion, pair, offset, owner):
    """How far turning may close a gap that the velocities of now do not show [m].

    A point at r from the position of a body that turns at w accelerates by w x (w x r). What comes down on a plane that
    does not turn bends away from it.
    """
    i, j = pair
    a, b = system.body[i], system.body[j]
    of_a = 0.0 if is_sphere(system.shapes, a.shape_row) else norm(load_vec3(motion.spin, i))
    of_b = 0.0 if is_sphere(system.shapes, b.shape_row) else norm(load_vec3(motion.spin, j))
    if owner == OF_B and (is_half_space(system.shapes, b.shape_row) or (j >= system.bounded and of_b == 0.0)):
        return 0.0
    lever = a.radius + b.radius
    if j >= system.bounded:
        lever = a.radius if of_b == 0.0 else a.radius + norm(offset)
    angle, inradius = (of_a + of_b) * motion.duration, min(a.inradius, b.inradius)
    return min(0.5 * angle * angle * lever / RESTING_SUBSTEPS, MAX_TURNING_SLACK * inradius)


@kernel
def _write_point(system, motion, p, terms, pair, arm, offset):
    """Write contact point ``p`` of a pair of bodies, whose ``normal`` is known, and its ``terms``."""
    a, b, normal = system.body[pair[0]], system.body[pair[1]], vec(p.normal)
    law, held = system.law[a.material, b.material], motion.held[pair[1]]
    arm_b = sub(arm, offset)
    p.a, p.b = pair
    set_vec3(p.arm_a, arm)
    set_vec3(p.arm_b, arm_b)
    by_unit = response(a, b, held, arm, arm_b, normal)
    set_vec3(p.response, by_unit)
    p.normal_mass, p.tangential_mass = 1.0 / dot(by_unit, normal), 0.0
    p.friction, p.static_friction = law.friction, law.static_friction
    if law.static_friction > 0.0:
        p.tangential_mass = tangential_mass(a, b, held, arm, arm_b, normal)
    p.push = 0.0
    set_vec3(p.wanted, (0.0, 0.0, 0.0))
    set_vec3(p.drag, (0.0, 0.0, 0.0))
    terms.inradius = min(a.inradius, b.inradius)
    terms.restitution, terms.threshold = law.restitution, rest_threshold(system, a, b)
    terms.rolling_friction, terms.rolling_mass = law.rolling_friction, rolling_mass(a, b, held)
    of_a = add(vec(a.velocity), cross(load_vec3(motion.spin, pair[0]), arm))
    of_b = add(vec(b.velocity), cross(load_vec3(motion.spin, pair[1]), arm_b))
    terms.approach = dot(normal, sub(of_b, of_a))
    for vector in (terms.roll, terms.impulse, terms.angular_impulse, terms.force, terms.torque):
        set_vec3(vector, (0.0, 0.0, 0.0))
    terms.pushed = terms.rubbed = terms.rolled = terms.work = 0.0


@kernel
def _add_points(system, motion, pair, parts, patch, room, found, size):
    """Add the points of a patch (normal, offset, count, least gap, whether they rebound in full) to ``found``.

    ``parts`` are the bodies, or those parts of them that touch. Returns how many there are then; where what rebounds in
    full is not still, none are added.
    """
    normal, offset, count, clear, lossless = patch
    (a, b), (points, terms) = parts, found
    owner = normal_owner(system, a, b, normal)
    turning = 0.0 if lossless else _turning_slack(system, motion, pair, offset, owner)
    for k in range(count):
        p, t = points[size + k], terms[size + k]
        set_vec3(p.normal, normal)
        _write_point(system, motion, p, t, pair, load_vec3(room.points, k), offset)
        if lossless and abs(t.approach) > t.threshold * LOSSLESS_REST:
            return size
        t.gap, t.separation = room.gaps[k], clear
        t.slack, t.owner = turning + REST_SLACK * t.inradius, owner
        t.round_a, t.round_b = is_sphere(system.shapes, a.shape_row), is_sphere(system.shapes, b.shape_row)
        if owner == OF_EDGES:
            write_edges(system, a, b, normal, t)
    return size + count


@kernel
def add_contact(system, motion, pair, clear, room, found, size):
    """Add the points of a pair of bodies (i, j) that may close to ``found`` (points, terms), which has ``size``.

    Returns how many there are then, how far apart the bodies are at least, which is ``clear`` or more, and whether they
    must collide as others do: what rebounds in full is in lasting contact only where it is quite still. There must be
    room for MAX_MANIFOLD more.
    """
    a, b = system.body[pair[0]], system.body[pair[1]]
    reach, tilt, lossless = reach_of(system, motion, pair[0], pair[1])
    if clear > reach:
        return size, clear, lossless
    normal, offset, count, clear = _pair_points(system, a, b, reach, tilt, room)
    if count == 0:
        return size, clear, lossless
    patch = normal, offset, count, clear, lossless
    return _add_points(system, motion, pair, (a, b), patch, room, found, size), clear, lossless


@kernel
def _patch_points(patches, k, surface, deepest, room):
    """Write the points of patch k, and their gaps; how many there are.

    A ``surface`` of 0.5 is that of the first body, of 0 half way. What seems ``deepest`` or deeper lies beside a mesh.
    """
    kept, count, normal, nearest = np.empty((MAX_MANIFOLD, 4)), 0, load_vec3(patches.normal, k), patches.nearest[k]
    for m in range(patch_corners(patches, k, kept)):
        if kept[m, 3] >= deepest:
            store_vec3(room.points, count, axpy(load_vec3(kept, m), normal, -surface * kept[m, 3]))
            room.gaps[count] = kept[m, 3]
            count += 1
    if count > 0 and nearest[3] >= deepest:
        middle = axpy((nearest[0], nearest[1], nearest[2]), normal, -surface * nearest[3])
        count = _with_nearest(room, count, middle, nearest[3], 0.0)
    return count


@kernel
def _add_part_contacts(system, meshes, motion, pair, clear, room, found, size):
    """As ``add_contact``, of two bodies of which one has parts. There must be room for MAX_PATCH_POINTS more."""
    i, j = pair
    a, b, begin = system.body[i], system.body[j], size
    reach, tilt, lossless = reach_of(system, motion, i, j)
    if clear > reach:
        return size, clear, lossless
    inradius = min(a.inradius, b.inradius)
    limits, patches = (reach, tilt, min(reach, MANIFOLD_MARGIN * inradius)), new_patches()
    offset, count, least = gather_patches(system, meshes, a, b, limits, SAME_PATCH_SINE, patches)
    # Parts that are farther apart have not been looked at.
    clear = min(least, max((1.0 + SEARCH_MARGIN) * reach, norm(offset) - a.radius - b.radius))
    parts, surface, deepest = np.empty(2, dtype=BODY), 0.5 if j >= system.bounded else 0.0, -np.inf
    parts[0], parts[1] = a, b
    if j >= system.bounded:
        # Deeper than any triangle.
        deepest = least - RESTITUTION_THRESHOLD_HEIGHT * inradius
    for k in range(count):
        parts[0].shape_row, parts[1].shape_row = patches.row[k, 0], patches.row[k, 1]
        points = _patch_points(patches, k, surface, deepest, room)
        patch = load_vec3(patches.normal, k), offset, points, least, lossless
        before = size
        size = _add_points(system, motion, pair, (parts[0], parts[1]), patch, room, found, size)
        if points > 0 and size == before:
            return begin, clear, lossless
    return size, clear, lossless


@kernel
def _add_contacts(system, meshes, motion, pair, clear, room, found, size):
    """As ``add_contact``, of any two bodies."""
    shapes, a, b = system.shapes, system.body[pair[0]], system.body[pair[1]]
    if meshes is not None and (has_parts(shapes, a.shape_row) or has_parts(shapes, b.shape_row)):
        return _add_part_contacts(system, meshes, motion, pair, clear, room, found, size)
    return add_contact(system, motion, pair, clear, room, found, size)


@kernel
def _most_points(meshes):
    """How many contact points there may be between two bodies."""
    if meshes is None:
        return MAX_MANIFOLD
    return MAX_PATCH_POINTS


@entry_kernel
def contacts_of(system, neighbours, motion, search, indices, first, last):
    """Contact points (m,) and their terms of bodies ``indices[first:last]``, those of the present round of a search.

    Of pairs within the round, and of those with bodies of later rounds: each stands there once. Of two particles the
    second is the one that sleeps. Between bodies that are both held there are none.
    """
    system, neighbours, motion, search, indices = without_refcounts((system, neighbours, motion, search, indices))
    room = _Room(np.empty((MAX_MANIFOLD, 3)), np.empty(MAX_MANIFOLD))
    most = _most_points(system.meshes)
    points, terms = np.empty(8 * most, dtype=CONTACT_POINT), np.empty(8 * most, dtype=CONTACT_TERMS)
    size = 0
    for k in range(first, last):
        i = indices[k]
        place, now, held = neighbours.place[i], search.round[i], motion.held[i]
        for j in range(system.bounded, len(system.body)):
            if held and motion.held[j]:
                continue
            if size + most > len(points):
                points, terms = grow_records(points), grow_records(terms)
            size, _, loose = _add_contacts(system, system.meshes, motion, (i, j), -np.inf, room, (points, terms), size)
            search.loose[i] |= loose
        for near in range(neighbours.start[place], neighbours.start[place + 1]):
            j = neighbours.body[neighbours.other[near]]
            if (held and motion.held[j]) or (search.round[j] >= 0 and (search.round[j] < now or j < i)):
                continue
            if size + most > len(points):
                points, terms = grow_records(points), grow_records(terms)
            come, pair = search.displacement[i] + search.displacement[j], (min(i, j), max(i, j))
            if motion.held[pair[0]] and pair[1] < system.particles:
                pair = pair[1], pair[0]
            clear = search.clearance[near] - come
            size, clear, loose = _add_contacts(system, system.meshes, motion, pair, clear, room, (points, terms), size)
            search.clearance[near] = clear + come
            search.loose[i] |= loose
    return points[:size], terms[:size]


@kernel
def _rests(terms, points, size, pull, lead):
    """Whether bodies hardly move against each other at one of these points, and are pulled together there.

    ``lead`` is the velocity that fields have given the first of them ahead of time [m/s].
    """
    for k in range(size):
        t, normal = terms[k], vec(points[k].normal)
        near = RESTITUTION_THRESHOLD_HEIGHT * t.inradius * (LOSSLESS_REST if t.restitution == 1.0 else 1.0)
        slow = abs(t.approach + dot(normal, lead)) <= rest_speed(norm(pull), t.inradius)
        if t.gap <= near and slow and dot(normal, pull) > 0.0:
            return True
    return False


@entry_kernel
def resting_on_obstacles(system, neighbours, motion, pulled, rests, first, last):
    """Mark in ``rests`` (n,) those of particles ``first .. last`` that gravity or fields press against an obstacle.

    ``pulled``: accelerations (n, 3) [m/s^2], and for how long fields have acted ahead of time [s].
    """
    system, neighbours, motion, rests = without_refcounts((system, neighbours, motion, rests))
    pulls, ahead = pulled
    room = _Room(np.empty((MAX_MANIFOLD, 3)), np.empty(MAX_MANIFOLD))
    most = _most_points(system.meshes)
    points, terms = np.empty(most, dtype=CONTACT_POINT), np.empty(most, dtype=CONTACT_TERMS)
    gravity = vec(system.domain[0].gravity)
    for i in range(first, last):
        pull = load_vec3(pulls, i)
        lead = scale(sub(pull, gravity), ahead)
        for j in range(system.bounded, len(system.body)):
            if not rests[i]:
                size, _, _ = _add_contacts(system, system.meshes, motion, (i, j), -np.inf, room, (points, terms), 0)
                rests[i] = _rests(terms, points, size, pull, lead)
        place = neighbours.place[i]
        for near in range(neighbours.start[place], neighbours.start[place + 1]):
            j = neighbours.body[neighbours.other[near]]
            if j >= system.particles and not rests[i]:
                size, _, _ = _add_contacts(system, system.meshes, motion, (i, j), -np.inf, room, (points, terms), 0)
                rests[i] = _rests(terms, points, size, pull, lead)
