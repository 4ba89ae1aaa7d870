"""The narrow phase: exact separation, normal and contact points of two shapes anywhere in space."""

from __future__ import annotations

from itertools import product
from typing import Any, NamedTuple

import numpy as np

from particlesim.core.arguments import checked_arguments, real_numbers, shown
from particlesim.core.constants import COMPOUND, HALF_SPACE, MAX_MANIFOLD
from particlesim.core.math3d import quat_multiply, quat_normalize
from particlesim.geometry.narrow_phase.pair import pair_contact
from particlesim.geometry.shape_table import stack_shapes
from particlesim.geometry.shapes import CATALOGUE, Shape


class Pose(NamedTuple):
    """Where a shape stands: its centroid [m], its orientation (w, x, y, z) and its size, a factor on the shape.

    The orientation turns the axes in which the shape was described (those of a mesh's file, or of the vertices that
    ``hull`` was given) into world axes, as in a scene file.
    """

    position: Any
    orientation: Any = (1.0, 0.0, 0.0, 0.0)
    size: float = 1.0


class Separation(NamedTuple):
    """How far apart two shapes are.

    Attributes
    ----------
    distance : float [m]
        If positive, the exact distance; if negative, minus the exact penetration depth, the length of the shortest
        shift that parts the shapes.
    normal : (3,) float64
        Unit, from the first to the second.
    points : (k, 3) float64 [m]
        Where the shapes (would) touch, half way between the surfaces: the corners of the patch where faces or edges
        are parallel.
    """

    distance: float
    normal: np.ndarray
    points: np.ndarray


@checked_arguments
def separation(shape_a: Shape | str, pose_a: Any, shape_b: Shape | str, pose_b: Any) -> Separation:
    """Exact signed distance of two shapes.

    Parameters
    ----------
    shape_a, shape_b : Shape or str
        A name of the catalogue, with its usual parameters, or a ``Shape``. A half-space may be the second only.
    pose_a, pose_b : Pose or tuple
        (position (3,) [m], orientation (4,) (w, x, y, z), size), the last two optional. Orientations need not be
        normalised.

    Returns
    -------
    Separation
        Distance, normal from a to b, and contact points; against a half-space the points are on the first shape. Of
        compounds, those of the two parts that are nearest, or deepest in each other.

    Raises
    ------
    ValueError
        For an unknown shape, one that needs parameters, a pose with numbers that are not finite, a zero quaternion or
        a size not above 0, and a half-space as the first shape.
    """
    shapes = [_shape("shape_a", shape_a), _shape("shape_b", shape_b)]
    if shapes[0].kind == HALF_SPACE:
        raise ValueError("separation: shape_a: a half-space may be the second shape only")
    position_a, orientation_a, size_a = _checked("pose_a", pose_a)
    position_b, orientation_b, size_b = _checked("pose_b", pose_b)
    orientations = [_of_body_axes(q, shape) for q, shape in zip((orientation_a, orientation_b), shapes, strict=True)]
    points = np.empty((MAX_MANIFOLD, 3))
    offset = tuple((position_b - position_a).tolist())
    table = stack_shapes(shapes)
    found = []
    for row_a, row_b in product(*(_rows(table.shape[k], k) for k in range(2))):
        part_a, part_b = (row_a, size_a, orientations[0]), (row_b, size_b, orientations[1])
        distance, normal, count = pair_contact(table, part_a, part_b, offset, points)
        found.append(Separation(distance, np.array(normal), position_a + points[:count]))
    return min(found, key=lambda separation: separation.distance)


def _rows(record: np.void, row: int) -> range:
    """Rows of the shape table of what a shape in a ``row`` consists of: a compound of its parts."""
    return range(record["first_part"], record["last_part"]) if record["kind"] == COMPOUND else range(row, row + 1)


def _shape(name: str, shape: Shape | str) -> Shape:
    """A shape that is given, or of the catalogue. ValueError that names the argument if there is none."""
    if isinstance(shape, Shape):
        return shape
    if shape not in CATALOGUE:
        raise ValueError(f"separation: {name}: unknown shape {shown(shape)}; the catalogue has {', '.join(CATALOGUE)}")
    try:
        return CATALOGUE[shape]()
    except TypeError as error:
        how = f"'{shape}' needs parameters; give a Shape, as from CATALOGUE['{shape}'](...)"
        raise ValueError(f"separation: {name}: {how}") from error


def _finite(values: Any, count: int, what: str) -> np.ndarray:
    """The values as an array (count,). ValueError if they are not that many finite numbers."""
    try:
        array = np.array(real_numbers(what, values))
    except ValueError:
        array = np.full(0, np.nan)
    if array.shape != (count,) or not np.isfinite(array).all():
        raise ValueError(f"{what} must be {count} finite numbers, not {shown(values)}")
    return array


def _checked(name: str, pose: Any) -> tuple[np.ndarray, np.ndarray, float]:
    """Position, unit quaternion and size of a pose. ValueError that names the argument if it has none."""
    what = f"separation: {name}:"
    try:
        position, orientation, size = Pose(*pose)
    except TypeError as error:
        layout = "a pose is (position, orientation, size), the last two optional"
        raise ValueError(f"{what} {layout}, not {shown(pose)}") from error
    at = _finite(position, 3, f"{what} a position")
    quaternion = _finite(orientation, 4, f"{what} an orientation")
    factor = _finite([size], 1, f"{what} a size")[0]
    if not quaternion.any():
        raise ValueError(f"{what} an orientation must not be all zero")
    if factor <= 0.0:
        raise ValueError(f"{what} a size must be above 0, not {shown(size)}")
    # First by the largest: the squares of a tiny or huge quaternion are not numbers that float64 has.
    quaternion /= np.abs(quaternion).max()
    return at, quaternion / np.linalg.norm(quaternion), float(factor)


def _of_body_axes(described: np.ndarray, shape: Shape) -> tuple[float, ...]:
    """The orientation of a shape's body axes when ``described`` is that of the axes it was described in."""
    product = quat_multiply(tuple(described.tolist()), tuple(shape.orientation.tolist()))
    return tuple(quat_normalize(product))
