"""Runs in the formats of other programs. Each module writes one format, from an ``Exported``."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from particlesim.scene import Scene
from particlesim.trajectory.frames import Frame, Header


class ExportError(ValueError):
    """A run that a format cannot hold; the message is one line."""


class Exported(NamedTuple):
    """What there is to write of a run: ``frames`` in the order of time, ``colours`` (n, 3) linear RGB 0 .. 1 by id."""

    scene: Scene
    header: Header
    frames: Iterable[Frame]
    colours: np.ndarray
