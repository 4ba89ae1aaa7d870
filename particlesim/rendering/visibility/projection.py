"""Where particles are for one who looks at them, be it the camera or the light."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Outlook(NamedTuple):
    """A picture, or the shadow map, as squares of which each shows what is nearest at its middle.

    ``axes`` (3, 3): rows right, up and away of the one who looks; ``eye`` (3,) [m], where that is, or any place if
    the view is ``parallel``; ``scale``: squares a metre, at distance 1 m if the view is not parallel; ``size``:
    squares across and down, ``eye`` being in their middle.
    """

    axes: np.ndarray
    eye: np.ndarray
    parallel: bool
    scale: float
    size: tuple[int, int]


def nearest_first(away: np.ndarray) -> np.ndarray:
    """The order of what is so far ``away``, (k,), int64: roughly the nearer first."""
    low, high = (away.min(), away.max()) if len(away) else (0.0, 0.0)
    # Distances in so many steps are sorted in a time that grows with their number only.
    steps = (away - low) * (65535.0 / (high - low) if high > low else 0.0)
    return np.argsort(steps.astype(np.uint16), kind="stable")
