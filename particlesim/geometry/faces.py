"""Polyhedra as corners and faces: triangles, normals and edges of the faces, and whether all of it is convex."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

Faces = tuple[tuple[int, ...], ...]

# Corners (v, 3) and faces, loops of corners that run counter-clockwise seen from outside.
Polyhedron = tuple[np.ndarray, Faces]


def triangles_of(faces: Sequence[Sequence[int]]) -> tuple[np.ndarray, np.ndarray]:
    """Faces as fans of triangles about their first corners: the face of each (t,), and its corners (t, 3)."""
    rows = [(f, loop[0], loop[k], loop[k + 1]) for f, loop in enumerate(faces) for k in range(1, len(loop) - 1)]
    table = np.array(rows, dtype=np.int64).reshape(-1, 4)
    return table[:, 0], table[:, 1:]


def face_normals(vertices: np.ndarray, faces: Sequence[Sequence[int]]) -> np.ndarray:
    """Unit normals (f, 3) of plane polygons given by their corners in order (Newell's sum of cross products)."""
    face, triangle = triangles_of(faces)
    start = vertices[triangle[:, 0]]
    crosses = np.cross(vertices[triangle[:, 1]] - start, vertices[triangle[:, 2]] - start)
    normals = np.zeros((len(faces), 3))
    np.add.at(normals, face, crosses)
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def edges_of(faces: Faces) -> list[tuple[int, int, int, int]]:
    """Each edge of a closed polyhedron once: its two corners, then the faces to its left and right."""
    left = {}
    for face, loop in enumerate(faces):
        for start, end in zip(loop, loop[1:] + loop[:1], strict=True):
            left[start, end] = face
    return [(a, b, left[a, b], left[b, a]) for a, b in sorted(left) if a < b]


def is_convex(corners: np.ndarray, faces: Faces) -> bool:
    """Whether a polyhedron is closed, and every face bends inwards along its edges and at its corners."""
    normals = face_normals(corners, faces)
    face = np.repeat(np.arange(len(faces)), [len(loop) for loop in faces])
    start = np.array([v for loop in faces for v in loop])
    end = np.array([v for loop in faces for v in loop[1:] + loop[:1]])
    after = np.array([v for loop in faces for v in loop[2:] + loop[:2]])
    # Each side of a face is the same of one other, the other way round.
    ahead, back = start * len(corners) + end, end * len(corners) + start
    order = np.argsort(ahead)
    twin = order[np.searchsorted(ahead, back, sorter=order) % len(order)]
    if (ahead[twin] != back).any() or len(np.unique(ahead)) != len(ahead):
        return False
    side, next_side = corners[end] - corners[start], corners[after] - corners[end]
    turns = np.einsum("ij,ij->i", np.cross(side, next_side), normals[face])
    bends = np.einsum("ij,ij->i", next_side, normals[face[twin]])
    return bool((turns > 0.0).all() and (bends < 0.0).all())
