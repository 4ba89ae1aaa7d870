"""What placing needs to know of particles and of the domain that they are placed in."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Crowd(NamedTuple):
    """The particles of a scene, all (n,)."""

    shape: np.ndarray  # int64, row of the shape table
    group: np.ndarray  # int64, entry of the scene's particles
    size: np.ndarray  # factor on the shape of size 1
    radius: np.ndarray  # bounding sphere [m]
    volume: np.ndarray  # [m^3]


class Space(NamedTuple):
    """The domain that they are placed in, all (3,)."""

    lower: np.ndarray  # [m]
    upper: np.ndarray  # [m]
    boundary: np.ndarray  # int64: WALL, PERIODIC or OPEN
    period: np.ndarray  # edge of a periodic axis, 0 elsewhere [m]
