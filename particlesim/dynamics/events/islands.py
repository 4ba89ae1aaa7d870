"""Islands: particles whose impacts hang together. What happens in one does not touch the others."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from particlesim.core.jit import kernel
from particlesim.dynamics.events.paths import Course


class Islands(NamedTuple):
    """The members of island ``k`` are ``member[start[k]:start[k + 1]]``."""

    start: np.ndarray  # (k + 1,) int64
    member: np.ndarray  # (m,) int64


@kernel
def _island_of(island, i):
    """The smallest particle of an island; on the way each particle is led there more directly."""
    while island[i] != i:
        island[i] = island[island[i]]
        i = island[i]
    return i


@kernel
def _unite(island, ring, met):
    """Join the islands of particles that meet; ``island`` (n,) leads from each to a smaller one or itself.

    (R. E. Tarjan, Journal of the ACM 22 (1975) 215-225.) ``ring`` leads round the members of an island: two rings
    become one by an exchange of what follows two of their members.
    """
    for k in range(len(met)):
        i, j = met[k, 0], met[k, 1]
        if j >= 0:
            a, b = _island_of(island, i), _island_of(island, j)
            if a != b:
                island[max(a, b)] = min(a, b)
                ring[a], ring[b] = ring[b], ring[a]


@kernel
def _gather(island, ring, listed, met):
    """The islands of the first partners of pairs, in the order of the pairs, and their members: (starts, members)."""
    islands = members = 0
    for k in range(len(met)):
        root = _island_of(island, met[k, 0])
        if not listed[root]:
            islands += 1
            i = root
            while not listed[i]:
                listed[i] = True
                members += 1
                i = ring[i]
    start, member = np.empty(islands + 1, dtype=np.int64), np.empty(members, dtype=np.int64)
    islands = members = 0
    for k in range(len(met)):
        root = _island_of(island, met[k, 0])
        if listed[root]:
            start[islands] = members
            islands += 1
            i = root
            while listed[i]:
                listed[i] = False
                island[i] = root
                member[members] = i
                members += 1
                i = ring[i]
    start[islands] = members
    return start, member


def unite(course: Course, met: np.ndarray) -> Islands:
    """Join the islands of pairs (m, 2) that meet, and gather all that these concern."""
    _unite(course.island, course.ring, met)
    return Islands(*_gather(course.island, course.ring, course.listed, met))


@kernel
def newly_touched(touched, met):
    """Mark the particles of pairs in ``touched`` (n,) bool; those that were not marked, in the order of the pairs."""
    new = np.empty(2 * len(met), dtype=np.int64)
    count = 0
    for k in range(len(met)):
        for side in range(2):
            i = met[k, side]
            if i >= 0 and not touched[i]:
                touched[i] = True
                new[count] = i
                count += 1
    return new[:count]


@kernel
def add_up(tally, island, touched):
    """The sum over islands, in the order of the particles ``touched``, of the rows of ``tally``, which become 0."""
    total = np.zeros(tally.shape[1])
    for i in touched:
        for column in range(tally.shape[1]):
            if island[i] == i:
                total[column] += tally[i, column]
            tally[i, column] = 0.0
    return total
