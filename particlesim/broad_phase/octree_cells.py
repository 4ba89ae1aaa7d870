"""The octree of the particle centres as the paper draws it: eight equal parts of the world, and so on."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from particlesim.broad_phase.morton import LEVELS, fill_octants
from particlesim.core.jit import entry_kernel

# A node taken from the stack puts back at most its eight children, at each of the levels.
_STACK = 8 * (LEVELS + 1)


@entry_kernel
def _fill_leaves(codes, max_count, max_depth, leaves):
    """Rows (depth, x, y, z) in cells of that depth, as many as ``leaves`` (k, 4) holds; the number there are."""
    stack = np.empty((_STACK, 6), dtype=np.int64)  # range of codes, depth, x, y, z
    stack[0] = 0
    stack[0, 1] = codes.size
    size = 1
    found = 0
    while size > 0:
        size -= 1
        start, stop, depth, x, y, z = stack[size]
        if stop - start > max_count and depth < max_depth:
            shift = 3 * (LEVELS - depth - 1)
            for octant in range(8):
                end = start
                while end < stop and (codes[end] >> shift) & 7 == octant:
                    end += 1
                stack[size, 0] = start
                stack[size, 1] = end
                stack[size, 2] = depth + 1
                stack[size, 3] = 2 * x + (octant & 1)
                stack[size, 4] = 2 * y + (octant >> 1 & 1)
                stack[size, 5] = 2 * z + (octant >> 2)
                start = end
                size += 1
        else:
            if found < leaves.shape[0]:
                leaves[found, 0] = depth
                leaves[found, 1] = x
                leaves[found, 2] = y
                leaves[found, 3] = z
            found += 1
    return found


def octree_leaves(
    lower: ArrayLike,
    upper: ArrayLike,
    max_count: int,
    max_depth: int,
    world_lower: ArrayLike,
    world_upper: ArrayLike,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Leaf cells of the octree of the AABB centres, empty ones too: together they fill the world.  For drawing.

    Source: S. Goodwin, section III.

    Parameters
    ----------
    lower, upper : array_like (n, 3)
        Corners of the AABBs [m], as for ``find_pairs``.  A centre outside the world counts as in the cell nearest to
        it.
    max_count, max_depth : int
        A cell is split into eight while it holds more than ``max_count`` centres and is less than ``max_depth``
        (1 .. 20) deep.
    world_lower, world_upper : array_like (3,)
        Corners of the world [m].

    Returns
    -------
    tuple of numpy.ndarray
        Lower and upper corners (k, 3) float64 [m] of the cells, and their depths (k,) int64, 0 for the world itself.

    Raises
    ------
    ValueError
        For ``max_count`` or ``max_depth`` out of range, and a world without a volume.
    """
    edges = np.asarray(world_upper, dtype=np.float64) - np.asarray(world_lower, dtype=np.float64)
    if max_count < 1 or not 1 <= max_depth <= LEVELS or not (edges > 0.0).all():
        raise ValueError(
            f"octree_leaves: need max_count >= 1, max_depth in 1 .. {LEVELS} and a world with a volume, "
            f"got {max_count}, {max_depth} and edges {edges}"
        )
    centre = 0.5 * (np.asarray(lower, dtype=np.float64) + np.asarray(upper, dtype=np.float64))
    corner = np.array(world_lower, dtype=np.float64)
    codes = np.empty(len(centre), dtype=np.int64)
    fill_octants(centre, corner, 1.0 / edges, codes)
    codes.sort()
    leaves = np.empty((64, 4), dtype=np.int64)
    found = _fill_leaves(codes, max_count, max_depth, leaves)
    if found > len(leaves):
        leaves = np.empty((found, 4), dtype=np.int64)
        _fill_leaves(codes, max_count, max_depth, leaves)
    depth = leaves[:found, 0]
    size = edges / (1 << depth)[:, None]
    low = corner + leaves[:found, 1:] * size
    return low, low + size, depth
