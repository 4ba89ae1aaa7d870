"""Where the boxes are and how large: what grid and octree are laid out by."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from particlesim.broad_phase.aabb_test import SLACK
from particlesim.core.jit import kernel
from particlesim.core.parallel import ThreadTeam

# The typical place and size are taken from this many boxes, picked by multiples of a prime modulo the number of
# boxes: no pattern in the order of the particles is met in step.
SAMPLE = 64
_PRIME = 2654435761

# This many of the sample are left out at either end: one particle that has escaped to far away must not set the size
# of the cells of all.
_TAIL = 2

# Boxes looked at before the next axis is: 24 kB of corners.
_BLOCK = 512


class Survey(NamedTuple):
    """Each (3,) float64 [m], and ``typical`` a float [m]."""

    region_lower: np.ndarray  # most centres lie in the region; on a periodic axis it is 0 .. period
    region_upper: np.ndarray
    widest: np.ndarray  # the largest width of a box along each axis
    slack: np.ndarray  # bound on the rounding of coordinates
    typical: float  # the median of the boxes' longest edges, by the sample


@kernel
def wrapped_centre(lower, upper, period):
    """Centre of an interval, on a periodic axis the image in 0 .. ``period``."""
    centre = 0.5 * (lower + upper)
    if period > 0.0:
        centre -= period * np.floor(centre / period)
    return centre


@kernel
def _extremes(first, last, lower, upper, period, result):
    """Rows of ``result`` (4, 3): -smallest and largest centre, largest width, largest absolute coordinate.

    On a periodic axis the centres are left out.  By blocks that stay in the fastest cache while the axes take turns.
    """
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
def _typical(lower, upper, period, result):
    """``result`` (3, 3): where most centres start, and end; the median longest edge in all of row 2."""
    count = lower.shape[0]
    size = min(count, SAMPLE)
    tail = _TAIL * size // SAMPLE
    sample = np.empty(size)
    for axis in range(3):
        for turn in range(size):
            index = turn * _PRIME % count if count > SAMPLE else turn
            _insert(sample, turn, wrapped_centre(lower[index, axis], upper[index, axis], period[axis]))
        result[0, axis] = sample[tail]
        result[1, axis] = sample[size - 1 - tail]
    for turn in range(size):
        index = turn * _PRIME % count if count > SAMPLE else turn
        width = 0.0
        for axis in range(3):
            width = max(width, upper[index, axis] - lower[index, axis])
        _insert(sample, turn, width)
    result[2, :] = sample[size // 2]


@kernel
def _region(extremes, typical, period, region):
    """``region`` (2, 3): the typical centres with a quarter more on either side, inside the extremes."""
    for axis in range(3):
        low = -extremes[0, axis]
        high = extremes[1, axis]
        if period[axis] > 0.0:
            low = 0.0
            high = period[axis]
        else:
            margin = 0.25 * (typical[1, axis] - typical[0, axis])
            if margin > 0.0:
                low = max(low, typical[0, axis] - margin)
                high = min(high, typical[1, axis] + margin)
        region[0, axis] = low
        region[1, axis] = high


def survey(lower: np.ndarray, upper: np.ndarray, period: np.ndarray, crew: ThreadTeam) -> Survey:
    """Look at all boxes once.  ``lower``, ``upper`` (n, 3) float64 [m], n > 0; ``period`` (3,) [m]."""
    parts = np.empty((crew.threads, 4, 3))
    crew.each(lambda thread, a, b: _extremes(a, b, lower, upper, period, parts[thread]), len(lower))
    extremes = parts.max(axis=0)
    typical, region = np.empty((3, 3)), np.empty((2, 3))
    _typical(lower, upper, period, typical)
    _region(extremes, typical, period, region)
    return Survey(region[0], region[1], extremes[2], SLACK * (extremes[3] + period), typical[2, 0])
