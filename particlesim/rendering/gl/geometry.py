"""Vertices and instances of what is drawn, as the arrays that pyrender_bridge takes. Plain numpy."""

from __future__ import annotations

import numpy as np

# Corners of a line's strip: x from its start to its end, y from one side to the other.
STRIP = np.array([(0, -1, 0), (0, 1, 0), (1, -1, 0), (1, 1, 0)], dtype=np.float32)

# The corners of a box as 0 (lower) and 1 (upper), and its twelve edges between them.
_CORNERS = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=np.float64)
_EDGES = np.array([(a, a | bit) for a in range(8) for bit in (4, 2, 1) if not a & bit])


def box_edges(lower: np.ndarray, upper: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Start and end of the twelve edges of each box, (k, 12, 3) each; ``lower`` and ``upper`` (k, 3)."""
    corners = lower[:, None, :] + _CORNERS * (upper - lower)[:, None, :]
    return corners[:, _EDGES[:, 0]], corners[:, _EDGES[:, 1]]


def lines(start: np.ndarray, end: np.ndarray, colour: np.ndarray, width: float) -> np.ndarray:
    """Lines, (m, 11): ends (m, 3) [m], ``colour`` (m, 4) sRGB and opacity, width [pixels]."""
    return np.hstack([start, np.full((len(start), 1), width), end, colour]).astype(np.float32)


def box_lines(lower: np.ndarray, upper: np.ndarray, colour: np.ndarray, width: float) -> np.ndarray:
    """The edges of boxes ``lower`` .. ``upper`` (k, 3) [m] as ``lines``; ``colour`` (12 k, 4), that of each edge."""
    start, end = box_edges(lower, upper)
    return lines(start.reshape(-1, 3), end.reshape(-1, 3), colour, width)


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
