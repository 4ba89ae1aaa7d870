"""The surface of a shape as triangles, for programs that know no roundings."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import trimesh.creation
from scipy.spatial import ConvexHull

from particlesim.geometry.faces import triangles_of
from particlesim.geometry.shapes import Shape

# Times the faces of an icosahedron are split in four: 162 corners, which leave a sphere 1.5 % of its radius too flat.
SPLITS = 2


class Surface(NamedTuple):
    """The surface of a shape of size 1 about its centroid, closed unless it is that of an open mesh.

    ``vertices`` and outward ``normals`` (v, 3) float64 [m], [1]; ``triangles`` (t, 3) int64, counter-clockwise from
    outside. Flat faces share no vertices, so that their edges stay sharp. Of a mesh it is about the origin of the
    file, and out is where the file says it is.
    """

    vertices: np.ndarray
    normals: np.ndarray
    triangles: np.ndarray


def surface_of(shape: Shape, splits: int = SPLITS) -> Surface:
    """The surface of a bounded shape: exact of what is flat, of what is round its hull with corners on the surface.

    That of a compound is the surfaces of its parts, also where they are within each other.
    """
    if len(shape.triangles):
        corners = shape.vertices[shape.triangles]
        out = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        return _flat(corners.reshape(-1, 3), out / np.linalg.norm(out, axis=1, keepdims=True))
    if shape.parts:
        return together([surface_of(part, splits) for part in shape.parts])
    if shape.rounding == 0.0:
        face, corners = triangles_of(shape.faces)
        return _flat(shape.vertices[corners].reshape(-1, 3), shape.face_normals[face])
    ball = np.asarray(trimesh.creation.icosphere(subdivisions=splits).vertices)
    points = (shape.vertices[:, None, :] + shape.rounding * ball).reshape(-1, 3)
    hull = ConvexHull(points)
    a, b, c = (points[hull.simplices[:, k]] for k in range(3))
    inwards = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) < 0.0
    triangles = np.where(inwards[:, None], hull.simplices[:, ::-1], hull.simplices)
    used, numbers = np.unique(triangles, return_inverse=True)
    return Surface(points[used], ball[used % len(ball)], numbers.reshape(-1, 3))


def _flat(corners: np.ndarray, normals: np.ndarray) -> Surface:
    """The surface of triangles by themselves, from their corners (3 t, 3) and normals (t, 3)."""
    return Surface(corners, np.repeat(normals, 3, axis=0), np.arange(len(corners)).reshape(-1, 3))


def together(surfaces: list[Surface]) -> Surface:
    """Several surfaces as one."""
    ends = np.cumsum([len(surface.vertices) for surface in surfaces])
    triangles = [s.triangles + end - len(s.vertices) for s, end in zip(surfaces, ends, strict=True)]
    vertices, normals = ([getattr(s, name) for s in surfaces] for name in ("vertices", "normals"))
    return Surface(np.concatenate(vertices), np.concatenate(normals), np.concatenate(triangles))
