"""Dark lines where one body ends before another, or before nothing: found in what each pixel sees."""

from __future__ import annotations

import math

import numpy as np

from particlesim.core.jit import entry_kernel, kernel, without_refcounts
from particlesim.core.parallel import ThreadTeam
from particlesim.rendering.visibility.rasterise import VisibilityBuffer

# How much darker a line is than what it is on.
_DARKER = 0.85

# A line takes no more of the radius of what it is about: of a million bodies there would be nothing but lines.
_SHARE = 0.15


def draw_outlines(
    colours: np.ndarray, buffer: VisibilityBuffer, body: np.ndarray, radius: np.ndarray, width: float
) -> None:
    """Draw lines into a picture, on the nearer side of each edge.

    Parameters
    ----------
    colours : (h, w, 4) uint8
        The picture.
    buffer : VisibilityBuffer
        What each pixel sees.
    body : (m,) int64
        A number for each instance; those with the same are one body, as the triangles of a mesh are.
    radius : (m,) float64
        Their radii in pixels at distance 1 m.
    width : float
        Of lines [pixels].
    """

    def fill(_: int, first: int, last: int) -> None:
        _draw_rows((first, last), buffer, body, radius, width, colours)

    team = ThreadTeam(buffer.id.size)
    team.each(fill, len(colours), 4 * team.threads)


@entry_kernel
def _draw_rows(rows, buffer, body, radius, width, colours):
    buffer, body, radius = without_refcounts(buffer), without_refcounts(body), without_refcounts(radius)
    colours = without_refcounts(colours)
    for row in range(rows[0], rows[1]):
        for column in range(buffer.id.shape[1]):
            i = buffer.id[row, column]
            if i >= 0:
                wide = min(width, _SHARE * radius[i] * buffer.inverse_depth[row, column])
                left = 1.0 - _DARKER * _covered(row, column, buffer, body, wide)
                if left < 1.0:
                    for channel in range(3):
                        colours[row, column, channel] = np.uint8(left * colours[row, column, channel] + 0.5)


@kernel
def _covered(row, column, buffer, body, wide):
    """How much of a pixel a line covers, 0 .. 1: the nearest pixel counts that sees something else, farther away."""
    height, width = buffer.id.shape
    reach, here = math.ceil(wide), buffer.inverse_depth[row, column]
    own, nearest = body[buffer.id[row, column]], (wide + 1.0) ** 2
    for r in range(max(row - reach, 0), min(row + reach + 1, height)):
        for c in range(max(column - reach, 0), min(column + reach + 1, width)):
            i = buffer.id[r, c]
            if buffer.inverse_depth[r, c] < here and (i < 0 or body[i] != own):
                nearest = min(nearest, float((r - row) ** 2 + (c - column) ** 2))
    return min(max(wide + 1.0 - math.sqrt(nearest), 0.0), 1.0)
