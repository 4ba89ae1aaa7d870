"""How surfaces send light to the eye, and how that becomes a pixel. Single precision: eight at a time."""

from __future__ import annotations

import math

import numpy as np

from particlesim.core.jit import kernel

# The colours of the light, linear. Sky and ground make the light that comes from everywhere; what the ground sends back
# fills what would be black below.
KEY = np.float32(0.86), np.float32(0.83), np.float32(0.78)
SKY = np.float32(0.44), np.float32(0.47), np.float32(0.52)
GROUND = np.float32(0.31), np.float32(0.295), np.float32(0.28)

NONE, HALF, ONE, TWO = np.float32(0.0), np.float32(0.5), np.float32(1.0), np.float32(2.0)
_FULL = np.float32(255.0)
_OPAQUE = -16777216  # the highest byte of 32 bits


@kernel
def single(v):
    """A vector in single precision."""
    return np.float32(v[0]), np.float32(v[1]), np.float32(v[2])


@kernel
def ambient(channel, upward, towards_eye):
    """Share of the light from everywhere that a matt white surface sends to the eye, in one of three channels.

    ``upward``: the height of its unit normal. Less where it turns away from the eye, which shows its form.
    """
    even = HALF + HALF * upward
    return (GROUND[channel] + even * (SKY[channel] - GROUND[channel])) * (
        np.float32(0.55) + np.float32(0.45) * max(towards_eye, NONE)
    )


@kernel
def encode(light, background, haze):
    """From linear light to sRGB 0 .. 1, with so much of the background's sRGB over it.

    The square root stands for the curve of sRGB at a tenth of its cost; colours come in by the square, so that a colour
    in full light is the one that was asked for.
    """
    return min(math.sqrt(light), ONE) * (ONE - haze) + background * haze


@kernel
def packed(red, green, blue):
    """A pixel of sRGB 0 .. 1 as four bytes, the fourth full."""
    r, g, b = np.int32(red * _FULL + HALF), np.int32(green * _FULL + HALF), np.int32(blue * _FULL + HALF)
    return np.int32(r | g << 8 | b << 16 | _OPAQUE)
