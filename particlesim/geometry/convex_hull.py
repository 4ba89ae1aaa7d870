"""Corners and plane faces of the convex hull of points that are plane but for rounding."""

from __future__ import annotations

import numpy as np
from scipy.optimize import nnls
from scipy.spatial import ConvexHull, QhullError

from particlesim.geometry.faces import Polyhedron, is_convex
from particlesim.geometry.plane_faces import made_plane
from particlesim.geometry.tolerances import SAME_FACE_ANGLE, VERTEX_ROUNDINGS

# What is wrong with vertices that lie in a plane, on a line or in a point.
NO_VOLUME = "the vertices of '{}' enclose no volume"


def hull_polygons(name: str, points: np.ndarray) -> Polyhedron:
    """The convex hull of points.

    Points that stand out by less than rounding are dropped; the corners of a face are moved into its plane. Rounding is
    the first of VERTEX_ROUNDINGS that leaves a convex body: what is thin may be curved by no more than the usual one.
    ValueError if the points enclose no volume.
    """
    for rounding in VERTEX_ROUNDINGS:
        standing_out = corner_points(name, points, rounding)
        try:
            corners, faces = _polygons(name, standing_out, convex_hull(name, standing_out), rounding)
            corners = made_plane(name, corners, faces)
        except ValueError:
            continue
        if is_convex(corners, faces):
            return corners, faces
    raise ValueError(NO_VOLUME.format(name))


def convex_hull(name: str, points: np.ndarray) -> ConvexHull:
    """Qhull's triangulated hull. ValueError if the points enclose no volume."""
    try:
        return ConvexHull(points)
    except (QhullError, ValueError) as error:
        raise ValueError(NO_VOLUME.format(name)) from error


def triangulated_hull(name: str, corners: np.ndarray) -> Polyhedron:
    """The convex hull of points that are all corners of it, with triangles for faces. ValueError without volume."""
    convex = convex_hull(name, corners)
    a, b, c = (corners[convex.simplices[:, k]] for k in range(3))
    inwards = np.einsum("ij,ij->i", np.cross(b - a, c - a), convex.equations[:, :3]) < 0.0
    triangles = np.where(inwards[:, None], convex.simplices[:, ::-1], convex.simplices)
    return corners, tuple(map(tuple, triangles.tolist()))


def spread(points: np.ndarray, count: int) -> np.ndarray:
    """``count`` of the points, each the farthest from those chosen before it."""
    chosen = [int(np.argmax(np.linalg.norm(points - points.mean(axis=0), axis=1)))]
    distance = np.linalg.norm(points - points[chosen[0]], axis=1)
    while len(chosen) < count:
        chosen.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return points[chosen]


def corner_points(name: str, points: np.ndarray, rounding: float = VERTEX_ROUNDINGS[0]) -> np.ndarray:
    """The points that stand out from the hull of the others, by more than rounding [fraction of the extent]."""
    while True:
        convex = convex_hull(name, points)
        near = rounding * np.linalg.norm(np.ptp(points, axis=0))
        dropped: set[int] = set()
        for v, ring in zip(convex.vertices.tolist(), _rings(convex), strict=True):
            if dropped.isdisjoint(ring.tolist()) and distance_from_hull(points[v], points[ring]) < near:
                dropped.add(v)
        points = points[[v for v in convex.vertices if v not in dropped]]
        if not dropped:
            return points


def _rings(convex: ConvexHull) -> list[np.ndarray]:
    """Of each vertex of a triangulated hull the vertices that it shares triangles with, in rising order."""
    starts = np.concatenate([convex.simplices[:, [k, k, k]] for k in range(3)]).ravel()
    ends = np.concatenate([convex.simplices] * 3).ravel()
    pairs = np.unique(np.stack([starts, ends], axis=1)[starts != ends], axis=0)
    ranges = np.searchsorted(pairs[:, 0], convex.vertices), np.searchsorted(pairs[:, 0], convex.vertices, side="right")
    return [pairs[first:last, 1] for first, last in zip(*ranges, strict=True)]


def distance_from_hull(point: np.ndarray, others: np.ndarray) -> float:
    """Distance of a point from the convex hull of others near it, which may be flat."""
    arms = others - point
    scale = np.abs(arms).max()
    # Weights of the others that are not negative, sum to 1 and make the point.
    _, off = nnls(np.vstack([arms.T / scale, np.ones(len(arms))]), np.array([0.0, 0.0, 0.0, 1.0]))
    return scale * off


def _polygons(name: str, points: np.ndarray, convex: ConvexHull, rounding: float) -> Polyhedron:
    """Corners and faces of a hull: its coplanar triangles joined, vertices inside a face or an edge dropped."""
    face_of = _faces_of_triangles(points, convex, rounding)
    # Which vertices each face has; a corner is where three faces meet: two meet along an edge.
    face, vertex = np.unique(np.stack([np.repeat(face_of, 3), convex.simplices.ravel()]), axis=1)
    corner = np.bincount(vertex, minlength=len(points)) >= 3
    face, vertex = face[corner[vertex]], vertex[corner[vertex]]
    seeds, starts, sizes = np.unique(face, return_index=True, return_counts=True)
    # Nearly flat points may leave fewer faces or corners than enclose anything.
    if len(seeds) < max(4, len(np.unique(face_of))) or sizes.min() < 3:
        raise ValueError(NO_VOLUME.format(name))
    number = np.cumsum(corner) - 1
    loops = []
    for seed, members in zip(seeds, np.split(vertex, starts[1:]), strict=True):
        loops.append(number[members[_outline(points[members], convex.equations[seed, :3])]])
    return points[corner], tuple(tuple(loop.tolist()) for loop in loops)


def _faces_of_triangles(points: np.ndarray, convex: ConvexHull, rounding: float) -> np.ndarray:
    """For each triangle of a hull the largest one, of those in its plane, that its face is numbered after, (t,)."""
    normals, corners = convex.equations[:, :3], points[convex.simplices]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    near = rounding * np.linalg.norm(np.ptp(points, axis=0))
    face_of = np.full(len(normals), -1)
    # The largest first: the normal of a sliver is uncertain.
    for seed in np.argsort(-area, kind="stable"):
        if face_of[seed] >= 0:
            continue
        face_of[seed] = seed
        reach = [seed]
        while reach:
            beside = convex.neighbors[reach.pop()]
            beside = beside[face_of[beside] < 0]
            height = np.abs((corners[beside] - corners[seed, 0]) @ normals[seed])
            flat = (height < near).all(axis=1)
            flat &= np.linalg.norm(normals[beside] - normals[seed], axis=1) < SAME_FACE_ANGLE
            face_of[beside[flat]] = seed
            reach += beside[flat].tolist()
    return face_of


def _outline(points: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """The order in which plane points run counter-clockwise about ``normal``."""
    arm = points - points.mean(axis=0)
    u = arm[np.argmax(np.linalg.norm(arm, axis=1))]
    v = np.cross(normal, u)
    return np.argsort(np.arctan2(arm @ v, arm @ u))
