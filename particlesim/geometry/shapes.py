"""The catalogue of shapes. A convex shape is its vertices; everything else about it follows from them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import pi, sqrt
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import nnls
from scipy.spatial import ConvexHull, QhullError
from scipy.spatial.transform import Rotation

from particlesim.core.constants import HULL, SPHERE
from particlesim.geometry.mass_properties import mass_properties, principal_axes

# Mesh files hold float32 or six digits: what is smaller than this fraction of the shape is rounding.  A vertex that
# stands out by less is none, triangles that leave the plane of a larger neighbour by less are one face with it.
_ROUNDING = 1e-6

# Triangles steeper than this against each other [rad] are two faces, however thin the shape.
_SAME_FACE = 0.1

# Corners may lie this far off the plane of their face, as a fraction of the shape: rounding.
_FLAT = 1e-14

# An exact test of two hulls looks at every pair of their edges; a mesh of more corners than this is thinned.
MAX_MESH_VERTICES = 96


@dataclass(frozen=True, eq=False)
class Shape:
    """A shape of size 1 about its centroid, in its principal axes; a particle has a shape and a size.

    ``kind`` is SPHERE or HULL. ``vertices`` (v, 3) [m]; ``faces`` are loops of vertex numbers, counter-clockwise
    seen from outside; ``volume`` [m^3]; ``moments`` (3,) principal moments at density 1 [kg m^2]; ``radius`` of the
    bounding and ``inradius`` of the inscribed sphere about the centroid [m]. ``orientation`` (w, x, y, z) turns
    these axes into the axes the shape was described in; it is the identity but for meshes.
    """

    name: str
    kind: int
    vertices: np.ndarray
    faces: tuple[tuple[int, ...], ...]
    volume: float
    moments: np.ndarray
    radius: float
    inradius: float
    orientation: np.ndarray

    @property
    def face_normals(self) -> np.ndarray:
        """Outward unit normals of the faces, (f, 3)."""
        return np.array([_loop_normal(self.vertices[list(loop)]) for loop in self.faces]).reshape(-1, 3)

    @property
    def edges(self) -> list[tuple[int, int, int, int]]:
        """Each edge once: its two vertices, then the faces to its left and to its right."""
        left = {}
        for face, loop in enumerate(self.faces):
            for start, end in zip(loop, loop[1:] + loop[:1], strict=True):
                left[start, end] = face
        return [(a, b, left[a, b], left[b, a]) for a, b in sorted(left) if a < b]


def sphere() -> Shape:
    """The sphere of diameter 1."""
    volume = pi / 6.0
    return Shape(
        name="sphere",
        kind=SPHERE,
        vertices=np.zeros((0, 3)),
        faces=(),
        volume=volume,
        moments=np.full(3, 0.1 * volume),  # 2/5 m r^2 with r = 1/2
        radius=0.5,
        inradius=0.5,
        orientation=np.array([1.0, 0.0, 0.0, 0.0]),
    )


def hull(name: str, vertices: Any) -> Shape:
    """The convex hull of ``vertices`` (v, 3) as a shape about its centroid.

    Vertices inside the hull, its faces or its edges are dropped; triangles in one plane within 1e-6 of the shape's
    extent become one face, and its corners are moved into the plane.
    ValueError if the vertices are not finite or enclose no volume.
    """
    points = np.asarray(vertices, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
        raise ValueError(f"the vertices of '{name}' must be rows of three finite numbers")
    points = _corners(name, points)
    corners, faces = _polygons(points, _convex_hull(name, points))
    corners = _flattened(name, corners, faces)
    volume, centroid, inertia = mass_properties(corners, faces)
    moments, axes = principal_axes(inertia)
    body = np.ascontiguousarray((corners - centroid) @ axes)
    offsets = [_loop_normal(body[list(loop)]) @ body[loop[0]] for loop in faces]
    return Shape(
        name=name,
        kind=HULL,
        vertices=body,
        faces=faces,
        volume=volume,
        moments=moments,
        radius=float(np.linalg.norm(body, axis=1).max()),
        inradius=float(min(offsets)),
        orientation=np.roll(Rotation.from_matrix(axes).as_quat(canonical=True), 1),
    )


def box(edges: Any = (1.0, 1.0, 1.0), name: str = "box") -> Shape:
    """A box with the given three edges."""
    half = 0.5 * np.asarray(edges, dtype=np.float64)
    return hull(name, [(x, y, z) * half for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])


def cube() -> Shape:
    """The cube of edge 1."""
    return box(name="cube")


def pyramid(height: float = 1.0) -> Shape:
    """A pyramid on a square base of edge 1, its top on +z."""
    base = [(x, y, 0.0) for x in (-0.5, 0.5) for y in (-0.5, 0.5)]
    return hull("pyramid", [*base, (0.0, 0.0, height)])


def tetrahedron() -> Shape:
    """The regular tetrahedron of edge 1."""
    corners = np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)])
    return hull("tetrahedron", corners / sqrt(8.0))


def mesh(file: str | Path) -> Shape:
    """The convex hull of an STL, OBJ or PLY file in its own units, thinned to MAX_MESH_VERTICES corners.

    OSError or ValueError if the file cannot be read or encloses no volume.
    """
    import trimesh  # noqa: PLC0415  (slow to import, needed for meshes only)

    path = Path(file)
    if not path.is_file():
        raise FileNotFoundError(f"no such file: {path}")
    try:
        loaded: Any = trimesh.load(path, force="mesh", process=False)
        points = np.asarray(loaded.vertices, dtype=np.float64)
    except Exception as error:
        raise ValueError(f"{path} cannot be read as a mesh: {error}") from error
    return hull(path.stem, _spread(points[_convex_hull(path.stem, points).vertices]))


# Adding a convex shape is one entry here: a function that returns it, whose parameters scene files may set.
CATALOGUE: dict[str, Callable[..., Shape]] = {
    "sphere": sphere,
    "cube": cube,
    "box": box,
    "pyramid": pyramid,
    "tetrahedron": tetrahedron,
    "mesh": mesh,
}


def _convex_hull(name: str, points: np.ndarray) -> ConvexHull:
    try:
        return ConvexHull(points)
    except (QhullError, ValueError) as error:
        raise ValueError(f"the vertices of '{name}' enclose no volume") from error


def _loop_normal(loop: np.ndarray) -> np.ndarray:
    """Unit normal of a plane polygon given by its corners in order (Newell's sum of cross products)."""
    arm = loop - loop[0]
    normal = np.cross(arm[1:-1], arm[2:]).sum(axis=0)
    return normal / np.linalg.norm(normal)


def _corners(name: str, points: np.ndarray) -> np.ndarray:
    """The points that stand out from the hull of the others, by more than rounding."""
    while True:
        convex = _convex_hull(name, points)
        near = _ROUNDING * np.linalg.norm(np.ptp(points, axis=0))
        dropped: set[int] = set()
        for v in convex.vertices.tolist():
            ring = np.unique(convex.simplices[(convex.simplices == v).any(axis=1)])
            ring = ring[ring != v]
            if dropped.isdisjoint(ring.tolist()) and _distance_from_hull(points[v], points[ring]) < near:
                dropped.add(v)
        points = points[[v for v in convex.vertices if v not in dropped]]
        if not dropped:
            return points


def _distance_from_hull(point: np.ndarray, others: np.ndarray) -> float:
    """Distance of a point from the convex hull of others near it, which may be flat."""
    arms = others - point
    scale = np.abs(arms).max()
    # Weights of the others that are not negative, sum to 1 and make the point.
    _, off = nnls(np.vstack([arms.T / scale, np.ones(len(arms))]), np.array([0.0, 0.0, 0.0, 1.0]))
    return scale * off


def _polygons(points: np.ndarray, convex: ConvexHull) -> tuple[np.ndarray, tuple[tuple[int, ...], ...]]:
    """Corners and faces of a hull: its coplanar triangles joined, vertices inside a face or an edge dropped."""
    normals = convex.equations[:, :3]
    a, b, c = (points[convex.simplices[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    near = _ROUNDING * np.linalg.norm(np.ptp(points, axis=0))
    face_of = np.full(len(normals), -1)
    # The largest first: the normal of a sliver is uncertain.
    for seed in np.argsort(-area, kind="stable"):
        if face_of[seed] >= 0:
            continue
        height = np.abs((points - points[convex.simplices[seed, 0]]) @ normals[seed])
        flat = (height[convex.simplices] < near).all(axis=1)
        flat &= np.linalg.norm(normals - normals[seed], axis=1) < _SAME_FACE
        face_of[seed] = seed
        reach = [seed]
        while reach:
            for other in convex.neighbors[reach.pop()]:
                if face_of[other] < 0 and flat[other]:
                    face_of[other] = seed
                    reach.append(other)
    meets = np.zeros((len(points), len(normals)), dtype=bool)
    meets[convex.simplices, face_of[:, None]] = True
    # A corner is where three faces meet: two meet along an edge.
    corner = meets.sum(axis=1) >= 3
    number = np.cumsum(corner) - 1
    loops = []
    for seed in np.unique(face_of):
        members = np.flatnonzero(meets[:, seed] & corner)
        loops.append(number[members[_outline(points[members], normals[seed])]])
    return points[corner], tuple(tuple(loop.tolist()) for loop in loops)


def _outline(points: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """The order in which plane points run counter-clockwise about ``normal``."""
    arm = points - points.mean(axis=0)
    u = arm[np.argmax(np.linalg.norm(arm, axis=1))]
    v = np.cross(normal, u)
    return np.argsort(np.arctan2(arm @ v, arm @ u))


def _flattened(name: str, corners: np.ndarray, faces: tuple[tuple[int, ...], ...]) -> np.ndarray:
    """Corners moved as little as possible so that those of each face lie in one plane.

    Newton's method on normal . corner = offset for every corner of every face that is not a triangle, in the least
    change of corners, normals and offsets: corners that are off by 1e-6 are in their planes after two steps.
    """
    loops = [list(loop) for loop in faces if len(loop) > 3]
    centre, scale = corners.mean(axis=0), np.ptp(corners, axis=0).max()
    x = (corners - centre) / scale
    normals = np.array([_loop_normal(x[loop]) for loop in loops]).reshape(-1, 3)
    offsets = np.array([(x[loop] @ n).mean() for loop, n in zip(loops, normals, strict=True)])
    face = np.repeat(np.arange(len(loops)), [len(loop) for loop in loops])
    corner = np.array([v for loop in loops for v in loop], dtype=np.int64)
    rows, first, last = np.arange(len(corner)), x.size, x.size + normals.size
    for _ in range(8):
        off = np.einsum("ij,ij->i", normals[face], x[corner]) - offsets[face]
        if np.abs(off).max(initial=0.0) <= _FLAT:
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


def _spread(points: np.ndarray) -> np.ndarray:
    """At most MAX_MESH_VERTICES of the points, each the farthest from those chosen before it."""
    if len(points) <= MAX_MESH_VERTICES:
        return points
    chosen = [int(np.argmax(np.linalg.norm(points - points.mean(axis=0), axis=1)))]
    distance = np.linalg.norm(points - points[chosen[0]], axis=1)
    while len(chosen) < MAX_MESH_VERTICES:
        chosen.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return points[chosen]
