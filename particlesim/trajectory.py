"""A trajectory: what stays the same about its particles, then frame after frame, in memory or in a GSD file."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from particlesim.shapes import Shape


@dataclass(frozen=True)
class Header:
    """What stays the same from frame to frame.

    ``scene_json``: the scene as JSON. ``shapes``: the shapes of size 1 that occur. Arrays (n,): ``shape`` index
    into ``shapes``, ``size`` the factor on it, ``group`` the entry of the scene's particles.
    """

    scene_json: str
    shapes: tuple[Shape, ...]
    shape: np.ndarray
    size: np.ndarray
    group: np.ndarray


@dataclass(frozen=True)
class Frame:
    """The particles at one time [s].

    ``position`` (n, 3) [m], ``orientation`` (n, 4) quaternions (w, x, y, z) body to world, ``velocity`` (n, 3) [m/s],
    ``angular_velocity`` (n, 3) [rad/s], ``ledger`` numbers by name (see ledger.py).
    """

    time: float
    position: np.ndarray
    orientation: np.ndarray
    velocity: np.ndarray
    angular_velocity: np.ndarray
    ledger: dict[str, float]
