"""Meshes for tests."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from particlesim.geometry.shapes import Shape, triangle_mesh


def ground(
    squares: int, half: float, height: Callable[[np.ndarray, np.ndarray], np.ndarray] | None = None, seed: int = 0
) -> Shape:
    """A square of ``squares`` x ``squares`` about the origin, up to ``half`` [m], each cut along either diagonal."""
    line = np.linspace(-half, half, squares + 1)
    x, y = (grid.ravel() for grid in np.meshgrid(line, line, indexing="ij"))
    points = np.stack([x, y, np.zeros(len(x)) if height is None else height(x, y)], axis=1)
    number = np.arange((squares + 1) ** 2).reshape(squares + 1, squares + 1)
    a, b, c, d = (n.ravel() for n in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]))
    one, other = np.array([[a, b, c], [a, c, d]]), np.array([[a, b, d], [b, c, d]])
    which = np.random.default_rng(seed).random(len(a)) < 0.5
    return triangle_mesh("ground", points, np.where(which, one, other).transpose(0, 2, 1).reshape(-1, 3))
