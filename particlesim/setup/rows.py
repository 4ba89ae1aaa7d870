"""Particles in a row: at equal distances along a smooth curve."""

from __future__ import annotations

import numpy as np

from particlesim.core.rotations import quaternion_products
from particlesim.scene.placements import RowPlacement

# Straight pieces that stand for the curve between two of its points where its length is measured: their sum is short
# of it by less than a part in a million.
_PIECES = 1000


def on_row(row: RowPlacement, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Positions (count, 3) [m] along a row, and its directions there (count, 3) [1], not normalised.

    The curve is a cubic spline over the lengths of the chords between its points (C. de Boor, A Practical Guide to
    Splines, ch. IV: not-a-knot). One particle alone is at its start.
    """
    from scipy.interpolate import CubicSpline  # noqa: PLC0415  (slow to import)

    points = np.array(row.through)
    knots = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    curve = CubicSpline(knots, points)
    fine = np.interp(np.linspace(0.0, len(knots) - 1.0, _PIECES * (len(knots) - 1) + 1), np.arange(len(knots)), knots)
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(curve(fine), axis=0), axis=1))])
    at = np.interp(np.linspace(0.0, length[-1], count), length, fine)
    return curve(at), curve(at, 1)


def turned_along(row: RowPlacement, orientation: np.ndarray) -> np.ndarray:
    """Orientations (n, 4) turned about z by what the row turns there, seen from above."""
    _, direction = on_row(row, len(orientation))
    half = 0.5 * np.arctan2(direction[:, 1], direction[:, 0])
    turn = np.column_stack([np.cos(half), np.zeros_like(half), np.zeros_like(half), np.sin(half)])
    return quaternion_products(turn, orientation)
