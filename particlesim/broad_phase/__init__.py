"""Broad phase: which boxes overlap, and so which particles may touch.

The contract.  ``lower`` and ``upper`` (n, 3) float64 [m] are the corners of n axis-aligned boxes.  A broad phase
returns all pairs i < j of boxes that overlap, each once, sorted by (i, j), as an (m, 2) int64 array.  Boxes are
closed: touching counts, a box may be flat or a point, boxes may coincide.  Sizes may differ by any factor and boxes
lie anywhere.  ``period`` (3,) [m] is the edge of the world on an axis that wraps, 0 on one that does not; on an axis
that wraps, boxes overlap if they do after a shift by some whole number of periods.

Every method gives the same array, to the last entry, for any number of threads: all of them decide by the one test
``pairs.boxes_overlap``, and a method only leaves out pairs that cannot pass it.  Nothing is dropped: lists that are
too short are made longer and filled again.

A method is a callable ``(lower, upper, period, **parameters) -> (pairs, tested)`` in ``METHODS``; ``tested`` is the
number of box tests it made.  It trusts its arrays (C-contiguous, writable, float64, as ``find_pairs`` checks them);
the simulation calls it directly.

    naive   every pair                                                      no parameters
    grid    uniform cells                                                   cells=None (an int: so many along each axis)
    octree  cells split where many particles are, a tree for each size      max_count=32, max_depth=16
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from particlesim.broad_phase.grid import grid_pairs
from particlesim.broad_phase.naive import naive_pairs
from particlesim.broad_phase.octree import octree_pairs
from particlesim.broad_phase.octree_cells import octree_leaves

__all__ = ["METHODS", "find_pairs", "octree_leaves"]

METHODS: dict[str, Callable[..., tuple[np.ndarray, int]]] = {
    "naive": naive_pairs,
    "grid": grid_pairs,
    "octree": octree_pairs,
}

# Coordinates [m] up to which differences and cell numbers stay finite, and distance from the origin in periods up to
# which an image is still placed to a millionth of the period.
_FARTHEST = 1e100
_MOST_PERIODS = 2.0**32


def find_pairs(
    lower: np.ndarray,
    upper: np.ndarray,
    method: str = "octree",
    *,
    period: Sequence[float] | np.ndarray | None = None,
    **parameters: Any,
) -> np.ndarray:
    """Pairs of axis-aligned boxes that overlap: (m, 2) int64, i < j, each once, sorted by (i, j).

    ``lower``, ``upper`` (n, 3) float64 [m], lower <= upper; ``method`` one of ``METHODS``, with its ``parameters``;
    ``period`` None or (3,) [m], 0 on axes that do not wrap.  The contract is at the top of this module.

    Raises ``ValueError`` for an unknown method, arrays of another shape or type, boxes that are not finite or whose
    lower corner exceeds the upper one, and parameters out of range.
    """
    if method not in METHODS:
        raise ValueError(f"find_pairs: unknown method {method!r}, expected one of {', '.join(METHODS)}")
    low, high = _checked("lower", lower), _checked("upper", upper)
    if low.shape != high.shape:
        raise ValueError(f"find_pairs: lower has {len(low)} boxes, upper has {len(high)}")
    wrong = np.flatnonzero((low > high).any(axis=1))
    if wrong.size:
        raise ValueError(f"find_pairs: lower exceeds upper in {wrong.size} boxes, first in box {wrong[0]}")
    lengths = _checked_period(period)
    wraps = lengths > 0.0
    if len(low) and (np.maximum(-low, high).max(axis=0)[wraps] > _MOST_PERIODS * lengths[wraps]).any():
        raise ValueError("find_pairs: boxes lie more than 2**32 periods from the origin")
    pairs, _ = METHODS[method](low, high, lengths, **parameters)
    return pairs


def _checked(name: str, values: np.ndarray) -> np.ndarray:
    array = np.asarray(values)
    if array.ndim != 2 or array.shape[1] != 3 or array.dtype != np.float64:
        raise ValueError(f"find_pairs: {name} must be (n, 3) float64, got {array.shape} {array.dtype}")
    wrong = np.flatnonzero(~(np.abs(array) <= _FARTHEST).all(axis=1))
    if wrong.size:
        raise ValueError(
            f"find_pairs: {name} must be finite and within {_FARTHEST:g} m, first violated by box {wrong[0]}"
        )
    return np.require(array, requirements=["C", "W"])


def _checked_period(period: Sequence[float] | np.ndarray | None) -> np.ndarray:
    lengths = np.zeros(3) if period is None else np.array(period, dtype=np.float64)
    if lengths.shape != (3,) or not ((lengths >= 0.0) & (lengths <= _FARTHEST)).all():
        raise ValueError(f"find_pairs: period must be three lengths, 0 on axes that do not wrap, got {period}")
    return lengths
