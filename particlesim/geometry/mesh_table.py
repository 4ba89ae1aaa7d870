"""What shapes of a scene consist of, for the kernels: where parts are, trees over meshes, what is beside what."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from particlesim.core.records import record
from particlesim.geometry.shape_table import middle_of, stack_shapes, with_parts
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

# Where a shape is about the position of its body, which is that of a compound if it is a part of one.
EXTENT = record(
    [
        ("lower", "f8", (3,)),  # of the box about it, at size 1, body axes [m]
        ("upper", "f8", (3,)),
        ("middle", "f8", (3,)),  # of the sphere about it [m]
        ("radius", "f8"),  # of that sphere [m]
    ]
)


class MeshTable(NamedTuple):
    """All meshes of a scene end to end, and the parts of its compounds.

    Triangles are numbered through, those of the first mesh from 0 on.
    """

    tree: np.ndarray  # (s,) TREE, by the row of the shape table; of no use for shapes that are no meshes
    extent: np.ndarray  # (s,) EXTENT, likewise; boxes are of parts of compounds only
    box: np.ndarray  # (n, 6) float64: lower and upper corners of the boxes of nodes, at size 1, body axes [m]
    corner: np.ndarray  # (t, 3) int64, rows of ``vertex`` of the shape table: those of the mesh, each point once
    beyond: np.ndarray  # (t, 3) int64, likewise: the corner beyond the side that begins at each, NONE_BEYOND if none
    ring_start: np.ndarray  # (v + 1,) int64: neighbours of vertex k are ring[ring_start[k]:ring_start[k + 1]]
    ring: np.ndarray  # (r,) int64


def stack_meshes(shapes: Sequence[Shape]) -> MeshTable | None:
    """What the shapes of a ``stack_shapes`` consist of; None if each is one by itself, so that nothing is compiled."""
    return _stacked(tuple(shapes)) if any(len(shape.triangles) or shape.parts for shape in shapes) else None


@functools.lru_cache(maxsize=8)
def _stacked(shapes: tuple[Shape, ...]) -> MeshTable:
    table = stack_shapes(shapes)
    every = with_parts(shapes)
    tree, none = np.zeros(len(every), dtype=TREE), np.zeros((0, 3), dtype=np.int64)
    boxes, corners, beyond, rings = [np.zeros((0, 6))], [none], [none], [none[:, 0]]
    ring_count = np.zeros(len(table.vertex), dtype=np.int64)
    begin = 0
    for row, shape in enumerate(shapes):
        count = len(shape.triangles)
        if not count:
            continue
        first_vertex = table.shape["first_vertex"][row]
        around = beside(shape.triangles, len(shape.vertices))
        tree[row] = table.shape["first_part"][row], count, begin, leaves_for(count)
        boxes.append(tree_boxes(shape.vertices[shape.triangles]))
        begin += len(boxes[-1])
        corners.append(shape.triangles + first_vertex)
        beyond.append(np.where(around.beyond == NONE_BEYOND, NONE_BEYOND, around.beyond + first_vertex))
        rings.append(around.ring + first_vertex)
        ring_count[first_vertex : first_vertex + len(shape.vertices)] = np.diff(around.ring_start)
    return MeshTable(
        tree=tree,
        extent=_extents(every, len(shapes)),
        box=np.concatenate(boxes),
        corner=np.concatenate(corners),
        beyond=np.concatenate(beyond),
        ring_start=np.append(0, np.cumsum(ring_count)),
        ring=np.concatenate(rings),
    )


def _extents(every: Sequence[Shape], first_part: int) -> np.ndarray:
    """Where shapes are about the positions of their bodies, (s,) EXTENT; those from ``first_part`` on are parts."""
    extent = np.zeros(len(every), dtype=EXTENT)
    extent["radius"] = [shape.radius for shape in every]
    for e, part in zip(extent[first_part:], every[first_part:], strict=True):
        e["middle"] = middle_of(part)
        e["lower"] = part.vertices.min(axis=0) - part.rounding
        e["upper"] = part.vertices.max(axis=0) + part.rounding
        e["radius"] = np.linalg.norm(part.vertices - e["middle"], axis=1).max() + part.rounding
    return extent
