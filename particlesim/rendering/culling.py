"""Which particles are wholly hidden behind others, found before they are drawn: in a heap of many, nearly all."""

from __future__ import annotations

import math

import numpy as np

from particlesim.crew import Crew
from particlesim.jit import kernel
from particlesim.rendering.outlook import Outlook, nearest_first


def in_sight(outlook: Outlook, position: np.ndarray, inner: np.ndarray, outer: np.ndarray) -> np.ndarray:
    """Particles that may be seen, (k,) int64, roughly the nearer ones first; those left out change no pixel.

    ``position`` (n, 3) float64; ``inner`` and ``outer`` (n,) float64, radii of spheres within and about each [m].
    """
    order = nearest_first(outlook, position)
    eye, slack = np.ascontiguousarray(outlook.eye), outlook.slack
    axes = np.ascontiguousarray(outlook.axes)

    def seen(_: int, first: int, last: int) -> np.ndarray:
        squares = np.full((outlook.size[1], last - first), np.inf)
        visible = np.zeros(len(position), dtype=np.bool_)
        middle = (0.5 * outlook.size[0] - first, 0.5 * outlook.size[1])
        _mark_visible(
            position, inner, outer, order, axes, eye, outlook.parallel, outlook.scale, middle, slack, squares, visible
        )
        return visible

    # Each thread looks at a strip of the picture: what hides what in it is told by that strip alone.
    with Crew(len(position)) as crew:
        strips = crew.each(seen, outlook.size[0])
    return order[np.logical_or.reduce(strips)[order]]


@kernel
def _mark_visible(position, inner, outer, order, axes, eye, parallel, scale, middle, slack, squares, visible):
    """``squares`` keeps the distance behind which nothing is seen through each square of the picture."""
    for i in order:
        dx, dy, dz = position[i, 0] - eye[0], position[i, 1] - eye[1], position[i, 2] - eye[2]
        x = axes[0, 0] * dx + axes[0, 1] * dy + axes[0, 2] * dz
        y = axes[1, 0] * dx + axes[1, 1] * dy + axes[1, 2] * dz
        away = axes[2, 0] * dx + axes[2, 1] * dy + axes[2, 2] * dz
        near, far = away - outer[i], away + outer[i]
        if parallel:
            least = most = middle_scale = scale
        elif near > 0.0:
            # Squares a metre where the particle is farthest, nearest and in its middle.
            least, most, middle_scale = scale / far, scale / near, scale / away
        else:
            # About or behind the one who looks: some of it may be seen.
            visible[i] = True
            continue
        # The rectangle about the particle, as large in the picture as any part of it is.
        left, right = x - outer[i], x + outer[i]
        low, high = y - outer[i], y + outer[i]
        left = middle[0] + left * (most if left < 0.0 else least)
        right = middle[0] + right * (most if right > 0.0 else least)
        low = middle[1] + low * (most if low < 0.0 else least)
        high = middle[1] + high * (most if high > 0.0 else least)
        if _any_open(squares, left, right, low, high, near):
            visible[i] = True
            # Every ray through the disc that cuts the inner sphere in half meets that sphere before the disc.
            at_x, at_y = middle[0] + middle_scale * x, middle[1] + middle_scale * y
            _cover(squares, at_x, at_y, middle_scale * inner[i], away + slack * outer[i])


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
