"""What is about the particles: the background, the floor, the haze between near and far, the edges of the world."""

from __future__ import annotations

import numpy as np

from particlesim.rendering.camera import View
from particlesim.rendering.gl import geometry
from particlesim.rendering.shading.colour_maps import encoded
from particlesim.rendering.shading.lighting import towards_light
from particlesim.rendering.shading.shade_floor import Ground
from particlesim.rendering.transparency import CLEAR_FLOOR
from particlesim.scene import Scene

# The floor fades out over this fraction of the world's longer horizontal side, beyond all shadows that it may bear.
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
        self.background = encoded(scene.movie.behind)
        self.dark = bool(self.background.mean() < 0.5)
        lower, towards = -0.5 * self._size, towards_light(scene)
        # How far from below it the shadow of what is at the top of the world falls.
        cast = -self._size[2] / towards[2] * towards[:2]
        self._floor = lower[:2] + np.minimum(cast, 0.0), -lower[:2] + np.maximum(cast, 0.0), float(lower[2])
        # A shade off the background, so that the floor is seen, and a shadow on it even when that is black.
        self._bright = self.background * 0.97 + (0.06 if self.dark else 0.0)
        if scene.movie.transparent:
            self._bright = np.full(3, CLEAR_FLOOR / 255.0)
        self.has_floor = scene.world.boundary[2] == "wall"

    @property
    def floor(self) -> tuple[np.ndarray, np.ndarray, float]:
        """Corners of the floor with its fading rim, (2,) each, and its height [m]."""
        lower, upper, height = self._floor
        return lower - self._rim, upper + self._rim, height

    def ground(self, light: np.ndarray) -> Ground:
        """The background and the floor; ``light`` (b, a) float32: share of the light that reaches the floor."""
        colours = np.array([self.background, self._bright, _FLOOR_SHADOW * self._bright])
        return Ground(colours, *self._floor, self._rim, light)

    def haze(self, view: View) -> np.ndarray:
        """Where far things become pale, as ``Paint`` has it: from the nearest corner of the world to the farthest."""
        back, eye = view.pose[:3, 2], view.pose[:3, 3]
        depth = float(np.abs(back) @ self._size)
        haze = 0.0 if self._scene.movie.transparent else _HAZE
        return np.array([float(back @ eye) - 0.5 * depth, 1.0 / depth, haze])

    def box_lines(self, view: View, width: float) -> np.ndarray:
        """Lines (see gl.geometry) for the edges of the world, ``width`` [pixels] wide; none if a scene hides it."""
        if not self._scene.box_shown:
            return np.zeros((0, 11), dtype=np.float32)
        upper = 0.5 * self._size
        colour = np.full((12, 4), 0.75 if self.dark else 0.25)
        colour[:, 3] = 0.7 * geometry.edge_opacity(-upper, upper, view.pose[:3, 3])
        return geometry.box_lines(-upper[None], upper[None], colour, width)
