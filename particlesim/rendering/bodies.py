"""What the particles of a movie look like, as the kernels that look for them want it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from particlesim.trajectory import Header


class Bodies(NamedTuple):
    """``inner`` and ``outer`` (n,) radii of spheres within and about each particle [m], the same for spheres alone;
    ``size`` (n,) [m]; ``start`` (n,) and ``faces`` (n,) int64: its first row of ``planes`` (p, 4) float64 and their
    number, of a hull of size 1: outward normal and distance from the middle."""

    inner: np.ndarray
    outer: np.ndarray
    size: np.ndarray
    start: np.ndarray
    faces: np.ndarray
    planes: np.ndarray


def bodies_of(header: Header) -> Bodies:
    """The particles of a trajectory."""
    shapes, shape = header.shapes, header.shape
    planes = [
        [(*normal, normal @ hull.vertices[loop[0]]) for normal, loop in zip(hull.face_normals, hull.faces, strict=True)]
        for hull in shapes
    ]
    faces = np.array([len(of_one) for of_one in planes], dtype=np.int64)
    return Bodies(
        inner=np.array([hull.inradius for hull in shapes])[shape] * header.size,
        outer=np.array([hull.radius for hull in shapes])[shape] * header.size,
        size=np.ascontiguousarray(header.size, dtype=np.float64),
        start=(np.cumsum(faces) - faces)[shape],
        faces=faces[shape],
        planes=np.array([plane for of_one in planes for plane in of_one], dtype=np.float64).reshape(-1, 4),
    )
