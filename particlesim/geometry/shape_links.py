"""What is beside what on a shape: the neighbours of its vertices and of its faces, and where to begin a climb.

They are numbers in one array, ``link`` of the shape table, the parts of each shape one after the other:

    6 CELLS^2        the vertex farthest along the middle of each cell of directions
    vertices + 1     where in ``link`` the neighbours of each vertex begin, and the last end
    2 edges          the neighbours of each vertex, rising
    corners          for each corner of each face the face beyond the side that begins there
"""

from __future__ import annotations

import numpy as np

from particlesim.core.jit import kernel
from particlesim.geometry.faces import Faces
from particlesim.geometry.tolerances import CELLS


def links_of(vertices: np.ndarray, faces: Faces, edges: np.ndarray, first_vertex: int, begin: int) -> np.ndarray:
    """The part of a shape.

    Parameters
    ----------
    vertices : (v, 3) float64
    faces : loops of vertex numbers
    edges : (e, 4) int64
        Two rows of vertices, then the faces to the left and right, as the table numbers them.
    first_vertex : int
        Row of the shape's first vertex in the table.
    begin : int
        Where the part begins.
    """
    starts = first_vertex + np.argmax(cell_middles() @ vertices.T, axis=1)
    both_ways = np.concatenate([edges[:, :2], edges[:, 1::-1]])
    order = np.lexsort((both_ways[:, 1], both_ways[:, 0]))
    ends = np.cumsum(np.bincount(both_ways[:, 0] - first_vertex, minlength=len(vertices)))
    lists = begin + len(starts) + len(vertices) + 1
    # The face beyond a side is to the right of the edge that runs like it, to the left of one that runs against it.
    key = (both_ways - first_vertex) @ (len(vertices), 1)
    beyond = np.concatenate([edges[:, 3], edges[:, 2]])[order]
    sides = [v * len(vertices) + w for loop in faces for v, w in zip(loop, loop[1:] + loop[:1], strict=True)]
    beside = beyond[np.searchsorted(key[order], np.array(sides, dtype=np.int64))]
    return np.concatenate([starts, lists + np.append(0, ends), both_ways[order, 1], beside])


def cell_middles() -> np.ndarray:
    """Directions through the middles of the cells that the six faces of a cube have, CELLS x CELLS each, (n, 3).

    Faces in the order +x, -x, +y, -y, +z, -z; on that across an axis, columns run along the next axis and rows along
    the one after that.
    """
    along = (np.arange(CELLS) + 0.5) * 2.0 / CELLS - 1.0
    up, right = (grid.ravel() for grid in np.meshgrid(along, along, indexing="ij"))
    faces = []
    for axis in range(3):
        for sign in (1.0, -1.0):
            faces.append(np.roll(np.stack([np.full(len(up), sign), right, up], axis=1), axis, axis=1))
    return np.concatenate(faces)


def links_before_rings() -> int:
    """How many numbers of a part come before those that say where the neighbours of each vertex begin."""
    return 6 * CELLS * CELLS


@kernel
def cell_of(direction):
    """The cell that a direction of any length is in."""
    size = abs(direction[0]), abs(direction[1]), abs(direction[2])
    axis = 0 if size[0] >= size[1] and size[0] >= size[2] else 1 if size[1] >= size[2] else 2
    most, right, up = direction[axis], direction[(axis + 1) % 3], direction[(axis + 2) % 3]
    half = 0.5 * CELLS / abs(most) if most != 0.0 else 0.0
    # Clipped, so that no number, not even one that is none, leads out of the table.
    column = min(max(int(0.5 * CELLS + right * half), 0), CELLS - 1)
    row = min(max(int(0.5 * CELLS + up * half), 0), CELLS - 1)
    return ((2 * axis + (1 if most < 0.0 else 0)) * CELLS + row) * CELLS + column


@kernel
def ring_of(link, core, vertex):
    """Where the neighbours of a vertex of a core (see support.core_of) stand in ``link``: the first, past the last."""
    at = core[2] + 6 * CELLS * CELLS + vertex - core[0]
    return link[at], link[at + 1]


@kernel
def faces_beside(table, shape):
    """Add row k of ``loop`` to it: the face beyond the side that begins at that corner stands there in ``link``."""
    record = table.shape[shape]
    vertices, edges = record.last_vertex - record.first_vertex, record.last_edge - record.first_edge
    return record.link + 6 * CELLS * CELLS + vertices + 1 + 2 * edges - table.face[record.first_face].first
