"""Points in the order of a space-filling curve: what is near in space is near in memory."""

from __future__ import annotations

import numpy as np

from particlesim.broad_phase.aabb_statistics import aabb_statistics
from particlesim.broad_phase.aabb_test import Aabbs
from particlesim.broad_phase.morton import LEVELS, codes_of
from particlesim.broad_phase.octree_build import sort_by_code
from particlesim.core.parallel import ThreadTeam

# Points that lie together are sorted only roughly: as many fit the fastest cache.
_TOGETHER = 16


def spatial_order(position: np.ndarray, period: np.ndarray, threads: int | None = None) -> np.ndarray:
    """Numbers (n,) int32 of points in the order of Morton's curve (see ``morton``).

    Parameters
    ----------
    position : numpy.ndarray (n, 3) float64
        The points [m].
    period : numpy.ndarray (3,) float64
        Edges of a periodic world [m], 0 on axes that do not wrap.
    threads : int, optional
        Threads to sort with; the result does not depend on it.
    """
    numbers = np.arange(len(position), dtype=np.int32)
    if not len(position):
        return numbers
    team = ThreadTeam(len(position), threads)
    points = Aabbs(position, position, period)
    codes = codes_of(points, aabb_statistics(points, team), team)
    return sort_by_code(codes, numbers, _TOGETHER, LEVELS, team)[1]
