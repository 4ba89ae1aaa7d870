"""Collision prediction: the first impact of each pair on the paths that all bodies are on, and across islands."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from particlesim.core.constants import MAX_MANIFOLD
from particlesim.core.jit import entry_kernel, kernel, without_refcounts
from particlesim.core.math3d import axpy, norm, scale, sub, to_vec3
from particlesim.core.parallel import ThreadTeam
from particlesim.dynamics.ccd.pair_impact import next_impact
from particlesim.dynamics.ccd.swept_bounds import (
    CANDIDATE,
    LOOK_CLOSER,
    bounds_apart,
    cull_pairs,
    cull_surroundings,
    free_displacement,
    inverse_period,
    write_bounds,
)
from particlesim.dynamics.ccd.time_of_impact import stays_apart
from particlesim.dynamics.events.paths import Paths, path_of_segment
from particlesim.dynamics.neighbour_list import NeighbourList
from particlesim.dynamics.settings import PAIR_COST
from particlesim.geometry.narrow_phase.gjk import NO_SIMPLEX
from particlesim.geometry.narrow_phase.pair import pair_separation
from particlesim.geometry.support import is_sphere
from particlesim.model.domain import nearest_image
from particlesim.model.free_motion import advance_path, free_acceleration, path_of_body
from particlesim.model.system import System


class Predicted(NamedTuple):
    """The impacts on the paths that all bodies are on at the start of a substep, sorted by pair."""

    first: np.ndarray  # (n,) int64, the first row of a particle, -1 if it has none
    pair: np.ndarray  # (m, 2) int64, i < j
    time: np.ndarray  # (m,) [s]


@kernel
def _segment_end(paths, segment, duration):
    """When a path segment ends; segment -1 is the only one of a body that is undisturbed."""
    following = paths.segment[segment].next if segment >= 0 else -1
    return paths.segment[following].start if following >= 0 else duration


@kernel
def _path_at(system, paths, i, segment, time):
    """The path of body ``i`` as seen at a time within a segment of it."""
    if segment >= 0:
        path, begun = path_of_segment(system, paths.segment[segment]), paths.segment[segment].start
    else:
        path, begun = path_of_body(system, i), 0.0
    return advance_path(path, to_vec3(system.body[i].principal_inertia), time - begun)


@kernel
def _first_impact(system, paths, i, j, duration, simplex, points):
    """When bodies i < j first collide, whatever else strikes them meanwhile; inf if they do not."""
    segment_i, segment_j = paths.clock[i].first_segment, paths.clock[j].first_segment
    time, found = 0.0, math.inf
    while time < duration and found == math.inf:
        end_i, end_j = _segment_end(paths, segment_i, duration), _segment_end(paths, segment_j, duration)
        end = min(end_i, end_j)
        both = _path_at(system, paths, i, segment_i, time), _path_at(system, paths, j, segment_j, time)
        found = time + next_impact(system, system.body[i], system.body[j], both, end - time, simplex, points)
        time = end
        if end_i <= end and segment_i >= 0:
            segment_i = paths.segment[segment_i].next
        if end_j <= end and segment_j >= 0:
            segment_j = paths.segment[segment_j].next
    return found


@kernel
def _stay_apart(system, i, j, normal, duration, points):
    """Whether a normal is soon found that separates bodies i and j as long as nothing strikes them.

    First the ``normal`` that did so a substep ago, or the line of centres. If it does not, the normal of the nearest
    points is tried, and kept. Nothing but the computing time depends on it. Returns the simplex by which they are
    nearest as well, NO_SIMPLEX where that was not looked into.
    """
    simplex = NO_SIMPLEX
    a, b = system.body[i], system.body[j]
    paths = path_of_body(system, i), path_of_body(system, j)
    offset = nearest_image(sub(paths[1][0], paths[0][0]), system.domain[0].period)
    known = float(normal[0]), float(normal[1]), float(normal[2])
    if known[0] == 0.0 and known[1] == 0.0 and known[2] == 0.0:
        known = offset
    length = norm(known)
    apart = length > 0.0
    if apart:
        apart = stays_apart(system, a, b, paths, offset, scale(known, 1.0 / length), duration)
    if not apart:
        placed_a, placed_b = (a.shape_row, a.scale, paths[0][1]), (b.shape_row, b.scale, paths[1][1])
        gap, found, simplex = pair_separation(system.shapes, placed_a, placed_b, offset, NO_SIMPLEX, points)
        if gap > 0.0:
            normal[0], normal[1], normal[2] = found
            apart = stays_apart(system, a, b, paths, offset, found, duration)
    return apart, simplex


@kernel
def _are_spheres(system, i, j):
    shapes, body = system.shapes, system.body
    return is_sphere(shapes, body[i].shape_row) and is_sphere(shapes, body[j].shape_row)


@entry_kernel
def _look_closer(system, paths, normals, candidates, duration, first, last):
    """Fill in the times of candidates ``first .. last`` where they are LOOK_CLOSER.

    Those whose slots are not -1 are on free paths, and have a row in ``normals`` (see neighbour_list.py).
    """
    system, paths, normals, candidates = without_refcounts((system, paths, normals, candidates))
    points = np.empty((MAX_MANIFOLD, 3))
    for k in range(first, last):
        c = candidates[k]
        if c.time == LOOK_CLOSER:
            c.time = math.inf
            i, j = c.i, c.j
            apart, simplex = False, NO_SIMPLEX
            if c.slot >= 0 and not (
                is_sphere(system.shapes, system.body[i].shape_row)
                and is_sphere(system.shapes, system.body[j].shape_row)
            ):
                apart, simplex = _stay_apart(system, i, j, normals[c.slot], duration, points)
            if not apart:
                c.time = _first_impact(system, paths, i, j, duration, simplex, points)


@entry_kernel
def _across(system, paths, first_segment, bound, neighbours, indices, first, last):
    """Candidates (m,) of particles ``indices[first:last]`` with bodies of other islands that they may touch.

    ``indices`` are all those whose path segments begin with ``first_segment`` or later; pairs of them stand there once.
    """
    system, paths, first_segment, bound, neighbours, indices = without_refcounts(
        (system, paths, first_segment, bound, neighbours, indices)
    )
    clock = paths.clock
    periods = inverse_period(system.domain[0].period)
    most = 0
    for k in range(first, last):
        p = neighbours.place[indices[k]]
        most += neighbours.start[p + 1] - neighbours.start[p]
    found = np.empty(most, dtype=CANDIDATE)
    count = 0
    for k in range(first, last):
        i = indices[k]
        p = neighbours.place[i]
        for near in range(neighbours.start[p], neighbours.start[p + 1]):
            q = neighbours.other[near]
            j = neighbours.body[q]
            if j >= system.particles or bounds_apart(bound[p], bound[q], periods):
                continue
            if clock[j].island != clock[i].island and (j > i or clock[j].first_segment < first_segment):
                c = found[count]
                c.i, c.j, c.slot, c.time = min(i, j), max(i, j), -1, LOOK_CLOSER
                count += 1
    return found[:count]


@kernel
def _is_within(position, reference, bulge, period):
    """Whether a position is within the skin about a reference position, and the tops of parabolas near it are."""
    offset = nearest_image(sub(position, (reference[0], reference[1], reference[2])), period)
    return norm(offset) + bulge <= reference[3]


@kernel
def _bound_path(system, paths, reference, i, duration):
    """How far particle ``i`` goes on its path at most [m], and whether that stays within its skin.

    A parabola between two points on it is farther out than both by at most a t^2 / 8.
    """
    segment, displacement, within = paths.clock[i].first_segment, 0.0, True
    period = system.domain[0].period
    if segment < 0:
        b = system.body[i]
        return free_displacement(to_vec3(b.velocity), norm(free_acceleration(system, b)), duration), True
    while segment >= 0:
        following = paths.segment[segment].next
        time = _segment_end(paths, segment, duration) - paths.segment[segment].start
        position, _, velocity, _, acceleration, _ = path_of_segment(system, paths.segment[segment])
        displacement += free_displacement(velocity, norm(acceleration), time)
        bulge = 0.125 * norm(acceleration) * time * time
        end = axpy(axpy(position, velocity, time), acceleration, 0.5 * time * time)
        within = within and _is_within(position, reference, bulge, period)
        within = within and _is_within(end, reference, bulge, period)
        segment = following
    return displacement, within


@entry_kernel
def _bound_paths(system, paths, neighbours, bound, indices, duration, first, last):
    """See ``bound_paths``, of particles ``indices[first:last]``."""
    system, paths, neighbours, bound, indices = without_refcounts((system, paths, neighbours, bound, indices))
    all_within = True
    for k in range(first, last):
        i = indices[k]
        displacement, within = _bound_path(system, paths, neighbours.reference[i], i, duration)
        all_within = all_within and within
        bound[neighbours.place[i]].reach = system.body[i].radius + displacement
    return all_within


def bound_paths(
    system: System, paths: Paths, neighbours: NeighbourList, bound: np.ndarray, indices: np.ndarray, duration: float
) -> bool:
    """Let the swept bounds of particles hold the paths they have taken; whether these stayed within their skins."""
    return all(
        ThreadTeam(len(indices)).each(
            lambda _, first, last: _bound_paths(system, paths, neighbours, bound, indices, duration, first, last),
            len(indices),
        )
    )


def _colliding(
    system: System, paths: Paths, normals: np.ndarray, parts: list[np.ndarray], duration: float
) -> np.ndarray:
    """Those of the candidates that collide, with the times of LOOK_CLOSER filled in."""
    candidates = np.concatenate(parts)
    if not (candidates["time"] == LOOK_CLOSER).any():  # as among spheres, which need not have it compiled
        return candidates
    team = ThreadTeam(PAIR_COST * len(candidates))
    # Some pairs take far longer than others: threads that are done take on more.
    team.each(
        lambda _, first, last: _look_closer(system, paths, normals, candidates, duration, first, last),
        len(candidates),
        4 * team.threads,
    )
    return candidates[candidates["time"] < np.inf]


def predict(
    system: System, paths: Paths, neighbours: NeighbourList, bound: np.ndarray, standing: np.ndarray, duration: float
) -> Predicted:
    """All first impacts within ``duration`` [s] if every body goes on as it is.

    ``bound`` (n,) BOUND is filled in. ``standing`` (n,) says what settles together: that does not collide; it is empty
    where nothing comes to rest.
    """
    team = ThreadTeam(system.bounded)
    alike = all(
        team.each(
            lambda _, first, last: write_bounds(system, neighbours.place, duration, bound, first, last), system.bounded
        )
    )
    parts = team.each(
        lambda _, first, last: cull_pairs(system, neighbours, bound, standing, alike, duration, first, last),
        system.bounded,
    )
    if len(system.body) > system.bounded:
        parts += team.each(
            lambda _, first, last: cull_surroundings(system, standing, duration, first, last), system.particles
        )
    found = _colliding(system, paths, neighbours.normal, parts, duration)
    found = found[np.argsort(found["i"] * len(system.body) + found["j"])]
    first_row = np.full(system.particles, -1, dtype=np.int64)
    starts = np.flatnonzero(np.diff(found["i"], prepend=-1))
    first_row[found["i"][starts]] = starts
    return Predicted(first_row, np.column_stack((found["i"], found["j"])), found["time"].copy())


def predict_across(
    system: System, paths: Paths, neighbours: NeighbourList, bound: np.ndarray, moved: tuple[np.ndarray, int],
    duration: float,
) -> np.ndarray:  # fmt: skip
    """Pairs (m, 2) of particles of different islands that collide after all, on the paths they have taken.

    ``moved`` are the particles, and their first path segment: all those whose segments begin with it or later, and any
    whose segments were undone.
    """
    indices, first_segment = moved
    parts = ThreadTeam(len(indices)).each(
        lambda _, first, last: _across(system, paths, first_segment, bound, neighbours, indices, first, last),
        len(indices),
    )
    found = _colliding(system, paths, neighbours.normal, parts, duration)
    return np.column_stack((found["i"], found["j"]))
