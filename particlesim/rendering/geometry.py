"""Vertices and instances of what is drawn, as the arrays that the layers of pyrender_bridge take. Plain numpy."""

from __future__ import annotations

import numpy as np

from particlesim.shapes import Shape

# Corners of the square that spheres, lines and the floor are drawn on, in the order of a triangle strip.
SQUARE = np.array([(-1, -1, 0), (1, -1, 0), (-1, 1, 0), (1, 1, 0)], dtype=np.float32)

# Corners of a line's strip: x from its start to its end, y from one side to the other.
STRIP = np.array([(0, -1, 0), (0, 1, 0), (1, -1, 0), (1, 1, 0)], dtype=np.float32)

# Farther than any edge of a shape of size 1 [m].
_NO_EDGE = 1e6

# The corners of a box as 0 (lower) and 1 (upper), and its twelve edges between them.
_CORNERS = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=np.float64)
_EDGES = np.array([(a, a | bit) for a in range(8) for bit in (4, 2, 1) if not a & bit])


def hull_mesh(shape: Shape) -> tuple[np.ndarray, np.ndarray]:
    """A hull of size 1: rows of place (3), normal (3), distances to edges (4), (v, 10); triangles (t, 3) uint32.

    The four distances are those from up to four edges of a face's plane piece, and the smallest one is the distance
    from the edge of the face: each runs evenly over the face. A face of more corners is cut into a fan.
    """
    rows: list[np.ndarray] = []
    triangles: list[tuple[int, int, int]] = []
    for loop, normal in zip(shape.faces, shape.face_normals, strict=True):
        corners = shape.vertices[list(loop)]
        if len(loop) <= 4:
            pieces = [(corners, len(loop))]
        else:
            fan = zip(corners, np.roll(corners, -1, axis=0), strict=True)
            pieces = [(np.array([a, b, corners.mean(axis=0)]), 1) for a, b in fan]
        for outline, edges in pieces:
            first = len(rows)
            triangles += [(first, first + k, first + k + 1) for k in range(1, len(outline) - 1)]
            distances = _edge_distances(outline, normal, edges)
            rows += list(np.hstack([outline, np.tile(normal, (len(outline), 1)), distances]))
    return np.array(rows, dtype=np.float32), np.array(triangles, dtype=np.uint32)


def _edge_distances(outline: np.ndarray, normal: np.ndarray, edges: int) -> np.ndarray:
    """Distance of each corner (c, 3) from the first ``edges`` edges of its outline, (c, 4); no edge is far away."""
    distances = np.full((len(outline), 4), _NO_EDGE)
    for edge in range(edges):
        start, end = outline[edge], outline[(edge + 1) % len(outline)]
        inward = np.cross(normal, end - start) / np.linalg.norm(end - start)
        distances[:, edge] = np.maximum((outline - start) @ inward, 0.0)
    return distances


def box_edges(lower: np.ndarray, upper: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Start and end of the twelve edges of each box, (k, 12, 3) each; ``lower`` and ``upper`` (k, 3)."""
    corners = lower[:, None, :] + _CORNERS * (upper - lower)[:, None, :]
    return corners[:, _EDGES[:, 0]], corners[:, _EDGES[:, 1]]


def lines(start: np.ndarray, end: np.ndarray, colour: np.ndarray, width: float) -> np.ndarray:
    """Instances of a line layer, (m, 11): ends (m, 3) [m], ``colour`` (m, 4) sRGB and opacity, width [pixels]."""
    return np.hstack([start, np.full((len(start), 1), width), end, colour]).astype(np.float32)


def edge_opacity(lower: np.ndarray, upper: np.ndarray, eye: np.ndarray) -> np.ndarray:
    """Opacity (12,) of the edges of a box seen from ``eye``: those in front of what it holds are fainter."""
    start, end = (ends[0] for ends in box_edges(lower[None], upper[None]))
    middle = 0.5 * (lower + upper)
    opacity = np.ones(12)
    for edge in range(12):
        # The two faces at an edge are those of the two axes that it does not run along.
        across = np.flatnonzero(start[edge] == end[edge])
        outward = np.sign(start[edge, across] - middle[across])
        if np.all((eye[across] - start[edge, across]) * outward > 0.0):
            opacity[edge] = 0.35
    return opacity
