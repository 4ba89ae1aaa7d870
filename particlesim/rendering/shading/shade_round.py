"""Pixels that see a ball, or a part of a rounded shape: glossy, and matt below that."""

from __future__ import annotations

import math

import numpy as np

from particlesim.core.jit import kernel
from particlesim.rendering.shading.light import KEY, NONE, ONE, TWO, ambient, encode, packed, single

_GLOSS = np.float32(0.22)

# Shadows end in ragged edges where light grazes; on a round body the key light is faded out from this cosine on.
_GRAZING = np.float32(0.3)


@kernel
def shade_round(span, form, paint, lighting, background, row, pixels, sky):
    """Shade some pixels of a row, ``pixels`` (width,) int32.

    ``span``: the first, past the last, and y of their rays; ``form``: a point, an axis, 1 / radius, and a vector that
    is the normal where the radius is infinite, else 0: a sphere has no axis (0), a cylinder a unit vector along it.
    ``paint``: linear colour, share of the ambient light, and of the background in it; ``sky``: None, or a row of such
    shares, times that.
    """
    first, last, y = span
    centre, axis, flat = single(form[0]), single(form[1]), single(form[3])
    bend, v = np.float32(form[2]), np.float32(y)
    red, green, blue = np.float32(paint[0]), np.float32(paint[1]), np.float32(paint[2])
    share, haze = np.float32(paint[3]), np.float32(paint[4])
    back, light, zenith = single(background), single(lighting.towards), single(lighting.zenith)
    # Slices, whose numbers begin at 0: only loops over these are done eight at a time.
    aside, close, lit, out = row.aside[first:last], row.close[first:last], row.lit[first:last], pixels[first:last]
    for k in range(len(out)):
        u, depth = aside[k], ONE / close[k]
        a, b, c = u * depth - centre[0], v * depth - centre[1], depth - centre[2]
        along = a * axis[0] + b * axis[1] + c * axis[2]
        nx = flat[0] + (a - along * axis[0]) * bend
        ny = flat[1] + (b - along * axis[1]) * bend
        nz = flat[2] + (c - along * axis[2]) * bend
        per = ONE / math.sqrt(u * u + v * v + ONE)
        facing = -(nx * u + ny * v + nz) * per
        towards = nx * light[0] + ny * light[1] + nz * light[2]
        # Half way between the eye and the light the surface shines most.
        between = TWO - TWO * per * (u * light[0] + v * light[1] + light[2])
        gloss = max((towards + facing) / math.sqrt(between), NONE)
        gloss *= gloss
        gloss *= gloss
        gloss *= gloss
        gloss *= gloss
        gloss *= gloss
        step = min(max(towards / _GRAZING, NONE), ONE)
        key = lit[k] * max(towards, NONE) * step * step * (np.float32(3.0) - TWO * step)
        shine = lit[k] * _GLOSS * gloss
        reaching = share
        if sky is not None:
            reaching = share * sky[first + k]
        upward = nx * zenith[0] + ny * zenith[1] + nz * zenith[2]
        out[k] = packed(
            encode(red * (reaching * ambient(0, upward, facing) + KEY[0] * key) + shine, back[0], haze),
            encode(green * (reaching * ambient(1, upward, facing) + KEY[1] * key) + shine, back[1], haze),
            encode(blue * (reaching * ambient(2, upward, facing) + KEY[2] * key) + shine, back[2], haze),
        )
