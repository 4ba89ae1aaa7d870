"""How much work goes into a picture: the presets that a scene chooses from."""

from __future__ import annotations

from typing import NamedTuple

from particlesim.scene import Scene


class Quality(NamedTuple):
    """What a preset asks for."""

    samples: int  # squares a side that each pixel is the mean of
    fxaa: bool  # whether jagged edges are found in the finished picture and smoothed
    shadow: float  # edge of the shadow map, in heights of the picture
    ambient_occlusion: bool  # whether particles amidst others, and the floor below, get less of the sky
    lamps: int = 0  # points of the key light, for soft shadows; 0: one, and the edges of its map are softened
    sky: int = 0  # directions of the sky, for ambient occlusion of each pixel; 0: of each particle
    passes: int = 1  # pictures that each is the mean of, with other points, directions, and places on the lens


PRESETS = {
    "draft": Quality(samples=1, fxaa=False, shadow=0.8, ambient_occlusion=False),
    "normal": Quality(samples=1, fxaa=True, shadow=1.4, ambient_occlusion=True),
    "high": Quality(samples=2, fxaa=False, shadow=2.0, ambient_occlusion=True, lamps=6, sky=16),
    "best": Quality(samples=2, fxaa=False, shadow=2.0, ambient_occlusion=True, lamps=2, sky=12, passes=12),
}


def quality_of(scene: Scene) -> Quality:
    """What the preset of a scene's movie asks for."""
    asked = PRESETS[scene.movie.quality]
    # Jagged edges are found by colours, of which a picture without a background has none beside its bodies; fine lines
    # would be taken for them.
    several = scene.movie.transparent or scene.show.outlines
    return asked._replace(samples=2, fxaa=False) if asked.fxaa and several else asked
