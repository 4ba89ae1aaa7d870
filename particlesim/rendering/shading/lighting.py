"""The key light: where it stands, and the box of the world that its shadow map shows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from particlesim.rendering.camera import light_azimuth
from particlesim.rendering.shading.shadow import SQUARES, ShadowMap
from particlesim.rendering.visibility.projection import Projection
from particlesim.scene import Scene

# Height of the key light above the horizon [degrees]: shadows stay short and under their particles.
_ELEVATION = 58.0

# What is behind another by less than this share of the depth of the box is not in its shadow.
_BEFORE = 1.2e-3

# How wide the soft edge of a shadow is at the least, in radii of a particle: what is far smaller looks like a texture.
_PENUMBRA = 0.3

# Texels of its shorter side at the least: what is looked at about one place has to be there.
_FEWEST = 8

# The box is a little larger than the world, for what leans out of it.
_ROOM = 1.04


class Light(NamedTuple):
    """A light from infinitely far. ``axes`` (3, 3): rows right, up and away from it; ``towards`` (3,): unit vector.

    Its shadow map shows half the ``reach`` (3,) [m] to each side of the world's middle along the axes, in ``pixels``.
    """

    towards: np.ndarray
    axes: np.ndarray
    reach: np.ndarray
    pixels: tuple[int, int]

    @property
    def projection(self) -> Projection:
        """The projection of the shadow map."""
        return Projection(self.axes, np.zeros(3), True, self.pixels[0] / (2.0 * self.reach[0]), self.pixels)

    def in_view(self, view: Projection, shadow: ShadowMap) -> Lighting:
        """The light on what ``view`` shows."""
        texels = self.projection.scale
        to_map = (self.axes * [[texels], [texels], [-1.0]]) @ np.column_stack([view.axes.T, view.eye])
        # To the first of the texels that are looked at, from its middle.
        first = 0.5 * np.asarray(self.pixels) - 0.5 * SQUARES
        to_map[:, 3] += *first, _BEFORE * self.reach[2]
        return Lighting(view.axes @ self.towards, np.ascontiguousarray(view.axes[:, 2]), to_map, shadow)


class Lighting(NamedTuple):
    """The key light as a picture has it, in view coordinates.

    Parameters
    ----------
    towards, zenith : (3,) float64
        Unit vectors towards the light, and upwards.
    to_map : (3, 4) float64
        From places to columns and rows of the shadow map where the texels that are looked at begin, and to their
        closeness to the light [m]: three factors and what is added. Places seem a little closer than they are, or
        rounding would cast shadows.
    shadow : ShadowMap
    """

    towards: np.ndarray
    zenith: np.ndarray
    to_map: np.ndarray
    shadow: ShadowMap


def towards_light(scene: Scene) -> np.ndarray:
    """Unit vector (3,) towards the key light of a scene."""
    a, e = np.radians([light_azimuth(scene), _ELEVATION])
    return np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])


def key_light(scene: Scene, pixels: int, radius: float = 0.0) -> Light:
    """The light of a scene, with a shadow map of up to ``pixels`` along its longer side.

    ``radius`` of a usual particle [m]: where it is large, so are the texels.
    """
    towards = towards_light(scene)
    axes, reach = _axes_and_reach(towards, scene.world.size)
    # Texels are squares in the world: the shorter side has fewer of them, and reaches as far as whole ones do.
    texel = max(2.0 * max(reach[:2]) / pixels, _PENUMBRA * radius / SQUARES)
    sides = np.maximum(np.ceil(2.0 * reach[:2] / texel - 1e-9).astype(int), _FEWEST)
    reach[:2] = 0.5 * texel * sides
    return Light(towards, axes, reach, (int(sides[0]), int(sides[1])))


def lights_from(directions: np.ndarray, scene: Scene, pixels: int, texel: float) -> list[Light]:
    """Lights from several directions (k, 3), all with square maps of one size, of up to ``pixels`` along a side.

    Texels are no smaller than ``texel`` [m].
    """
    found = [_axes_and_reach(towards, scene.world.size) for towards in directions]
    widest = max(float(max(reach[:2])) for _, reach in found)
    side = int(np.clip(np.ceil(2.0 * widest / max(texel, 1e-9 * widest)), _FEWEST, pixels))
    lights = []
    for towards, (axes, reach) in zip(directions, found, strict=True):
        reach[:2] = max(reach[:2])
        lights.append(Light(towards, axes, reach, (side, side)))
    return lights


def _axes_and_reach(towards: np.ndarray, size: Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
    """The axes of a light, and how far along them the box reaches that it shows, each way [m]."""
    right = np.array([-towards[1], towards[0], 0.0]) / np.hypot(*towards[:2])
    axes = np.array([right, np.cross(towards, right), -towards])
    return axes, _ROOM * np.abs(axes) @ (0.5 * np.asarray(size))
