"""Hulls at the pixels of a picture: where they are the nearest so far (see visibility.py).

Along a row of pixels the closeness of a plane changes evenly. The planes that face the one who looks bound that of the
hull from above, the others from below, and a pixel sees the hull where that leaves room between them.
"""

from __future__ import annotations

import math

import numpy as np

from particlesim.jit import kernel
from particlesim.vec import apply_transposed, matrix_of, row4, vector

# OpenGL moves corners to places that it can tell apart, by at most 1/256 of a pixel: a hull hides only what is hidden
# by it wherever within this [pixels] it is drawn, and is left out only if nobody saw it there.
_MOVED = 1.0 / 128.0

# Closeness is kept in single precision: what is nearer by less than this share is not hidden.
ROUNDING = 1e-6


@kernel
def turned(axes, orientation, i):
    """The matrix from a particle's own axes to those of the one who looks, row by row."""
    own = matrix_of(row4(orientation, i))
    return (
        apply_transposed(own, vector(axes[0])),
        apply_transposed(own, vector(axes[1])),
        apply_transposed(own, vector(axes[2])),
    )


@kernel
def sides_of(x, y, z, size, m, planes, first, count, parallel, window, sides):
    """Closeness of a hull's planes as right * column + up * row + there, and how much that is in a pixel's diagonal.

    Planes that face the one who looks come first; returns how many they are.
    """
    middle_x, middle_y, scale, _, _ = window
    facing, away = 0, count
    for f in range(count):
        a, b, c, h = planes[first + f, 0], planes[first + f, 1], planes[first + f, 2], planes[first + f, 3]
        nx = m[0][0] * a + m[0][1] * b + m[0][2] * c
        ny = m[1][0] * a + m[1][1] * b + m[1][2] * c
        nz = m[2][0] * a + m[2][1] * b + m[2][2] * c
        offset = nx * x + ny * y + nz * z + h * size
        if parallel:
            # A plane seen from its edge is as good as one that turns away a little.
            nz = nz if abs(nz) > 1e-9 else 1e-9
            faces, right, up, there = nz < 0.0, nx / nz, ny / nz, -offset / nz
        else:
            tiny = 1e-9 * size
            offset = offset if abs(offset) > tiny else tiny
            faces, right, up, there = offset < 0.0, nx / offset, ny / offset, nz / offset
        if faces:
            place = facing
            facing += 1
        else:
            away -= 1
            place = away
        right, up = right / scale, up / scale
        sides[place, 0] = right
        sides[place, 1] = up
        sides[place, 2] = there + right * (0.5 - middle_x) + up * (0.5 - middle_y)
        sides[place, 3] = abs(right) + abs(up)
    return facing


@kernel
def _most(sides, facing, row, column, grown):
    """The greatest closeness of a hull at a pixel, by the planes that face the eye, grown by a part of a pixel."""
    most = np.inf
    for f in range(facing):
        most = min(most, sides[f, 0] * column + sides[f, 1] * row + sides[f, 2] + grown * sides[f, 3])
    return most


@kernel
def _room(sides, facing, count, row, column, grown):
    """By how much the planes of a hull leave room for it at a pixel, below 0 if it is not seen; and how that grows."""
    most, least = np.inf, -np.inf
    slope_most = slope_least = 0.0
    for f in range(count):
        q = sides[f, 0] * column + sides[f, 1] * row + sides[f, 2]
        if f < facing:
            q += grown * sides[f, 3]
            if q < most:
                most, slope_most = q, sides[f, 0]
        else:
            q -= grown * sides[f, 3]
            if q > least:
                least, slope_least = q, sides[f, 0]
    return most - least, slope_most - slope_least


@kernel
def _border(sides, facing, count, row, column, end, grown):
    """Where a row of pixels comes into a hull on its way from ``column`` to ``end``, or beyond that if it never does.

    The room for the hull is concave along the row: the root of its slope is never beyond the border, and each planes'
    corner is passed once.
    """
    way = 1.0 if end >= column else -1.0
    for _ in range(count):
        room, slope = _room(sides, facing, count, row, column, grown)
        if room >= 0.0:
            return column
        if slope * way <= 0.0:
            return end + way
        column -= room / slope
        if (column - end) * way > 0.0:
            return column
    return column


@kernel
def _seen_in_row(sides, facing, count, row, start, end, grown):
    """The pixels ``start .. end`` of a row whose middles see a hull: the first, and one past the last."""
    left = _border(sides, facing, count, row, float(start), end - 1.0, grown)
    if left > end - 1.0:
        return start, start
    right = _border(sides, facing, count, row, end - 1.0, left, grown)
    return math.ceil(left), math.floor(right) + 1


@kernel
def trace_hull(sides, facing, count, box, close, owner):
    """Whether a hull may be seen; it hides what is behind it."""
    seen = False
    for row in range(box[0], box[1]):
        start, end = _seen_in_row(sides, facing, count, row, box[2], box[3], -_MOVED)
        for column in range(start, end):
            most = _most(sides, facing, row, column, -_MOVED)
            if close[row, column] < most:
                close[row, column] = most
                owner[row, column] = -1
                seen = True
    return seen or _peeps_out(sides, facing, count, box, close)


@kernel
def _peeps_out(sides, facing, count, box, close):
    """Whether any pixel might see a hull that is a little larger, and nearer, than it is."""
    for row in range(box[0], box[1]):
        start, end = _seen_in_row(sides, facing, count, row, box[2], box[3], _MOVED)
        for column in range(start, end):
            if close[row, column] < _most(sides, facing, row, column, _MOVED) * (1.0 + ROUNDING):
                return True
    return False


@kernel
def cast_hull(sides, facing, count, box, close):
    """A hull in the light hides it from what is behind its rear."""
    for row in range(box[0], box[1]):
        start, end = _seen_in_row(sides, facing, count, row, box[2], box[3], 0.0)
        for column in range(start, end):
            rear = -np.inf
            for f in range(facing, count):
                rear = max(rear, sides[f, 0] * column + sides[f, 1] * row + sides[f, 2])
            close[row, column] = max(close[row, column], rear)
