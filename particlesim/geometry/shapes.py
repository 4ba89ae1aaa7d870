"""Shapes: a convex core and a rounding radius, from which everything else about a shape follows. The catalogue."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from particlesim.core.arguments import FARTHEST, checked_arguments, real_numbers, shown
from particlesim.core.constants import CAPSULE, COMPOUND, HALF_SPACE, MESH, POLYHEDRON, SPHERE
from particlesim.core.polyhedra import POLYHEDRA
from particlesim.geometry.convex_hull import (
    NO_VOLUME,
    convex_hull,
    corner_points,
    distance_from_hull,
    hull_polygons,
    spread,
    triangulated_hull,
)
from particlesim.geometry.faces import Faces, Polyhedron, edges_of, face_normals
from particlesim.geometry.mass_properties import (
    MassProperties,
    capsule_moments,
    mass_properties,
    principal_axes,
    rounded_mass_properties,
)
from particlesim.geometry.mesh_file import mesh_vertices
from particlesim.geometry.tolerances import MAX_MESH_VERTICES, MAX_TRIANGLES
from particlesim.geometry.triangle_surface import surface_of_triangles
from particlesim.geometry.triangle_tree import tree_order

_UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])
_NO_TRIANGLES = np.zeros((0, 3), dtype=np.int64)


@dataclass(frozen=True, eq=False)
class Shape:
    """A shape of size 1 about its centroid, in its principal axes; a particle has a shape and a size.

    The shape is all points within ``rounding`` of its core: a point (sphere), a segment (capsule) or a polyhedron.

    Attributes
    ----------
    name : str
    kind : int
        SPHERE, CAPSULE, POLYHEDRON, HALF_SPACE (see ``half_space``), MESH (see ``triangle_mesh``) or COMPOUND (see
        compounds.py), whose core is the box about it; of the parts of a compound BALL, CAPSULE or POLYHEDRON.
    vertices : (v, 3) float64 [m]
        Of the core.
    faces : tuple of tuples of int
        Of the core: loops of vertex numbers, counter-clockwise seen from outside; none of a point or segment.
    rounding : float [m]
        How far the surface is outside of the core.
    volume : float [m^3]
    moments : (3,) float64 [kg m^2]
        Principal moments at density 1 kg/m^3.
    radius, inradius : float [m]
        Of the bounding and of the inscribed sphere about the centroid; of a compound the smallest inscribed sphere of
        its parts.
    orientation : (4,) float64
        Quaternion (w, x, y, z) that turns the principal axes into the axes that the shape was described in; the
        identity where those are principal, as they are for all but meshes and hulls.
    described_corners : int
        How many corners the hull of a mesh has; more than there are vertices if it was thinned. Volume, centroid and
        moments are those of the whole hull. 0 of a shape that is no hull.
    triangles : (t, 3) int64
        Of a mesh: its triangles, by their vertices, in the order of the tree over them; (0, 3) of any other shape.
    remarks : tuple of str
        Of a mesh: what is odd about it, a line each.
    parts : tuple of Shape
        Of a compound: where they are in it, about its centroid and in its axes; () of any other shape.
    """

    name: str
    kind: int
    vertices: np.ndarray
    faces: Faces
    rounding: float
    volume: float
    moments: np.ndarray
    radius: float
    inradius: float
    orientation: np.ndarray
    described_corners: int = 0
    triangles: np.ndarray = field(default_factory=lambda: _NO_TRIANGLES)
    remarks: tuple[str, ...] = ()
    parts: tuple[Shape, ...] = ()

    @property
    def is_sphere(self) -> bool:
        """Whether it is the same from all sides."""
        return self.kind == SPHERE

    @property
    def is_bounded(self) -> bool:
        """Whether it has a bounding sphere, as all shapes but half-spaces have."""
        return self.kind != HALF_SPACE

    @property
    def is_convex(self) -> bool:
        """Whether it is one core with a rounding radius, as all shapes but meshes and compounds are."""
        return self.kind not in (MESH, COMPOUND)

    @cached_property
    def face_normals(self) -> np.ndarray:
        """Outward unit normals of the faces, (f, 3)."""
        return face_normals(self.vertices, self.faces)

    @cached_property
    def edges(self) -> list[tuple[int, int, int, int]]:
        """Each edge of the core once: its two vertices, then the faces to its left and right, -1 for none."""
        if self.kind == CAPSULE:
            return [(0, 1, -1, -1)]
        return edges_of(self.faces) if self.kind == POLYHEDRON else []


def sphere() -> Shape:
    """The sphere of diameter 1."""
    volume = pi / 6.0
    moments = np.full(3, 0.1 * volume)  # 2/5 m r^2 with r = 1/2
    return Shape("sphere", SPHERE, np.zeros((1, 3)), (), 0.5, volume, moments, 0.5, 0.5, _UPRIGHT)


@checked_arguments
def capsule(length: float) -> Shape:
    """All points within 0.5 of a segment of the given length, along z; it is ``length`` + 1 long in all."""
    if not 0.0 < length <= FARTHEST:
        raise ValueError(f"the length of a capsule must be a number above 0, up to {FARTHEST:g} m, not {length!r}")
    ends = np.array([(0.0, 0.0, -0.5 * length), (0.0, 0.0, 0.5 * length)])
    volume, moments = capsule_moments(length, 0.5)
    return Shape("capsule", CAPSULE, ends, (), 0.5, volume, moments, 0.5 * length + 0.5, 0.5, _UPRIGHT)


def half_space(normal: Any = (1.0, 0.0, 0.0)) -> Shape:
    """All points x with ``normal`` . x <= 0; the normal points out of it. It has no size, no mass and no end.

    ``vertices`` are three points of its plane, which its one face runs round.
    """
    outwards = np.asarray(normal, dtype=np.float64)
    along = np.cross(np.eye(3)[np.argmin(np.abs(outwards))], outwards)
    plane = np.array([np.zeros(3), along, np.cross(outwards, along)])
    none = np.full(3, np.inf)
    return Shape("half_space", HALF_SPACE, plane, ((0, 1, 2),), 0.0, np.inf, none, np.inf, np.inf, _UPRIGHT)


def triangle_mesh(name: str, points: Any, triangles: Any) -> Shape:
    """Triangles (t, 3) between ``points`` (p, 3) [m] as they are: an obstacle that has two sides and no volume.

    Its position is the origin of the points. ValueError if there are too many triangles, or none has an area.
    """
    corners = np.asarray(triangles, dtype=np.int64)
    if len(corners) > MAX_TRIANGLES:
        raise ValueError(f"'{name}' has {len(corners):,} triangles; there may be up to {MAX_TRIANGLES:,}")
    surface = surface_of_triangles(np.asarray(points, dtype=np.float64), corners)
    return tree_mesh(name, surface.vertices, surface.triangles, surface.remarks)


def tree_mesh(name: str, vertices: np.ndarray, triangles: np.ndarray, remarks: tuple[str, ...] = ()) -> Shape:
    """As ``triangle_mesh``, of triangles that are in order already."""
    order = tree_order(vertices[triangles])
    none, radius = np.full(3, np.inf), float(np.linalg.norm(vertices, axis=1).max())
    return Shape(name, MESH, vertices, (), 0.0, np.inf, none, radius, np.inf, _UPRIGHT, 0, triangles[order], remarks)


@checked_arguments
def hull(name: str, vertices: Any, rounding: float = 0.0) -> Shape:
    """All points within ``rounding`` of the convex hull of ``vertices`` (v, 3), as a shape about its centroid.

    Vertices inside the hull, its faces or its edges are dropped; triangles in one plane within 1e-6 of the shape's
    extent become one face, and its corners are moved into the plane.
    ValueError if the vertices are not finite or enclose no volume, or the rounding is not 0 or more.
    """
    points = real_numbers(f"the vertices of '{name}'", vertices)
    if points.ndim != 2 or points.shape[1] != 3 or not (np.abs(points) <= FARTHEST).all():
        raise ValueError(f"the vertices of '{name}' must be rows of three finite numbers, up to {FARTHEST:g} m")
    if not 0.0 <= rounding <= FARTHEST:
        raise ValueError(
            f"the rounding of '{name}' must be a number of 0 or more, up to {FARTHEST:g} m, not {rounding!r}"
        )
    core = hull_polygons(name, points)
    return _about_centroid(name, core, core, rounding)


def _about_centroid(name: str, core: Polyhedron, whole: Polyhedron, rounding: float) -> Shape:
    """A polyhedron with rounding about the centroid and in the principal axes of another, which it stands for."""
    mass = _mass(*whole, rounding)
    _, axes = principal_axes(mass.inertia)
    # Again in the principal axes: in others, what is small about a needle is a difference of what is large.
    again = _mass((whole[0] - mass.centroid) @ axes, whole[1], rounding)
    body = np.ascontiguousarray((core[0] - mass.centroid) @ axes)
    return principal_hull(
        name,
        (body, core[1]),
        rounding,
        volume=again.volume,
        moments=np.diag(again.inertia).copy(),
        orientation=np.roll(Rotation.from_matrix(axes).as_quat(canonical=True), 1),
        described_corners=len(whole[0]),
    )


def principal_hull(name: str, core: Polyhedron, rounding: float, **properties: Any) -> Shape:
    """A polyhedron with rounding that is about its centroid and in its principal axes already.

    Parameters
    ----------
    name : str
    core : (vertices (v, 3) float64 [m], loops of vertex numbers)
    rounding : float [m]
    **properties
        volume, moments, orientation and described_corners, as in ``Shape``.

    Raises
    ------
    ValueError
        If the shape encloses no volume.
    """
    vertices, faces = core
    shape = Shape(
        name=name,
        kind=POLYHEDRON,
        vertices=vertices,
        faces=faces,
        rounding=float(rounding),
        radius=float(np.linalg.norm(vertices, axis=1).max()) + float(rounding),
        inradius=_depth_of_centroid(vertices, faces) + float(rounding),
        **properties,
    )
    if not min(shape.volume, shape.inradius, *shape.moments) > 0.0:
        raise ValueError(NO_VOLUME.format(name))
    return shape


def drawn_hull(name: str, vertices: Any, rounding: float = 0.0, orientation: Any = _UPRIGHT) -> Shape:
    """All points within ``rounding`` of the convex hull of ``vertices`` (v, 3), about their origin: only to be drawn.

    ``orientation`` (4,): as in ``Shape``.
    """
    core = hull_polygons(name, np.asarray(vertices, dtype=np.float64))
    radius = float(np.linalg.norm(core[0], axis=1).max()) + rounding
    return Shape(
        name, POLYHEDRON, *core, rounding, 1.0, np.ones(3), radius, rounding, np.asarray(orientation, dtype=np.float64)
    )


def _mass(corners: np.ndarray, faces: Faces, rounding: float) -> MassProperties:
    """Mass properties of a polyhedron with rounding, which may be 0."""
    if rounding > 0.0:
        return rounded_mass_properties(corners, faces, edges_of(faces), rounding)
    return mass_properties(corners, faces)


def _depth_of_centroid(vertices: np.ndarray, faces: Faces) -> float:
    """How deep the origin is in a core; below 0 if it is outside, as the centroid of a flat core that is rounded."""
    starts = vertices[[loop[0] for loop in faces]]
    depth = float(np.einsum("ij,ij->i", face_normals(vertices, faces), starts).min())
    return depth if depth >= 0.0 else -distance_from_hull(np.zeros(3), vertices)


@checked_arguments
def box(edges: Any = (1.0, 1.0, 1.0), rounding: float = 0.0) -> Shape:
    """A box with the given three edges."""
    half = 0.5 * real_numbers("edges of a box", edges)
    if half.shape != (3,):
        raise ValueError(f"edges of a box must be three numbers above 0, not {shown(edges)}")
    return hull("box", [(x, y, z) * half for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], rounding)


@checked_arguments
def pyramid(height: float = 1.0, rounding: float = 0.0) -> Shape:
    """A pyramid on a square base of edge 1, its top on +z."""
    base = [(x, y, 0.0) for x in (-0.5, 0.5) for y in (-0.5, 0.5)]
    return hull("pyramid", [*base, (0.0, 0.0, height)], rounding)


# Sides of what is round about an axis: its outline is off by 0.12 % of the radius.
_ROUND = 64


def _ring() -> np.ndarray:
    """Corners of a circle of diameter 1 as a polygon of _ROUND sides, (_ROUND, 2)."""
    angle = (np.arange(_ROUND) + 0.5) * (2.0 * pi / _ROUND)
    return 0.5 * np.column_stack([np.cos(angle), np.sin(angle)])


@checked_arguments
def cylinder(length: float = 1.0, rounding: float = 0.0) -> Shape:
    """A cylinder of diameter 1 along z, as a prism of _ROUND sides within it."""
    ends = [np.column_stack([_ring(), np.full(_ROUND, z)]) for z in (-0.5 * length, 0.5 * length)]
    return hull("cylinder", np.concatenate(ends), rounding)


@checked_arguments
def cone(height: float = 1.0, rounding: float = 0.0) -> Shape:
    """A cone on a base of diameter 1, its top on +z, as a pyramid of _ROUND sides within it."""
    base = np.column_stack([_ring(), np.zeros(_ROUND)])
    return hull("cone", [*base, (0.0, 0.0, height)], rounding)


@checked_arguments
def mesh(file: str | Path, rounding: float = 0.0, unit: str = "m") -> Shape:
    """The convex hull of an STL, OBJ or PLY file whose numbers are in ``unit``: m, cm, mm, um or in.

    A hull of more than MAX_MESH_VERTICES corners is thinned to so many; mass properties stay those of the whole.
    OSError or ValueError if the file cannot be read, is no mesh or encloses no volume.
    """
    path = Path(file)
    name, points = path.stem, mesh_vertices(path, unit)
    # Points inside faces and edges are no corners: what is left is thinned, so that a cube of many points stays one.
    corners = corner_points(name, points[convex_hull(name, points).vertices])
    if len(corners) <= MAX_MESH_VERTICES:
        return hull(name, corners, rounding)
    core = hull_polygons(name, spread(corners, MAX_MESH_VERTICES))
    return _about_centroid(name, core, triangulated_hull(name, corners), rounding)


def _polyhedron(name: str) -> Callable[..., Shape]:
    """The function that makes a polyhedron of core.polyhedra."""

    def make(rounding: float = 0.0) -> Shape:
        return hull(name, POLYHEDRA[name], rounding)

    make.__doc__ = f"The {name} of edge 1."
    make.__name__ = make.__qualname__ = name
    return checked_arguments(make)


cube, tetrahedron = _polyhedron("cube"), _polyhedron("tetrahedron")

# Functions that return shapes of size 1, whose parameters scene files may set. Polyhedra without parameters are entries
# of core.polyhedra.
CATALOGUE: dict[str, Callable[..., Shape]] = {
    "sphere": sphere,
    "capsule": capsule,
    **{name: _polyhedron(name) for name in POLYHEDRA},
    "box": box,
    "pyramid": pyramid,
    "cylinder": cylinder,
    "cone": cone,
    "mesh": mesh,
}
