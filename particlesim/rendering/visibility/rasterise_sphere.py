"""Spheres, and discs, at the pixels of a picture where they are the nearest so far (see rasterise.py)."""

from __future__ import annotations

import math

import numpy as np

from particlesim.core.jit import kernel
from particlesim.rendering.visibility.screen_bounds import integer_range, pixel_range


@kernel
def rasterise_disc(centre, radius, strip, inverse_depth):
    """A disc that faces a parallel projection."""
    x, y, z = centre
    scale, middle_x, middle_y = strip.scale, strip.middle_x, strip.middle_y
    low, high = pixel_range(y - radius, y + radius, middle_y, scale, 0, len(inverse_depth))
    for row in range(low, high):
        aside = (row + 0.5 - middle_y) / scale - y
        half = math.sqrt(max(radius * radius - aside * aside, 0.0))
        start, end = pixel_range(x - half, x + half, middle_x, scale, strip.first, strip.last)
        for column in range(start, end):
            inverse_depth[row, column] = max(inverse_depth[row, column], -z)


@kernel
def rasterise_sphere(i, primitive, centre, radius, strip, buffer):
    """A sphere before the eye: where the ray (u, v, 1) t meets it first, t^2 (d.d) - 2 t (d.c) + c.c - r^2 = 0.

    ``primitive`` is its number in a rounded shape, None for a body that is one sphere: compiled apart, since to write
    it takes time.
    """
    x, y, z = centre
    scale, middle_x, middle_y = strip.scale, strip.middle_x, strip.middle_y
    power = x * x + y * y + z * z - radius * radius
    # The rows between the two planes through the eye that touch it, and in a row the columns between two rays that do.
    reach = radius * math.sqrt(y * y + z * z - radius * radius)
    across = z * z - radius * radius
    height, width = buffer.inverse_depth.shape
    low, high = pixel_range((y * z - reach) / across, (y * z + reach) / across, middle_y, scale, 0, height)
    across = power - x * x
    pixel, per_power, per_across = 1.0 / scale, 1.0 / power, 1.0 / across
    bend = np.float32(math.sqrt(across) * pixel * per_power)
    slope = np.float32(x * pixel * per_power)
    for row in range(low, high):
        v = (row + 0.5 - middle_y) * pixel
        w = v * y + z
        half = math.sqrt(max(x * x * w * w + across * (w * w - (1.0 + v * v) * power), 0.0))
        left = middle_x + scale * (x * w - half) * per_across - 0.5
        right = middle_x + scale * (x * w + half) * per_across - 0.5
        # In single precision, by which from these two columns on no digits are lost. The first of the whole row counts,
        # or the number of strips would be seen.
        start, end = integer_range(left, right, 0, width)
        there = np.float32((w + (start + 0.5 - middle_x) * pixel * x) * per_power)
        before, beyond = np.float32(start - left), np.float32(right - start)
        begin, end = max(start, strip.first), min(end, strip.last)
        nearest, ids = buffer.inverse_depth[row, begin:end], buffer.id[row, begin:end]
        for k in range(len(nearest)):
            t = np.float32(begin - start + k)
            q = there + slope * t + bend * math.sqrt(max((before + t) * (beyond - t), np.float32(0.0)))
            nearer = nearest[k] < q
            nearest[k] = q if nearer else nearest[k]
            ids[k] = i if nearer else ids[k]
            if primitive is not None and nearer:
                buffer.primitive[row, begin + k] = primitive


@kernel
def rasterise_near_sphere(i, primitive, centre, radius, strip, buffer):
    """A sphere that reaches beside the eye: any pixel may see it. None does from within."""
    x, y, z = centre
    power = x * x + y * y + z * z - radius * radius
    if power <= 0.0:
        return
    for row in range(len(buffer.inverse_depth)):
        v = (row + 0.5 - strip.middle_y) / strip.scale
        for column in range(strip.first, strip.last):
            u = (column + 0.5 - strip.middle_x) / strip.scale
            b = u * x + v * y + z
            root = b * b - (1.0 + u * u + v * v) * power
            if b > 0.0 and root >= 0.0:
                q = (b + math.sqrt(root)) / power
                if buffer.inverse_depth[row, column] < q:
                    buffer.inverse_depth[row, column] = q
                    buffer.id[row, column] = i
                    if primitive is not None:
                        buffer.primitive[row, column] = primitive
