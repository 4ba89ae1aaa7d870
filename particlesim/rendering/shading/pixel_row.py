"""The pixels of a row while they are shaded, pass by pass: arithmetic for all, then what is looked up for each.

Processors do arithmetic on eight or more numbers at a time, if nothing is looked up between. Passes are over slices,
whose numbers begin at 0, since the compiler finds no such use of an array into which something else may reach.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from particlesim.core.jit import kernel
from particlesim.rendering.shading.light import NONE, ONE

_TINY = np.float32(1e-12)
_INFINITE = np.float32(np.inf)


class PixelRow(NamedTuple):
    """What is known of each pixel, (width,) float32 but for ``texel``.

    Parameters
    ----------
    aside
        x of its ray.
    close
        Inverse depth of what it sees [1/m], 0 where that is nothing.
    lit
        Fraction of the key light.
    share
        How much it shows of the floor, or of the dark rim of a face.
    across, along
        Where that is on a map (see ``locate``): how far on from the middle of a texel to that of the next.
    value
        A third coordinate there, or what was looked up.
    texel : int32
        The texel.
    """

    aside: np.ndarray
    close: np.ndarray
    lit: np.ndarray
    share: np.ndarray
    across: np.ndarray
    along: np.ndarray
    value: np.ndarray
    texel: np.ndarray


@kernel
def new_row(strip, width):
    """A row of a picture, with the rays of its pixels.

    Each is an array of its own: of rows of one array the compiler cannot tell that they do not overlap.
    """
    aside, close = np.empty(width, dtype=np.float32), np.empty(width, dtype=np.float32)
    lit, share = np.empty(width, dtype=np.float32), np.empty(width, dtype=np.float32)
    across, along = np.empty(width, dtype=np.float32), np.empty(width, dtype=np.float32)
    value, texel = np.empty(width, dtype=np.float32), np.empty(width, dtype=np.int32)
    for x in range(width):
        aside[x] = np.float32((x + 0.5 - strip.middle_x) / strip.scale)
    return PixelRow(aside, close, lit, share, across, along, value, texel)


@kernel
def locate(span, form, size, room, row):
    """Find where on a map lies what pixels see: fill in ``row.texel``, ``across``, ``along`` and ``value``.

    ``span``: the first, past the last, y of their rays; ``form`` (3, 4): from places in view coordinates to columns,
    rows and ``value``, three factors and what is added; ``size``: columns and rows of the map; ``room``: how many
    texels from one on are looked up. What is beyond them is at the rim, and its ``value`` infinite.
    """
    first, last, y = span
    right, top = np.float32(size[0] - room + 1), np.float32(size[1] - room + 1)
    last_column, last_line = np.int32(size[0] - room), np.int32(size[1] - room)
    a1, a2, a3 = np.float32(form[0, 0]), np.float32(form[0, 1] * y + form[0, 2]), np.float32(form[0, 3])
    b1, b2, b3 = np.float32(form[1, 0]), np.float32(form[1, 1] * y + form[1, 2]), np.float32(form[1, 3])
    c1, c2, c3 = np.float32(form[2, 0]), np.float32(form[2, 1] * y + form[2, 2]), np.float32(form[2, 3])
    aside, close, value = row.aside[first:last], row.close[first:last], row.value[first:last]
    across, along, texel = row.across[first:last], row.along[first:last], row.texel[first:last]
    for k in range(len(texel)):
        depth = ONE / max(close[k], _TINY)
        a, b = (a1 * aside[k] + a2) * depth + a3, (b1 * aside[k] + b2) * depth + b3
        inner_a, inner_b = min(max(a, NONE), right), min(max(b, NONE), top)
        column, line = min(np.int32(inner_a), last_column), min(np.int32(inner_b), last_line)
        value[k] = (c1 * aside[k] + c2) * depth + c3 if a == inner_a and b == inner_b else _INFINITE
        across[k], along[k] = inner_a - np.float32(column), inner_b - np.float32(line)
        texel[k] = line * size[0] + column
