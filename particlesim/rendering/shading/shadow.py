"""How much of the key light reaches what pixels see: looked up in the shadow map.

The light comes from a small disc of the sky, not from a point, so shadows have soft edges: looked at are nine squares
of the map around a place, and what the place is not behind lights it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from particlesim.core.jit import entry_kernel, kernel
from particlesim.core.parallel import ThreadTeam
from particlesim.rendering.shading.light import HALF, NONE, ONE
from particlesim.rendering.shading.pixel_row import locate

# Squares of the map, a texel each, that light is looked for in, on each axis; they lie between so many texels.
SQUARES = 3
_TEXELS = SQUARES + 1
_SHARE = np.float32(1.0 / SQUARES**2)


class ShadowMap(NamedTuple):
    """What the key light sees, all (h, w) float32 [m].

    Parameters
    ----------
    closeness
        How close to the light what each texel meets is.
    least, most
        Of the 4 x 4 texels from each on; behind all of them all is dark, before all of them all is lit.
    """

    closeness: np.ndarray
    least: np.ndarray
    most: np.ndarray


def shadow_map(closeness: np.ndarray) -> ShadowMap:
    """The map whose texels meet what is so close to the light, (h, w) float32 [m]."""
    found = ShadowMap(closeness, np.empty_like(closeness), np.empty_like(closeness))
    rows = max(len(closeness) - _TEXELS + 1, 0)
    ThreadTeam(closeness.size).each(lambda _, first, last: _fill_bounds(found, first, last), rows)
    return found


@entry_kernel
def _fill_bounds(found, first, last):
    """Fill in the bounds of some rows."""
    closeness, width = found.closeness, found.closeness.shape[1]
    low, high = np.empty(width, dtype=np.float32), np.empty(width, dtype=np.float32)
    for row in range(first, last):
        a, b, c, d = closeness[row], closeness[row + 1], closeness[row + 2], closeness[row + 3]
        for k in range(width):
            low[k], high[k] = min(a[k], b[k], c[k], d[k]), max(a[k], b[k], c[k], d[k])
        least, most = found.least[row], found.most[row]
        for k in range(width - 3):
            least[k] = min(low[k], low[k + 1], low[k + 2], low[k + 3])
            most[k] = max(high[k], high[k + 1], high[k + 2], high[k + 3])


@kernel
def light_row(span, y, lighting, row):
    """Fill in ``row.lit`` for a span of pixels, the first to before the last, of whose rays ``y`` is the same.

    Beyond the map all is lit.
    """
    height, width = lighting.shadow.closeness.shape
    first, last = span
    locate((first, last, y), lighting.to_map, (width, height), _TEXELS, row)
    least, most = lighting.shadow.least.reshape(-1), lighting.shadow.most.reshape(-1)
    lit, value, texel = row.lit[first:last], row.value[first:last], row.texel[first:last]
    across, along = row.across[first:last], row.along[first:last]
    for k in range(len(lit)):
        lit[k] = ONE if most[texel[k]] <= value[k] else (NONE if least[texel[k]] > value[k] else HALF)
    # What is all lit or all dark is most, and found. The rest is looked at texel by texel.
    closeness = lighting.shadow.closeness.reshape(-1)
    for k in range(len(lit)):
        if lit[k] == HALF:
            lit[k] = _share_lit(closeness, width, texel[k], value[k], (across[k], along[k]))


@kernel
def _share_lit(closeness, width, at, z, part):
    """How much of nine squares, ``part`` of a texel on from the corner of 4 x 4, what is at ``z`` is not behind."""
    total = NONE
    for line in range(_TEXELS):
        a, b = _open(closeness[at], z), _open(closeness[at + 1], z)
        c, d = _open(closeness[at + 2], z), _open(closeness[at + 3], z)
        weight = ONE - part[1] if line == 0 else (part[1] if line == SQUARES else ONE)
        total += weight * (a + b + c + part[0] * (d - a))
        at += width
    return total * _SHARE


@kernel
def _open(texel, z):
    return ONE if texel <= z else NONE
