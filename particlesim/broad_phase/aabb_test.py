"""What every broad phase shares: the records that hold AABBs, the overlap test, and the list of pairs that pass it.

A method stores AABBs in an order that suits it (``StoredAabbs``).  It writes the candidates it finds, as two rows
each, to a short list, and ``append_overlaps`` decides them all in one loop without a branch: where pairs are few and
irregular, a branch for each costs more than the test.  A found pair is one int64 key, ``i << 32 | j`` with i < j.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from particlesim.core.jit import kernel
from particlesim.core.parallel import ThreadTeam

# Candidates that are decided at a time: two lists of as many uint32, which stay in the fastest cache.
BATCH = 2048

# Blocks a search is cut into for each thread: the work in a block is uneven.  And pairs expected in a block, where that
# makes fewer: to hand out one costs about 5 us.
_BLOCKS_PER_THREAD = 16
_PAIRS_PER_BLOCK = 2048

# Room for this much more than a block was short of is given to the blocks that come after it.
_MORE = 1.1

# Rounding of coordinates and of their differences, relative to the largest coordinate: 32 units in the last place.
# Wherever a method sorts AABBs by rounded numbers, it widens its reach by this.
SLACK = 2.0**-47


class Aabbs(NamedTuple):
    """AABBs as the caller gives them."""

    lower: np.ndarray  # (n, 3) float64 [m]
    upper: np.ndarray  # (n, 3) float64 [m]
    period: np.ndarray  # (3,) float64 [m], 0 on axes that do not wrap


class StoredAabbs(NamedTuple):
    """AABBs in the order of a method."""

    bounds: np.ndarray  # (n, 6) float64, lower x y z, upper x y z [m]
    order: np.ndarray  # (n,) int32, the number of each in the caller's arrays
    period: np.ndarray  # (3,) float64 [m], 0 on axes that do not wrap


@kernel
def load_aabb(bounds, index):
    """Row ``index`` of an (n, 6) array as a tuple, which stays in registers."""
    return (
        bounds[index, 0], bounds[index, 1], bounds[index, 2], bounds[index, 3], bounds[index, 4], bounds[index, 5]
    )  # fmt: skip


@kernel
def intervals_overlap(lower_a, upper_a, lower_b, upper_b, period):
    """Whether two closed intervals overlap, on a line (``period`` 0) or on a circle of length ``period``.

    On a circle the nearest image of b is tested; no other image is nearer.  The two differences are compared with the
    shift, not shifted themselves: the answer is then the same to the last bit with a and b exchanged.
    """
    shift = 0.0
    if period > 0.0:
        shift = period * np.rint(0.5 * ((lower_b + upper_b) - (lower_a + upper_a)) / period)
    return (lower_a - upper_b <= -shift) & (lower_b - upper_a <= shift)


@kernel
def aabbs_overlap(a, b, period, wraps):
    """The overlap test of every method.  ``period`` (3,) [m], 0 on axes that do not wrap; ``wraps``: any does."""
    if wraps:
        return (
            intervals_overlap(a[0], a[3], b[0], b[3], period[0])
            & intervals_overlap(a[1], a[4], b[1], b[4], period[1])
            & intervals_overlap(a[2], a[5], b[2], b[5], period[2])
        )
    return (a[0] <= b[3]) & (b[0] <= a[3]) & (a[1] <= b[4]) & (b[1] <= a[4]) & (a[2] <= b[5]) & (b[2] <= a[5])


@kernel
def append_overlaps(candidates, size, stored, keys, found):
    """Test the first ``size`` of ``candidates`` (2, BATCH), rows of ``stored``; how many keys there are then.

    Where ``keys`` has no room for all of them, overlaps are counted and not stored: the list is whole if the final
    ``found`` leaves room for a batch (``collect`` sees to it).  Unsigned indices spare the check for negative ones.
    """
    bounds, order, period = stored
    wraps = period[0] > 0.0 or period[1] > 0.0 or period[2] > 0.0
    fill = np.uint64(found)
    if found + size <= keys.size:
        for slot in range(np.uint64(size)):
            a = np.uint64(candidates[0, slot])
            b = np.uint64(candidates[1, slot])
            hit = aabbs_overlap(load_aabb(bounds, a), load_aabb(bounds, b), period, wraps)
            number_a = np.int64(order[a])
            number_b = np.int64(order[b])
            keys[fill] = min(number_a, number_b) << 32 | max(number_a, number_b)  # overwritten unless it is a hit
            fill += np.uint64(hit)
    else:
        for slot in range(size):
            a = candidates[0, slot]
            b = candidates[1, slot]
            fill += np.uint64(aabbs_overlap(load_aabb(bounds, a), load_aabb(bounds, b), period, wraps))
    return np.int64(fill)


def collect(
    search: Callable[[int, int, np.ndarray], tuple[int, int]], count: int, team: ThreadTeam, expected: int
) -> tuple[list[np.ndarray], int]:
    """Run ``search(first, last, keys) -> (found, tested)`` over ``0 .. count``; the lists of keys and tests made.

    ``expected`` pairs in all are given room at first; a block that finds more is searched again with room for all,
    and those after it are given as much.
    """
    each = expected / max(count, 1)

    def block(_: int, first: int, last: int) -> tuple[np.ndarray, int]:
        nonlocal each
        keys = np.empty(int(each * (last - first)) + 2 * BATCH, dtype=np.int64)
        found, tested = search(first, last, keys)
        if found + BATCH > keys.size:
            each = max(each, _MORE * found / (last - first))
            keys = np.empty(found + BATCH, dtype=np.int64)
            found, tested = search(first, last, keys)
        return keys[:found], tested

    most = _BLOCKS_PER_THREAD * team.threads
    results = team.each(block, count, min(most, max(2 * team.threads, expected // _PAIRS_PER_BLOCK)))
    return [keys for keys, _ in results], sum(tested for _, tested in results)
