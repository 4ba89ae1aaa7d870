"""Who meets whom on the paths that all are on: the first meeting of each pair, and of each particle with each wall."""

from __future__ import annotations

import math

import numpy as np

from particlesim.constants import MAX_MANIFOLD
from particlesim.crew import Crew
from particlesim.impacts.course import Course, Log, path_of_piece, path_of_state
from particlesim.impacts.neighbours import Neighbours
from particlesim.impacts.next_impact import body_of, later, pair_meets, wall_meets
from particlesim.impacts.sieve import sieve
from particlesim.jit import borrowed, kernel
from particlesim.narrow_phase.contacts import wall_of_partner
from particlesim.state import Constants, ShapeTable, State, World
from particlesim.vec import row

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
    return later(path, row(constants.inertia, i), time - begun)


@kernel(inline=True)
def _first_meeting(table, world, constants, state, course, log, i, j, duration, points):
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
        found = time + pair_meets(table, world, kind_i, body_i, path_i, kind_j, body_j, path_j, end - time, points)
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


@kernel
def _look_closer(table, world, constants, state, course, log, pairs, times, duration, first, last):
    """Fill in the times of pairs ``first .. last`` where they are -1."""
    table, world, constants, state, course, log = borrowed((table, world, constants, state, course, log))
    pairs, times = borrowed((pairs, times))
    points = np.empty((MAX_MANIFOLD, 3))
    for k in range(first, last):
        if times[k] < 0.0:
            i, j = pairs[k, 0], pairs[k, 1]
            if j < 0:
                times[k] = _wall_met(table, world, constants, state, course, i, wall_of_partner(j), duration, points)
            else:
                times[k] = _first_meeting(table, world, constants, state, course, log, i, j, duration, points)


@kernel
def _across(island, start, other, whom):
    """Pairs (m, 2), the smaller first, of particles ``whom`` with neighbours of other islands."""
    count = 0
    for i in whom:
        count += start[i + 1] - start[i]
    pairs = np.empty((count, 2), dtype=np.int64)
    count = 0
    for i in whom:
        for near in range(start[i], start[i + 1]):
            j = other[near]
            if island[j] != island[i]:
                pairs[count, 0], pairs[count, 1] = min(i, j), max(i, j)
                count += 1
    return pairs[:count]


def _met(where: Where, pairs: np.ndarray, times: np.ndarray, duration: float) -> tuple[np.ndarray, np.ndarray]:
    """Those of the pairs that meet, and when, with the times of -1 filled in."""
    with Crew(len(pairs)) as crew:
        crew.each(lambda _, first, last: _look_closer(*where, pairs, times, duration, first, last), len(pairs))
    meet = times < np.inf
    return pairs[meet], times[meet]


def first_meetings(
    where: Where, neighbours: Neighbours, standing: np.ndarray, duration: float
) -> tuple[np.ndarray, np.ndarray]:
    """Who meets whom within ``duration`` [s] if all go on as they are: pairs (m, 2), sorted by the first, times (m,).

    Partners below 0 are walls. ``standing`` (n,) says who settles together: they do not meet.
    """
    table, world, constants, state, course, _ = where
    count = len(constants.radius)
    arguments = (
        table.kind, constants.shape, constants.radius, state.position, state.velocity, course.acceleration,
        world.lower, world.upper, world.boundary, world.period, neighbours.start, neighbours.other, standing, duration,
    )  # fmt: skip
    with Crew(count) as crew:
        parts = crew.each(lambda _, first, last: sieve(*arguments, first, last), count)
    pairs, times = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
    return _met(where, pairs, times, duration)


def missed_meetings(where: Where, neighbours: Neighbours, whom: np.ndarray, duration: float) -> np.ndarray:
    """Pairs (m, 2) that particles ``whom`` make with others of other islands, whatever either has met meanwhile."""
    pairs = _across(where[4].island, neighbours.start, neighbours.other, whom)
    met, _ = _met(where, pairs, np.full(len(pairs), -1.0), duration)
    return met
