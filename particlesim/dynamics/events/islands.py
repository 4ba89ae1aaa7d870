"""Islands: particles whose impacts hang together. What happens in one does not touch the others.

Obstacles join nothing: two particles that strike the same wall are independent.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from particlesim.core.jit import entry_kernel, kernel, without_refcounts


class Islands(NamedTuple):
    """The members of island ``k`` are ``member[start[k]:start[k + 1]]``."""

    start: np.ndarray  # (k + 1,) int64
    member: np.ndarray  # (m,) int64


@kernel
def _root(clock, i):
    """The smallest particle of an island; on the way each particle is led there more directly."""
    while clock[i].island != i:
        clock[i].island = clock[clock[i].island].island
        i = clock[i].island
    return i


@entry_kernel
def _unite(clock, pairs, particles):
    """Join the islands of pairs of particles; ``clock.island`` leads from each to a smaller one or itself.

    (R. E. Tarjan, Journal of the ACM 22 (1975) 215-225.) ``next_in_island`` leads round the members of an island: two
    rings become one by an exchange of what follows two of their members.
    """
    clock, pairs = without_refcounts((clock, pairs))
    for k in range(len(pairs)):
        if pairs[k, 1] < particles:
            a, b = _root(clock, pairs[k, 0]), _root(clock, pairs[k, 1])
            if a != b:
                clock[max(a, b)].island = min(a, b)
                after = clock[a].next_in_island
                clock[a].next_in_island = clock[b].next_in_island
                clock[b].next_in_island = after


@entry_kernel
def _gather(clock, pairs):
    """The islands of the first of each pair, in the order of the pairs, and their members: (starts, members)."""
    clock, pairs = without_refcounts((clock, pairs))
    islands = members = 0
    for k in range(len(pairs)):
        root = _root(clock, pairs[k, 0])
        if not clock[root].listed:
            islands += 1
            i = root
            while not clock[i].listed:
                clock[i].listed = 1
                members += 1
                i = clock[i].next_in_island
    start, member = np.empty(islands + 1, dtype=np.int64), np.empty(members, dtype=np.int64)
    islands = members = 0
    for k in range(len(pairs)):
        root = _root(clock, pairs[k, 0])
        if clock[root].listed:
            start[islands] = members
            islands += 1
            i = root
            while clock[i].listed:
                clock[i].listed = 0
                clock[i].island = root
                member[members] = i
                members += 1
                i = clock[i].next_in_island
    start[islands] = members
    return start, member


def unite(clock: np.ndarray, pairs: np.ndarray, particles: int) -> Islands:
    """Join the islands of pairs (m, 2) that collide, and gather all that these concern."""
    _unite(clock, pairs, particles)
    return Islands(*_gather(clock, pairs))


@entry_kernel
def newly_touched(clock, pairs, particles):
    """Mark the particles of pairs as touched; those that were not marked, in the order of the pairs."""
    clock, pairs = without_refcounts((clock, pairs))
    new = np.empty(2 * len(pairs), dtype=np.int64)
    count = 0
    for k in range(len(pairs)):
        for side in range(2):
            i = pairs[k, side]
            if i < particles and not clock[i].touched:
                clock[i].touched = 1
                new[count] = i
                count += 1
    return new[:count]


@entry_kernel
def add_up(accumulator, clock, touched):
    """The sum over islands, in the order of ``touched``, of the rows of ``accumulator``, which become 0."""
    accumulator, clock, touched = without_refcounts((accumulator, clock, touched))
    total = np.zeros(accumulator.shape[1])
    for i in touched:
        for column in range(accumulator.shape[1]):
            if clock[i].island == i:
                total[column] += accumulator[i, column]
            accumulator[i, column] = 0.0
    return total
