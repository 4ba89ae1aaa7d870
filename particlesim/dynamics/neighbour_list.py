"""Who may meet whom for a while: neighbour lists that stay true as long as every particle is on its leash.

A particle's anchor is where it was when the lists were made; its leash says how far its centroid may get from there
before they have to be made anew. Two particles are neighbours if their bounding spheres could touch with both at the
ends of their leashes (L. Verlet, Physical Review 159 (1967) 98, whose leash is the same for all).

What is looked at together lies together: particles have places in the order of a curve that fills space, and lists of
pairs are in the order of the places, so that the partners of consecutive particles are in the cache already.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from particlesim.broad_phase.spatial_order import spatial_order
from particlesim.core.constants import VERLET_SKIN
from particlesim.core.jit import kernel
from particlesim.core.math3d import load_vec3, norm
from particlesim.core.parallel import ThreadTeam

FindPairs = Callable[[np.ndarray, np.ndarray, np.ndarray], tuple[np.ndarray, int]]


class Places(NamedTuple):
    """An order of the particles in which neighbours are near each other."""

    particle: np.ndarray  # (n,) int32, who is at a place
    place: np.ndarray  # (n,) int32, where a particle is


class Lists(NamedTuple):
    """The places of all neighbours of place p: other[start[p]:start[p + 1]]."""

    particle: np.ndarray  # (n,) int32, who is at a place
    place: np.ndarray  # (n,) int32, where a particle is
    start: np.ndarray  # (n + 1,) int64
    other: np.ndarray  # (2 m,) int32


class Neighbours(NamedTuple):
    """Who may meet whom."""

    anchor: np.ndarray  # (n, 3) of each particle [m]
    leash: np.ndarray  # (n,) of each particle [m]
    lists: Lists
    later_start: np.ndarray  # (n + 1,) int64
    later: np.ndarray  # (m,) int32, the places of later neighbours of place p: later[later_start[p]:later_start[p + 1]]
    normal: np.ndarray  # (m, 3) float32, what separated these two when that was last looked into; 0 before. Hulls only


def places_of(position: np.ndarray, period: np.ndarray) -> Places:
    """Places along a space-filling curve for particles at ``position`` (n, 3)."""
    count = len(position)
    particle = spatial_order(position, period)
    place = np.empty(count, dtype=np.int32)
    place[particle] = np.arange(count, dtype=np.int32)
    return Places(particle, place)


@kernel
def _boxes(position, reach, particle, lower, upper, first, last):
    """Boxes of what particles at places ``first .. last`` can reach on their leashes."""
    for p in range(first, last):
        i = particle[p]
        for axis in range(3):
            lower[p, axis] = position[i, axis] - reach[i]
            upper[p, axis] = position[i, axis] + reach[i]


@kernel
def around_of(period):
    """Periods (3,) and their inverses, 0 on axes that do not wrap, as ``far_apart`` takes them."""
    return (
        (period[0], period[1], period[2]),
        (
            1.0 / period[0] if period[0] > 0.0 else 0.0,
            1.0 / period[1] if period[1] > 0.0 else 0.0,
            1.0 / period[2] if period[2] > 0.0 else 0.0,
        ),
    )


@kernel
def far_apart(ball, p, q, around):
    """Whether the balls of two places have no point in common."""
    period, inverse = around
    x, y, z = ball[q, 0] - ball[p, 0], ball[q, 1] - ball[p, 1], ball[q, 2] - ball[p, 2]
    x -= period[0] * np.rint(x * inverse[0])
    y -= period[1] * np.rint(y * inverse[1])
    z -= period[2] * np.rint(z * inverse[2])
    reach = ball[p, 3] + ball[q, 3]
    return x * x + y * y + z * z > reach * reach


@kernel
def _begin_of_row(pairs, k):
    """The first pair from ``k`` on whose first partner differs from that of the pair before."""
    while 0 < k < len(pairs) and pairs[k, 0] == pairs[k - 1, 0]:
        k += 1
    return k


@kernel
def _later(pairs, sphere, period, later_start, first, last):
    """Later neighbours among candidate pairs ``first .. last``, counted for each place into ``later_start[p + 1]``.

    Whole rows of pairs with the same first partner: those that begin in the range.
    """
    first, last = _begin_of_row(pairs, first), _begin_of_row(pairs, last)
    later = np.empty(last - first, dtype=np.int32)
    around = around_of(period)
    size = 0
    for k in range(first, last):
        p, q = pairs[k, 0], pairs[k, 1]
        if not far_apart(sphere, p, q, around):
            later[size] = q
            size += 1
            later_start[p + 1] += 1
    return later[:size]


@kernel
def _both_ways(later_start, later, start, other):
    """Write all neighbours of each place, unsorted, and where they begin into ``start``, which is 0 and longer by 2."""
    count = len(later_start) - 1
    for p in range(count):
        start[p + 2] += later_start[p + 1] - later_start[p]
        for k in range(later_start[p], later_start[p + 1]):
            start[later[k] + 2] += 1
    for k in range(2, count + 2):
        start[k] += start[k - 1]
    for p in range(count):
        for k in range(later_start[p], later_start[p + 1]):
            q = later[k]
            other[start[p + 1]] = q
            start[p + 1] += 1
            other[start[q + 1]] = p
            start[q + 1] += 1


@kernel
def _sort_rows(particle, start, other, first, last):
    """Sort the neighbours of places ``first .. last`` by their numbers, by insertion: they are few."""
    for p in range(first, last):
        for k in range(start[p] + 1, start[p + 1]):
            value = other[k]
            hole = k
            while hole > start[p] and particle[other[hole - 1]] > particle[value]:
                other[hole] = other[hole - 1]
                hole -= 1
            other[hole] = value


def _candidate_pairs(
    position: np.ndarray, reach: np.ndarray, period: np.ndarray, places: Places, find_pairs: FindPairs
) -> tuple[np.ndarray, int]:
    """Pairs of places whose boxes, of half widths ``reach`` (n,), overlap, and the number of boxes compared."""
    count = len(reach)
    lower, upper = np.empty((count, 3)), np.empty((count, 3))
    ThreadTeam(count).each(
        lambda _, first, last: _boxes(position, reach, places.particle, lower, upper, first, last), count
    )
    return find_pairs(lower, upper, period)


def _later_neighbours(
    position: np.ndarray, reach: np.ndarray, period: np.ndarray, places: Places, pairs: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Of the candidate pairs those whose spheres of radius ``reach`` overlap, as ``later_start`` and ``later``."""
    sphere = np.column_stack((position, reach))[places.particle]
    later_start = np.zeros(len(reach) + 1, dtype=np.int64)
    parts = ThreadTeam(len(pairs)).each(
        lambda _, first, last: _later(pairs, sphere, period, later_start, first, last), len(pairs)
    )
    return later_start.cumsum(), np.concatenate(parts)


def find_neighbours(
    position: np.ndarray,
    radius: np.ndarray,
    leash: np.ndarray,
    period: np.ndarray,
    places: Places,
    hulls: bool,
    find_pairs: FindPairs,
) -> tuple[Neighbours, int, int]:
    """Neighbours of particles at ``position`` (n, 3) on leashes (n,); boxes compared, and candidate pairs found.

    Without ``hulls`` among them no normals are kept.
    """
    reach = radius + leash
    pairs, tested = _candidate_pairs(position, reach, period, places, find_pairs)
    candidates = len(pairs)
    later_start, later = _later_neighbours(position, reach, period, places, pairs)
    del pairs
    start = np.zeros(len(radius) + 2, dtype=np.int64)
    other = np.empty(2 * len(later), dtype=np.int32)
    _both_ways(later_start, later, start, other)
    lists = Lists(*places, start[:-1], other)
    normal = np.zeros((len(later) if hulls else 0, 3), dtype=np.float32)
    return Neighbours(position.copy(), leash, lists, later_start, later, normal), tested, candidates


def in_order(neighbours: Neighbours) -> None:
    """Put the neighbours of each particle in the order of their numbers."""
    particle, _, start, other = neighbours.lists
    count = len(particle)
    ThreadTeam(count).each(lambda _, first, last: _sort_rows(particle, start, other, first, last), count)


def pairs_of(neighbours: Neighbours) -> np.ndarray:
    """All pairs of neighbours, (m, 2) int64, i < j."""
    earlier = np.repeat(neighbours.lists.particle, np.diff(neighbours.later_start))
    pairs = np.column_stack((earlier, neighbours.lists.particle[neighbours.later])).astype(np.int64)
    pairs.sort(axis=1)
    return pairs


@kernel
def leashes(radius, velocity, acceleration, duration, leash, first, last):
    """How long leashes must be for a path of ``duration``, straight or deflected, and a while after."""
    for i in range(first, last):
        way = (norm(load_vec3(velocity, i)) + norm(load_vec3(acceleration, i)) * duration) * duration
        leash[i] = VERLET_SKIN * radius[i] + 1.5 * way
