"""Where particles come and go, as the edges of boxes: of use while a scene is being made, so drafts have them."""

from __future__ import annotations

import numpy as np

from particlesim.rendering.gl import geometry
from particlesim.scene import Scene

# Red, green, blue, opacity in sRGB of the edges of emitters and of sinks.
_IN, _OUT = (0.0, 0.62, 0.45, 0.8), (0.84, 0.37, 0.0, 0.8)


def region_lines(scene: Scene, width: float) -> np.ndarray:
    """Lines (see gl.geometry), ``width`` [pixels] wide, of the regions of emitters and sinks within the world."""
    colours = [_IN] * len(scene.emitters) + [_OUT] * len(scene.sinks)
    regions = [*(emitter.region for emitter in scene.emitters), *(sink.region for sink in scene.sinks)]
    half = 0.5 * np.asarray(scene.world.size)
    lower = np.clip(np.array([region.lower for region in regions]).reshape(-1, 3), -half, half)
    upper = np.clip(np.array([region.upper for region in regions]).reshape(-1, 3), -half, half)
    return geometry.box_lines(lower, upper, np.repeat(np.array(colours).reshape(-1, 4), 12, axis=0), width)
