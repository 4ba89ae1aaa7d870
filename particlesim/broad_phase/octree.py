"""The octree: nodes split into eight where many particles are, and tests between leaves that overlap.

S. Goodwin, "Analysis of Efficient Collision Detection using Pre-Processing Data Structures", section III: a node is
split while it holds more than ``max_count`` particles.  There, a particle on the border of two leaves is missed or
is in both; here each belongs to the node of its centre, every node has the bounds of the boxes in it, and leaves
are searched in pairs whose bounds overlap, so that each pair of boxes is met once.
"""

from __future__ import annotations

import numpy as np

from particlesim.broad_phase.codes import CODE_BITS, LEVELS, fill_codes
from particlesim.broad_phase.counting import radix_sort
from particlesim.broad_phase.pairs import (
    any_wraps,
    append_overlaps,
    box_of,
    boxes_overlap,
    canonical,
    collect,
    column_of,
    gathered,
)
from particlesim.broad_phase.survey import Survey, survey
from particlesim.broad_phase.tree import CHILD, CHILDREN, START, STOP, build, fit
from particlesim.crew import ALONE, Crew
from particlesim.jit import kernel

# A search of many boxes is shared out by subtrees that hold at most this part of all: up to eight times as many, each
# tested against each.
SUBTREES = 64

# Pairs of nodes that wait.  Splitting a node against itself adds at most 36 pairs, once 36 more for the classes,
# splitting one of two adds 8, and the depth is at most LEVELS + 1 for each: 21 * 36 + 42 * 8 at most.
_STACK = 2048

# Levels sorted beyond those that uniform particles need, before it is looked whether more are needed.
_SPARE_LEVELS = 2


@kernel
def _search_leaf(node, nodes, boxes, order, period, wraps, keys, found):
    stop = nodes[node, STOP]
    tested = 0
    for index in range(nodes[node, START], stop):
        tested += stop - index - 1
        found = append_overlaps(boxes, order, index, index + 1, stop, period, wraps, keys, found)
    return found, tested


@kernel
def _search_leaves(a, b, nodes, bounds, boxes, order, period, wraps, keys, found):
    start = nodes[b, START]
    stop = nodes[b, STOP]
    bound = box_of(bounds, b)
    tested = 0
    for index in range(nodes[a, START], nodes[a, STOP]):
        if boxes_overlap(column_of(boxes, index), bound, period, wraps):
            tested += stop - start
            found = append_overlaps(boxes, order, index, start, stop, period, wraps, keys, found)
    return found, tested


@kernel
def _push_children(node, nodes, bounds, period, wraps, stack, size):
    """Each child with itself and with each later one whose bounds overlap its own."""
    child = nodes[node, CHILD]
    end = child + nodes[node, CHILDREN]
    for a in range(child, end):
        bound = box_of(bounds, a)
        for b in range(a, end):
            if a == b or boxes_overlap(bound, box_of(bounds, b), period, wraps):
                stack[size, 0] = a
                stack[size, 1] = b
                size += 1
    return size


@kernel
def _push_against(node, other, nodes, bounds, period, wraps, stack, size):
    """Each child of ``node`` that overlaps ``other``."""
    child = nodes[node, CHILD]
    bound = box_of(bounds, other)
    for a in range(child, child + nodes[node, CHILDREN]):
        if boxes_overlap(box_of(bounds, a), bound, period, wraps):
            stack[size, 0] = a
            stack[size, 1] = other
            size += 1
    return size


@kernel
def _longest_edge(bounds, node):
    return max(
        bounds[node, 3] - bounds[node, 0],
        bounds[node, 4] - bounds[node, 1],
        bounds[node, 5] - bounds[node, 2],
    )


@kernel
def _search_pair(a, b, nodes, bounds, boxes, order, period, wraps, stack, keys, found):
    """Overlaps between boxes in nodes a and b, or within a if b is a; of two nodes the longer is split first."""
    tested = 0
    stack[0, 0] = a
    stack[0, 1] = b
    size = 1
    while size > 0:
        size -= 1
        a = stack[size, 0]
        b = stack[size, 1]
        inner_a = nodes[a, CHILDREN] > 0
        inner_b = nodes[b, CHILDREN] > 0
        if a == b and inner_a:
            size = _push_children(a, nodes, bounds, period, wraps, stack, size)
        elif a == b:
            found, tests = _search_leaf(a, nodes, boxes, order, period, wraps, keys, found)
            tested += tests
        elif inner_a and (not inner_b or _longest_edge(bounds, a) >= _longest_edge(bounds, b)):
            size = _push_against(a, b, nodes, bounds, period, wraps, stack, size)
        elif inner_b:
            size = _push_against(b, a, nodes, bounds, period, wraps, stack, size)
        else:
            found, tests = _search_leaves(a, b, nodes, bounds, boxes, order, period, wraps, keys, found)
            tested += tests
    return found, tested


@kernel
def _search(first, last, subtrees, nodes, bounds, boxes, order, period, keys):
    """Pairs within subtrees ``first .. last`` and between them and all later ones: (found, tested)."""
    wraps = any_wraps(period)
    stack = np.empty((_STACK, 2), dtype=np.int64)
    found = 0
    tested = 0
    for one in range(first, last):
        a = subtrees[one]
        bound = box_of(bounds, a)
        for other in range(one, subtrees.size):
            b = subtrees[other]
            if a == b or boxes_overlap(bound, box_of(bounds, b), period, wraps):
                found, tests = _search_pair(a, b, nodes, bounds, boxes, order, period, wraps, stack, keys, found)
                tested += tests
    return found, tested


@kernel
def _subtrees(nodes, limit, roots):
    """Largest nodes that hold at most ``limit`` boxes, or are leaves, into ``roots``; their number."""
    if nodes[0, STOP] <= limit or nodes[0, CHILDREN] == 0:
        roots[0] = 0
        return 1
    size = 0
    for node in range(nodes.shape[0]):
        if nodes[node, STOP] - nodes[node, START] > limit:
            child = nodes[node, CHILD]
            for near in range(child, child + nodes[node, CHILDREN]):
                if nodes[near, STOP] - nodes[near, START] <= limit or nodes[near, CHILDREN] == 0:
                    roots[size] = near
                    size += 1
    return size


@kernel
def _longest_run(codes, shift):
    """Most codes that are equal above ``shift``, which sorted codes have in a row."""
    longest = 0
    start = 0
    for index in range(1, codes.size + 1):
        if index == codes.size or codes[index] >> shift != codes[start] >> shift:
            longest = max(longest, index - start)
            start = index
    return longest


def _sorted_codes(
    codes: np.ndarray, order: np.ndarray, max_count: int, max_depth: int, crew: Crew
) -> tuple[np.ndarray, np.ndarray, int]:
    """Codes and order, sorted by as many levels as the splitting needs, and this depth.

    Uniform particles need few of the levels that a code has, and sorting by all takes three times as long.
    """
    depth = _SPARE_LEVELS
    while depth < max_depth and 8 ** (depth - _SPARE_LEVELS) * max_count < len(codes):
        depth += 1
    result = radix_sort(codes, order, 3 * (LEVELS - depth), CODE_BITS, crew)
    if depth < max_depth and _longest_run(result[0], 3 * (LEVELS - depth)) > max_count:
        depth = max_depth
        result = radix_sort(codes, order, 3 * (LEVELS - depth), CODE_BITS, crew)
    return *result, min(depth, max_depth)


def _codes(
    lower: np.ndarray, upper: np.ndarray, period: np.ndarray, seen: Survey, crew: Crew
) -> tuple[np.ndarray, np.ndarray]:
    """The code of each box in the cube about the region of most centres, and the numbers of the boxes."""
    count = len(lower)
    codes, order = np.empty(count, dtype=np.int64), np.empty(count, dtype=np.int32)
    edge = float((seen.region_upper - seen.region_lower).max())
    inverse = 1.0 / edge if edge > 1e-300 else 0.0
    widest = float(seen.widest.max())

    def fill(_: int, first: int, last: int) -> None:
        fill_codes(first, last, lower, upper, period, seen.region_lower, inverse, widest, codes, order)

    crew.each(fill, count)
    return codes, order


def octree_pairs(
    lower: np.ndarray, upper: np.ndarray, period: np.ndarray, max_count: int = 16, max_depth: int = 16
) -> tuple[np.ndarray, int]:
    """Pairs (m, 2) int64 and the number of box tests.  Arguments as checked by ``find_pairs``.

    A node is split while it holds more than ``max_count`` boxes, down to ``max_depth`` levels of octants of the cube
    about most of the particles.  Boxes of very different sizes are in trees of their own (``codes.size_class``),
    which are the first children of the root.

    Raises ``ValueError`` for ``max_count`` below 1 or ``max_depth`` outside 1 .. 20.
    """
    if max_count < 1:
        raise ValueError(f"octree: max_count must be at least 1, got {max_count}")
    if not 1 <= max_depth <= LEVELS:
        raise ValueError(f"octree: max_depth must be in 1 .. {LEVELS}, got {max_depth}")
    count = len(lower)
    if count == 0:
        return np.empty((0, 2), dtype=np.int64), 0
    with Crew(count) as crew:
        seen = survey(lower, upper, period, crew)
        codes, order = _codes(lower, upper, period, seen, crew)
        codes, order, depth = _sorted_codes(codes, order, max_count, max_depth, crew)
        boxes = gathered(lower, upper, order, crew)
        nodes = build(codes, max_count, depth)
        bounds = fit(nodes, boxes, period, seen.slack, crew)
        subtrees = np.empty(len(nodes), dtype=np.int32)
        # Not by the number of threads: the number of tests must not depend on it.
        limit = count // SUBTREES if count >= ALONE else count
        subtrees = subtrees[: _subtrees(nodes, limit, subtrees)]

        def search(first: int, last: int, keys: np.ndarray) -> tuple[int, int]:
            return _search(first, last, subtrees, nodes, bounds, boxes, order, period, keys)

        lists, tested = collect(search, len(subtrees), crew, 4 * count)
        return canonical(lists, count, crew), tested
