"""The octree: AABBs sorted by code as far as it takes, the nodes over them, and the bounds of the AABBs in each."""

from __future__ import annotations

import numpy as np

from particlesim.broad_phase.aabb_statistics import wrapped_centre
from particlesim.broad_phase.aabb_test import Aabbs, StoredAabbs
from particlesim.broad_phase.counting_sort import counting_sort
from particlesim.broad_phase.morton import CLASS_SHIFT, CODE_BITS, LEVELS
from particlesim.broad_phase.soa_aabb import LANES
from particlesim.core.jit import entry_kernel, kernel
from particlesim.core.parallel import ALONE, ThreadTeam
from particlesim.core.records import record

# A node of the octree.  Node 0 is the root; children stand after their parents.
NODE = record(
    [
        ("start", "i4"),  # range of AABBs
        ("stop", "i4"),
        ("child", "i4"),  # the first; the others follow it
        ("children", "i4"),  # how many; a leaf has none
    ]
)

# Levels that many AABBs are sorted by first, all threads together, and the size classes with them: 2**12 ranges,
# which are then sorted further one by one.
_TOP_LEVELS = 3

# Levels sorted by at a time within a range: 2**9 counters at most.
_LEVELS_AT_ONCE = 3

# Ranges that wait to be sorted further: at most 2**9 at each step down.
_STACK = (2 + LEVELS) * 512


@kernel
def _sort_range(start, stop, shift, bits, coded, spare, ends):
    """Sort ``start .. stop`` of ``coded`` by the ``bits`` above ``shift``; ``ends`` (2**bits,): where each bucket ends.

    ``coded`` and ``spare`` are codes and numbers of AABBs, (codes, order).
    """
    codes, order = coded
    spare_codes, spare_order = spare
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


@entry_kernel
def _sort_deeper(first, last, starts, limits, coded, spare):
    """Sort ranges ``first .. last`` of ``starts``, equal above ``shift``, until they are short or equal to ``lowest``.

    ``limits``: (shift, lowest, max_count).  Ranges that hold at most ``max_count`` AABBs stay as they are: they will
    not be split.
    """
    shift, lowest, max_count = limits
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
                _sort_range(start, stop, above - bits, bits, coded, spare, ends)
                for bucket in range(1 << bits):
                    if ends[bucket] - start > max_count:
                        stack[size, 0] = start
                        stack[size, 1] = ends[bucket]
                        stack[size, 2] = above - bits
                        size += 1
                    start = ends[bucket]


def sort_by_code(
    codes: np.ndarray, order: np.ndarray, max_count: int, max_depth: int, team: ThreadTeam
) -> tuple[np.ndarray, np.ndarray]:
    """Sort ``codes`` (n,) int64 with ``order`` (n,) int32, as far as nodes of ``max_count`` AABBs need it.

    AABBs are in the order of the octants of all nodes that hold more; in nodes that hold fewer they are as they were.
    """
    count = len(codes)
    shift = CODE_BITS
    starts = np.array([0, count], dtype=np.int32)
    if count >= ALONE and max_depth > _TOP_LEVELS:
        shift = CLASS_SHIFT - 3 * _TOP_LEVELS
        spare = codes, order
        codes, order, starts = counting_sort(codes, order, 1 << (CODE_BITS - shift), team, shift=shift)
    else:
        spare = np.empty_like(codes), np.empty_like(order)
    coded, limits = (codes, order), (shift, 3 * (LEVELS - max_depth), max_count)
    team.each(
        lambda _, first, last: _sort_deeper(first, last, starts, limits, coded, spare),
        len(starts) - 1,
        32 * team.threads,
    )
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


@entry_kernel
def _build(codes, max_count, max_depth, nodes, leaves):
    """Write nodes and leaves; how many of each."""
    nodes[0].start = 0
    nodes[0].stop = codes.size
    size = 1
    node = 0
    found = 0
    while node < size:
        start = nodes[node].start
        stop = nodes[node].stop
        nodes[node].children = 0
        if stop - start > max_count:
            shift = _split_shift(codes[start], codes[stop - 1], max_depth)
            if shift >= 0:
                nodes[node].child = size
                while start < stop:
                    # Octants that hold few together are one leaf: half of the node, or a quarter, or an eighth.
                    bits = 0 if shift == CLASS_SHIFT else 2
                    end = _end_of_digit(codes, start, stop, shift + bits)
                    while bits > 0 and end - start > max_count:
                        bits -= 1
                        end = _end_of_digit(codes, start, end, shift + bits)
                    nodes[size].start = start
                    nodes[size].stop = end
                    size += 1
                    start = end
                nodes[node].children = size - nodes[node].child
        if nodes[node].children == 0:
            leaves[found] = node
            found += 1
        node += 1
    return size, found


def build(codes: np.ndarray, max_count: int, max_depth: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes (k,) ``NODE`` over sorted ``codes`` (n,) int64, n > 0, and the numbers (l,) int32 of those that are leaves.

    Nodes are split while they hold more than ``max_count`` AABBs.  Depth is counted in octants;
    ``max_depth`` ends the splitting of particles that coincide.
    """
    # Every inner node has two children or more, so there are fewer than twice as many nodes as AABBs.
    nodes, leaves = np.empty(2 * len(codes), dtype=NODE), np.empty(len(codes), dtype=np.int32)
    size, found = _build(codes, max_count, max_depth, nodes, leaves)
    return nodes[:size], leaves[:found]


@entry_kernel
def _fill_in_order(first, last, aabbs, statistics, stored, soa):
    lower, upper, period = aabbs
    bounds, order, _ = stored
    scale = statistics[0].scale
    origin = statistics[0].region_lower
    for place in range(first, last):
        index = np.uint64(order[place])
        for axis in range(3):
            a = lower[index, axis]
            b = upper[index, axis]
            bounds[place, axis] = a
            bounds[place, axis + 3] = b
            if period[axis] > 0.0:
                shift = wrapped_centre(a, b, period[axis]) - 0.5 * (a + b)
                a += shift
                b += shift
            soa[axis, place] = (a - origin[axis]) * scale
            soa[axis + 3, place] = (b - origin[axis]) * scale


def in_order(
    aabbs: Aabbs, order: np.ndarray, statistics: np.ndarray, team: ThreadTeam
) -> tuple[StoredAabbs, np.ndarray]:
    """The AABBs that ``order`` (n,) names, and the same as ``soa`` (6, n + LANES) float32.

    ``soa`` is in the unit cube that stands for the root cube; on a periodic axis it holds the image whose centre is in
    the primary cell.
    """
    count = len(order)
    stored = StoredAabbs(np.empty((count, 6)), order, aabbs.period)
    soa = np.zeros((6, count + LANES), dtype=np.float32)
    team.each(lambda _, first, last: _fill_in_order(first, last, aabbs, statistics, stored, soa), count)
    return stored, soa


@entry_kernel
def _fit_leaves(first, last, nodes, soa, node_soa):
    for node in range(first, last):
        if nodes[node].children == 0:
            start = np.uint64(nodes[node].start)
            stop = np.uint64(nodes[node].stop)
            for axis in range(3):
                low = soa[axis, start]
                high = soa[axis + 3, start]
                for place in range(start + np.uint64(1), stop):
                    low = min(low, soa[axis, place])
                    high = max(high, soa[axis + 3, place])
                node_soa[axis, node] = low
                node_soa[axis + 3, node] = high


@entry_kernel
def _fit_parents(nodes, node_soa):
    """From the last node to the root: children stand after their parents."""
    for node in range(nodes.shape[0] - 1, -1, -1):
        child = nodes[node].child
        if nodes[node].children > 0:
            for axis in range(3):
                low = node_soa[axis, child]
                high = node_soa[axis + 3, child]
                for near in range(child + 1, child + nodes[node].children):
                    low = min(low, node_soa[axis, near])
                    high = max(high, node_soa[axis + 3, near])
                node_soa[axis, node] = low
                node_soa[axis + 3, node] = high


def fit(nodes: np.ndarray, soa: np.ndarray, team: ThreadTeam) -> np.ndarray:
    """Bounds (6, k + LANES) float32 of the AABBs in each node."""
    node_soa = np.zeros((6, len(nodes) + LANES), dtype=np.float32)
    team.each(lambda _, first, last: _fit_leaves(first, last, nodes, soa, node_soa), len(nodes), 4 * team.threads)
    _fit_parents(nodes, node_soa)
    return node_soa
