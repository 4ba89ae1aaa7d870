"""Spheres, and discs, at the pixels of a picture: where they are the nearest so far (see visibility.py)."""

from __future__ import annotations

import math

import numpy as np

from particlesim.core.jit import kernel


@kernel
def span(low, high, middle, scale, first, last):
    """The pixels of ``first .. last`` whose middles lie between two lines [m at distance 1]: first, past last."""
    return pixels(middle + scale * low - 0.5, middle + scale * high - 0.5, first, last)


@kernel
def pixels(start, end, first, last):
    """The whole numbers of ``first .. last`` from ``start`` to ``end``: first, past last."""
    # Compared as numbers first: a line may be farther away than an integer can say.
    start = first if start <= first else (last if start >= last else math.ceil(start))
    end = first if end < first else (last if end >= last - 1 else math.floor(end) + 1)
    return int(start), int(end)


@kernel
def trace_disc(x, y, z, radius, window, close):
    """A disc that faces a parallel view."""
    middle_x, middle_y, scale, first, last = window
    low, high = span(y - radius, y + radius, middle_y, scale, 0, len(close))
    for row in range(low, high):
        aside = (row + 0.5 - middle_y) / scale - y
        half = math.sqrt(max(radius * radius - aside * aside, 0.0))
        start, end = span(x - half, x + half, middle_x, scale, first, last)
        for column in range(start, end):
            close[row, column] = max(close[row, column], -z)


@kernel
def trace_sphere(i, x, y, z, radius, window, close, owner):
    """A sphere before the eye: where the ray (u, v, 1) t meets it first, t^2 (d.d) - 2 t (d.c) + c.c - r^2 = 0."""
    middle_x, middle_y, scale, first, last = window
    power = x * x + y * y + z * z - radius * radius
    # The rows between the two planes through the eye that touch it, and in a row the columns between two rays that do.
    reach = radius * math.sqrt(y * y + z * z - radius * radius)
    across = z * z - radius * radius
    low, high = span((y * z - reach) / across, (y * z + reach) / across, middle_y, scale, 0, len(close))
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
        start, end = pixels(left, right, 0, close.shape[1])
        there = np.float32((w + (start + 0.5 - middle_x) * pixel * x) * per_power)
        before, beyond = np.float32(start - left), np.float32(right - start)
        begin = max(start, first)
        closest, owners = close[row, begin : min(end, last)], owner[row, begin : min(end, last)]
        for k in range(len(closest)):
            t = np.float32(begin - start + k)
            q = there + slope * t + bend * math.sqrt(max((before + t) * (beyond - t), np.float32(0.0)))
            nearer = closest[k] < q
            closest[k] = q if nearer else closest[k]
            owners[k] = i if nearer else owners[k]


@kernel
def trace_sphere_beside(i, x, y, z, radius, window, close, owner):
    """A sphere that reaches beside the eye: any pixel may see it. None does from within."""
    middle_x, middle_y, scale, first, last = window
    power = x * x + y * y + z * z - radius * radius
    if power <= 0.0:
        return
    for row in range(len(close)):
        v = (row + 0.5 - middle_y) / scale
        for column in range(first, last):
            u = (column + 0.5 - middle_x) / scale
            b = u * x + v * y + z
            root = b * b - (1.0 + u * u + v * v) * power
            if b > 0.0 and root >= 0.0:
                q = (b + math.sqrt(root)) / power
                if close[row, column] < q:
                    close[row, column] = q
                    owner[row, column] = i
