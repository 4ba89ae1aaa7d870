"""Neighbouring instances in clusters: what hides the AABB of a cluster hides all of it, and is tested once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from particlesim.core.jit import entry_kernel
from particlesim.core.parallel import ThreadTeam

# Instances in a cluster, about, where they are spread evenly: more are hidden less often, fewer take more tests.
_CLUSTER_SIZE = 16

# The cells that make the clusters lie between these quantiles of the positions on each axis; what is farther out, be
# it ever so far, belongs to the outermost.
_BULK = 0.02, 0.98

# So many positions are enough to place the cells.
_SAMPLE = 4096


class OcclusionClusters(NamedTuple):
    """Instances, cluster by cluster.

    Parameters
    ----------
    indices : (n,) int64
        The instances; cluster c has those from ``start[c]`` to ``start[c + 1]``, in the order of their numbers.
    start : (c + 1,) int64
    sphere : (n, 4) float64
        Centre and radius of the sphere about each, in the order of ``indices`` [m].
    lower, upper : (c, 3) float64
        Corners of the AABB of each cluster's spheres [m].
    """

    indices: np.ndarray
    start: np.ndarray
    sphere: np.ndarray
    lower: np.ndarray
    upper: np.ndarray


def occlusion_clusters(position: np.ndarray, radius: np.ndarray) -> OcclusionClusters:
    """Clusters of spheres; they do not depend on the number of threads.

    Parameters
    ----------
    position : (n, 3) float64
        Centres [m].
    radius : (n,) float64
        Radii [m].
    """
    count = len(position)
    first, edge, shape = _cells(position)
    team = ThreadTeam(count)
    cell = np.empty(count, dtype=np.int32)
    inside = team.each(lambda _, low, high: _cell_of_each(position, first, edge, shape, cell, low, high), count)
    # In a cell the instances of an earlier range come first.
    total = np.sum(inside, axis=0)
    place = np.cumsum(total) - total + np.cumsum(inside, axis=0) - inside
    indices = np.empty(count, dtype=np.int64)
    team.each(lambda block, low, high: _sort(cell, place[block], indices, low, high), count)
    start = np.append(0, np.cumsum(total[total > 0]))
    clusters = OcclusionClusters(indices, start, np.empty((count, 4)), *np.empty((2, len(start) - 1, 3)))
    team.each(lambda _, low, high: _bound(position, radius, clusters, low, high), len(start) - 1)
    return clusters


def _cells(position: np.ndarray) -> tuple[np.ndarray, float, np.ndarray]:
    """Cells that hold clusters: their lowest corner (3,), edge [m], and how many they are along each axis (3,)."""
    some = position[:: max(1, len(position) // _SAMPLE)]
    low, high = np.quantile(some, _BULK, axis=0) if len(some) else np.zeros((2, 3))
    width = np.maximum(high - low, 1e-3 * (high - low).max() or 1.0)
    edge = float(np.prod(width) * _CLUSTER_SIZE / max(len(position), _CLUSTER_SIZE)) ** (1.0 / 3.0)
    return low, edge, np.ceil(width / edge).astype(np.int64)


@entry_kernel
def _cell_of_each(position, first, edge, shape, cell, low, high):
    """Write the number of each instance's cell; returns how many are in each cell."""
    inside = np.zeros(shape[0] * shape[1] * shape[2], dtype=np.int64)
    for i in range(low, high):
        number = 0
        for axis in (2, 1, 0):
            along = (position[i, axis] - first[axis]) / edge
            number = number * shape[axis] + int(min(max(along, 0.0), shape[axis] - 1.0))
        cell[i] = number
        inside[number] += 1
    return inside


@entry_kernel
def _sort(cell, place, indices, low, high):
    for i in range(low, high):
        indices[place[cell[i]]] = i
        place[cell[i]] += 1


@entry_kernel
def _bound(position, radius, clusters, low, high):
    """Fill in the spheres and AABBs of some clusters."""
    for c in range(low, high):
        for axis in range(3):
            clusters.lower[c, axis], clusters.upper[c, axis] = np.inf, -np.inf
        for k in range(clusters.start[c], clusters.start[c + 1]):
            i = clusters.indices[k]
            clusters.sphere[k, 3] = radius[i]
            for axis in range(3):
                clusters.sphere[k, axis] = position[i, axis]
                clusters.lower[c, axis] = min(clusters.lower[c, axis], position[i, axis] - radius[i])
                clusters.upper[c, axis] = max(clusters.upper[c, axis], position[i, axis] + radius[i])
