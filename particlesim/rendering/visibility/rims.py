"""Which edges of shapes are to be seen: not the inner ones of meshes, nor the seams between parts of a compound."""

from __future__ import annotations

import functools
from collections.abc import Sequence

import numpy as np

from particlesim.core.constants import TRIANGLE
from particlesim.geometry.shape_table import ShapeTable
from particlesim.geometry.shapes import Shape

# What goes on beyond an edge is asked at this share of the body's radius: more than the gaps that a decomposition
# leaves, less than what one sees of a body. Up to this slope to the face it is the same surface.
_BEYOND, _SLOPE = 0.01, 0.2

# Where along an edge it is asked; an edge is a seam if it is one along most of its length.
_ALONG = (np.arange(5) + 0.5) / 5.0


def rims_of(shapes: Sequence[Shape], table: ShapeTable) -> np.ndarray:
    """Whether the edge that leads to each corner of ``table.loop`` is to be seen, (l,) bool.

    Parameters
    ----------
    shapes
        The shapes.
    table : ShapeTable
        The same as a table.
    """
    rim = np.ones(len(table.loop), dtype=bool)
    for row in np.flatnonzero(table.shape["kind"] == TRIANGLE).tolist():
        rim[_corners(table, row)] = False
    for shape, row in zip(shapes, table.shape, strict=False):
        for number, seams in enumerate(_seams(shape), int(row["first_part"])):
            rim[_corners(table, number)] = ~seams
    return rim


def _corners(table: ShapeTable, row: int) -> slice:
    """The corners of the faces of a shape in ``table.loop``."""
    first, last = table.shape["first_face"][row], table.shape["last_face"][row]
    return slice(table.face["first"][first], table.face["last"][last - 1]) if last > first else slice(0, 0)


@functools.lru_cache(maxsize=256)
def _seams(shape: Shape) -> tuple[np.ndarray, ...]:
    """Of each part of a compound, whether each edge of its faces, (c,) bool, is where the surface goes on in another.

    That is so where beyond it there is another part beneath the face, and none above it.
    """
    off = _BEYOND * shape.radius
    found = []
    for part in shape.parts:
        corner = np.array([k for loop in part.faces for k in loop], dtype=np.int64)
        before = np.array([k for loop in part.faces for k in (loop[-1], *loop[:-1])], dtype=np.int64)
        normal = np.repeat(np.reshape(part.face_normals, (-1, 3)), [len(loop) for loop in part.faces], axis=0)
        start, along = part.vertices[before], part.vertices[corner] - part.vertices[before]
        outward = np.cross(along, normal)
        outward /= np.linalg.norm(outward, axis=1, keepdims=True)
        beyond = start + _ALONG[:, None, None] * along + off * outward
        others = [other for other in shape.parts if other is not part]
        beneath, above = (_in_any(others, beyond + side * _SLOPE * off * normal) for side in (-1.0, 1.0))
        found.append(2 * (beneath & ~above).sum(axis=0) > len(_ALONG))
    return tuple(found)


def _in_any(parts: Sequence[Shape], points: np.ndarray) -> np.ndarray:
    """Which points (..., 3) are within one of those parts that have faces; of rounded ones, within the planes."""
    within = np.zeros(points.shape[:-1], dtype=bool)
    for part in parts:
        if part.faces:
            normals = np.asarray(part.face_normals)
            offsets = (normals * part.vertices[[loop[0] for loop in part.faces]]).sum(axis=1) + part.rounding
            within |= (points @ normals.T <= offsets).all(axis=-1)
    return within
