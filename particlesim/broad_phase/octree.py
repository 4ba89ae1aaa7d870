"""The octree: nodes split into eight where many particles are, and tests between leaves that overlap.

S. Goodwin, "Analysis of Efficient Collision Detection using Pre-Processing Data Structures", section III: a node is
split while it holds more than ``max_count`` particles.  There, a particle on the border of two leaves is missed or
is in both; here each belongs to the node of its centre, every node has the bounds of the AABBs in it, and a leaf
is searched against the leaves before it whose bounds overlap its own, so that each pair of AABBs is tested once.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from particlesim.broad_phase.aabb_statistics import aabb_statistics
from particlesim.broad_phase.aabb_test import BATCH, Aabbs, StoredAabbs, append_overlaps, collect
from particlesim.broad_phase.morton import LEVELS, codes_of
from particlesim.broad_phase.octree_build import build, fit, in_order, sort_by_code
from particlesim.broad_phase.pair_sort import sort_pairs
from particlesim.broad_phase.soa_aabb import LANES, child_bits, load_soa, lowest, may_overlap, overlap_bits
from particlesim.core.jit import entry_kernel, kernel, without_refcounts
from particlesim.core.math3d import to_vec3
from particlesim.core.parallel import ThreadTeam

# AABBs near a leaf that are listed before all of the leaf are tested against them: 24 kB.
_LIST = 1024

# Own AABBs of a leaf listed at once, with those near it.
_OWN = 256

# Nodes that wait to be looked into: each step down leaves at most seven beside the one that is taken, and the size
# classes are one step.
_STACK = 8 * (LEVELS + 3)

# Rounding of float32 coordinates and of their sums: four units in the last place.
_ROUNDING = 2.0**-22


class Tree(NamedTuple):
    """The octree and the AABBs in it, in the order of the nodes."""

    nodes: np.ndarray  # (k,) NODE
    node_soa: np.ndarray  # (6, k + LANES) float32, bounds of the AABBs in each node
    leaves: np.ndarray  # (l,) int32, nodes
    soa: np.ndarray  # (6, n + LANES) float32
    stored: StoredAabbs


class Images(NamedTuple):
    """The periodic images that may be nearest, in the coordinates of ``soa``."""

    shifts: np.ndarray  # (k, 3) float32, none first
    margin: np.ndarray  # (3,) float32, for the rounding


# Along an axis: no shift, or one period either way.
_DIRECTIONS = np.array([0.0, 1.0, -1.0])


@kernel
def _moved(aabb, image):
    """An AABB moved by a shift, with a margin all around for the rounding; ``image``: (shift, margin)."""
    shift, margin = image
    return (
        aabb[0] + shift[0] - margin[0], aabb[1] + shift[1] - margin[1], aabb[2] + shift[2] - margin[2],
        aabb[3] + shift[0] + margin[0], aabb[4] + shift[1] + margin[1], aabb[5] + shift[2] + margin[2],
    )  # fmt: skip


@kernel
def _find_near(leaf, aabb, nodes, node_soa, stack, ranges):
    """Ranges of the leaves before ``leaf`` whose bounds may overlap ``aabb``, into rows of ``ranges``; how many."""
    own = nodes[leaf].start
    stack[0] = 0
    size = np.uint64(nodes[0].children > 0)
    found = np.uint64(0)
    while size > np.uint64(0):
        size -= np.uint64(1)
        node = np.uint64(stack[size])
        child = np.uint64(nodes[node].child)
        bits = child_bits(node_soa, child, aabb) & ((1 << nodes[node].children) - 1)
        while bits:
            near = child + lowest(bits)
            bits &= bits - 1
            if nodes[near].start < own:
                if nodes[near].children > 0:
                    stack[size] = near
                    size += np.uint64(1)
                else:
                    ranges[found, 0] = nodes[near].start
                    ranges[found, 1] = nodes[near].stop
                    found += np.uint64(1)
    return np.int64(found)


@kernel
def _list_near(ranges, slot, number, aabb, soa, near):
    """List the AABBs in ``ranges`` from row ``slot`` on that may overlap ``aabb``, until the list is full.

    Returns the row it has come to, which then starts where the list ends, and the length of the list.
    """
    near_soa, places = near
    size = np.uint64(0)
    while slot < number:
        base = int(ranges[slot, 0])
        stop = int(ranges[slot, 1])
        while base < stop:
            if size > np.uint64(_LIST - LANES):
                ranges[slot, 0] = base
                return slot, np.int64(size)
            bits = overlap_bits(soa, np.uint64(base), aabb) & ((1 << min(LANES, stop - base)) - 1)
            while bits:
                place = np.uint64(base) + lowest(bits)
                bits &= bits - 1
                for row in range(6):
                    near_soa[row, size] = soa[row, place]
                places[size] = place
                size += np.uint64(1)
            base += LANES
        slot += 1
    return slot, np.int64(size)


@kernel
def _list_own(first, last, soa, near, size):
    """Add the AABBs ``first .. last`` to the list."""
    near_soa, places = near
    slot = np.uint64(size)
    for place in range(first, last):
        for row in range(6):
            near_soa[row, slot] = soa[row, place]
        places[slot] = place
        slot += np.uint64(1)


@kernel
def _test_list(span, near, image, soa, stored, candidates, keys, progress):
    """Test a range of AABBs against those near them, and against themselves.

    ``span``: (first, last, before, own): AABBs ``first .. last``, against the first ``before`` of the list, which
    ``own`` of themselves follow: number ``first + k`` is tested against the first k of these.  ``progress``, in and
    out: candidates that wait, pairs found, tests made.
    """
    first, last, before, own = span
    near_soa, places = near
    size, found, tested = progress
    for index in range(first, last):
        aabb = _moved(load_soa(soa, index), image)
        number = before + min(index - first, own)
        tested += number
        for base in range(0, number, LANES):
            bits = overlap_bits(near_soa, np.uint64(base), aabb) & ((1 << min(LANES, number - base)) - 1)
            while bits:
                candidates[0, size] = index
                candidates[1, size] = places[np.uint64(base) + lowest(bits)]
                bits &= bits - 1
                size += 1
            if size > BATCH - LANES:
                found = append_overlaps(candidates, size, stored, keys, found)
                size = 0
    return size, found, tested


@entry_kernel
def _search(first, last, tree, images, keys):
    """Pairs within the leaves ``first .. last`` and between them and the leaves before them: (found, tested)."""
    nodes, node_soa, leaves, soa, stored = without_refcounts(tree)
    shifts, margin = images
    keys = without_refcounts(keys)
    stack = np.empty(_STACK, dtype=np.uint32)
    ranges = np.empty((leaves.size, 2), dtype=np.int32)
    near = (
        np.zeros((6, _LIST + _OWN + LANES), dtype=np.float32),
        np.empty(_LIST + _OWN + LANES, dtype=np.uint32),
    )
    candidates = np.empty((2, BATCH), dtype=np.uint32)
    progress = 0, 0, 0
    for number in range(first, last):
        leaf = leaves[number]
        start = int(nodes[leaf].start)
        stop = int(nodes[leaf].stop)
        for k in range(shifts.shape[0]):
            image = to_vec3(shifts[k]), to_vec3(margin)
            aabb = _moved(load_soa(node_soa, leaf), image)
            if not may_overlap(aabb, load_soa(node_soa, 0)):
                continue
            near_ranges = _find_near(leaf, aabb, nodes, node_soa, stack, ranges)
            slot, size = _list_near(ranges, 0, near_ranges, aabb, soa, near)
            while slot < near_ranges:
                progress = _test_list((start, stop, size, 0), near, image, soa, stored, candidates, keys, progress)
                slot, size = _list_near(ranges, slot, near_ranges, aabb, soa, near)
            if size == 0 and not may_overlap(aabb, load_soa(node_soa, leaf)):
                continue  # an image that does not reach its own
            for base in range(start, stop, _OWN):
                end = min(base + _OWN, stop)
                _list_own(base, end, soa, near, size)
                span = base, stop, size, end - base
                progress = _test_list(span, near, image, soa, stored, candidates, keys, progress)
                size = 0
    waiting, found, tested = progress
    return append_overlaps(candidates, waiting, stored, keys, found), tested


@entry_kernel
def _write_images(period, statistics, shifts, margin):
    """Shifts to all images that can be nearest, none first, and the margin; how many shifts."""
    scale = statistics[0].scale
    for axis in range(3):
        around = 2.0 * period[axis] + statistics[0].widest[axis]
        margin[axis] = scale * (_ROUNDING * around + statistics[0].slack[axis]) if period[axis] > 0.0 else 0.0
    number = 0
    for k in range(27):
        x, y, z = _DIRECTIONS[k // 9], _DIRECTIONS[k // 3 % 3], _DIRECTIONS[k % 3]
        if (x == 0.0 or period[0] > 0.0) and (y == 0.0 or period[1] > 0.0) and (z == 0.0 or period[2] > 0.0):
            shifts[number, 0] = x * scale * period[0]
            shifts[number, 1] = y * scale * period[1]
            shifts[number, 2] = z * scale * period[2]
            number += 1
    return number


def _images(period: np.ndarray, statistics: np.ndarray) -> Images:
    """All images that can be nearest, in the unit cube that stands for the root cube."""
    shifts, margin = np.empty((27, 3), dtype=np.float32), np.empty(3, dtype=np.float32)
    return Images(shifts[: _write_images(period, statistics, shifts, margin)], margin)


def _candidates(aabbs: Aabbs, max_count: int, max_depth: int, team: ThreadTeam) -> tuple[list[np.ndarray], int, bool]:
    """Lists of pairs of AABBs that overlap, the number of tests, and whether a pair may be there more than once."""
    count = len(aabbs.lower)
    statistics = aabb_statistics(aabbs, team)
    numbers = np.arange(count, dtype=np.int32)
    codes, order = sort_by_code(codes_of(aabbs, statistics, team), numbers, max_count, max_depth, team)
    stored, soa = in_order(aabbs, order, statistics, team)
    nodes, leaves = build(codes, max_count, max_depth)
    tree = Tree(nodes, fit(nodes, soa, team), leaves, soa, stored)
    images = _images(aabbs.period, statistics)
    lists, tested = collect(
        lambda first, last, keys: _search(first, last, tree, images, keys), len(leaves), team, 2 * count
    )
    return lists, tested, len(images.shifts) > 1


def octree_pairs(
    lower: np.ndarray,
    upper: np.ndarray,
    period: np.ndarray,
    *,
    max_count: int = 32,
    max_depth: int = 16,
    threads: int | None = None,
) -> tuple[np.ndarray, int]:
    """Pairs (m, 2) int64 and the number of AABB tests.  Arguments as checked by ``find_pairs``.

    A node is split while it holds more than ``max_count`` AABBs, down to ``max_depth`` levels of octants of the cube
    about most of the particles; octants that hold no more together stay together.  AABBs of very different sizes are
    in trees of their own (``morton.CLASS_RATIO``), which are the first children of the root.

    Raises ``ValueError`` for ``max_count`` below 1 or ``max_depth`` outside 1 .. 20.
    """
    if max_count < 1:
        raise ValueError(f"octree: max_count must be at least 1, got {max_count}")
    if not 1 <= max_depth <= LEVELS:
        raise ValueError(f"octree: max_depth must be in 1 .. {LEVELS}, got {max_depth}")
    count = len(lower)
    if count == 0:
        return np.empty((0, 2), dtype=np.int64), 0
    team = ThreadTeam(count, threads)
    # What the search needs is given back before the pairs are sorted: that takes the most memory of all.
    lists, tested, unique = _candidates(Aabbs(lower, upper, period), max_count, max_depth, team)
    return sort_pairs(lists, count, team, unique=unique), tested
