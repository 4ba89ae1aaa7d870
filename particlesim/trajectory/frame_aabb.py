"""The boxes along the axes that the particles of a frame are in: what a broad phase searches."""

from __future__ import annotations

import numpy as np

from particlesim.core.constants import SPHERE
from particlesim.core.rotations import matrices_of
from particlesim.trajectory.frames import Frame, Header


def frame_boxes(header: Header, frame: Frame) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper corners (n, 3) float64 [m] of the boxes of all particles of a frame."""
    lower, upper = np.empty_like(frame.position), np.empty_like(frame.position)
    for number, shape in enumerate(header.shapes):
        members = np.flatnonzero(header.shape == number)
        size = header.size[members, None]
        if shape.kind == SPHERE:
            low, high = -0.5 * size, 0.5 * size
        else:
            vertices = np.einsum("nij,vj->nvi", matrices_of(frame.orientation[members]), shape.vertices)
            low, high = size * vertices.min(axis=1), size * vertices.max(axis=1)
        lower[members], upper[members] = frame.position[members] + low, frame.position[members] + high
    return lower, upper
