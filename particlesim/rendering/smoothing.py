"""Smooths the jagged edges of a picture that has one sample a pixel.

Where brightness steps, a pixel is mixed with the one across the edge, the more the nearer the step of its stair is:
the idea of T. Lottes, "FXAA" (NVIDIA white paper, 2009).
"""

from __future__ import annotations

import numpy as np

from particlesim.crew import Crew
from particlesim.jit import kernel

# Steps of brightness (0 .. 255) below both of these are no edges: the least, and the share of the brightest about.
_DIM = 10.0
_STEEP = 0.07

# How far along an edge its end is looked for [pixels].
_FARTHEST = 16

# How much a pixel that stands out from all about it is drawn in.
_SUBDUED = 0.6


def smooth_edges(image: np.ndarray) -> np.ndarray:
    """A smoother picture, (height, width, 3) uint8; ``image`` (height, width, 4) uint8, as it comes from OpenGL.

    OpenGL's first row is the lowest, that of the result the highest; the fourth channel is left out.
    """
    height, width = image.shape[:2]
    bright = np.empty((height, width), dtype=np.float32)
    smooth = np.empty((height, width, 3), dtype=np.uint8)
    crew = Crew(height * width)
    crew.each(lambda _, first, last: _brightness(image, bright, first, last), height)
    crew.each(lambda _, first, last: _smooth(image, bright, smooth, first, last), height)
    return smooth


@kernel
def _brightness(image, bright, first, last):
    """Brightness as the eye has it: green most, blue least (ITU-R BT.601)."""
    for row in range(first, last):
        for column in range(image.shape[1]):
            red, green, blue = image[row, column, 0], image[row, column, 1], image[row, column, 2]
            bright[row, column] = np.float32(0.299) * red + np.float32(0.587) * green + np.float32(0.114) * blue


@kernel
def _smooth(image, bright, smooth, first, last):
    height, width = bright.shape
    for row in range(first, last):
        out = height - 1 - row
        above, below = min(row + 1, height - 1), max(row - 1, 0)
        for column in range(width):
            right, left = min(column + 1, width - 1), max(column - 1, 0)
            here = bright[row, column]
            n, s, e, w = bright[above, column], bright[below, column], bright[row, right], bright[row, left]
            most = max(here, n, s, e, w)
            least = min(here, n, s, e, w)
            share, across, down = 0.0, column, row
            if most - least > max(_DIM, _STEEP * most):
                ne, nw, se, sw = bright[above, right], bright[above, left], bright[below, right], bright[below, left]
                # The edge runs along the direction in which brightness bends less.
                upright = abs(ne - 2.0 * e + se) + 2.0 * abs(n - 2.0 * here + s) + abs(nw - 2.0 * w + sw)
                sideways = abs(ne - 2.0 * n + nw) + 2.0 * abs(e - 2.0 * here + w) + abs(se - 2.0 * s + sw)
                if upright >= sideways:
                    down = above if abs(n - here) >= abs(s - here) else below
                    share = _share(bright, row, column, down, column, 0, 1)
                else:
                    across = right if abs(e - here) >= abs(w - here) else left
                    share = _share(bright, row, column, row, across, 1, 0)
                around = (2.0 * (n + s + e + w) + ne + nw + se + sw) / 12.0
                sticks_out = min(abs(around - here) / (most - least), 1.0)
                share = max(share, _SUBDUED * sticks_out * sticks_out)
            if share == 0.0:
                for channel in range(3):
                    smooth[out, column, channel] = image[row, column, channel]
            else:
                for channel in range(3):
                    own, other = image[row, column, channel], image[down, across, channel]
                    smooth[out, column, channel] = np.uint8(own + share * (float(other) - own) + 0.5)


@kernel
def _share(bright, row, column, other_row, other_column, step_row, step_column):
    """How much a pixel takes from the one across the edge: half at the end of a step, none in its middle."""
    height, width = bright.shape
    here, there = bright[row, column], bright[other_row, other_column]
    middle, quarter = 0.5 * (here + there), 0.25 * abs(there - here)
    nearest, total, rest = 2 * _FARTHEST, 0, 0.0
    for way in (-1, 1):
        gone, change = _FARTHEST, 0.0
        for k in range(1, _FARTHEST + 1):
            r, c = row + way * k * step_row, column + way * k * step_column
            p, q = other_row + way * k * step_row, other_column + way * k * step_column
            if not (0 <= r < height and 0 <= c < width):
                break
            change = 0.5 * (bright[r, c] + bright[p, q]) - middle
            if abs(change) >= quarter:
                gone = k
                break
        total += gone
        if gone < nearest:
            nearest, rest = gone, change
    # Of the two sides only that whose colour ends where the step does gives way to the other.
    if (rest < 0.0) == (here < middle):
        return 0.0
    return max(0.5 - (nearest - 0.5) / (total - 1.0), 0.0)
