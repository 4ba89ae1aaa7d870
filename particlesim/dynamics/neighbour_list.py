"""Neighbour lists: which bodies may touch for a while, true as long as every body is within its skin.

A body's reference position is where it was when the lists were made; its skin says how far it may get from there
before they have to be made anew. Two bodies are neighbours if their bounding spheres could touch with both at the ends
of their skins (L. Verlet, Physical Review 159 (1967) 98, whose skin is the same for all).

What is read together lies together: bodies have places in the order of a curve that fills space, and lists of pairs
are in the order of the places, so that the neighbours of consecutive bodies are in the cache already. Half-spaces have
no bounding sphere and stand in no list.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from particlesim.broad_phase.spatial_order import spatial_order
from particlesim.core.jit import entry_kernel, kernel, without_refcounts
from particlesim.core.math3d import norm, to_vec3
from particlesim.core.parallel import ThreadTeam
from particlesim.dynamics.ccd.swept_bounds import BOUND, bounds_apart, inverse_period, largest_acceleration
from particlesim.dynamics.settings import SKIN_SUBSTEPS, VERLET_SKIN

FindPairs = Callable[[np.ndarray, np.ndarray, np.ndarray], tuple[np.ndarray, int]]


class Order(NamedTuple):
    """An order of the bodies in which neighbours are near each other."""

    body: np.ndarray  # (n,) int32, the body at a place
    place: np.ndarray  # (n,) int32, the place of a body


class NeighbourList(NamedTuple):
    """Neighbours of place p are at the places ``other[start[p]:start[p + 1]]``, those of later places at
    ``later[later_start[p]:later_start[p + 1]]`` as well.
    """

    body: np.ndarray  # (n,) int32, the body at a place
    place: np.ndarray  # (n,) int32, the place of a body
    reference: np.ndarray  # (n, 4): reference position and skin of a body [m]
    start: np.ndarray  # (n + 1,) int64
    other: np.ndarray  # (2 m,) int32
    later_start: np.ndarray  # (n + 1,) int64
    later: np.ndarray  # (m,) int32
    normal: np.ndarray  # (m, 3) float32, what last separated these two; 0 before, and (0, 3) for spheres alone


def order_of(position: np.ndarray, period: np.ndarray) -> Order:
    """Places along a space-filling curve for bodies at ``position`` (n, 3)."""
    count = len(position)
    body = spatial_order(position, period)
    place = np.empty(count, dtype=np.int32)
    place[body] = np.arange(count, dtype=np.int32)
    return Order(body, place)


@entry_kernel
def write_skins(system, duration, skin, first, last):
    """How wide skins must be for a path of ``duration`` [s], straight or deflected, and a while after [m]."""
    system, skin = without_refcounts((system, skin))
    for i in range(first, last):
        b = system.body[i]
        displacement = (norm(to_vec3(b.velocity)) + largest_acceleration(system, b) * duration) * duration
        skin[i] = VERLET_SKIN * b.radius + SKIN_SUBSTEPS * displacement


@entry_kernel
def _write_spheres(spheres, order, sphere, boxes, first, last):
    """By place, the spheres that bodies cannot leave within their skins, and their boxes (2, n, 3)."""
    spheres, order, sphere, boxes = without_refcounts((spheres, order, sphere, boxes))
    position, radius, skin, _ = spheres
    for p in range(first, last):
        i = order.body[p]
        reach = radius[i] + skin[i]
        sphere[p].reach = reach
        for axis in range(3):
            sphere[p].position[axis] = position[i, axis]
            boxes[0, p, axis] = position[i, axis] - reach
            boxes[1, p, axis] = position[i, axis] + reach


@kernel
def _begin_of_row(pairs, k):
    """The first pair from ``k`` on whose first partner differs from that of the pair before."""
    while 0 < k < len(pairs) and pairs[k, 0] == pairs[k - 1, 0]:
        k += 1
    return k


@entry_kernel
def _later_places(pairs, sphere, order, particles, period, later_start, first, last):
    """Later neighbours among candidate pairs ``first .. last``, counted for each place into ``later_start[p + 1]``.

    Whole rows of pairs with the same first place: those that begin in the range. Two obstacles are no neighbours.
    """
    pairs, sphere, order, later_start = without_refcounts((pairs, sphere, order, later_start))
    first, last = _begin_of_row(pairs, first), _begin_of_row(pairs, last)
    later = np.empty(last - first, dtype=np.int32)
    periods = inverse_period(period)
    size = 0
    for k in range(first, last):
        p, q = pairs[k, 0], pairs[k, 1]
        if order.body[p] >= particles and order.body[q] >= particles:
            continue
        if not bounds_apart(sphere[p], sphere[q], periods):
            later[size] = q
            size += 1
            later_start[p + 1] += 1
    return later[:size]


@entry_kernel
def _count_earlier(later_start, later, counts, first, last):
    """For each place, how many of the places ``first .. last`` have it among their later neighbours."""
    later_start, later, counts = without_refcounts((later_start, later, counts))
    for k in range(later_start[first], later_start[last]):
        counts[later[k]] += 1


@entry_kernel
def _write_both_ways(later_start, later, cursors, start, other, first, last):
    """Write places ``first .. last`` as neighbours of their later ones, and these as theirs.

    Earlier neighbours of a place go where ``cursors`` says, later ones to the end of its row.
    """
    later_start, later, cursors, start, other = without_refcounts((later_start, later, cursors, start, other))
    for p in range(first, last):
        own = start[p + 1] - later_start[p + 1]
        for k in range(later_start[p], later_start[p + 1]):
            q = later[k]
            other[own + k] = q
            other[cursors[q]] = p
            cursors[q] += 1


def _both_ways(later_start: np.ndarray, later: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """All neighbours of each place, the earlier ones first, and where they begin: (start, other)."""
    count = len(later_start) - 1
    team = ThreadTeam(count)
    counts = np.zeros((team.threads, count), dtype=np.int64)  # of the earlier ones, by the thread that has them
    team.each(lambda block, first, last: _count_earlier(later_start, later, counts[block], first, last), count)
    start = np.zeros(count + 1, dtype=np.int64)
    np.cumsum(counts.sum(axis=0) + np.diff(later_start), out=start[1:])
    cursors = start[:-1] + counts.cumsum(axis=0) - counts
    other = np.empty(2 * len(later), dtype=np.int32)
    team.each(
        lambda block, first, last: _write_both_ways(later_start, later, cursors[block], start, other, first, last),
        count,
    )
    return start, other


@entry_kernel
def _sort_rows(body, start, other, first, last):
    """Sort the neighbours of places ``first .. last`` by their numbers, by insertion: they are few."""
    body, start, other = without_refcounts((body, start, other))
    for p in range(first, last):
        for k in range(start[p] + 1, start[p + 1]):
            value = other[k]
            hole = k
            while hole > start[p] and body[other[hole - 1]] > body[value]:
                other[hole] = other[hole - 1]
                hole -= 1
            other[hole] = value


class Spheres(NamedTuple):
    """Where bodies are that neighbours are searched of, and how far they reach; all by body."""

    position: np.ndarray  # (n, 3) [m]
    radius: np.ndarray  # (n,) [m]
    skin: np.ndarray  # (n,) [m]
    particles: int  # of them that are no obstacles


def find_neighbours(
    spheres: Spheres, period: np.ndarray, order: Order, with_normals: bool, find_pairs: FindPairs
) -> tuple[NeighbourList, int, int]:
    """The neighbour list of bodies; boxes compared, and candidate pairs found. Normals are kept if asked for."""
    position, radius, skin, particles = spheres
    count = len(radius)
    sphere, boxes = np.zeros(count, dtype=BOUND), np.empty((2, count, 3))
    ThreadTeam(count).each(lambda _, first, last: _write_spheres(spheres, order, sphere, boxes, first, last), count)
    pairs, tested = find_pairs(boxes[0], boxes[1], period)
    candidates = len(pairs)
    later_start = np.zeros(count + 1, dtype=np.int64)
    later = np.concatenate(
        ThreadTeam(len(pairs)).each(
            lambda _, first, last: _later_places(pairs, sphere, order, particles, period, later_start, first, last),
            len(pairs),
        )
    )
    later_start = later_start.cumsum()
    start, other = _both_ways(later_start, later)
    normal = np.zeros((len(later) if with_normals else 0, 3), dtype=np.float32)
    reference = np.column_stack((position, skin))
    return NeighbourList(*order, reference, start, other, later_start, later, normal), tested, candidates


def sort_neighbours(neighbours: NeighbourList) -> None:
    """Put the neighbours of each body in the order of their numbers."""
    count = len(neighbours.body)
    ThreadTeam(count).each(
        lambda _, first, last: _sort_rows(neighbours.body, neighbours.start, neighbours.other, first, last), count
    )


def pairs_of(neighbours: NeighbourList) -> np.ndarray:
    """All pairs of neighbours, (m, 2) int64, i < j."""
    earlier = np.repeat(neighbours.body, np.diff(neighbours.later_start))
    pairs = np.column_stack((earlier, neighbours.body[neighbours.later])).astype(np.int64)
    pairs.sort(axis=1)
    return pairs
