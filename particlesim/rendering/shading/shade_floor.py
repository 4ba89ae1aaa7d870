"""Pixels that see the floor, or nothing."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from particlesim.core.jit import kernel
from particlesim.rendering.shading.light import HALF, NONE, ONE, TWO, packed, single
from particlesim.rendering.shading.pixel_row import locate

# Less than a step of grey at random hides the bands of a slow fade (interleaved gradient noise: J. Jimenez, "Next
# generation post processing in Call of Duty: Advanced Warfare", SIGGRAPH 2014).
_NOISE = np.float32(52.9829189), np.float32(0.06711056), np.float32(0.00583715)
_STEP = np.float32(1.0 / 255.0)

_TINY = np.float32(1e-12)

# The light from everywhere at the floor, as a share of all its light.
_AMBIENT = np.float32(0.4)


class Ground(NamedTuple):
    """The background, and the floor before it, which is seen from above only: from below one looks through it.

    Parameters
    ----------
    colours : (3, 3) float64
        sRGB 0 .. 1, row by row of the background, and of the floor in the key light and in the shadow.
    lower, upper : (2,) float64
        Corners of the floor, between which it is whole [m].
    height, rim : float
        Its z, and the width of the rim around it over which it fades [m].
    light : (b, a) float32
        Share of the light that reaches the floor, from its lower corner to its upper one, rims included; (0, 0) if
        there is no floor.
    """

    colours: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    height: float
    rim: float
    light: np.ndarray


@kernel
def find_floor(y, strip, ground, seen, row):
    """Find the floor in a row, of whose rays ``y`` is the same, where no instance is seen.

    ``seen``: inverse depth of the instances. ``row.close`` becomes that of what each pixel sees, 0 where that is
    nothing, and ``row.share`` how much it shows of the floor.
    """
    below = ground.height - strip.eye[2]
    nothing = ground.light.size == 0 or below >= 0.0
    up, east, north = _along(strip, 2), _along(strip, 0), _along(strip, 1)
    per = np.float32(0.0 if nothing else 1.0 / below)
    half_x, middle_x = _half_and_middle(ground, 0)
    half_y, middle_y = _half_and_middle(ground, 1)
    east_off, north_off, rim, v = east[3] - middle_x, north[3] - middle_y, np.float32(ground.rim), np.float32(y)
    aside, close, share = row.aside, row.close, row.share
    for k in range(len(seen)):
        here = (up[0] * aside[k] + (up[1] * v + up[2])) * per
        depth = ONE / max(here, _TINY)
        past_x = max(abs((east[0] * aside[k] + (east[1] * v + east[2])) * depth + east_off) - half_x, NONE)
        past_y = max(abs((north[0] * aside[k] + (north[1] * v + north[2])) * depth + north_off) - half_y, NONE)
        past = min(math.sqrt(past_x * past_x + past_y * past_y) / rim, ONE)
        left = ONE - past * past * (np.float32(3.0) - TWO * past)
        left = NONE if nothing or here <= NONE else left
        share[k] = left
        close[k] = seen[k] if seen[k] > NONE else (here if left > NONE else NONE)


@kernel
def shade_floor(span, number, to_map, ground, row, pixels, shares):
    """Shade some pixels of a row, ``pixels`` (width,) int32, that see the floor.

    ``span``: the first, past the last, y of their rays; ``number`` of the row; ``to_map``: see ``floor_form``;
    ``shares``: None, or a row of the shares of the light from everywhere that reach it.
    """
    first, last, _ = span
    rows, columns = ground.light.shape
    locate(span, to_map, (columns, rows), 2, row)
    light, sky = ground.light.reshape(-1), row.value[first:last]
    across, along, texel = row.across[first:last], row.along[first:last], row.texel[first:last]
    for k in range(len(sky)):
        at = texel[k]
        low, at = light[at] + across[k] * (light[at + 1] - light[at]), at + columns
        high = light[at] + across[k] * (light[at + 1] - light[at])
        sky[k] = low + along[k] * (high - low)
    back, bright, dark = single(ground.colours[0]), single(ground.colours[1]), single(ground.colours[2])
    start, line = np.float32(first + 0.5), np.float32(number + 0.5)
    share, lit, out = row.share[first:last], row.lit[first:last], pixels[first:last]
    if shares is not None:
        for k in range(len(out)):
            sky[k] *= ONE - _AMBIENT * (ONE - shares[first + k])
    for k in range(len(out)):
        noise = _noise(start + np.float32(k), line) * share[k] * _STEP
        out[k] = packed(
            back[0] + share[k] * ((dark[0] + lit[k] * (bright[0] - dark[0])) * sky[k] - back[0]) + noise,
            back[1] + share[k] * ((dark[1] + lit[k] * (bright[1] - dark[1])) * sky[k] - back[1]) + noise,
            back[2] + share[k] * ((dark[2] + lit[k] * (bright[2] - dark[2])) * sky[k] - back[2]) + noise,
        )


@kernel
def floor_form(strip, ground):
    """From places in view coordinates to columns and rows of the floor's map, as ``locate`` has them."""
    form = np.zeros((3, 4))
    for axis in range(2):
        points = ground.light.shape[1 - axis]
        start = ground.lower[axis] - ground.rim
        scale = points / (ground.upper[axis] + ground.rim - start)
        for k in range(3):
            form[axis, k] = scale * strip.axes[k, axis]
        form[axis, 3] = scale * (strip.eye[axis] - start) - 0.5
    return form


@kernel
def shade_nothing(span, ground, pixels):
    """Fill some pixels of a row with the background."""
    back = single(ground.colours[0])
    pixels[span[0] : span[1]] = packed(back[0], back[1], back[2])


@kernel
def _half_and_middle(ground, axis):
    """Half the width of the whole floor along an axis, and its middle."""
    lower, upper = ground.lower[axis], ground.upper[axis]
    return np.float32(0.5 * (upper - lower)), np.float32(0.5 * (upper + lower))


@kernel
def _along(strip, axis):
    """A coordinate in the world as a form of a place in view coordinates: three factors, and what is added."""
    axes = strip.axes
    a, b, c = single((axes[0, axis], axes[1, axis], axes[2, axis]))
    return a, b, c, np.float32(strip.eye[axis])


@kernel
def _noise(x, y):
    """Between -1/2 and 1/2."""
    inner = x * _NOISE[1] + y * _NOISE[2]
    inner -= np.float32(np.int32(inner))
    outer = _NOISE[0] * inner
    return outer - np.float32(np.int32(outer)) - HALF
