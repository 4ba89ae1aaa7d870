"""Volume, centroid and inertia of solids of uniform density, exactly: polyhedra, rounded or not, and capsules."""

from __future__ import annotations

from collections.abc import Sequence
from math import pi
from typing import NamedTuple

import numpy as np

from particlesim.geometry.faces import face_normals, triangles_of
from particlesim.geometry.tolerances import PRINCIPAL_AXES


class MassProperties(NamedTuple):
    """What follows from a shape at density 1 kg/m^3."""

    volume: float  # [m^3]
    centroid: np.ndarray  # (3,) [m]
    inertia: np.ndarray  # (3, 3) about the centroid [kg m^2]


class _Integrals(NamedTuple):
    """Integrals of 1, x and x x^T over a solid."""

    volume: float
    first: np.ndarray  # (3,)
    second: np.ndarray  # (3, 3)


def mass_properties(vertices: np.ndarray, faces: Sequence[Sequence[int]]) -> MassProperties:
    """Mass properties of a closed polyhedron whose faces run counter-clockwise seen from outside.

    Parameters
    ----------
    vertices : (v, 3) float64 [m]
    faces : loops of vertex numbers
    """
    volume, centroid, second = _polyhedron(vertices, faces)
    return MassProperties(volume, centroid, _inertia(second))


def _polyhedron(vertices: np.ndarray, faces: Sequence[Sequence[int]]) -> tuple[float, np.ndarray, np.ndarray]:
    """Volume, centroid, and the integral of x x^T about the centroid, of a closed polyhedron.

    The solid is the signed sum of the tetrahedra that join a vertex of it to the triangles of its faces. Over a
    tetrahedron with one corner at the origin and edges a, b, c the second moments are
    det(a, b, c) / 120 * (s s^T + a a^T + b b^T + c c^T) with s = a + b + c
    (F. Tonon, Journal of Mathematics and Statistics 1 (2005) 8-11, eq. 9 in another arrangement).
    """
    origin = vertices[0]
    corners = vertices - origin
    a, b, c = (corners[corner] for corner in triangles_of(faces)[1].T)
    six_volumes = np.einsum("ij,ij->i", a, np.cross(b, c))
    volume = six_volumes.sum() / 6.0
    s = a + b + c
    centroid = np.einsum("i,ij->j", six_volumes, s) / (24.0 * volume)
    second = np.sum([np.einsum("i,ij,ik->jk", six_volumes, e, e) for e in (s, a, b, c)], axis=0) / 120.0
    return float(volume), origin + centroid, second - volume * np.outer(centroid, centroid)


def principal_axes(inertia: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Principal moments (3,) and the rotation (3, 3) whose columns are the principal axes.

    Axes that are principal already stay as they are, so a cube keeps the axes it was described in.
    """
    products = inertia - np.diag(np.diag(inertia))
    if np.abs(products).max() <= PRINCIPAL_AXES * np.abs(inertia).max():
        return np.diag(inertia).copy(), np.eye(3)
    moments, axes = np.linalg.eigh(inertia)
    if np.linalg.det(axes) < 0.0:
        axes[:, 2] = -axes[:, 2]
    return moments, axes


def rounded_mass_properties(
    vertices: np.ndarray, faces: Sequence[Sequence[int]], edges: Sequence[Sequence[int]], radius: float
) -> MassProperties:
    """Mass properties of all points within ``radius`` of a polyhedron, its core.

    Outside of the core lie a prism on each face, a wedge of a cylinder along each edge and a sector of a sphere at each
    vertex (J. Steiner, Monatsberichte der Akademie der Wissenschaften zu Berlin (1840) 114-118). The integrals of 1, x
    and x x^T over each are closed forms; the sectors together make a whole sphere.

    Parameters
    ----------
    vertices : (v, 3) float64, of the core [m]
    faces : loops of vertex numbers, counter-clockwise seen from outside
    edges : rows (first vertex, second vertex, face to the left, face to the right)
    radius : above 0 [m]
    """
    core_volume, core_centroid, core_second = _polyhedron(vertices, faces)
    about = vertices - core_centroid
    normals = face_normals(about, faces)
    parts = (
        _Integrals(core_volume, np.zeros(3), core_second),
        _prisms(about, faces, normals, radius),
        _wedges(about, np.asarray(edges), normals, radius),
        _sectors(about, faces, radius),
    )
    volume = sum(part.volume for part in parts)
    first = np.sum([part.first for part in parts], axis=0)
    second = np.sum([part.second for part in parts], axis=0)
    centroid = first / volume
    return MassProperties(float(volume), core_centroid + centroid, _inertia(second - np.outer(centroid, first)))


def _inertia(second: np.ndarray) -> np.ndarray:
    """The inertia tensor of a solid from its integral of x x^T.

    Each moment is the sum of the other two integrals: the trace less one of them loses the small moment of a needle.
    """
    moments = np.diag(second)
    return np.diag(np.roll(moments, -1) + np.roll(moments, -2)) - (second - np.diag(moments))


def _products(weight: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Sum of weight * (a b^T + b a^T) / 2 over rows: weight (k,), a and b (k, 3)."""
    product = np.einsum("i,ij,ik->jk", weight, a, b)
    return 0.5 * (product + product.T)


def _prisms(vertices: np.ndarray, faces: Sequence[Sequence[int]], normals: np.ndarray, radius: float) -> _Integrals:
    """Integrals of 1, x and x x^T over the prisms of height ``radius`` on the faces, triangle by triangle.

    Over a triangle of area A with corners a, b, c the integral of x x^T is A / 12 * (a a^T + b b^T + c c^T + s s^T)
    with s = a + b + c.
    """
    face, corners = triangles_of(faces)
    a, b, c = (vertices[corner] for corner in corners.T)
    n, s = normals[face], a + b + c
    area = 0.5 * np.einsum("ij,ij->i", np.cross(b - a, c - a), n)
    in_plane = sum(_products(area / 12.0, corner, corner) for corner in (a, b, c, s))
    volume = radius * area.sum()
    first = radius * area @ s / 3.0 + 0.5 * radius**2 * area @ n
    second = radius * in_plane + radius**2 * _products(area, s / 3.0, n) + radius**3 / 3.0 * _products(area, n, n)
    return _Integrals(float(volume), first, second)


def _wedges(vertices: np.ndarray, edges: np.ndarray, normals: np.ndarray, radius: float) -> _Integrals:
    """Integrals of 1, x and x x^T over the wedges of cylinders along the edges.

    A wedge spans the directions d from the normal of the face to the left, n, to that of the face to the right. With w
    perpendicular to n and to the edge, d = n cos(t) + w sin(t) for t from 0 to the angle between the normals.
    """
    start, end = vertices[edges[:, 0]], vertices[edges[:, 1]]
    length = np.linalg.norm(end - start, axis=1)
    along, middle = (end - start) / length[:, None], 0.5 * (start + end)
    n = normals[edges[:, 2]]
    w = np.cross(along, n)
    right = normals[edges[:, 3]]
    angle = np.arctan2(np.einsum("ij,ij->i", w, right), np.einsum("ij,ij->i", n, right))
    sine, versine = np.sin(angle), 2.0 * np.sin(0.5 * angle) ** 2
    outwards = sine[:, None] * n + versine[:, None] * w  # the integral of d over the angle
    section = 0.5 * radius**2 * angle * length  # volumes
    first = section @ middle + radius**3 / 3.0 * length @ outwards
    second = _products(section, middle, middle) + _products(section * length**2 / 12.0, along, along)
    second += 2.0 / 3.0 * radius**3 * _products(length, middle, outwards)
    # The integral of d d^T over the angle; over the sphere sectors at both ends the first moments of d add up to the
    # last term, as the directions of a sector are bounded by the arcs of its edges.
    of_n, of_w = 0.5 * angle + 0.25 * np.sin(2.0 * angle), 0.5 * angle - 0.25 * np.sin(2.0 * angle)
    around = _products(length * of_n, n, n) + _products(length * of_w, w, w) + _products(length * sine**2, n, w)
    second += 0.25 * radius**4 * (around + _products(length * angle, along, along))
    return _Integrals(float(section.sum()), first, second)


def _sectors(vertices: np.ndarray, faces: Sequence[Sequence[int]], radius: float) -> _Integrals:
    """Integrals of 1, x and x x^T over the sectors of spheres at the vertices, but for what _wedges adds.

    The solid angle of a sector is what the angles of the faces at its vertex lack of a full turn (Descartes).
    """
    solid_angle = np.full(len(vertices), 2.0 * pi)
    for loop in faces:
        corner = vertices[list(loop)]
        ahead, behind = np.roll(corner, -1, axis=0) - corner, np.roll(corner, 1, axis=0) - corner
        sine = np.linalg.norm(np.cross(ahead, behind), axis=1)
        solid_angle[list(loop)] -= np.arctan2(sine, np.einsum("ij,ij->i", ahead, behind))
    weight = radius**3 / 3.0 * solid_angle
    second = _products(weight, vertices, vertices) + 4.0 * pi / 15.0 * radius**5 * np.eye(3)
    return _Integrals(4.0 * pi / 3.0 * radius**3, weight @ vertices, second)


def capsule_moments(length: float, radius: float) -> tuple[float, np.ndarray]:
    """Volume and principal moments (3,) of a capsule along z: a cylinder between two half spheres."""
    cylinder, sphere = pi * radius**2 * length, 4.0 / 3.0 * pi * radius**3
    # The centroid of a half sphere is 3/8 of the radius from its base.
    across = cylinder * (length**2 / 12.0 + radius**2 / 4.0)
    across += sphere * (0.4 * radius**2 + 0.25 * length**2 + 0.375 * length * radius)
    along = cylinder * 0.5 * radius**2 + sphere * 0.4 * radius**2
    return cylinder + sphere, np.array([across, across, along])
