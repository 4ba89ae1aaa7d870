"""Who may meet whom for a while: neighbour lists that stay true as long as every particle is on its leash.

A particle's anchor is where it was when the lists were made; its leash says how far its centroid may get from there
before they have to be made anew. Two particles are neighbours if their bounding spheres could touch with both at the
ends of their leashes (L. Verlet, Physical Review 159 (1967) 98, whose leash is the same for all).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from particlesim.constants import LEASH
from particlesim.crew import Crew
from particlesim.jit import kernel
from particlesim.narrow_phase.pair import nearest_image
from particlesim.vec import dot, norm, row, sub

FindPairs = Callable[[np.ndarray, np.ndarray, np.ndarray], tuple[np.ndarray, int]]


class Neighbours(NamedTuple):
    """The neighbours of particle ``i`` are ``other[start[i]:start[i + 1]]``, in ascending order."""

    anchor: np.ndarray  # (n, 3) [m]
    leash: np.ndarray  # (n,) [m]
    start: np.ndarray  # (n + 1,) int64
    other: np.ndarray  # (2 m,) int32
    pairs: np.ndarray  # (m, 2) int64, candidate pairs i < j: whose boxes overlap, whether or not neighbours


@kernel
def _box(position, radius, leash, lower, upper, first, last):
    """Boxes of the places that particles can reach on their leashes."""
    for i in range(first, last):
        for axis in range(3):
            lower[i, axis] = position[i, axis] - radius[i] - leash[i]
            upper[i, axis] = position[i, axis] + radius[i] + leash[i]


@kernel
def _count(pairs, anchor, leash, radius, period, near, start):
    """Mark which candidate pairs are neighbours, and count those of each particle into ``start[i + 2]``."""
    for k in range(len(pairs)):
        i, j = pairs[k, 0], pairs[k, 1]
        offset = nearest_image(sub(row(anchor, j), row(anchor, i)), period)
        reach = radius[i] + radius[j] + leash[i] + leash[j]
        near[k] = dot(offset, offset) <= reach * reach
        if near[k]:
            start[i + 2] += 1
            start[j + 2] += 1
    for i in range(2, len(start)):
        start[i] += start[i - 1]


@kernel
def _fill(pairs, near, start, other):
    """Write the neighbours; ``start[i + 1]`` moves from the first of particle i to the first of the next.

    The pairs are sorted: first those that come before a particle reach it, in order, then those that come after.
    """
    for k in range(len(pairs)):
        if near[k]:
            j = pairs[k, 1]
            other[start[j + 1]] = pairs[k, 0]
            start[j + 1] += 1
    for k in range(len(pairs)):
        if near[k]:
            i = pairs[k, 0]
            other[start[i + 1]] = pairs[k, 1]
            start[i + 1] += 1


def find_neighbours(
    position: np.ndarray, radius: np.ndarray, leash: np.ndarray, period: np.ndarray, find_pairs: FindPairs
) -> tuple[Neighbours, int]:
    """Neighbours of particles at ``position`` (n, 3) on leashes (n,), and the number of boxes compared."""
    count = len(radius)
    lower, upper = np.empty((count, 3)), np.empty((count, 3))
    crew = Crew(count)
    crew.each(lambda _, first, last: _box(position, radius, leash, lower, upper, first, last), count)
    pairs, tested = find_pairs(lower, upper, period)
    near = np.empty(len(pairs), dtype=np.bool_)
    start = np.zeros(count + 2, dtype=np.int64)
    anchor = position.copy()
    _count(pairs, anchor, leash, radius, period, near, start)
    other = np.empty(start[-1], dtype=np.int32)
    _fill(pairs, near, start, other)
    return Neighbours(anchor, leash, start[:-1], other, pairs), tested


@kernel
def leashes(radius, velocity, acceleration, duration, leash, first, last):
    """How long leashes must be for a path of ``duration``, straight or deflected, and a while after."""
    for i in range(first, last):
        way = (norm(row(velocity, i)) + norm(row(acceleration, i)) * duration) * duration
        leash[i] = LEASH * radius[i] + 1.5 * way


@kernel
def time_on_leash(anchor, leash, position, velocity, acceleration, period, first, last):
    """For how long [s] particles ``first .. last`` certainly stay on their leashes, going straight on."""
    longest = np.inf
    for i in range(first, last):
        away = norm(nearest_image(sub(row(position, i), row(anchor, i)), period))
        room = leash[i] - away
        speed = norm(row(velocity, i))
        pull = norm(row(acceleration, i))
        # room = speed t + pull t^2 / 2
        denominator = speed + np.sqrt(speed * speed + 2.0 * pull * max(room, 0.0))
        if denominator > 0.0:
            longest = min(longest, 2.0 * max(room, 0.0) / denominator)
        elif room < 0.0:
            longest = 0.0
    return longest
