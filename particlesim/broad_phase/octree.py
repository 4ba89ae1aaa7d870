"""The octree: nodes split into eight where many particles are, and tests between leaves that overlap.

S. Goodwin, "Analysis of Efficient Collision Detection using Pre-Processing Data Structures", section III: a node is
split while it holds more than ``max_count`` particles.  There, a particle on the border of two leaves is missed or
is in both; here each belongs to the node of its centre, every node has the bounds of the boxes in it, and a leaf
is searched against the leaves before it whose bounds overlap its own, so that each pair of boxes is met once.
"""

from __future__ import annotations

import itertools

import numpy as np

from particlesim.broad_phase.aabb_statistics import Survey, survey
from particlesim.broad_phase.aabb_test import BATCH, any_wraps, append_overlaps, collect
from particlesim.broad_phase.morton import LEVELS, codes_of
from particlesim.broad_phase.octree_build import CHILD, CHILDREN, START, STOP, build, fit, in_order, sort_by_code
from particlesim.broad_phase.pair_sort import canonical
from particlesim.broad_phase.soa_aabb import LANES, child_bits, column_of, lowest, may_overlap, overlap_bits
from particlesim.core.jit import kernel
from particlesim.core.parallel import ThreadTeam

# Boxes near a leaf that are listed before all boxes of the leaf are tested against them: 24 kB of columns.
_LIST = 1024

# Own boxes of a leaf listed at once, with those near it.
_OWN = 256

# Nodes that wait to be looked into: each step down leaves at most seven beside the one that is taken, and the size
# classes are one step.
_STACK = 8 * (LEVELS + 3)

# Rounding of float32 coordinates and of their sums: four units in the last place.
_ROUNDING = 2.0**-22

# Where no axis is periodic.
_NO_SHIFT = np.zeros((1, 3), dtype=np.float32)
_NO_MARGIN = np.zeros(3, dtype=np.float32)


@kernel
def _moved(box, shift, margin):
    """The image of a box a ``shift`` away, with a ``margin`` all around for the rounding."""
    return (
        box[0] + shift[0] - margin[0], box[1] + shift[1] - margin[1], box[2] + shift[2] - margin[2],
        box[3] + shift[0] + margin[0], box[4] + shift[1] + margin[1], box[5] + shift[2] + margin[2],
    )  # fmt: skip


@kernel
def _find_near(leaf, box, nodes, bounds, stack, ranges):
    """Ranges of the leaves before ``leaf`` whose bounds may overlap ``box``, into rows of ``ranges``; how many."""
    own = nodes[leaf, START]
    stack[0] = 0
    size = np.uint64(nodes[0, CHILDREN] > 0)
    found = np.uint64(0)
    while size > np.uint64(0):
        size -= np.uint64(1)
        node = np.uint64(stack[size])
        child = np.uint64(nodes[node, CHILD])
        bits = child_bits(bounds, child, box) & ((1 << nodes[node, CHILDREN]) - 1)
        while bits:
            near = child + lowest(bits)
            bits &= bits - 1
            if nodes[near, START] < own:
                if nodes[near, CHILDREN] > 0:
                    stack[size] = near
                    size += np.uint64(1)
                else:
                    ranges[found, 0] = nodes[near, START]
                    ranges[found, 1] = nodes[near, STOP]
                    found += np.uint64(1)
    return np.int64(found)


@kernel
def _list_near(ranges, slot, number, box, columns, near, places):
    """List the columns in ``ranges`` from row ``slot`` on that may overlap ``box``, until the list is full.

    Returns the row it has come to, which then starts where the list ends, and the length of the list.
    """
    size = np.uint64(0)
    while slot < number:
        base = int(ranges[slot, 0])
        stop = int(ranges[slot, 1])
        while base < stop:
            if size > np.uint64(_LIST - LANES):
                ranges[slot, 0] = base
                return slot, np.int64(size)
            bits = overlap_bits(columns, np.uint64(base), box) & ((1 << min(LANES, stop - base)) - 1)
            while bits:
                place = np.uint64(base) + lowest(bits)
                bits &= bits - 1
                for row in range(6):
                    near[row, size] = columns[row, place]
                places[size] = place
                size += np.uint64(1)
            base += LANES
        slot += 1
    return slot, np.int64(size)


@kernel
def _list_own(first, last, columns, near, places, size):
    """Add the columns ``first .. last`` to the list."""
    slot = np.uint64(size)
    for place in range(first, last):
        for row in range(6):
            near[row, slot] = columns[row, place]
        places[slot] = place
        slot += np.uint64(1)


@kernel
def _test_list(
    first, last, before, own, near, places, shift, margin,
    columns, boxes, order, period, wraps, candidates, size, keys, found,
):  # fmt: skip
    """Test boxes ``first .. last`` against the first ``before`` of a list, which ``own`` of themselves follow.

    Box ``first + k`` is tested against the first k of its own.  Candidates now waiting, pairs found, tests made.
    """
    tested = 0
    for index in range(first, last):
        box = _moved(column_of(columns, index), shift, margin)
        number = before + min(index - first, own)
        tested += number
        for base in range(0, number, LANES):
            bits = overlap_bits(near, np.uint64(base), box) & ((1 << min(LANES, number - base)) - 1)
            while bits:
                candidates[0, size] = index
                candidates[1, size] = places[np.uint64(base) + lowest(bits)]
                bits &= bits - 1
                size += 1
            if size > BATCH - LANES:
                found = append_overlaps(candidates, size, boxes, order, period, wraps, keys, found)
                size = 0
    return size, found, tested


@kernel
def _search(first, last, leaves, nodes, bounds, columns, boxes, order, shifts, margin, period, keys):
    """Pairs within the leaves ``first .. last`` and between them and the leaves before them: (found, tested)."""
    wraps = any_wraps(period)
    stack = np.empty(_STACK, dtype=np.uint32)
    ranges = np.empty((leaves.size, 2), dtype=np.int32)
    near = np.zeros((6, _LIST + _OWN + LANES), dtype=np.float32)
    places = np.empty(_LIST + _OWN + LANES, dtype=np.uint32)
    candidates = np.empty((2, BATCH), dtype=np.uint32)
    waiting = 0
    found = 0
    tested = 0
    for number in range(first, last):
        leaf = leaves[number]
        start = int(nodes[leaf, START])
        stop = int(nodes[leaf, STOP])
        for image in range(shifts.shape[0]):
            shift = (shifts[image, 0], shifts[image, 1], shifts[image, 2])
            reach = (margin[0], margin[1], margin[2])
            box = _moved(column_of(bounds, leaf), shift, reach)
            if not may_overlap(box, column_of(bounds, 0)):
                continue
            near_ranges = _find_near(leaf, box, nodes, bounds, stack, ranges)
            slot, size = _list_near(ranges, 0, near_ranges, box, columns, near, places)
            while slot < near_ranges:
                waiting, found, tests = _test_list(
                    start, stop, size, 0, near, places, shift, reach,
                    columns, boxes, order, period, wraps, candidates, waiting, keys, found,
                )  # fmt: skip
                tested += tests
                slot, size = _list_near(ranges, slot, near_ranges, box, columns, near, places)
            if size == 0 and not may_overlap(box, column_of(bounds, leaf)):
                continue  # an image that does not meet its own
            for base in range(start, stop, _OWN):
                end = min(base + _OWN, stop)
                _list_own(base, end, columns, near, places, size)
                waiting, found, tests = _test_list(
                    base, stop, size, end - base, near, places, shift, reach,
                    columns, boxes, order, period, wraps, candidates, waiting, keys, found,
                )  # fmt: skip
                tested += tests
                size = 0
    return append_overlaps(candidates, waiting, boxes, order, period, wraps, keys, found), tested


def _images(period: np.ndarray, seen: Survey, scale: float) -> tuple[np.ndarray, np.ndarray]:
    """Shifts (k, 3) to all images that can be nearest, none first, and the margin (3,) for rounding; in columns."""
    if not period.any():
        return _NO_SHIFT, _NO_MARGIN
    axes = [(0.0, length, -length) if length > 0.0 else (0.0,) for length in (scale * period).tolist()]
    shifts = np.array(list(itertools.product(*axes)), dtype=np.float32)
    margin = scale * np.where(period > 0.0, _ROUNDING * (2.0 * period + seen.widest) + seen.slack, 0.0)
    return shifts, margin.astype(np.float32)


def _candidates(
    lower: np.ndarray, upper: np.ndarray, period: np.ndarray, max_count: int, max_depth: int, crew: ThreadTeam
) -> tuple[list[np.ndarray], int, bool]:
    """Lists of pairs of boxes that overlap, the number of box tests, and whether a pair may be there more than once."""
    count = len(lower)
    seen = survey(lower, upper, period, crew)
    edge = float((seen.region_upper - seen.region_lower).max())
    scale = 1.0 / edge if edge > 1e-300 else 0.0  # to the unit cube
    codes, order = sort_by_code(
        codes_of(lower, upper, period, seen, scale, crew),
        np.arange(count, dtype=np.int32),
        max_count,
        max_depth,
        crew,
    )
    boxes, columns = in_order(lower, upper, order, period, seen, scale, crew)
    nodes = build(codes, max_count, max_depth)
    bounds = fit(nodes, columns, crew)
    leaves = np.flatnonzero(nodes[:, CHILDREN] == 0).astype(np.int32)
    shifts, margin = _images(period, seen, scale)

    def search(first: int, last: int, keys: np.ndarray) -> tuple[int, int]:
        return _search(first, last, leaves, nodes, bounds, columns, boxes, order, shifts, margin, period, keys)

    lists, tested = collect(search, len(leaves), crew, 2 * count)
    return lists, tested, len(shifts) > 1


def octree_pairs(
    lower: np.ndarray, upper: np.ndarray, period: np.ndarray, max_count: int = 32, max_depth: int = 16
) -> tuple[np.ndarray, int]:
    """Pairs (m, 2) int64 and the number of box tests.  Arguments as checked by ``find_pairs``.

    A node is split while it holds more than ``max_count`` boxes, down to ``max_depth`` levels of octants of the cube
    about most of the particles; octants that hold no more together stay together.  Boxes of very different sizes are
    in trees of their own (``codes.size_class``), which are the first children of the root.

    Raises ``ValueError`` for ``max_count`` below 1 or ``max_depth`` outside 1 .. 20.
    """
    if max_count < 1:
        raise ValueError(f"octree: max_count must be at least 1, got {max_count}")
    if not 1 <= max_depth <= LEVELS:
        raise ValueError(f"octree: max_depth must be in 1 .. {LEVELS}, got {max_depth}")
    count = len(lower)
    if count == 0:
        return np.empty((0, 2), dtype=np.int64), 0
    crew = ThreadTeam(count)
    # What the search needs is given back before the pairs are sorted: that takes the most memory of all.
    lists, tested, unique = _candidates(lower, upper, period, max_count, max_depth, crew)
    return canonical(lists, count, crew, unique=unique), tested
