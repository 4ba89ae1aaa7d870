"""Which particles are wholly hidden behind others, found before they are drawn: in a heap of many, nearly all."""

from __future__ import annotations

import math

import numpy as np

from particlesim.jit import kernel

# Edge of the squares in which coverage is noted [pixels]: smaller ones find more, larger ones cost less.
_SQUARE = 1


def in_sight(seen: np.ndarray, inner: np.ndarray, outer: np.ndarray, slope: float, size: tuple[int, int]) -> np.ndarray:
    """Which particles may be seen, (n,) bool; those left out change no pixel.

    ``seen`` (n, 3) float64: centres in camera axes [m], nearest first (by their distance along the camera's axis);
    ``inner`` and ``outer`` (n,) radii of spheres within and about each particle [m]; ``slope``: tangent of half the
    vertical field of view; ``size``: width and height of the picture [pixels].
    """
    scale = 0.5 * size[1] / (slope * _SQUARE)
    squares = np.full((-(-size[1] // _SQUARE), -(-size[0] // _SQUARE)), np.inf)
    visible = np.ones(len(seen), dtype=np.bool_)
    _mark_visible(seen, inner, outer, scale, 0.5 * size[0] / _SQUARE, 0.5 * size[1] / _SQUARE, squares, visible)
    return visible


@kernel
def _mark_visible(seen, inner, outer, scale, middle_x, middle_y, squares, visible):
    """``squares`` keeps the distance behind which nothing is seen through each square of the picture."""
    for i in range(len(seen)):
        x, y, away = seen[i, 0], seen[i, 1], -seen[i, 2]
        near, far = away - outer[i], away + outer[i]
        if near <= 0.0:
            # About or behind the camera: some of it may be seen.
            continue
        # The square about the particle, as large on the picture as any part of it is.
        left = middle_x + scale * min((x - outer[i]) / near, (x - outer[i]) / far)
        right = middle_x + scale * max((x + outer[i]) / near, (x + outer[i]) / far)
        low = middle_y + scale * min((y - outer[i]) / near, (y - outer[i]) / far)
        high = middle_y + scale * max((y + outer[i]) / near, (y + outer[i]) / far)
        visible[i] = _any_open(squares, left, right, low, high, near)
        if visible[i]:
            # Every ray through the disc that cuts the inner sphere in half meets that sphere before the disc.
            cover = scale * inner[i] / away
            _cover(squares, middle_x + scale * x / away, middle_y + scale * y / away, cover, away)


@kernel
def _any_open(squares, left, right, low, high, near):
    """Whether something at distance ``near`` is seen in any of the squares between the four lines."""
    rows, columns = squares.shape
    if right < 0.0 or high < 0.0 or left > columns or low > rows:
        return False
    for row in range(max(0, math.floor(low)), min(rows - 1, math.floor(high)) + 1):
        for column in range(max(0, math.floor(left)), min(columns - 1, math.floor(right)) + 1):
            if squares[row, column] >= near:
                return True
    return False


@kernel
def _cover(squares, x, y, radius, away):
    """Note that the squares wholly inside a circle hide what is farther than ``away``."""
    rows, columns = squares.shape
    for row in range(max(0, math.ceil(y - radius)), min(rows, math.floor(y + radius))):
        # The corners farthest from the middle decide.
        dy = max(abs(row - y), abs(row + 1 - y))
        if dy < radius:
            half = math.sqrt(radius * radius - dy * dy)
            first, last = max(0, math.ceil(x - half)), min(columns, math.floor(x + half))
            for column in range(first, last):
                squares[row, column] = min(squares[row, column], away)
