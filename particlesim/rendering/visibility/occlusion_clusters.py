"""Neighbours taken together: what hides the box about a group hides all of it, and is asked once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from particlesim.core.jit import kernel
from particlesim.core.parallel import ThreadTeam

# Particles of a group, about, where they are spread evenly.
_TOGETHER = 16

# The cells that make the groups lie between these shares of the particles on each axis; what is farther out, be it
# ever so far, belongs to the outermost.
_BULK = 0.02, 0.98

# So many particles tell where the cells are to be.
_SOME = 4096


class Groups(NamedTuple):
    """``members`` (n,) int64: the particles, group by group, of which k begins at ``start[k]``, (g + 1,) int64.

    ``balls`` (n, 4) float64: their centres and the radii of the spheres about them, in the same order [m]; ``lower``
    and ``upper`` (g, 3): corners of the box about each group's spheres [m].
    """

    members: np.ndarray
    start: np.ndarray
    balls: np.ndarray
    lower: np.ndarray
    upper: np.ndarray


def grouped(position: np.ndarray, outer: np.ndarray) -> Groups:
    """Groups of particles at ``position`` (n, 3) within spheres of radius ``outer`` (n,) [m], all float64.

    They depend on no number of threads; within a group particles are in the order of their numbers.
    """
    count = len(position)
    first, edge, shape = _cells(position)
    crew = ThreadTeam(count)
    cell = np.empty(count, dtype=np.int32)
    inside = crew.each(lambda _, low, high: _cell_of_each(position, first, edge, shape, cell, low, high), count)
    # In a cell the particles of an earlier range come first.
    total = np.sum(inside, axis=0)
    place = np.cumsum(total) - total + np.cumsum(inside, axis=0) - inside
    members = np.empty(count, dtype=np.int64)
    crew.each(lambda block, low, high: _sort(cell, place[block], members, low, high), count)
    start = np.append(0, np.cumsum(total[total > 0]))
    groups = Groups(members, start, np.empty((count, 4)), *np.empty((2, len(start) - 1, 3)))
    crew.each(lambda _, low, high: _surround(position, outer, groups, low, high), len(start) - 1)
    return groups


def _cells(position: np.ndarray) -> tuple[np.ndarray, float, np.ndarray]:
    """Cells that hold groups: their lowest corner (3,), edge [m], and how many they are along each axis (3,)."""
    some = position[:: max(1, len(position) // _SOME)]
    low, high = np.quantile(some, _BULK, axis=0) if len(some) else np.zeros((2, 3))
    width = np.maximum(high - low, 1e-3 * (high - low).max() or 1.0)
    edge = float(np.prod(width) * _TOGETHER / max(len(position), _TOGETHER)) ** (1.0 / 3.0)
    return low, edge, np.ceil(width / edge).astype(np.int64)


@kernel
def _cell_of_each(position, first, edge, shape, cell, low, high):
    """Write the number of each particle's cell; returns how many are in each cell."""
    inside = np.zeros(shape[0] * shape[1] * shape[2], dtype=np.int64)
    for i in range(low, high):
        number = 0
        for axis in (2, 1, 0):
            along = (position[i, axis] - first[axis]) / edge
            number = number * shape[axis] + int(min(max(along, 0.0), shape[axis] - 1.0))
        cell[i] = number
        inside[number] += 1
    return inside


@kernel
def _sort(cell, place, members, low, high):
    for i in range(low, high):
        members[place[cell[i]]] = i
        place[cell[i]] += 1


@kernel
def _surround(position, outer, groups, low, high):
    for group in range(low, high):
        for axis in range(3):
            groups.lower[group, axis], groups.upper[group, axis] = np.inf, -np.inf
        for k in range(groups.start[group], groups.start[group + 1]):
            i = groups.members[k]
            groups.balls[k, 3] = outer[i]
            for axis in range(3):
                groups.balls[k, axis] = position[i, axis]
                groups.lower[group, axis] = min(groups.lower[group, axis], position[i, axis] - outer[i])
                groups.upper[group, axis] = max(groups.upper[group, axis], position[i, axis] + outer[i])
