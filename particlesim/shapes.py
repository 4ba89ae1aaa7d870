"""The catalogue of shapes. A convex shape is its vertices; everything else about it follows from them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import pi, sqrt
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import ConvexHull, QhullError
from scipy.spatial.transform import Rotation

from particlesim.constants import HULL, SPHERE
from particlesim.mass_properties import mass_properties, principal_axes

# Triangles of a hull whose normals differ by less than this angle [rad] are one face of it.
_COPLANAR = 1e-6

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
    """The convex hull of ``vertices`` (v, 3) as a shape about its centroid. ValueError if it encloses no volume."""
    points = np.asarray(vertices, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
        raise ValueError(f"the vertices of '{name}' must be rows of three finite numbers")
    corners, faces = _polygons(points, _convex_hull(name, points))
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


def _polygons(points: np.ndarray, convex: ConvexHull) -> tuple[np.ndarray, tuple[tuple[int, ...], ...]]:
    """Corners and faces of a hull: its coplanar triangles joined, corners inside a face or an edge dropped."""
    normals = convex.equations[:, :3]
    face_of = np.full(len(normals), -1)
    for seed in range(len(normals)):
        if face_of[seed] < 0:
            face_of[seed] = seed
            reach = [seed]
            while reach:
                for other in convex.neighbors[reach.pop()]:
                    flat = np.linalg.norm(normals[other] - normals[seed]) < _COPLANAR
                    if face_of[other] < 0 and flat:
                        face_of[other] = seed
                        reach.append(other)
    loops = []
    for seed in np.unique(face_of):
        members = np.unique(convex.simplices[face_of == seed])
        loops.append(members[_outline(points[members], normals[seed])])
    corners = np.unique(np.concatenate(loops))
    number = {int(old): new for new, old in enumerate(corners)}
    return points[corners], tuple(tuple(number[int(v)] for v in loop) for loop in loops)


def _outline(points: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """The order in which plane points run counter-clockwise about ``normal``."""
    arm = points - points.mean(axis=0)
    u = arm[np.argmax(np.linalg.norm(arm, axis=1))]
    v = np.cross(normal, u)
    return np.argsort(np.arctan2(arm @ v, arm @ u))


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
