"""Bounds on the screen: which pixels something may cover, and how near it may be there."""

from __future__ import annotations

import math

from particlesim.core.jit import kernel

# Inverse depth is kept in single precision: what is nearer by less than this share is not hidden.
_SINGLE_PRECISION = 1e-6


@kernel
def pixel_range(low, high, middle, scale, first, last):
    """The pixels of ``first .. last`` whose middles lie between two lines [m at distance 1]: first, past last."""
    return integer_range(middle + scale * low - 0.5, middle + scale * high - 0.5, first, last)


@kernel
def integer_range(start, end, first, last):
    """The integers of ``first .. last`` from ``start`` to ``end``: first, past last."""
    # Compared as numbers first: a line may be farther away than an integer can say.
    start = first if start <= first else (last if start >= last else math.ceil(start))
    end = first if end < first else (last if end >= last - 1 else math.floor(end) + 1)
    return int(start), int(end)


@kernel
def screen_box(centre, half, strip):
    """The pixels that an axis-aligned box in view coordinates may cover, and the inverse depth that it may reach.

    Pixels as (first row, past the last, first column, past the last). The box is before the eye.
    """
    x, y, z = centre
    # How large a metre is at its rear and at its front, seen from afar as 1 at distance 1.
    least = most = 1.0
    front = half[2] - z
    if not strip.parallel:
        least, most = 1.0 / (z + half[2]), 1.0 / (z - half[2])
        front = most * (1.0 + _SINGLE_PRECISION)
    left, right, low, high = x - half[0], x + half[0], y - half[1], y + half[1]
    left = left * (most if left < 0.0 else least)
    right = right * (most if right > 0.0 else least)
    low = low * (most if low < 0.0 else least)
    high = high * (most if high > 0.0 else least)
    bottom, top = pixel_range(low, high, strip.middle_y, strip.scale, 0, strip.height)
    start, end = pixel_range(left, right, strip.middle_x, strip.scale, strip.first, strip.last)
    return (bottom, top, start, end), front


@kernel
def whole_strip(strip):
    """All pixels of a strip, as ``screen_box`` has them."""
    return 0, strip.height, strip.first, strip.last


@kernel
def outside_frustum(centre, radius, strip):
    """Whether a sphere is beyond one of the four planes through the eye that bound the strip."""
    x, y, z = centre
    right, left = (strip.last - strip.middle_x) / strip.scale, (strip.first - strip.middle_x) / strip.scale
    high, low = (strip.height - strip.middle_y) / strip.scale, -strip.middle_y / strip.scale
    return (
        x - right * z > radius * (1.0 + abs(right))
        or left * z - x > radius * (1.0 + abs(left))
        or y - high * z > radius * (1.0 + abs(high))
        or low * z - y > radius * (1.0 + abs(low))
    )
