"""Broad phase: which axis-aligned bounding boxes overlap, and so which particles may touch.

The contract.  ``lower`` and ``upper`` (n, 3) float64 [m] are the corners of n axis-aligned bounding boxes (AABBs).  A
broad phase returns all pairs i < j of AABBs that overlap, each once, sorted by (i, j), as an (m, 2) int64 array.
AABBs are closed: touching counts, one may be flat or a point, they may coincide.  Sizes may differ by any factor and
AABBs lie anywhere.  ``period`` (3,) [m] is the edge of the world on an axis that wraps, 0 on one that does not; on an
axis that wraps, AABBs overlap if they do after a shift by some whole number of periods.

Every method gives the same array, to the last entry, for any number of threads: all of them decide by the one test
``aabb_test.aabbs_overlap``, and a method only leaves out pairs that cannot pass it.  Nothing is dropped: lists that
are too short are made longer and filled again.

A method is a callable ``(lower, upper, period, *, threads=None, **parameters) -> (pairs, tested)`` in ``METHODS``;
``tested`` is the number of AABB tests it made.  It trusts its arrays (C-contiguous, writable, float64, as
``find_pairs`` checks them); the simulation calls it directly.

    naive   every pair                                                      no parameters
    grid    uniform cells                                                   cells=None (an int: so many along each axis)
    octree  cells split where many particles are, a tree for each size      max_count=32, max_depth=16
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from particlesim.broad_phase.grid import grid_pairs
from particlesim.broad_phase.naive import naive_pairs
from particlesim.broad_phase.octree import octree_pairs
from particlesim.broad_phase.octree_cells import octree_leaves
from particlesim.core.arguments import real_numbers, shown

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

# The largest whole number of an array.
_MOST = 2**63 - 1


def find_pairs(
    lower: ArrayLike,
    upper: ArrayLike,
    method: str = "octree",
    *,
    period: ArrayLike | None = None,
    threads: int | None = None,
    **parameters: Any,
) -> np.ndarray:
    """Pairs of axis-aligned bounding boxes (AABBs) that overlap.

    AABBs are closed: touching counts.

    Parameters
    ----------
    lower, upper : array_like (n, 3), converted to float64
        Corners of the AABBs [m], ``lower <= upper``.
    method : str
        One of ``METHODS``: ``"naive"``, ``"grid"`` or ``"octree"``.  All give the same array.
    period : array_like (3,), optional
        Edges of a periodic world [m], 0 on axes that do not wrap; by default no axis does.
    threads : int, optional
        How many threads to search with; by default as many as there are processors.  The result does not depend on it.
    **parameters
        Of the method: ``cells`` of ``"grid"``, ``max_count`` and ``max_depth`` of ``"octree"``.

    Returns
    -------
    numpy.ndarray (m, 2) int64
        Numbers i < j of the AABBs of each pair, each pair once, sorted by (i, j).

    Raises
    ------
    ValueError
        For an unknown method, arrays of another shape or that are no numbers, AABBs that are not finite or whose lower
        corner exceeds the upper one, and parameters out of range.
    TypeError
        For a parameter that the method does not have, or one that is no whole number.
    """
    if not isinstance(method, str) or method not in METHODS:
        raise ValueError(f"find_pairs: unknown method {shown(method)}, expected one of {', '.join(METHODS)}")
    numbers = _checked_parameters(method, {"threads": threads, **parameters})
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
    try:
        pairs, _ = METHODS[method](low, high, lengths, **numbers)
    except ValueError as error:
        raise ValueError(f"find_pairs: {error}") from None
    return pairs


def _checked_parameters(method: str, parameters: dict[str, Any]) -> dict[str, int | None]:
    """The parameters as whole numbers of Python. TypeError if one is none, or the method does not have it."""
    signature = inspect.signature(METHODS[method])
    known = {p.name: p.default for p in signature.parameters.values() if p.kind is p.KEYWORD_ONLY}
    for name, value in parameters.items():
        if name not in known:
            raise TypeError(f"find_pairs: unknown parameter {name!r} of {method}, expected one of {', '.join(known)}")
        if value is None and known[name] is not None:
            raise TypeError(f"find_pairs: {name} must be a whole number, got None")
        if value is not None and (isinstance(value, bool) or not isinstance(value, int | np.integer)):
            raise TypeError(f"find_pairs: {name} must be a whole number, got {shown(value)}")
        if value is not None and not -_MOST <= value <= _MOST:
            raise ValueError(f"find_pairs: {name} must be a whole number that int64 has, got {shown(value)}")
    return {name: None if value is None else int(value) for name, value in parameters.items()}


def _checked(name: str, values: ArrayLike) -> np.ndarray:
    array = real_numbers(f"find_pairs: {name}", values)
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"find_pairs: {name} must be (n, 3) float64, got {array.shape}")
    wrong = np.flatnonzero(~(np.abs(array) <= _FARTHEST).all(axis=1))
    if wrong.size:
        raise ValueError(
            f"find_pairs: {name} must be finite and within {_FARTHEST:g} m, first violated by box {wrong[0]}"
        )
    return np.require(array, requirements=["C", "W"])


def _checked_period(period: ArrayLike | None) -> np.ndarray:
    lengths = np.zeros(3) if period is None else np.array(real_numbers("find_pairs: period", period))
    if lengths.shape != (3,) or not ((lengths >= 0.0) & (lengths <= _FARTHEST)).all():
        raise ValueError(f"find_pairs: period must be three lengths, 0 on axes that do not wrap, got {shown(period)}")
    return lengths
