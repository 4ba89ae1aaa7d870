"""Boxes to compare on, made at random for a sweep."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

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
