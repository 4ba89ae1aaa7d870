"""Pixels that see a face of a polyhedron: matt, and a little darker along its edges."""

from __future__ import annotations

import math

import numpy as np

from particlesim.core.jit import kernel
from particlesim.rendering.shading.light import KEY, NONE, ONE, ambient, encode, packed, single

# Along its edges a face is darker by this share, less and less so up to this distance on the screen [pixels].
_DARKER = np.float32(0.2)
_RIM = np.float32(2.0)
_SLOPE = np.float32(0.75)  # over one and a third pixels


@kernel
def shade_face(span, face, paint, lighting, background, row, pixels, sky):
    """Shade some pixels of a row, ``pixels`` (width,) int32, of which ``row.share`` says how much they show the rim.

    ``span``: the first, past the last; ``face``: FACE_IN_VIEW; ``paint``, ``sky``: as for ``shade_round``.
    """
    first, last, _ = span
    normal, facing = single(face.normal), face.facing
    back, zenith, light = single(background), single(lighting.zenith), single(lighting.towards)
    share, haze = np.float32(paint[3]), np.float32(paint[4])
    upward = normal[0] * zenith[0] + normal[1] * zenith[1] + normal[2] * zenith[2]
    towards = max(normal[0] * light[0] + normal[1] * light[1] + normal[2] * light[2], NONE)
    red, green, blue = single(paint)
    r, rk = red * share * ambient(0, upward, facing), red * KEY[0] * towards
    g, gk = green * share * ambient(1, upward, facing), green * KEY[1] * towards
    b, bk = blue * share * ambient(2, upward, facing), blue * KEY[2] * towards
    lit, rim, out = row.lit[first:last], row.share[first:last], pixels[first:last]
    for k in range(len(out)):
        key, left, reaching = lit[k], ONE - _DARKER * rim[k], ONE
        if sky is not None:
            reaching = sky[first + k]
        out[k] = packed(
            left * encode(r * reaching + key * rk, back[0], haze),
            left * encode(g * reaching + key * gk, back[1], haze),
            left * encode(b * reaching + key * bk, back[2], haze),
        )


@kernel
def find_rim(span, face, edges, row):
    """Write into ``row.share`` how much each pixel of a span shows the rim of a face, 0 .. 1.

    ``span``: the first, past the last, y of their rays; ``edges``: see FacesInView. How far what a pixel sees is from
    an edge changes evenly along a row.
    """
    first, last, y = span
    share, v = row.share[first:last], np.float32(y)
    count = len(share)
    share[:] = NONE
    left, right = row.aside[first], row.aside[last - 1]
    for e in range(face.first, face.last):
        start, end = _ends(edges[e, 0], left, right, v)
        if min(start, end) < _RIM:
            slope = (end - start) / np.float32(max(count - 1, 1))
            low, high = _beside(edges[e], left, right, v, count)
            for k in range(low, high):
                near = min(_SLOPE * (_RIM - (start + slope * np.float32(k))), ONE)
                share[k] = max(share[k], near)


@kernel
def _ends(form, left, right, v):
    """A form of rays at the first and the last ones of a span."""
    ahead = form[1] * v + form[2]
    return form[0] * left + ahead, form[0] * right + ahead


@kernel
def _beside(edge, left, right, v, count):
    """The first, and past the last, of ``count`` pixels of a span that are beside what is seen of an edge."""
    low, high = 0, count
    for side in range(1, 3):
        start, end = _ends(edge[side], left, right, v)
        if start < NONE and end < NONE:
            return 0, 0
        zero = np.float32(count - 1) * start / (start - end) if start != end else NONE
        if start < NONE:
            low = max(low, math.ceil(zero))
        elif end < NONE:
            high = min(high, math.floor(zero) + 1)
    return low, high
