"""Volume, centroid and inertia of a solid polyhedron of uniform density, exactly, from vertices and faces."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

# Products of inertia below this fraction of the largest moment are rounding: the axes are principal already.
_PRINCIPAL_TOLERANCE = 1e-12


class MassProperties(NamedTuple):
    """What follows from a shape at density 1 kg/m^3."""

    volume: float  # [m^3]
    centroid: np.ndarray  # (3,) [m]
    inertia: np.ndarray  # (3, 3) about the centroid [kg m^2]


def mass_properties(vertices: np.ndarray, faces: Sequence[Sequence[int]]) -> MassProperties:
    """Integrate 1, x and x x^T over a closed polyhedron whose faces run counter-clockwise seen from outside.

    The solid is the signed sum of the tetrahedra that join a vertex of it to the triangles of its faces. Over a
    tetrahedron with one corner at the origin and edges a, b, c the second moments are
    det(a, b, c) / 120 * (s s^T + a a^T + b b^T + c c^T) with s = a + b + c
    (F. Tonon, Journal of Mathematics and Statistics 1 (2005) 8-11, eq. 9 in another arrangement).
    """
    origin = vertices[0]
    corners = vertices - origin
    triangles = np.array([(f[0], f[k], f[k + 1]) for f in faces for k in range(1, len(f) - 1)])
    a, b, c = (corners[triangles[:, k]] for k in range(3))
    six_volumes = np.einsum("ij,ij->i", a, np.cross(b, c))
    volume = six_volumes.sum() / 6.0
    s = a + b + c
    centroid = np.einsum("i,ij->j", six_volumes, s) / (24.0 * volume)
    second = sum(np.einsum("i,ij,ik->jk", six_volumes, e, e) for e in (s, a, b, c)) / 120.0
    second = second - volume * np.outer(centroid, centroid)
    inertia = np.trace(second) * np.eye(3) - second
    return MassProperties(float(volume), origin + centroid, inertia)


def principal_axes(inertia: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Principal moments (3,) and the rotation (3, 3) whose columns are the principal axes.

    Axes that are principal already stay as they are, so a cube keeps the axes it was described in.
    """
    products = inertia - np.diag(np.diag(inertia))
    if np.abs(products).max() <= _PRINCIPAL_TOLERANCE * np.abs(inertia).max():
        return np.diag(inertia).copy(), np.eye(3)
    moments, axes = np.linalg.eigh(inertia)
    if np.linalg.det(axes) < 0.0:
        axes[:, 2] = -axes[:, 2]
    return moments, axes
