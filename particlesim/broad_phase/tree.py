"""The nodes of the octree over sorted codes, and the bounds of the boxes in each."""

from __future__ import annotations

import numpy as np

from particlesim.broad_phase.codes import CLASS_SHIFT, LEVELS
from particlesim.broad_phase.survey import wrapped_centre
from particlesim.crew import Crew
from particlesim.jit import kernel

# Columns of ``nodes`` (k, 4) int32: the range of boxes, the first child (the others follow it), how many; a leaf
# has none.  Node 0 is the root; children stand after their parents.
START, STOP, CHILD, CHILDREN = 0, 1, 2, 3


@kernel
def _split_shift(first_code, last_code, max_depth):
    """Bit from which codes differ at the highest level in a sorted range; -1 if nowhere above ``max_depth``.

    Levels at which a range is in one octant are passed over: they would be a chain of nodes with one child.
    """
    difference = first_code ^ last_code
    if difference >> CLASS_SHIFT:
        return CLASS_SHIFT
    for depth in range(1, max_depth + 1):
        shift = 3 * (LEVELS - depth)
        if difference >> shift:
            return shift
    return -1


@kernel
def _end_of_digit(codes, start, stop, shift):
    """First place after ``start`` whose code differs from the one there above ``shift``: a binary search."""
    digit = codes[start] >> shift
    low = start + 1
    while low < stop:
        middle = (low + stop) // 2
        if codes[middle] >> shift == digit:
            low = middle + 1
        else:
            stop = middle
    return low


@kernel
def _build(codes, max_count, max_depth, nodes):
    nodes[0, START] = 0
    nodes[0, STOP] = codes.size
    size = 1
    node = 0
    while node < size:
        start = nodes[node, START]
        stop = nodes[node, STOP]
        nodes[node, CHILDREN] = 0
        if stop - start > max_count:
            shift = _split_shift(codes[start], codes[stop - 1], max_depth)
            if shift >= 0:
                nodes[node, CHILD] = size
                while start < stop:
                    end = _end_of_digit(codes, start, stop, shift)
                    nodes[size, START] = start
                    nodes[size, STOP] = end
                    size += 1
                    start = end
                nodes[node, CHILDREN] = size - nodes[node, CHILD]
        node += 1
    return size


@kernel
def _fit_leaves(first, last, nodes, boxes, period, slack, bounds):
    for node in range(first, last):
        if nodes[node, CHILDREN] == 0:
            for axis in range(3):
                low = np.inf
                high = -np.inf
                for index in range(nodes[node, START], nodes[node, STOP]):
                    a = boxes[axis, index]
                    b = boxes[axis + 3, index]
                    if period[axis] > 0.0:
                        # The image whose centre is in the primary cell; its rounding is in the slack.
                        shift = wrapped_centre(a, b, period[axis]) - 0.5 * (a + b)
                        a += shift - slack[axis]
                        b += shift + slack[axis]
                    low = min(low, a)
                    high = max(high, b)
                bounds[node, axis] = low
                bounds[node, axis + 3] = high


@kernel
def _fit_parents(nodes, bounds):
    """From the last node to the root: children stand after their parents."""
    for node in range(nodes.shape[0] - 1, -1, -1):
        child = nodes[node, CHILD]
        for near in range(child, child + nodes[node, CHILDREN]):
            for axis in range(3):
                if near == child:
                    bounds[node, axis] = bounds[near, axis]
                    bounds[node, axis + 3] = bounds[near, axis + 3]
                else:
                    bounds[node, axis] = min(bounds[node, axis], bounds[near, axis])
                    bounds[node, axis + 3] = max(bounds[node, axis + 3], bounds[near, axis + 3])


def build(codes: np.ndarray, max_count: int, max_depth: int) -> np.ndarray:
    """Nodes (k, 4) int32 over sorted ``codes`` (n,) int64, n > 0: split while they hold more than ``max_count``.

    Depth is counted in octants; ``max_depth`` ends the splitting of particles that coincide.
    """
    # Every inner node has two children or more, so there are fewer than twice as many nodes as boxes.
    nodes = np.empty((2 * len(codes), 4), dtype=np.int32)
    return nodes[: _build(codes, max_count, max_depth, nodes)]


def fit(nodes: np.ndarray, boxes: np.ndarray, period: np.ndarray, slack: np.ndarray, crew: Crew) -> np.ndarray:
    """Bounds (k, 6) float64 of the boxes in each node; on a periodic axis of their images in the primary cell."""
    bounds = np.empty((len(nodes), 6))
    crew.each(lambda _, first, last: _fit_leaves(first, last, nodes, boxes, period, slack, bounds), len(nodes))
    _fit_parents(nodes, bounds)
    return bounds
