"""Projections: how the camera, or the key light, maps the world to pixels."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Projection(NamedTuple):
    """A picture, or the shadow map, as square pixels, each of which shows what is nearest at its middle.

    View coordinates are x to the right, y up and z away from the eye.

    Parameters
    ----------
    axes : (3, 3) float64
        Unit vectors right, up and away, row by row, in world axes.
    eye : (3,) float64
        Where the projection starts [m]; any point of the central ray if it is ``parallel``.
    parallel : bool
        Whether all rays run along the third axis, as those of the light do.
    scale : float
        Pixels per metre, at distance 1 m if the projection is not parallel.
    size : (int, int)
        Pixels across and down.
    shift : (float, float)
        From their middle to where ``eye`` projects to, across and up [pixels].
    """

    axes: np.ndarray
    eye: np.ndarray
    parallel: bool
    scale: float
    size: tuple[int, int]
    shift: tuple[float, float] = (0.0, 0.0)

    def strip(self, first: int, last: int) -> Strip:
        """Columns ``first`` to ``last`` of the picture, for the kernels."""
        width, height = self.size
        axes, eye = np.ascontiguousarray(self.axes), np.ascontiguousarray(self.eye)
        middle = 0.5 * width + self.shift[0], 0.5 * height + self.shift[1]
        return Strip(axes, eye, self.parallel, self.scale, *middle, height, first, last)


class Strip(NamedTuple):
    """Some columns of a picture, which one thread fills; see Projection.

    The middle of pixel (row, column) is at x = (column + 0.5 - middle_x) / scale, y = (row + 0.5 - middle_y) / scale
    in view coordinates [m], at z = 1 m if the projection is not parallel.
    """

    axes: np.ndarray
    eye: np.ndarray
    parallel: bool
    scale: float
    middle_x: float
    middle_y: float
    height: int
    first: int
    last: int


def depth_order(depth: np.ndarray) -> np.ndarray:
    """Indices (k,) int64 that sort ``depth`` (k,) [m], roughly: the nearer first."""
    low, high = (depth.min(), depth.max()) if len(depth) else (0.0, 0.0)
    # In 16 bits they are sorted by radix, in a time that grows with their number only.
    steps = (depth - low) * (65535.0 / (high - low) if high > low else 0.0)
    return np.argsort(steps.astype(np.uint16), kind="stable")
