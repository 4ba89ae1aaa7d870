"""The shapes of a scene as one table for the kernels."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from particlesim.geometry.shapes import Shape


class ShapeTable(NamedTuple):
    """All shapes of a scene end to end. ``x_start[s]:x_start[s + 1]`` are the rows of shape ``s``."""

    kind: np.ndarray  # (s,) int64: SPHERE or HULL
    radius: np.ndarray  # (s,) bounding sphere of size 1 [m]
    vertex: np.ndarray  # (v, 3) of size 1, body axes [m]
    vertex_start: np.ndarray  # (s + 1,)
    face_normal: np.ndarray  # (f, 3) outward, body axes
    face_offset: np.ndarray  # (f,) distance of the face's plane from the centroid at size 1 [m]
    face_start: np.ndarray  # (s + 1,)
    loop: np.ndarray  # (l,) vertices of the faces in order, counted from the shape's first
    loop_start: np.ndarray  # (f + 1,)
    edge: np.ndarray  # (e, 4): two vertices, then two faces, counted from the shape's first
    edge_start: np.ndarray  # (s + 1,)


def stack_shapes(shapes: Sequence[Shape]) -> ShapeTable:
    """The shapes as one table for the kernels."""
    normals = [shape.face_normals for shape in shapes]
    offsets = [
        [float(normal @ shape.vertices[loop[0]]) for normal, loop in zip(rows, shape.faces, strict=True)]
        for shape, rows in zip(shapes, normals, strict=True)
    ]
    edges = [shape.edges for shape in shapes]
    loops = [loop for shape in shapes for loop in shape.faces]
    return ShapeTable(
        kind=np.array([shape.kind for shape in shapes], dtype=np.int64),
        radius=np.array([shape.radius for shape in shapes], dtype=np.float64),
        vertex=np.concatenate([np.zeros((0, 3)), *(shape.vertices for shape in shapes)]),
        vertex_start=_starts([len(shape.vertices) for shape in shapes]),
        face_normal=np.concatenate([np.zeros((0, 3)), *normals]),
        face_offset=np.array([x for rows in offsets for x in rows], dtype=np.float64),
        face_start=_starts([len(shape.faces) for shape in shapes]),
        loop=np.array([v for loop in loops for v in loop], dtype=np.int64),
        loop_start=_starts([len(loop) for loop in loops]),
        edge=np.array([e for rows in edges for e in rows], dtype=np.int64).reshape(-1, 4),
        edge_start=_starts([len(rows) for rows in edges]),
    )


def _starts(counts: Sequence[int]) -> np.ndarray:
    return np.concatenate([[0], np.cumsum(np.asarray(counts, dtype=np.int64))]).astype(np.int64)
