"""Which edges of shapes are to be seen: not the inner ones of meshes, nor the seams between parts of a compound."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from particlesim.core.constants import TRIANGLE
from particlesim.geometry.shape_table import ShapeTable, middle_of
from particlesim.geometry.shapes import Shape

# What goes on beyond an edge is asked at this share of the body's radius: more than the gaps that a decomposition
# leaves, less than what one sees of a body. Up to this slope to the face it is the same surface.
_BEYOND, _SLOPE = 0.01, 0.2

# An edge is asked at so many places along it.
_PLACES = 40


class Rims(NamedTuple):
    """The edges of faces that are to be seen, each face with its own.

    Parameters
    ----------
    first : (f + 1,) int64
        Face f of a ShapeTable has those from ``first[f]`` to ``first[f + 1]``.
    line : (r, 4, 3) float64
        Two corners that are on the edge, counter-clockwise seen from outside, then the ends of what is seen of it, all
        at size 1 in the axes of the shape [m].
    whole : (r,) bool
        Whether all of it is seen.
    middle : (s, 3) float64
        Of each row of the table, where it is in its body at size 1 [m]: all parts of a body are turned to the eye as
        it is.
    """

    first: np.ndarray
    line: np.ndarray
    whole: np.ndarray
    middle: np.ndarray


def rims_of(shapes: Sequence[Shape], table: ShapeTable) -> Rims:
    """The edges of shapes, which are those of a ``table`` of what is drawn."""
    corners = table.face["last"] - table.face["first"]
    before = np.arange(len(table.loop)) - 1
    before[table.face["first"]] = table.face["last"] - 1
    corner, start = np.arange(len(table.loop)), np.zeros(len(table.loop))
    faces = table.shape["last_face"] - table.shape["first_face"]
    of_triangle = np.repeat(table.shape["kind"] == TRIANGLE, faces)  # of each face, as they are row by row
    seen = np.repeat(~of_triangle, corners)
    end, middle = np.ones(len(table.loop)), np.zeros((len(table.shape), 3))
    pieces = []
    for own, (shape, row) in enumerate(zip(shapes, table.shape, strict=False)):
        # A compound's own faces are those of the box about it, which is not drawn.
        seen[_corners(table, own)] &= not shape.parts
        for number, part in enumerate(shape.parts, int(row["first_part"])):
            middle[number] = middle_of(part)
            of_part = _corners(table, number)
            seen[of_part] = False
            pieces.append(_pieces(shape)[number - int(row["first_part"])] + (of_part.start, 0.0, 0.0))
    more = np.concatenate([np.zeros((0, 3)), *pieces])
    corner = np.append(corner[seen], more[:, 0].astype(np.int64))
    start, end = np.append(start[seen], more[:, 1]), np.append(end[seen], more[:, 2])
    order = np.argsort(corner, kind="stable")
    corner, start, end = corner[order], start[order], end[order]
    a, b = (table.vertex[table.loop[k]] for k in (before[corner], corner))
    ends = (a + share[:, None] * (b - a) for share in (start, end))
    first = np.searchsorted(corner, np.append(table.face["first"], corners.sum()))
    return Rims(first, np.stack([a, b, *ends], axis=1), (start == 0.0) & (end == 1.0), middle)


def _corners(table: ShapeTable, row: int) -> slice:
    """The corners of the faces of a shape in ``table.loop``."""
    first, last = table.shape["first_face"][row], table.shape["last_face"][row]
    return slice(table.face["first"][first], table.face["last"][last - 1]) if last > first else slice(0, 0)


@functools.lru_cache(maxsize=256)
def _pieces(shape: Shape) -> tuple[np.ndarray, ...]:
    """Of each part of a compound what is seen of its edges, (p, 3): the corner led to, from, to, 0 .. 1 along the edge.

    A place is on a seam where beyond it there is another part beneath the plane of the face, and none above it.
    """
    off = _BEYOND * shape.radius
    places = (np.arange(_PLACES) + 0.5) / _PLACES
    found = []
    for part in shape.parts:
        corner = np.array([k for loop in part.faces for k in loop], dtype=np.int64)
        before = np.array([k for loop in part.faces for k in (loop[-1], *loop[:-1])], dtype=np.int64)
        normal = np.repeat(np.reshape(part.face_normals, (-1, 3)), [len(loop) for loop in part.faces], axis=0)
        start, along = part.vertices[before], part.vertices[corner] - part.vertices[before]
        outward = np.cross(along, normal)
        outward /= np.linalg.norm(outward, axis=1, keepdims=True)
        beyond = start[:, None] + places[:, None] * along[:, None] + off * outward[:, None]
        others = [other for other in shape.parts if other is not part]
        beneath, above = (_in_any(others, beyond + side * _SLOPE * off * normal[:, None]) for side in (-1.0, 1.0))
        change = np.diff(np.pad(~beneath | above, ((0, 0), (1, 1))).astype(np.int8), axis=1)
        (edge, begins), ends = np.nonzero(change == 1), np.nonzero(change == -1)[1]
        found.append(np.column_stack([edge, begins / _PLACES, ends / _PLACES]))
    return tuple(found)


def _in_any(parts: Sequence[Shape], points: np.ndarray) -> np.ndarray:
    """Which points (..., 3) are within one of those parts that have faces; of rounded ones, within the planes."""
    within = np.zeros(points.shape[:-1], dtype=bool)
    for part in parts:
        if part.faces:
            normals = np.asarray(part.face_normals)
            offsets = (normals * part.vertices[[loop[0] for loop in part.faces]]).sum(axis=1) + part.rounding
            lower, upper = part.vertices.min(axis=0) - part.rounding, part.vertices.max(axis=0) + part.rounding
            near = ((points >= lower) & (points <= upper)).all(axis=-1)
            within[near] |= (points[near] @ normals.T <= offsets).all(axis=-1)
    return within
