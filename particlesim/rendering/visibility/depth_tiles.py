"""The farthest pixel of each tile of a picture: what is farther than that is hidden in all of the tile."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from particlesim.core.jit import kernel

# Edge of a tile [pixels].
TILE = 8


class DepthTiles(NamedTuple):
    """Both (rows, columns) of tiles.

    Parameters
    ----------
    farthest : float32
        Inverse depth of the farthest pixel of each tile, or less.
    stale : bool
        Whether it may be less: it is found anew when it is asked for.
    """

    farthest: np.ndarray
    stale: np.ndarray


def depth_tiles(width: int, height: int) -> DepthTiles:
    """The tiles of an empty picture."""
    shape = -(-height // TILE), -(-width // TILE)
    return DepthTiles(np.full(shape, -np.inf, dtype=np.float32), np.zeros(shape, dtype=np.bool_))


@kernel
def is_hidden(inverse_depth, tiles, box, front):
    """Whether all tiles about the pixels ``box`` show what is nearer everywhere, or there are no pixels in it."""
    if box[0] >= box[1] or box[2] >= box[3]:
        return True
    for row in range(box[0] // TILE, (box[1] - 1) // TILE + 1):
        for column in range(box[2] // TILE, (box[3] - 1) // TILE + 1):
            if tiles.farthest[row, column] < front:
                if tiles.stale[row, column]:
                    tiles.farthest[row, column] = _farthest_of(inverse_depth, row * TILE, column * TILE)
                    tiles.stale[row, column] = False
                if tiles.farthest[row, column] < front:
                    return False
    return True


@kernel
def any_farther(inverse_depth, box, front):
    """Whether any of the pixels ``box`` shows what is farther than ``front``."""
    for row in range(box[0], box[1]):
        for column in range(box[2], box[3]):
            if inverse_depth[row, column] < front:
                return True
    return False


@kernel
def mark_stale(tiles, box):
    """Note that pixels of ``box`` have changed."""
    for row in range(box[0] // TILE, (box[1] - 1) // TILE + 1):
        for column in range(box[2] // TILE, (box[3] - 1) // TILE + 1):
            tiles.stale[row, column] = True


@kernel
def _farthest_of(inverse_depth, row, column):
    """Inverse depth of the farthest pixel of the tile whose first pixel is given."""
    far = np.float32(np.inf)
    for r in range(row, min(row + TILE, inverse_depth.shape[0])):
        for c in range(column, min(column + TILE, inverse_depth.shape[1])):
            far = min(far, inverse_depth[r, c])
    return far
