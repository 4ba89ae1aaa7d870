"""The axis-aligned bounding boxes of the particles of a frame: what a broad phase searches."""

from __future__ import annotations

import numpy as np

from particlesim.geometry.aabb import aabbs_of
from particlesim.geometry.shape_table import stack_shapes
from particlesim.trajectory.frames import Frame, Header


def frame_boxes(header: Header, frame: Frame) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper corners (n, 3) float64 [m] of the AABBs of all particles of a frame."""
    header = header.of(frame)
    lower, upper = aabbs_of(stack_shapes(header.shapes), header.shape, header.size, frame.orientation)
    return frame.position + lower, frame.position + upper
