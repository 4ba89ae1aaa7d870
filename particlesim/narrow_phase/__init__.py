"""The narrow phase: exact separation, normal and contact points of two shapes anywhere in space."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from particlesim.constants import MAX_MANIFOLD
from particlesim.narrow_phase.pair import pair_contact
from particlesim.shapes import CATALOGUE, Shape
from particlesim.state import stack_shapes


class Pose(NamedTuple):
    """Where a shape stands: its centroid [m], its orientation (w, x, y, z) and its size, a factor on the shape."""

    position: Any
    orientation: Any = (1.0, 0.0, 0.0, 0.0)
    size: float = 1.0


class Separation(NamedTuple):
    """How far apart two shapes are.

    ``distance`` [m]: the exact distance if positive; if negative, minus the exact penetration depth, the length of
    the shortest shift that parts them. ``normal`` (3,): unit, from the first to the second. ``points`` (k, 3) [m]:
    where they (would) touch, half way between the surfaces; the corners of the patch where faces or edges are parallel.
    """

    distance: float
    normal: np.ndarray
    points: np.ndarray


def separation(shape_a: Shape | str, pose_a: Any, shape_b: Shape | str, pose_b: Any) -> Separation:
    """Exact signed distance of two shapes.

    Shapes are entries of the catalogue by name or ``Shape`` objects; poses are ``Pose`` or plain tuples
    (position, orientation, size), the last two optional. Orientations need not be normalised.
    ValueError for an unknown shape, a pose with numbers that are not finite, a zero quaternion or a size not above 0.
    """
    shapes = [_shape(shape_a), _shape(shape_b)]
    poses = [_checked(pose_a), _checked(pose_b)]
    points = np.empty((MAX_MANIFOLD, 3))
    (position_a, turn_a, size_a), (position_b, turn_b, size_b) = poses
    offset = tuple(float(x) for x in position_b - position_a)
    distance, normal, count = pair_contact(stack_shapes(shapes), 0, size_a, turn_a, 1, size_b, turn_b, offset, points)
    return Separation(distance, np.array(normal), position_a + points[:count])


def _shape(shape: Shape | str) -> Shape:
    if isinstance(shape, Shape):
        return shape
    if shape not in CATALOGUE:
        raise ValueError(f"unknown shape '{shape}'; the catalogue has {', '.join(CATALOGUE)}")
    return CATALOGUE[shape]()


def _checked(pose: Any) -> tuple[np.ndarray, tuple[float, ...], float]:
    position, orientation, size = Pose(*pose)
    where = np.asarray(position, dtype=np.float64)
    turn = np.asarray(orientation, dtype=np.float64)
    if where.shape != (3,) or not np.isfinite(where).all():
        raise ValueError(f"a position must be three finite numbers, not {position}")
    if turn.shape != (4,) or not np.isfinite(turn).all() or not turn.any():
        raise ValueError(f"an orientation must be four finite numbers, not all zero, not {orientation}")
    if not (np.isfinite(size) and size > 0):
        raise ValueError(f"a size must be a finite number above 0, not {size}")
    turn /= np.linalg.norm(turn)
    return where, tuple(float(x) for x in turn), float(size)
