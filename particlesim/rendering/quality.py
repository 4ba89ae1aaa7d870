"""How much work goes into a picture: the presets that a scene chooses from."""

from __future__ import annotations

from typing import NamedTuple


class Quality(NamedTuple):
    """What a preset asks for."""

    samples: int  # squares a side that each pixel is the mean of
    smooth: bool  # whether jagged edges are found in the finished picture and smoothed
    shadow: float  # edge of the shadow map, in heights of the picture
    sky: bool  # whether particles amidst others get less light from the sky, and shade the floor below them


PRESETS = {
    "draft": Quality(samples=1, smooth=False, shadow=0.8, sky=False),
    "normal": Quality(samples=1, smooth=True, shadow=1.4, sky=True),
    "high": Quality(samples=2, smooth=False, shadow=2.0, sky=True),
}
