"""How much of the key light reaches what pixels see: looked up in the shadow map."""

from __future__ import annotations

from particlesim.core.jit import kernel
from particlesim.rendering.shading.light import NONE, ONE
from particlesim.rendering.shading.pixel_row import locate


@kernel
def light_row(y, lighting, row):
    """Fill in ``row.lit``; ``y`` of the rays of this row. Beyond the map all is lit."""
    height, width = lighting.closeness.shape
    closeness = lighting.closeness.reshape(-1)
    locate((0, len(row.lit), y), lighting.to_map, (width, height), 2, row)
    for k in range(len(row.lit)):
        at, z, share = row.texel[k], row.value[k], row.across[k]
        low, at = _open(closeness[at], z) * (ONE - share) + _open(closeness[at + 1], z) * share, at + width
        high = _open(closeness[at], z) * (ONE - share) + _open(closeness[at + 1], z) * share
        row.lit[k] = low + row.along[k] * (high - low)


@kernel
def _open(texel, z):
    return ONE if texel <= z else NONE
