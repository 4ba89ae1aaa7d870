"""The octree: boxes sorted by code as far as it takes, the nodes over them, and the bounds of the boxes in each."""

from __future__ import annotations

import numpy as np

from particlesim.broad_phase.aabb_statistics import Survey, wrapped_centre
from particlesim.broad_phase.counting_sort import counting_sort
from particlesim.broad_phase.morton import CLASS_SHIFT, CODE_BITS, LEVELS
from particlesim.broad_phase.soa_aabb import LANES
from particlesim.core.jit import kernel
from particlesim.core.parallel import ALONE, ThreadTeam

# Columns of ``nodes`` (k, 4) int32: the range of boxes, the first child (the others follow it), how many; a leaf
# has none.  Node 0 is the root; children stand after their parents.
START, STOP, CHILD, CHILDREN = 0, 1, 2, 3

# Levels that many boxes are sorted by first, all threads together, and the size classes with them: 2**12 ranges,
# which are then sorted further one by one.
_TOP_LEVELS = 3

# Levels sorted by at a time within a range: 2**9 counters at most.
_LEVELS_AT_ONCE = 3

# Ranges that wait to be sorted further: at most 2**9 at each step down.
_STACK = (2 + LEVELS) * 512


@kernel
def _sort_range(start, stop, shift, bits, codes, order, spare_codes, spare_order, ends):
    """Sort ``start .. stop`` by the ``bits`` above ``shift``; ``ends`` (2**bits,): where each bucket ends."""
    mask = (1 << bits) - 1
    ends[: mask + 1] = 0
    for slot in range(start, stop):
        ends[np.uint64((codes[slot] >> shift) & mask)] += 1
    place = start
    for bucket in range(mask + 1):
        size = ends[bucket]
        ends[bucket] = place
        place += size
    for slot in range(start, stop):
        digit = np.uint64((codes[slot] >> shift) & mask)
        spot = np.uint64(ends[digit])
        ends[digit] = spot + np.uint64(1)
        spare_codes[spot] = codes[slot]
        spare_order[spot] = order[slot]
    for slot in range(start, stop):
        codes[slot] = spare_codes[slot]
        order[slot] = spare_order[slot]


@kernel
def _sort_deeper(first, last, shift, lowest, max_count, starts, codes, order, spare_codes, spare_order):
    """Sort ranges ``first .. last`` of ``starts``, equal above ``shift``, until they are short or equal to ``lowest``.

    Ranges that hold at most ``max_count`` boxes stay as they are: they will not be split.
    """
    stack = np.empty((_STACK, 3), dtype=np.int64)
    ends = np.empty(1 << 3 * _LEVELS_AT_ONCE, dtype=np.int64)
    for number in range(first, last):
        stack[0, 0] = starts[number]
        stack[0, 1] = starts[number + 1]
        stack[0, 2] = shift
        size = 1
        while size > 0:
            size -= 1
            start = stack[size, 0]
            stop = stack[size, 1]
            above = stack[size, 2]
            if stop - start > max_count and above > lowest:
                bits = 3
                while bits < 3 * _LEVELS_AT_ONCE and (max_count << bits) < stop - start and bits + 3 <= above - lowest:
                    bits += 3
                _sort_range(start, stop, above - bits, bits, codes, order, spare_codes, spare_order, ends)
                for bucket in range(1 << bits):
                    if ends[bucket] - start > max_count:
                        stack[size, 0] = start
                        stack[size, 1] = ends[bucket]
                        stack[size, 2] = above - bits
                        size += 1
                    start = ends[bucket]


def sort_by_code(
    codes: np.ndarray, order: np.ndarray, max_count: int, max_depth: int, crew: ThreadTeam
) -> tuple[np.ndarray, np.ndarray]:
    """Sort ``codes`` (n,) int64 with ``order`` (n,) int32, as far as nodes of ``max_count`` boxes need it.

    Boxes are in the order of the octants of all nodes that hold more; in nodes that hold fewer they are as they were.
    """
    count = len(codes)
    lowest = 3 * (LEVELS - max_depth)
    shift = CODE_BITS
    starts = np.array([0, count], dtype=np.int32)
    if count >= ALONE and max_depth > _TOP_LEVELS:
        shift = CLASS_SHIFT - 3 * _TOP_LEVELS
        spare_codes, spare_order = codes, order
        codes, order, starts = counting_sort(codes, order, 1 << (CODE_BITS - shift), crew, shift=shift)
    else:
        spare_codes, spare_order = np.empty_like(codes), np.empty_like(order)

    def deeper(_: int, first: int, last: int) -> None:
        _sort_deeper(first, last, shift, lowest, max_count, starts, codes, order, spare_codes, spare_order)

    crew.each(deeper, len(starts) - 1, 32 * crew.threads)
    return codes, order


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
                    # Octants that hold few together are one leaf: half of the node, or a quarter, or an eighth.
                    bits = 0 if shift == CLASS_SHIFT else 2
                    end = _end_of_digit(codes, start, stop, shift + bits)
                    while bits > 0 and end - start > max_count:
                        bits -= 1
                        end = _end_of_digit(codes, start, end, shift + bits)
                    nodes[size, START] = start
                    nodes[size, STOP] = end
                    size += 1
                    start = end
                nodes[node, CHILDREN] = size - nodes[node, CHILD]
        node += 1
    return size


def build(codes: np.ndarray, max_count: int, max_depth: int) -> np.ndarray:
    """Nodes (k, 4) int32 over sorted ``codes`` (n,) int64, n > 0: split while they hold more than ``max_count``.

    Depth is counted in octants; ``max_depth`` ends the splitting of particles that coincide.
    """
    # Every inner node has two children or more, so there are fewer than twice as many nodes as boxes.
    nodes = np.empty((2 * len(codes), 4), dtype=np.int32)
    return nodes[: _build(codes, max_count, max_depth, nodes)]


@kernel
def _fill_in_order(first, last, lower, upper, order, period, origin, scale, boxes, columns):
    for place in range(first, last):
        index = np.uint64(order[place])
        for axis in range(3):
            a = lower[index, axis]
            b = upper[index, axis]
            boxes[place, axis] = a
            boxes[place, axis + 3] = b
            if period[axis] > 0.0:
                shift = wrapped_centre(a, b, period[axis]) - 0.5 * (a + b)
                a += shift
                b += shift
            columns[axis, place] = (a - origin[axis]) * scale
            columns[axis + 3, place] = (b - origin[axis]) * scale


def in_order(
    lower: np.ndarray,
    upper: np.ndarray,
    order: np.ndarray,
    period: np.ndarray,
    seen: Survey,
    scale: float,
    crew: ThreadTeam,
) -> tuple[np.ndarray, np.ndarray]:
    """The boxes that ``order`` (n,) names: rows (n, 6) float64 [m], and columns (6, n + LANES) float32.

    Columns are about the corner of the region and times ``scale``; on a periodic axis they hold the image whose
    centre is in the primary cell.
    """
    count = len(order)
    boxes, columns = np.empty((count, 6)), np.zeros((6, count + LANES), dtype=np.float32)
    origin = seen.region_lower
    crew.each(
        lambda _, first, last: _fill_in_order(first, last, lower, upper, order, period, origin, scale, boxes, columns),
        count,
    )
    return boxes, columns


@kernel
def _fit_leaves(first, last, nodes, columns, bounds):
    for node in range(first, last):
        if nodes[node, CHILDREN] == 0:
            start = np.uint64(nodes[node, START])
            stop = np.uint64(nodes[node, STOP])
            for axis in range(3):
                low = columns[axis, start]
                high = columns[axis + 3, start]
                for place in range(start + np.uint64(1), stop):
                    low = min(low, columns[axis, place])
                    high = max(high, columns[axis + 3, place])
                bounds[axis, node] = low
                bounds[axis + 3, node] = high


@kernel
def _fit_parents(nodes, bounds):
    """From the last node to the root: children stand after their parents."""
    for node in range(nodes.shape[0] - 1, -1, -1):
        child = nodes[node, CHILD]
        if nodes[node, CHILDREN] > 0:
            for axis in range(3):
                low = bounds[axis, child]
                high = bounds[axis + 3, child]
                for near in range(child + 1, child + nodes[node, CHILDREN]):
                    low = min(low, bounds[axis, near])
                    high = max(high, bounds[axis + 3, near])
                bounds[axis, node] = low
                bounds[axis + 3, node] = high


def fit(nodes: np.ndarray, columns: np.ndarray, crew: ThreadTeam) -> np.ndarray:
    """Bounds (6, k + LANES) float32 of the columns in each node."""
    bounds = np.zeros((6, len(nodes) + LANES), dtype=np.float32)
    crew.each(lambda _, first, last: _fit_leaves(first, last, nodes, columns, bounds), len(nodes), 4 * crew.threads)
    _fit_parents(nodes, bounds)
    return bounds
