"""Spheres, and discs, at the pixels of a picture: where they are the nearest so far (see visibility.py)."""

from __future__ import annotations

import math

from particlesim.jit import kernel

# Edge of the squares of the picture that are noted as holding spheres [pixels].
TILE = 16


@kernel
def span(low, high, middle, scale, first, last):
    """The pixels of ``first .. last`` whose middles lie between two lines [m at distance 1]: first, past last."""
    start = middle + scale * low - 0.5
    end = middle + scale * high - 0.5
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
def trace_sphere(i, x, y, z, radius, window, close, owner, tiles):
    """A sphere before the eye: where the ray (u, v, 1) t meets it first, t^2 (d.d) - 2 t (d.c) + c.c - r^2 = 0."""
    middle_x, middle_y, scale, first, last = window
    power = x * x + y * y + z * z - radius * radius
    # The rows between the two planes through the eye that touch it, and in a row the columns between two rays that do.
    reach = radius * math.sqrt(y * y + z * z - radius * radius)
    across = z * z - radius * radius
    low, high = span((y * z - reach) / across, (y * z + reach) / across, middle_y, scale, 0, len(close))
    front = 1.0 / (z - radius)
    across = power - x * x
    for row in range(low, high):
        v = (row + 0.5 - middle_y) / scale
        w, g = v * y + z, 1.0 + v * v
        half = math.sqrt(max(x * x * w * w + across * (w * w - g * power), 0.0))
        start, end = span((x * w - half) / across, (x * w + half) / across, middle_x, scale, first, last)
        found = False
        for column in range(start, end):
            if close[row, column] < front:
                u = (column + 0.5 - middle_x) / scale
                b = u * x + w
                q = (b + math.sqrt(max(b * b - (g + u * u) * power, 0.0))) / power
                if close[row, column] < q:
                    close[row, column] = q
                    owner[row, column] = i
                    found = True
        if found:
            for tile in range(start // TILE, (end - 1) // TILE + 1):
                tiles[row // TILE, tile] = True


@kernel
def trace_sphere_beside(i, x, y, z, radius, window, close, owner, tiles):
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
                    tiles[row // TILE, column // TILE] = True
