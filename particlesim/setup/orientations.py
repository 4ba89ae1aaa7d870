"""Orientations as scenes say them, as those of body axes."""

from __future__ import annotations

import math

import numpy as np

from particlesim.core.rotations import quaternions_of, rotations_of
from particlesim.geometry.shapes import Shape
from particlesim.scene.placements import Turn


def quaternion_of(orientation: tuple[float, ...] | Turn | str) -> np.ndarray:
    """A scene's orientation as a unit quaternion (w, x, y, z); a word stands for the axes of the world."""
    if isinstance(orientation, str):
        return np.array([1.0, 0.0, 0.0, 0.0])
    if isinstance(orientation, Turn):
        axis = np.array(orientation.axis) / np.linalg.norm(orientation.axis)
        half = 0.5 * math.radians(orientation.angle)
        return np.concatenate([[math.cos(half)], math.sin(half) * axis])
    return np.array(orientation) / np.linalg.norm(orientation)


def of_body_axes(q: np.ndarray, shape: Shape) -> np.ndarray:
    """Orientations (k, 4) of the axes that a shape was described in, as orientations of its body axes."""
    if shape.orientation[0] == 1.0:
        return q
    return quaternions_of(rotations_of(q) * rotations_of(shape.orientation))
