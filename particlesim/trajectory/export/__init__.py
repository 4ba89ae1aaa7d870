"""Runs in the formats of other programs. Each module writes one format, from an ``Exported``."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from particlesim.scene import Scene
from particlesim.trajectory.drawn_obstacles import DrawnObstacle
from particlesim.trajectory.frames import Frame, Header


class ExportError(ValueError):
    """A run that a format cannot hold; the message is one line."""


class Exported(NamedTuple):
    """What there is to write of a run.

    ``frames`` are in the order of time; ``colours`` (n, 3) are linear RGB 0 .. 1, by id.
    """

    scene: Scene
    header: Header
    frames: Iterable[Frame]
    colours: np.ndarray
    obstacles: Sequence[DrawnObstacle] = ()
