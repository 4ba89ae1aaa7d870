"""Boxes to compare on: made at random for a sweep, or those of the particles of a frame."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from particlesim.constants import SPHERE
from particlesim.trajectory import Frame, Header

KINDS = ("uniform", "clustered", "mixed")

# Volume of the spheres in the boxes, as part of the unit cube they are in.
FILL = 0.2

# Clustered: this part of the boxes is in so many cubes, which are this part of the volume together, and boxes are
# smaller by this factor, so that there are about as many pairs.
_IN_CLUSTERS = 0.9
_CLUSTERS = 100
_CLUSTER_VOLUME = 0.01
_CLUSTER_SHRINK = 0.19

# Mixed: the largest box over the smallest; sizes in between are log-uniform.
_RATIO = 50.0


class Boxes(NamedTuple):
    """Cubes in the unit cube, in random order."""

    centre: np.ndarray  # (n, 3) [m]
    half: np.ndarray  # (n,) half of the edge [m]

    @property
    def lower(self) -> np.ndarray:
        """Lower corners (n, 3) [m]."""
        return self.centre - self.half[:, None]

    @property
    def upper(self) -> np.ndarray:
        """Upper corners (n, 3) [m]."""
        return self.centre + self.half[:, None]


def make_boxes(kind: str, count: int, seed: int = 1) -> Boxes:
    """``count`` boxes of one of ``KINDS``: the boxes of equal or mixed spheres that fill a fifth of the unit cube.

    clustered: nine in ten boxes are in a hundred small cubes, where it is ninety times as crowded as on average.
    """
    rng = np.random.default_rng(seed)
    centre = rng.random((count, 3))
    half = np.ones(count)
    if kind == "clustered":
        crowded = rng.random(count) < _IN_CLUSTERS
        edge = (_CLUSTER_VOLUME / _CLUSTERS) ** (1.0 / 3.0)
        corner = rng.random((_CLUSTERS, 3)) * (1.0 - edge)
        centre[crowded] = (corner[rng.integers(0, _CLUSTERS, count)] + edge * centre)[crowded]
    elif kind == "mixed":
        half = _RATIO ** rng.random(count)
    half *= (FILL / (4.0 / 3.0 * math.pi * (half**3).sum())) ** (1.0 / 3.0)
    return Boxes(centre, half * (_CLUSTER_SHRINK if kind == "clustered" else 1.0))


def frame_boxes(header: Header, frame: Frame) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper corners (n, 3) float64 [m] of the boxes of all particles of a frame."""
    lower, upper = np.empty_like(frame.position), np.empty_like(frame.position)
    for number, shape in enumerate(header.shapes):
        members = np.flatnonzero(header.shape == number)
        size = header.size[members, None]
        if shape.kind == SPHERE:
            low, high = -0.5 * size, 0.5 * size
        else:
            vertices = np.einsum("nij,vj->nvi", _matrices(frame.orientation[members]), shape.vertices)
            low, high = size * vertices.min(axis=1), size * vertices.max(axis=1)
        lower[members], upper[members] = frame.position[members] + low, frame.position[members] + high
    return lower, upper


def _matrices(orientation: np.ndarray) -> np.ndarray:
    """Rotation matrices (n, 3, 3) of unit quaternions (n, 4), body to world."""
    w, x, y, z = orientation.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)
