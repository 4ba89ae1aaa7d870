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
    """A closed surface about the centroid of a shape of size 1.

    ``vertices`` and outward ``normals`` (v, 3) float64 [m], [1]; ``triangles`` (t, 3) int64, counter-clockwise from
    outside. Flat faces share no vertices, so that their edges stay sharp.
    """

    vertices: np.ndarray
    normals: np.ndarray
    triangles: np.ndarray


def surface_of(shape: Shape, splits: int = SPLITS) -> Surface:
    """The surface of a bounded shape: exact of polyhedra, of what is round its hull with corners on the surface.

    That of a compound is the surfaces of its parts, also where they are within each other.
    """
    if shape.parts:
        return _together([surface_of(part, splits) for part in shape.parts])
    if shape.rounding == 0.0:
        face, corners = triangles_of(shape.faces)
        normals = np.repeat(shape.face_normals[face], 3, axis=0)
        return Surface(shape.vertices[corners].reshape(-1, 3), normals, np.arange(3 * len(corners)).reshape(-1, 3))
    ball = np.asarray(trimesh.creation.icosphere(subdivisions=splits).vertices)
    points = (shape.vertices[:, None, :] + shape.rounding * ball).reshape(-1, 3)
    hull = ConvexHull(points)
    a, b, c = (points[hull.simplices[:, k]] for k in range(3))
    inwards = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) < 0.0
    triangles = np.where(inwards[:, None], hull.simplices[:, ::-1], hull.simplices)
    used, numbers = np.unique(triangles, return_inverse=True)
    return Surface(points[used], ball[used % len(ball)], numbers.reshape(-1, 3))


def _together(surfaces: list[Surface]) -> Surface:
    """Several surfaces as one."""
    ends = np.cumsum([len(surface.vertices) for surface in surfaces])
    triangles = [s.triangles + end - len(s.vertices) for s, end in zip(surfaces, ends, strict=True)]
    vertices, normals = ([getattr(s, name) for s in surfaces] for name in ("vertices", "normals"))
    return Surface(np.concatenate(vertices), np.concatenate(normals), np.concatenate(triangles))
