"""The meshes among the shapes of a scene as one table for the kernels: trees over them, and what is beside what."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from particlesim.core.records import record
from particlesim.geometry.shape_table import stack_shapes
from particlesim.geometry.shapes import Shape
from particlesim.geometry.triangle_surface import NONE_BEYOND, beside
from particlesim.geometry.triangle_tree import leaves_for, tree_boxes

# The tree over a mesh.
TREE = record(
    [
        ("first", "i8"),  # row of the shape table of its first triangle
        ("count", "i8"),  # of its triangles
        ("begin", "i8"),  # node k is row begin + k of ``box``
        ("leaves", "i8"),
    ]
)


class MeshTable(NamedTuple):
    """All meshes of a scene end to end. Triangles are numbered through, those of the first mesh from 0 on."""

    tree: np.ndarray  # (s,) TREE, by the row of the shape table; of no use for shapes that are no meshes
    box: np.ndarray  # (n, 6) float64: lower and upper corners of the boxes of nodes, at size 1, body axes [m]
    corner: np.ndarray  # (t, 3) int64, rows of ``vertex`` of the shape table: those of the mesh, each point once
    beyond: np.ndarray  # (t, 3) int64, likewise: the corner beyond the side that begins at each, NONE_BEYOND if none
    ring_start: np.ndarray  # (v + 1,) int64: neighbours of vertex k are ring[ring_start[k]:ring_start[k + 1]]
    ring: np.ndarray  # (r,) int64


def stack_meshes(shapes: Sequence[Shape]) -> MeshTable | None:
    """The meshes among the shapes of a ``stack_shapes`` of them; None if there is none, so that nothing is compiled."""
    return _stacked(tuple(shapes)) if any(len(shape.triangles) for shape in shapes) else None


@functools.lru_cache(maxsize=8)
def _stacked(shapes: tuple[Shape, ...]) -> MeshTable:
    table = stack_shapes(shapes)
    tree = np.zeros(len(shapes), dtype=TREE)
    boxes, corners, beyond, rings = [], [], [], [np.zeros(0, dtype=np.int64)]
    ring_count = np.zeros(len(table.vertex), dtype=np.int64)
    begin = 0
    for row, shape in enumerate(shapes):
        count = len(shape.triangles)
        if not count:
            continue
        first_vertex = table.shape["first_vertex"][row]
        around = beside(shape.triangles, len(shape.vertices))
        tree[row] = table.shape["first_triangle"][row], count, begin, leaves_for(count)
        boxes.append(tree_boxes(shape.vertices[shape.triangles]))
        begin += len(boxes[-1])
        corners.append(shape.triangles + first_vertex)
        beyond.append(np.where(around.beyond == NONE_BEYOND, NONE_BEYOND, around.beyond + first_vertex))
        rings.append(around.ring + first_vertex)
        ring_count[first_vertex : first_vertex + len(shape.vertices)] = np.diff(around.ring_start)
    return MeshTable(
        tree=tree,
        box=np.concatenate(boxes),
        corner=np.concatenate(corners),
        beyond=np.concatenate(beyond),
        ring_start=np.append(0, np.cumsum(ring_count)),
        ring=np.concatenate(rings),
    )
