"""What is about the particles: the background, the floor, the haze between near and far, the edges of the world."""

from __future__ import annotations

import numpy as np

from particlesim.rendering.camera import View
from particlesim.rendering.gl import geometry
from particlesim.rendering.shading.colour import encoded
from particlesim.scene import Scene

# The floor fades out over this fraction of the world's longer horizontal side.
_FLOOR_RIM = 0.45

# How bright the floor is in the shadow, in sRGB.
_FLOOR_SHADOW = 0.78

# How pale the farthest corner of the world is: the share of the background in its colour.
_HAZE = 0.22


class Environment:
    """Of the pictures of one scene: ``background`` sRGB (3,), whether that is ``dark``, and if there is a floor."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._size = np.asarray(scene.world.size, dtype=np.float64)
        self._rim = _FLOOR_RIM * float(max(self._size[:2]))
        self.background = encoded(scene.movie.background)
        self.dark = bool(self.background.mean() < 0.5)
        # A shade off the background, so that the floor is seen, and a shadow on it even when that is black.
        self._bright = self.background * 0.97 + (0.06 if self.dark else 0.0)
        self.has_floor = scene.world.boundary[2] == "wall"

    @property
    def floor(self) -> tuple[np.ndarray, float]:
        """Half the width of the floor with its fading rim, (2,) [m], and its height [m]."""
        return 0.5 * self._size[:2] + self._rim, -0.5 * float(self._size[2])

    def colour_rows(self) -> list[tuple[float, ...]]:
        """Rows of the uniform block: the background, and the floor in the light and in the shadow."""
        return [(*self.background, 1.0), (*self._bright, 1.0), (*(_FLOOR_SHADOW * self._bright), 1.0)]

    def place_rows(self, view: View) -> list[tuple[float, ...]]:
        """Rows of the uniform block: where the floor is, and where the haze."""
        back, eye = view.pose[:3, 2], view.pose[:3, 3]
        x, y, z = 0.5 * self._size
        # Haze grows through the world, from its nearest corner to its farthest.
        depth = float(np.abs(back) @ self._size)
        return [(x, y, -z, self._rim), (float(back @ eye) - 0.5 * depth, 1.0 / depth, _HAZE, 0.0)]

    def box_lines(self, view: View, width: float) -> np.ndarray:
        """Instances of a line layer for the edges of the world, ``width`` [pixels] wide; none if a scene hides it."""
        if not self._scene.box_shown:
            return np.zeros((0, 11), dtype=np.float32)
        upper = 0.5 * self._size
        start, end = (ends[0] for ends in geometry.box_edges(-upper[None], upper[None]))
        colour = np.full((12, 4), 0.75 if self.dark else 0.25)
        colour[:, 3] = 0.7 * geometry.edge_opacity(-upper, upper, view.pose[:3, 3])
        return geometry.lines(start, end, colour, width)
