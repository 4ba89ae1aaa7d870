"""How much work goes into a picture: the presets that a scene chooses from."""

from __future__ import annotations

from typing import NamedTuple


class Quality(NamedTuple):
    """What a preset asks for."""

    samples: int  # squares a side that each pixel is the mean of
    fxaa: bool  # whether jagged edges are found in the finished picture and smoothed
    shadow: float  # edge of the shadow map, in heights of the picture
    ambient_occlusion: bool  # whether particles amidst others, and the floor below, get less of the sky


PRESETS = {
    "draft": Quality(samples=1, fxaa=False, shadow=0.8, ambient_occlusion=False),
    "normal": Quality(samples=1, fxaa=True, shadow=1.4, ambient_occlusion=True),
    "high": Quality(samples=2, fxaa=False, shadow=2.0, ambient_occlusion=True),
}
