"""Where the AABBs are and how large: what grid and octree are laid out by."""

from __future__ import annotations

import numpy as np

from particlesim.broad_phase.aabb_test import SLACK, Aabbs
from particlesim.core.jit import entry_kernel, kernel
from particlesim.core.parallel import ThreadTeam
from particlesim.core.records import record

# The typical place and size are taken from this many AABBs, picked by multiples of a prime modulo their number:
# a pattern in the order of the particles does not matter.
SAMPLE = 64
_PRIME = 2654435761

# This many of the sample are left out at either end: one particle that has escaped to far away must not set the size
# of the cells of all.
_TAIL = 2

# AABBs looked at before the next axis is: 24 kB of corners.
_BLOCK = 512


STATISTICS = record(
    [
        ("region_lower", "f8", (3,)),  # most centres lie in the region; on a periodic axis it is 0 .. period [m]
        ("region_upper", "f8", (3,)),  # [m]
        ("widest", "f8", (3,)),  # the largest width of an AABB along each axis [m]
        ("slack", "f8", (3,)),  # bound on the rounding of coordinates [m]
        ("longest", "f8"),  # the longest edge of any AABB [m]
        ("typical", "f8"),  # the median of the longest edges, by the sample [m]
        ("scale", "f8"),  # one over the longest edge of the region [1/m]; 0 for a point
    ]
)


@kernel
def wrapped_centre(lower, upper, period):
    """Centre of an interval, on a periodic axis the image in 0 .. ``period``."""
    centre = 0.5 * (lower + upper)
    if period > 0.0:
        centre -= period * np.floor(centre / period)
    return centre


@entry_kernel
def _extremes(first, last, aabbs, result):
    """Rows of ``result`` (4, 3): -smallest and largest centre, largest width, largest absolute coordinate.

    On a periodic axis the centres are left out.  By blocks that stay in the fastest cache while the axes alternate.
    """
    lower, upper, period = aabbs
    result[0:2] = -np.inf
    result[2:4] = 0.0
    for block in range(first, last, _BLOCK):
        for axis in range(3):
            low = -result[0, axis]
            high = result[1, axis]
            widest = result[2, axis]
            largest = result[3, axis]
            wraps = period[axis] > 0.0
            for index in range(block, min(block + _BLOCK, last)):
                a = lower[index, axis]
                b = upper[index, axis]
                centre = 0.0 if wraps else 0.5 * (a + b)
                low = min(low, centre)
                high = max(high, centre)
                widest = max(widest, b - a)
                largest = max(largest, -a, b)
            result[0, axis] = -low
            result[1, axis] = high
            result[2, axis] = widest
            result[3, axis] = largest


@kernel
def _insert(sample, size, value):
    """Insert ``value`` into the sorted first ``size`` of ``sample``."""
    hole = size
    while hole > 0 and sample[hole - 1] > value:
        sample[hole] = sample[hole - 1]
        hole -= 1
    sample[hole] = value


@kernel
def _sample_centres(aabbs, axis, sample):
    """Centres along an axis of as many AABBs as ``sample`` is long, sorted."""
    lower, upper, period = aabbs
    count = lower.shape[0]
    for pick in range(sample.size):
        index = pick * _PRIME % count if count > SAMPLE else pick
        _insert(sample, pick, wrapped_centre(lower[index, axis], upper[index, axis], period[axis]))


@kernel
def _sample_edges(aabbs, sample):
    """Longest edges of the same AABBs, sorted."""
    lower, upper, _ = aabbs
    count = lower.shape[0]
    for pick in range(sample.size):
        index = pick * _PRIME % count if count > SAMPLE else pick
        width = 0.0
        for axis in range(3):
            width = max(width, upper[index, axis] - lower[index, axis])
        _insert(sample, pick, width)


@kernel
def _region_along(low, high, period, sample):
    """Where most centres are along an axis: those of the sample with a quarter more on either side, in the extremes."""
    if period > 0.0:
        return 0.0, period
    tail = _TAIL * sample.size // SAMPLE
    first, last = sample[tail], sample[sample.size - 1 - tail]
    margin = 0.25 * (last - first)
    if margin > 0.0:
        low = max(low, first - margin)
        high = min(high, last + margin)
    return low, high


@entry_kernel
def _summarise(aabbs, parts, statistics):
    """The statistics from the extremes of each thread's part (see ``_extremes``)."""
    result = statistics[0]
    for thread in range(1, parts.shape[0]):
        for row in range(4):
            for axis in range(3):
                parts[0, row, axis] = max(parts[0, row, axis], parts[thread, row, axis])
    sample = np.empty(min(aabbs.lower.shape[0], SAMPLE))
    edge = 0.0
    result.longest = 0.0
    for axis in range(3):
        period = aabbs.period[axis]
        _sample_centres(aabbs, axis, sample)
        low, high = _region_along(-parts[0, 0, axis], parts[0, 1, axis], period, sample)
        result.region_lower[axis] = low
        result.region_upper[axis] = high
        result.widest[axis] = parts[0, 2, axis]
        result.slack[axis] = SLACK * (parts[0, 3, axis] + period)
        result.longest = max(result.longest, result.widest[axis])
        edge = max(edge, high - low)
    result.scale = 1.0 / edge if edge > 1e-300 else 0.0
    _sample_edges(aabbs, sample)
    result.typical = sample[sample.size // 2]


def aabb_statistics(aabbs: Aabbs, team: ThreadTeam) -> np.ndarray:
    """``STATISTICS`` (1,) of all AABBs, one or more, which are looked at once."""
    parts = np.empty((team.threads, 4, 3))
    team.each(lambda thread, first, last: _extremes(first, last, aabbs, parts[thread]), len(aabbs.lower))
    statistics = np.empty(1, dtype=STATISTICS)
    _summarise(aabbs, parts, statistics)
    return statistics
