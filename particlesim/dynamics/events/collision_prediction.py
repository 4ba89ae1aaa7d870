"""Who meets whom on the paths that all are on: the first meeting of each pair, and of each particle with each wall."""

from __future__ import annotations

import math

import numpy as np

from particlesim.core.constants import MAX_MANIFOLD, SPHERE, WALL
from particlesim.core.jit import kernel, without_refcounts
from particlesim.core.math3d import axpy, load_vec3, norm, scale, store_vec3, sub
from particlesim.core.parallel import ThreadTeam
from particlesim.dynamics.ccd.pair_impact import body_of, later, pair_meets, wall_meets
from particlesim.dynamics.ccd.swept_bounds import balls, free_way, sieve, sieve_walls
from particlesim.dynamics.ccd.time_of_impact import stays_apart
from particlesim.dynamics.events.paths import Course, Log, path_of_piece, path_of_state
from particlesim.dynamics.neighbour_list import Neighbours, around_of, far_apart
from particlesim.geometry.narrow_phase.gjk import NO_CORNERS
from particlesim.geometry.narrow_phase.pair import nearest_image, pair_separation
from particlesim.geometry.shape_table import ShapeTable
from particlesim.model.bodies import Constants, State, World
from particlesim.model.touching import wall_of_partner

# To look into a pair takes as long as other work on so many particles.
_LOOK = 16

Where = tuple[ShapeTable, World, Constants, State, Course, Log]


@kernel
def _piece_ends(log, piece, duration):
    """When a piece of path ends; ``piece`` -1 is the only one of a particle that has met nothing."""
    following = log.following[piece] if piece >= 0 else -1
    return log.piece[following, 0] if following >= 0 else duration


@kernel(inline=True)
def _path_at(log, state, course, constants, i, piece, time):
    """The path of particle ``i`` as seen at a time within a piece of it."""
    if piece >= 0:
        path = path_of_piece(log.piece, piece)
        begun = log.piece[piece, 0]
    else:
        path = path_of_state(state, course.acceleration, i)
        begun = 0.0
    return later(path, load_vec3(constants.inertia, i), time - begun)


@kernel(inline=True)
def _first_meeting(table, world, constants, state, course, log, i, j, duration, corners, points):
    """When particles i and j first meet, whatever else they meet meanwhile; inf if they do not."""
    piece_i, piece_j = course.head[i], course.head[j]
    body_i, body_j = body_of(constants, i), body_of(constants, j)
    kind_i, kind_j = table.kind[body_i[0]], table.kind[body_j[0]]
    time, found = 0.0, math.inf
    while time < duration and found == math.inf:
        end_i, end_j = _piece_ends(log, piece_i, duration), _piece_ends(log, piece_j, duration)
        end = min(end_i, end_j)
        path_i = _path_at(log, state, course, constants, i, piece_i, time)
        path_j = _path_at(log, state, course, constants, j, piece_j, time)
        found = time + pair_meets(
            table, world, kind_i, body_i, path_i, kind_j, body_j, path_j, end - time, corners, points
        )
        time = end
        if end_i <= end and piece_i >= 0:
            piece_i = log.following[piece_i]
        if end_j <= end and piece_j >= 0:
            piece_j = log.following[piece_j]
    return found


@kernel(inline=True)
def _wall_met(table, world, constants, state, course, i, wall, duration, points):
    """When particle ``i`` first meets a wall on the path it is on at the start; inf if it does not."""
    path = path_of_state(state, course.acceleration, i)
    body = body_of(constants, i)
    return wall_meets(
        table, world, world.lower, world.upper, world.boundary, table.kind[body[0]], body, path, wall, duration, points
    )


@kernel(inline=True)
def _stay_apart(table, world, constants, state, course, i, j, normals, slot, duration, points):
    """Whether a normal is soon found that separates particles i and j as long as they go straight on.

    First the one in row ``slot`` of ``normals``, which did so a stretch of time ago, or the line of centres. If it
    does not, the normal of the nearest points is tried, and kept. Nothing but time depends on it. Returns the corners
    that hulls are nearest by as well, NO_CORNERS where that was not looked into.
    """
    corners = NO_CORNERS
    body_i, body_j = body_of(constants, i), body_of(constants, j)
    path_i, path_j = path_of_state(state, course.acceleration, i), path_of_state(state, course.acceleration, j)
    offset = nearest_image(sub(path_j[0], path_i[0]), world.period)
    known = float(normals[slot, 0]), float(normals[slot, 1]), float(normals[slot, 2])
    if known[0] == 0.0 and known[1] == 0.0 and known[2] == 0.0:
        known = offset
    length = norm(known)
    apart = length > 0.0
    if apart:
        known = scale(known, 1.0 / length)
        apart = stays_apart(table, body_i, path_i, body_j, path_j, offset, known, duration)
    if not apart:
        gap, normal, corners = pair_separation(
            table, body_i[0], body_i[1], path_i[1], body_j[0], body_j[1], path_j[1], offset, NO_CORNERS, points
        )
        if gap > 0.0:
            store_vec3(normals, slot, normal)
            apart = stays_apart(table, body_i, path_i, body_j, path_j, offset, normal, duration)
    return apart, corners


@kernel
def _look_closer(
    table, world, constants, state, course, log, pairs, normals, slots, times, duration, points, first, last
):  # fmt: skip
    """Fill in the times of pairs ``first .. last`` where they are -1.

    Pairs whose ``slots`` are not -1 go straight on, and have a row in ``normals`` (see neighbours.py).
    """
    table, world, constants, state, course, log = without_refcounts((table, world, constants, state, course, log))
    pairs, normals, slots, times, points = without_refcounts((pairs, normals, slots, times, points))
    kind, shape = table.kind, constants.shape
    for k in range(first, last):
        if times[k] < 0.0:
            i, j = pairs[k, 0], pairs[k, 1]
            if j < 0:
                times[k] = _wall_met(table, world, constants, state, course, i, wall_of_partner(j), duration, points)
                continue
            times[k] = math.inf
            spheres = kind[shape[i]] == SPHERE and kind[shape[j]] == SPHERE
            apart, corners = False, NO_CORNERS
            if not spheres and slots[k] >= 0:
                apart, corners = _stay_apart(
                    table, world, constants, state, course, i, j, normals, slots[k], duration, points
                )
            if not apart:
                times[k] = _first_meeting(table, world, constants, state, course, log, i, j, duration, corners, points)


@kernel
def _across(island, head, first_piece, ball, period, lists, whom, first, last):
    """Pairs (m, 2), the smaller first, of particles ``whom[first:last]`` with others of other islands they may meet.

    ``whom`` are all those whose pieces of path begin with ``first_piece`` or later; pairs among them stand there once.
    """
    island, head, ball, lists, whom = without_refcounts((island, head, ball, lists, whom))
    particle, place, start, other = lists
    around = around_of(period)
    most = 0
    for k in range(first, last):
        p = place[whom[k]]
        most += start[p + 1] - start[p]
    pairs = np.empty((most, 2), dtype=np.int64)
    count = 0
    for k in range(first, last):
        i = whom[k]
        p = place[i]
        for near in range(start[p], start[p + 1]):
            if far_apart(ball, p, other[near], around):
                continue
            j = particle[other[near]]
            if island[j] != island[i] and (j > i or head[j] < first_piece):
                pairs[count, 0], pairs[count, 1] = min(i, j), max(i, j)
                count += 1
    return pairs[:count]


@kernel
def _is_near(position, anchor, leash, bulge, period, i):
    """Whether a place is on the leash of particle ``i``, and the tops of parabolas to and from there are."""
    return norm(nearest_image(sub(position, load_vec3(anchor, i)), period)) + bulge <= leash[i]


@kernel
def _follow_paths(
    log_piece, following, head, state, acceleration, radius, place, anchor, leash, period, duration, ball, whom,
    first, last,
):  # fmt: skip
    """See ``follow_paths``, of particles ``whom[first:last]``.

    A parabola between two points on it is farther out than both by at most a t^2 / 8.
    """
    log_piece, following, head, state, acceleration = without_refcounts(
        (log_piece, following, head, state, acceleration)
    )
    radius, place, anchor, leash, period, ball, whom = without_refcounts(
        (radius, place, anchor, leash, period, ball, whom)
    )
    on_leash = True
    for k in range(first, last):
        i = whom[k]
        piece, way = head[i], 0.0
        if piece < 0:
            way = free_way(load_vec3(state.velocity, i), load_vec3(acceleration, i), duration)
        while piece >= 0:
            after = following[piece]
            time = (log_piece[after, 0] if after >= 0 else duration) - log_piece[piece, 0]
            position, _, velocity, _, pull = path_of_piece(log_piece, piece)
            way += free_way(velocity, pull, time)
            bulge = 0.125 * norm(pull) * time * time
            end = axpy(axpy(position, velocity, time), pull, 0.5 * time * time)
            on_leash = on_leash and _is_near(position, anchor, leash, bulge, period, i)
            on_leash = on_leash and _is_near(end, anchor, leash, bulge, period, i)
            piece = after
        ball[place[i], 3] = radius[i] + way
    return on_leash


def follow_paths(where: Where, neighbours: Neighbours, ball: np.ndarray, whom: np.ndarray, duration: float) -> bool:
    """Let the balls of particles ``whom`` hold the paths they have taken; whether these stayed on their leashes."""
    _, world, constants, state, course, log = where
    at = neighbours
    arguments = (
        log.piece, log.following, course.head, state, course.acceleration, constants.radius,
        at.lists.place, at.anchor, at.leash, world.period, duration, ball, whom,
    )  # fmt: skip
    return all(ThreadTeam(len(whom)).each(lambda _, first, last: _follow_paths(*arguments, first, last), len(whom)))


def _met(
    where: Where, pairs: np.ndarray, normals: np.ndarray, slots: np.ndarray, times: np.ndarray, duration: float
) -> tuple[np.ndarray, np.ndarray]:
    """Those of the pairs that meet, and when, with the times of -1 filled in (see ``_look_closer``)."""
    arguments = pairs, normals, slots, times, duration
    crew = ThreadTeam(_LOOK * len(pairs))
    # Some pairs take far longer than others: threads that are done take on more.
    crew.each(
        lambda _, first, last: _look_closer(*where, *arguments, np.empty((MAX_MANIFOLD, 3)), first, last),
        len(pairs),
        4 * crew.threads,
    )
    meet = times < np.inf
    return pairs[meet], times[meet]


def first_meetings(
    where: Where, neighbours: Neighbours, ball: np.ndarray, standing: np.ndarray, duration: float
) -> tuple[np.ndarray, np.ndarray]:
    """Who meets whom within ``duration`` [s] if all go on as they are: pairs (m, 2), sorted, and times (m,).

    Partners below 0 are walls. ``ball`` (n, 8) is filled in (see sieve.py). ``standing`` (n,) says who settles
    together: they do not meet.
    """
    table, world, constants, state, course, _ = where
    count, at = len(constants.radius), neighbours
    moving = constants.radius, state.position, state.velocity, course.acceleration
    crew = ThreadTeam(count)
    alike = all(crew.each(lambda _, first, last: balls(*moving, at.lists.place, duration, ball, first, last), count))
    among = (
        course.acceleration,
        alike,
        ball,
        standing,
        at.lists.particle,
        at.later_start,
        at.later,
        world.period,
        duration,
    )
    parts = crew.each(lambda _, first, last: sieve(table.kind, constants.shape, *among, first, last), count)
    if (world.boundary == WALL).any():
        walls = table.kind, constants.shape, *moving, standing, world.lower, world.upper, world.boundary, duration
        parts += crew.each(lambda _, first, last: sieve_walls(*walls, first, last), count)
    pairs, slots, times = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
    pairs, times = _met(where, pairs, neighbours.normal, slots, times, duration)
    order = np.argsort(pairs[:, 0] * (count + 6) + pairs[:, 1])
    return pairs[order], times[order]


def missed_meetings(
    where: Where, neighbours: Neighbours, ball: np.ndarray, whom: np.ndarray, first_piece: int, duration: float
) -> np.ndarray:
    """Pairs (m, 2) that particles ``whom`` make with others of other islands, whatever either has met meanwhile.

    ``whom`` has all those whose pieces of path begin with ``first_piece`` or later, and any whose pieces were undone.
    """
    _, world, _, _, course, _ = where
    arguments = course.island, course.head, first_piece, ball, world.period, neighbours.lists, whom
    parts = ThreadTeam(len(whom)).each(lambda _, first, last: _across(*arguments, first, last), len(whom))
    pairs = np.concatenate(parts)
    nowhere = np.full(len(pairs), -1, dtype=np.int64)
    met, _ = _met(where, pairs, neighbours.normal, nowhere, np.full(len(pairs), -1.0), duration)
    return met
