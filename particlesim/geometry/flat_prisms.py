"""Triangles as polyhedra: prisms of no height, which the exact tests of polyhedra take like any other.

A prism has its triangle for both ends and, in between, sides of no area, whose normals lie in its plane. With them the
normals of a triangle that meet at an edge are half a circle as two quarters, and every axis that may separate it from
another body is one of a polyhedron's.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

# Of each prism: faces, edges (those of both ends), and numbers in ``link`` of the shape table.
FACES, EDGES, LINKS = 5, 6, 10

# Where the outlines of its faces begin, and the last one ends.
CORNERS = np.array([0, 3, 6, 8, 10, 12])
_LOOPS = np.array([0, 1, 2, 2, 1, 0, 0, 1, 1, 2, 2, 0])

# Its edges: two vertices, the faces to the left and right; those of the upper end, then of the lower.
_EDGES = np.array([(0, 1, 0, 2), (1, 2, 0, 3), (2, 0, 0, 4), (0, 1, 2, 1), (1, 2, 3, 1), (2, 0, 4, 1)])


class FlatPrisms(NamedTuple):
    """Prisms of no height, their vertices and faces numbered from 0 each."""

    normals: np.ndarray  # (t, FACES, 3) float64, outward
    offsets: np.ndarray  # (t, FACES) float64, of the faces from the origin along their normals [m]
    loops: np.ndarray  # (12,) int64
    edges: np.ndarray  # (EDGES, 4) int64


def flat_prisms(corners: np.ndarray) -> FlatPrisms:
    """The prisms of triangles with ``corners`` (t, 3, 3) [m]."""
    sides = np.roll(corners, -1, axis=1) - corners
    upper = np.cross(sides[:, 0], sides[:, 1])
    upper /= np.linalg.norm(upper, axis=1, keepdims=True)
    outward = np.cross(sides, upper[:, None, :])
    outward /= np.linalg.norm(outward, axis=2, keepdims=True)
    normals = np.concatenate([upper[:, None], -upper[:, None], outward], axis=1)
    # A corner of each face.
    of_ends = np.einsum("ij,ij->i", upper, corners.mean(axis=1))
    of_sides = np.einsum("ijk,ijk->ij", outward, corners)
    return FlatPrisms(normals, np.column_stack([of_ends, -of_ends, of_sides]), _LOOPS, _EDGES)
