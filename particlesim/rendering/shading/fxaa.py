"""Fast approximate antialiasing (FXAA): smooths the jagged edges of a picture that has one sample a pixel.

Where brightness steps, a pixel is mixed with the one across the edge, the more the nearer the step of its stair is:
the idea of T. Lottes, "FXAA" (NVIDIA white paper, 2009).
"""

from __future__ import annotations

import numpy as np

from particlesim.core.jit import entry_kernel, kernel
from particlesim.core.parallel import ThreadTeam

# Steps of brightness (0 .. 255) below both of these are no edges: the least, and the share of the brightest about.
_DIM = np.float32(10.0)
_STEEP = np.float32(0.07)

# How far along an edge its end is looked for [pixels].
_FARTHEST = 16

# How much a pixel that stands out from all about it is drawn in.
_SUBDUED = 0.6


def fxaa(image: np.ndarray) -> np.ndarray:
    """A smoother picture, (height, width, 3) uint8; ``image`` (height, width, 4) uint8, as it comes from OpenGL.

    OpenGL's first row is the lowest, that of the result the highest; the fourth channel is left out.
    """
    height, width = image.shape[:2]
    # A rim as bright as what it surrounds, for the neighbours of the pixels there.
    bright = np.empty((height + 2, width + 2), dtype=np.float32)
    smooth = np.empty((height, width, 3), dtype=np.uint8)
    team = ThreadTeam(height * width)
    team.each(lambda _, first, last: _brightness(image, bright, smooth, first, last), height)
    bright[0], bright[-1] = bright[1], bright[-2]
    team.each(lambda _, first, last: _smooth(image, bright, smooth, first, last), height)
    return smooth


@entry_kernel
def _brightness(image, bright, smooth, first, last):
    """Copy the colours, and work out brightness as the eye has it: green most, blue least (ITU-R BT.601)."""
    height, width = image.shape[0], image.shape[1]
    for row in range(first, last):
        out = height - 1 - row
        for column in range(width):
            red, green, blue = image[row, column, 0], image[row, column, 1], image[row, column, 2]
            smooth[out, column, 0], smooth[out, column, 1], smooth[out, column, 2] = red, green, blue
            bright[row + 1, column + 1] = (
                np.float32(0.299) * np.float32(red)
                + np.float32(0.587) * np.float32(green)
                + np.float32(0.114) * np.float32(blue)
            )
        bright[row + 1, 0], bright[row + 1, width + 1] = bright[row + 1, 1], bright[row + 1, width]


@kernel
def _contrast(bright, row, contrast):
    """How far the brightness about each pixel of a row goes beyond that of no edge; below 0 where there is none."""
    for column in range(len(contrast)):
        here = bright[row, column + 1]
        n, s, e, w = (
            bright[row + 1, column + 1],
            bright[row - 1, column + 1],
            bright[row, column + 2],
            bright[row, column],
        )
        most = max(here, n, s, e, w)
        contrast[column] = most - min(here, n, s, e, w) - max(_DIM, _STEEP * most)


@entry_kernel
def _smooth(image, bright, smooth, first, last):
    height, width = image.shape[0], image.shape[1]
    contrast = np.empty(width, dtype=np.float32)
    flat, stride = bright.reshape(-1), width + 2
    for row in range(first, last):
        _contrast(bright, row + 1, contrast)
        for column in range(width):
            if contrast[column] > 0.0:
                share, other = _mixture(flat, stride, row + 1, column + 1)
                down, across = other // stride - 1, other % stride - 1
                down, across = min(max(down, 0), height - 1), min(max(across, 0), width - 1)
                for channel in range(3):
                    own, foreign = image[row, column, channel], image[down, across, channel]
                    mixed = own + share * (float(foreign) - own) + 0.5
                    smooth[height - 1 - row, column, channel] = np.uint8(mixed)


@kernel
def _mixture(bright, stride, row, column):
    """How much a pixel takes from the one across the edge, and which that is."""
    here_at = row * stride + column
    here = bright[here_at]
    n, s, e, w = bright[here_at + stride], bright[here_at - stride], bright[here_at + 1], bright[here_at - 1]
    ne, nw = bright[here_at + stride + 1], bright[here_at + stride - 1]
    se, sw = bright[here_at - stride + 1], bright[here_at - stride - 1]
    # The edge runs along the direction in which brightness bends less.
    upright = abs(ne - 2.0 * e + se) + 2.0 * abs(n - 2.0 * here + s) + abs(nw - 2.0 * w + sw)
    sideways = abs(ne - 2.0 * n + nw) + 2.0 * abs(e - 2.0 * here + w) + abs(se - 2.0 * s + sw)
    if upright >= sideways:
        across, along = stride if abs(n - here) >= abs(s - here) else -stride, 1
        back, ahead = column, stride - 1 - column
    else:
        across, along = 1 if abs(e - here) >= abs(w - here) else -1, stride
        back, ahead = row, len(bright) // stride - 1 - row
    share = _share(bright, here_at, across, along, min(back, _FARTHEST), min(ahead, _FARTHEST))
    around = (2.0 * (n + s + e + w) + ne + nw + se + sw) / 12.0
    most, least = max(here, n, s, e, w), min(here, n, s, e, w)
    sticks_out = min(abs(around - here) / (most - least), 1.0)
    return max(share, _SUBDUED * sticks_out * sticks_out), here_at + across


@kernel
def _share(bright, at, across, along, back, ahead):
    """How much a pixel takes from the one across the edge: half at the end of a step, none in its middle.

    Along the edge there are so many pixels to look at, ``back`` and ``ahead``.
    """
    here, there = bright[at], bright[at + across]
    middle, quarter = 0.5 * (here + there), 0.25 * abs(there - here)
    for k in range(1, max(back, ahead) + 1):
        for direction, room in ((-1, back), (1, ahead)):
            change = _change(bright, at + direction * k * along, across, middle) if k <= room else 0.0
            if abs(change) >= quarter:
                # Of the two sides only that whose colour ends where the step does gives way to the other.
                if (change < 0.0) == (here < middle):
                    return 0.0
                rest = back if direction > 0 else ahead
                total = k + _FARTHEST
                for n in range(k, rest + 1):
                    if abs(_change(bright, at - direction * n * along, across, middle)) >= quarter:
                        total = k + n
                        break
                return max(0.5 - (k - 0.5) / (total - 1.0), 0.0)
    return 0.0


@kernel
def _change(bright, at, across, middle):
    """How much brighter than ``middle`` it is on an edge."""
    return 0.5 * (bright[at] + bright[at + across]) - middle
