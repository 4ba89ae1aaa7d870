"""Corners and plane faces of the convex hull of points that are plane but for rounding."""

from __future__ import annotations

import numpy as np
from scipy.optimize import nnls
from scipy.spatial import ConvexHull, QhullError

from particlesim.geometry.tolerances import FLAT_FACE, SAME_FACE_ANGLE, VERTEX_ROUNDING

Faces = tuple[tuple[int, ...], ...]

# What is wrong with vertices that lie in a plane, on a line or in a point.
NO_VOLUME = "the vertices of '{}' enclose no volume"


def hull_polygons(name: str, points: np.ndarray) -> tuple[np.ndarray, Faces]:
    """Corners (v, 3) of the convex hull of points, and its faces as loops of corners, counter-clockwise from outside.

    Points that stand out by less than VERTEX_ROUNDING are dropped; the corners of a face are moved into its plane.
    ValueError if the points enclose no volume.
    """
    standing_out = corner_points(name, points)
    corners, faces = _polygons(name, standing_out, convex_hull(name, standing_out))
    return _flattened(name, corners, faces), faces


def convex_hull(name: str, points: np.ndarray) -> ConvexHull:
    """Qhull's triangulated hull. ValueError if the points enclose no volume."""
    try:
        return ConvexHull(points)
    except (QhullError, ValueError) as error:
        raise ValueError(NO_VOLUME.format(name)) from error


def loop_normal(loop: np.ndarray) -> np.ndarray:
    """Unit normal of a plane polygon given by its corners in order (Newell's sum of cross products)."""
    arm = loop - loop[0]
    normal = np.cross(arm[1:-1], arm[2:]).sum(axis=0)
    return normal / np.linalg.norm(normal)


def corner_points(name: str, points: np.ndarray) -> np.ndarray:
    """The points that stand out from the hull of the others, by more than rounding."""
    while True:
        convex = convex_hull(name, points)
        near = VERTEX_ROUNDING * np.linalg.norm(np.ptp(points, axis=0))
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


def _polygons(name: str, points: np.ndarray, convex: ConvexHull) -> tuple[np.ndarray, Faces]:
    """Corners and faces of a hull: its coplanar triangles joined, vertices inside a face or an edge dropped."""
    face_of = _faces_of_triangles(points, convex)
    meets = np.zeros((len(points), len(face_of)), dtype=bool)
    meets[convex.simplices, face_of[:, None]] = True
    # A corner is where three faces meet: two meet along an edge.
    corner = meets.sum(axis=1) >= 3
    seeds = np.unique(face_of)
    # Nearly flat points may leave fewer faces or corners than enclose anything.
    if len(seeds) < 4 or (meets[:, seeds] & corner[:, None]).sum(axis=0).min() < 3:
        raise ValueError(NO_VOLUME.format(name))
    number = np.cumsum(corner) - 1
    loops = []
    for seed in seeds:
        members = np.flatnonzero(meets[:, seed] & corner)
        loops.append(number[members[_outline(points[members], convex.equations[seed, :3])]])
    return points[corner], tuple(tuple(loop.tolist()) for loop in loops)


def _faces_of_triangles(points: np.ndarray, convex: ConvexHull) -> np.ndarray:
    """For each triangle of a hull the largest one, of those in its plane, that its face is numbered after, (t,)."""
    normals = convex.equations[:, :3]
    a, b, c = (points[convex.simplices[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    near = VERTEX_ROUNDING * np.linalg.norm(np.ptp(points, axis=0))
    face_of = np.full(len(normals), -1)
    # The largest first: the normal of a sliver is uncertain.
    for seed in np.argsort(-area, kind="stable"):
        if face_of[seed] >= 0:
            continue
        height = np.abs((points - points[convex.simplices[seed, 0]]) @ normals[seed])
        flat = (height[convex.simplices] < near).all(axis=1)
        flat &= np.linalg.norm(normals - normals[seed], axis=1) < SAME_FACE_ANGLE
        face_of[seed] = seed
        reach = [seed]
        while reach:
            for other in convex.neighbors[reach.pop()]:
                if face_of[other] < 0 and flat[other]:
                    face_of[other] = seed
                    reach.append(other)
    return face_of


def _outline(points: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """The order in which plane points run counter-clockwise about ``normal``."""
    arm = points - points.mean(axis=0)
    u = arm[np.argmax(np.linalg.norm(arm, axis=1))]
    v = np.cross(normal, u)
    return np.argsort(np.arctan2(arm @ v, arm @ u))


def _flattened(name: str, corners: np.ndarray, faces: Faces) -> np.ndarray:
    """Corners moved as little as possible so that those of each face lie in one plane.

    Newton's method on normal . corner = offset for every corner of every face that is not a triangle, in the least
    change of corners, normals and offsets: corners that are off by 1e-6 are in their planes after two steps.
    """
    loops = [list(loop) for loop in faces if len(loop) > 3]
    centre, scale = corners.mean(axis=0), np.ptp(corners, axis=0).max()
    x = (corners - centre) / scale
    normals = np.array([loop_normal(x[loop]) for loop in loops]).reshape(-1, 3)
    offsets = np.array([(x[loop] @ n).mean() for loop, n in zip(loops, normals, strict=True)])
    face = np.repeat(np.arange(len(loops)), [len(loop) for loop in loops])
    corner = np.array([v for loop in loops for v in loop], dtype=np.int64)
    rows, first, last = np.arange(len(corner)), x.size, x.size + normals.size
    for _ in range(8):
        off = np.einsum("ij,ij->i", normals[face], x[corner]) - offsets[face]
        if np.abs(off).max(initial=0.0) <= FLAT_FACE:
            break
        system = np.zeros((len(rows) + len(loops), last + len(loops)))
        for axis in range(3):
            system[rows, 3 * corner + axis] = normals[face, axis]
            system[rows, first + 3 * face + axis] = x[corner, axis]
            system[len(rows) + np.arange(len(loops)), first + 3 * np.arange(len(loops)) + axis] = normals[:, axis]
        system[rows, last + face] = -1.0
        change = np.linalg.lstsq(system, np.concatenate([-off, np.zeros(len(loops))]), rcond=None)[0]
        x = x + change[:first].reshape(-1, 3)
        normals = normals + change[first:last].reshape(-1, 3)
        offsets = offsets + change[last:]
    else:
        raise ValueError(f"the faces of '{name}' cannot be made plane")
    return x * scale + centre if loops else corners
