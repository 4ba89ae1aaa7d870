"""What the particles of a movie look like, as the kernels that look for them want it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from particlesim.trajectory.frames import Header


class Bodies(NamedTuple):
    """``inner`` and ``outer`` (n,) radii of spheres within and about each particle [m], the same for spheres alone;
    ``size`` (n,) [m]; ``shape`` (n,) int64.

    Of the shape s of size 1, rows ``first_plane[s]`` to ``first_plane[s + 1]`` of ``planes`` (p, 4) float64 are its
    faces: outward normal and distance from the middle; ``corners`` (p,) int64, how many each has. Rows
    ``first_edge[s]`` to ``first_edge[s + 1]`` of ``edges`` (e, 2) int64 are its edges: the two faces, 0 the first of
    the shape. A sphere has neither.
    """

    inner: np.ndarray
    outer: np.ndarray
    size: np.ndarray
    shape: np.ndarray
    first_plane: np.ndarray
    planes: np.ndarray
    corners: np.ndarray
    first_edge: np.ndarray
    edges: np.ndarray


def bodies_of(header: Header) -> Bodies:
    """The particles of a trajectory."""
    shapes, shape = header.shapes, header.shape
    planes = [
        (*normal, normal @ hull.vertices[loop[0]])
        for hull in shapes
        for normal, loop in zip(hull.face_normals, hull.faces, strict=True)
    ]
    edges = [(left, right) for hull in shapes for _, _, left, right in hull.edges]
    return Bodies(
        inner=np.array([hull.inradius for hull in shapes])[shape] * header.size,
        outer=header.radius,
        size=np.ascontiguousarray(header.size, dtype=np.float64),
        shape=np.ascontiguousarray(shape, dtype=np.int64),
        first_plane=np.cumsum([0, *(len(hull.faces) for hull in shapes)]),
        planes=np.array(planes, dtype=np.float64).reshape(-1, 4),
        corners=np.array([len(loop) for hull in shapes for loop in hull.faces], dtype=np.int64),
        first_edge=np.cumsum([0, *(len(hull.edges) for hull in shapes)]),
        edges=np.array(edges, dtype=np.int64).reshape(-1, 2),
    )
