"""The shapes of a scene as one table for the kernels."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from particlesim.core.constants import TRIANGLE
from particlesim.core.records import record
from particlesim.geometry.flat_prisms import CORNERS, EDGES, FACES, LINKS, flat_prisms
from particlesim.geometry.shape_links import links_before_rings, links_of
from particlesim.geometry.shapes import Shape, sphere

# A shape: a convex core and a rounding radius. Ranges are half open, into the other arrays of the table.
SHAPE = record(
    [
        ("kind", np.int64),  # SPHERE, CAPSULE, POLYHEDRON, HALF_SPACE, MESH, TRIANGLE, COMPOUND or BALL
        ("radius", np.float64),  # of the bounding sphere at size 1, rounding included [m]
        ("inradius", np.float64),  # of the inscribed sphere at size 1, rounding included [m]
        ("rounding", np.float64),  # how far the surface is outside of the core at size 1 [m]
        ("first_vertex", np.int64),
        ("last_vertex", np.int64),
        ("first_face", np.int64),
        ("last_face", np.int64),
        ("first_edge", np.int64),
        ("last_edge", np.int64),
        ("link", np.int64),  # where its part of the table's ``link`` begins; -1 of a shape without edges
        ("first_part", np.int64),  # rows of shapes: the triangles of a mesh in the order of its tree, or of a compound
        ("last_part", np.int64),
    ],
)

# A face of a core. The solid is on the side that the normal points away from; a half-space is its one face.
FACE = record(
    [
        ("normal", np.float64, (3,)),  # outward, body axes
        ("offset", np.float64),  # of its plane from the centroid at size 1, along the normal [m]
        ("first", np.int64),  # its vertices are loop[first:last]
        ("last", np.int64),
    ],
)


class ShapeTable(NamedTuple):
    """All shapes of a scene end to end, then the parts of compounds, then the triangles of meshes."""

    shape: np.ndarray  # (s,) SHAPE
    vertex: np.ndarray  # (v, 3) float64, of the cores at size 1, body axes [m]
    face: np.ndarray  # (f,) FACE
    loop: np.ndarray  # (l,) int64, rows of vertex: the outlines of the faces, counter-clockwise seen from outside
    edge: np.ndarray  # (e, 4) int64: two rows of vertex, then the faces to the left and right, -1 for none
    link: np.ndarray  # (k,) int64: which vertices, and which faces, are neighbours (see shape_links.py)


def stack_shapes(shapes: Sequence[Shape], drawn: bool = False) -> ShapeTable:
    """The shapes as one table for the kernels, which is not to be written to: the same shapes have the same one.

    Triangles and parts are about the position of their body, that they turn about; to be ``drawn``, about the middles
    of the boxes about them.
    """
    return _stacked(tuple(shapes), drawn)


def with_parts(shapes: Sequence[Shape]) -> tuple[Shape, ...]:
    """The shapes, then the parts of those that are compounds, and the point that parts are asked for their distance."""
    parts = [part for shape in shapes for part in shape.parts]
    return (*shapes, *parts, sphere()) if parts else tuple(shapes)


@functools.lru_cache(maxsize=8)
def _stacked(shapes: tuple[Shape, ...], drawn: bool) -> ShapeTable:
    every = with_parts(shapes)
    if drawn:
        every = (*shapes, *(_about_middle(shape) for shape in every[len(shapes) :]))
    table = _stacked_as_they_are(every)
    begin = len(shapes)
    for row, shape in enumerate(shapes):
        table.shape["first_part"][row], table.shape["last_part"][row] = begin, begin + len(shape.parts)
        begin += len(shape.parts)
    for row, shape in enumerate(shapes):
        if len(shape.triangles):
            corners = shape.vertices[shape.triangles]
            table = _with_triangles(table, row, corners - corners.mean(axis=1, keepdims=True) if drawn else corners)
    return table


def middle_of(part: Shape) -> np.ndarray:
    """The middle of the box about a part of a compound, at size 1 (3,) [m]."""
    return 0.5 * (part.vertices.min(axis=0) + part.vertices.max(axis=0))


def _about_middle(part: Shape) -> Shape:
    vertices = part.vertices - middle_of(part)
    return replace(part, vertices=vertices, radius=float(np.linalg.norm(vertices, axis=1).max()) + part.rounding)


def _stacked_as_they_are(shapes: tuple[Shape, ...]) -> ShapeTable:
    """The table of shapes, of meshes without their triangles."""
    table = np.zeros(len(shapes), dtype=SHAPE)
    for field in ("kind", "radius", "inradius", "rounding"):
        table[field] = [getattr(shape, field) for shape in shapes]
    edges = [np.array(shape.edges, dtype=np.int64).reshape(-1, 4) for shape in shapes]
    counts = {
        "vertex": [len(shape.vertices) for shape in shapes],
        "face": [len(shape.faces) for shape in shapes],
        "edge": [len(rows) for rows in edges],
    }
    for name, count in counts.items():
        table[f"last_{name}"] = np.cumsum(count)
        table[f"first_{name}"] = table[f"last_{name}"] - count
    edges = [_numbered(rows, row) for rows, row in zip(edges, table, strict=True)]
    loops = [
        np.array(loop) + first
        for shape, first in zip(shapes, table["first_vertex"], strict=True)
        for loop in shape.faces
    ]
    return ShapeTable(
        shape=table,
        vertex=np.concatenate([np.zeros((0, 3)), *(shape.vertices for shape in shapes)]),
        face=_faces(shapes, [len(loop) for loop in loops]),
        loop=np.concatenate([np.zeros(0, dtype=np.int64), *loops]),
        edge=np.concatenate([np.zeros((0, 4), dtype=np.int64), *edges]),
        link=_links(shapes, edges, table),
    )


def _faces(shapes: Sequence[Shape], corners: Sequence[int]) -> np.ndarray:
    """The faces of all shapes, (f,) FACE; ``corners`` says how many vertices each has."""
    face = np.zeros(len(corners), dtype=FACE)
    starts = [shape.vertices[[loop[0] for loop in shape.faces]] for shape in shapes if shape.faces]
    face["normal"] = np.concatenate([np.zeros((0, 3)), *(shape.face_normals for shape in shapes)])
    face["offset"] = np.einsum("ij,ij->i", face["normal"], np.concatenate([np.zeros((0, 3)), *starts]))
    face["last"] = np.cumsum(corners)
    face["first"] = face["last"] - corners
    return face


def _numbered(edges: np.ndarray, shape: Any) -> np.ndarray:
    """Edges of one shape with the numbers that its vertices and faces have in the table."""
    shift = np.array([shape["first_vertex"], shape["first_vertex"], shape["first_face"], shape["first_face"]])
    return np.where(edges < 0, -1, edges + shift)


def _links(shapes: Sequence[Shape], edges: Sequence[np.ndarray], table: np.ndarray) -> np.ndarray:
    """The array ``link`` of the table; notes in ``table`` where each shape has its part of it."""
    parts, size = [np.zeros(0, dtype=np.int64)], 0
    for shape, rows, row in zip(shapes, edges, table, strict=True):
        row["link"] = size if len(rows) else -1
        if len(rows):
            parts.append(links_of(shape.vertices, shape.faces, rows, int(row["first_vertex"]), size))
            size += len(parts[-1])
    return np.concatenate(parts)


def _with_triangles(table: ShapeTable, mesh: int, corners: np.ndarray) -> ShapeTable:
    """The table with triangles (t, 3, 3) after its shapes, which are those of the shape in row ``mesh``."""
    count, prisms = len(corners), flat_prisms(corners)
    rows, each = np.zeros(count, dtype=SHAPE), np.arange(count)
    rows["kind"], rows["radius"] = TRIANGLE, np.linalg.norm(corners, axis=2).max(axis=1)
    for name, number, old in (("vertex", 3, table.vertex), ("face", FACES, table.face), ("edge", EDGES, table.edge)):
        rows[f"first_{name}"] = len(old) + number * each
        rows[f"last_{name}"] = rows[f"first_{name}"] + number
    # Cells of directions, which come before, are looked at where a core has many vertices.
    rows["link"] = len(table.link) + LINKS * each - links_before_rings()
    shape = np.concatenate([table.shape, rows])
    shape["first_part"][mesh], shape["last_part"][mesh] = len(table.shape), len(shape)
    vertex = rows["first_vertex"][:, None]
    face = np.zeros(FACES * count, dtype=FACE)
    face["normal"], face["offset"] = prisms.normals.reshape(-1, 3), prisms.offsets.ravel()
    ends = len(table.loop) + CORNERS[-1] * each[:, None]
    face["first"], face["last"] = (ends + CORNERS[:-1]).ravel(), (ends + CORNERS[1:]).ravel()
    numbers = np.concatenate([vertex, vertex, rows["first_face"][:, None], rows["first_face"][:, None]], axis=1)
    return ShapeTable(
        shape=shape,
        vertex=np.concatenate([table.vertex, corners.reshape(-1, 3)]),
        face=np.concatenate([table.face, face]),
        loop=np.concatenate([table.loop, (prisms.loops + vertex).ravel()]),
        edge=np.concatenate([table.edge, (prisms.edges + numbers[:, None, :]).reshape(-1, 4)]),
        link=np.concatenate([table.link, _triangle_links(len(table.link), rows["first_vertex"])]),
    )


def _triangle_links(begin: int, first_vertex: np.ndarray) -> np.ndarray:
    """The neighbours of the vertices of triangles (t,), as in ``links_of``; ``begin``: where they stand in ``link``."""
    lists = begin + LINKS * np.arange(len(first_vertex))[:, None] + 4 + np.array([0, 2, 4, 6])
    return np.concatenate([lists, first_vertex[:, None] + np.array([1, 2, 0, 2, 0, 1])], axis=1).ravel()
