"""Ambient occlusion of the floor: the soft shade of bodies close above it."""

from __future__ import annotations

import math

import numpy as np

from particlesim.core.jit import entry_kernel
from particlesim.rendering.visibility.instances import ALL_BODIES

# The shade is sampled at points a body's radius apart, and at most at so many along the floor's longer side.
_POINTS = 192

# Bodies whose centroid is at most so many of their radii above the floor shade it. Over the last of these radii their
# shade fades to nothing: it would blink as they fall.
_HIGHEST = 3.0

# Farther than so many heights, a sphere hides less than a fiftieth of what it hides below itself.
_REACH = 3.6

# The ambient light at the floor, as a share of all its light.
_AMBIENT = 0.4


class FloorOcclusion:
    """A floor.

    Parameters
    ----------
    lower, upper : (2,) float64
        Its corners [m].
    height : float
        Its z [m].
    inradius, radius : (n,) float64
        Radii of the spheres within and about the bodies above it [m].
    """

    def __init__(
        self, lower: np.ndarray, upper: np.ndarray, height: float, inradius: np.ndarray, radius: np.ndarray
    ) -> None:
        self._corner, self._size = np.array([*lower, height]), np.subtract(upper, lower)
        # A body hides about as much as a sphere between those within and about it.
        self._radius = 0.5 * (inradius + radius)
        typical = float(np.median(self._radius)) if len(radius) else 0.0
        self._step = max(float(max(self._size)) / _POINTS, typical)

    def light(self, position: np.ndarray, source: slice | np.ndarray = ALL_BODIES) -> np.ndarray:
        """Share of the light that reaches the floor, (b, a) float32, from its lower corner to its upper one.

        Parameters
        ----------
        position : (m, 3) float64
            Centroids of all instances [m].
        source : slice or (m,) int64
            The body that each is an image of (see instances.py).
        """
        width, depth = (max(2, round(edge / self._step)) for edge in self._size)
        light = np.ones((depth, width))
        _shade(np.ascontiguousarray(position), self._radius[source], self._corner, self._size, light)
        return (1.0 - _AMBIENT * (1.0 - light)).astype(np.float32)


@entry_kernel
def _shade(position, radius, corner, size, light):
    """Take away what each sphere close above the floor hides of an even light from above.

    At a distance d from the point below a sphere of radius r at height h that is (r / h)^2 / (1 + (d / h)^2)^(3/2) of
    its light (plane element to sphere; J. R. Howell, A Catalog of Radiation Heat Transfer Configuration Factors).
    """
    rows, columns = light.shape
    across, along = columns / size[0], rows / size[1]
    for k in range(len(position)):
        h = position[k, 2] - corner[2]
        if not 0.0 < h < _HIGHEST * radius[k]:
            continue
        h = max(h, radius[k])
        x, y, reach = position[k, 0] - corner[0], position[k, 1] - corner[1], _REACH * h
        share = (radius[k] / h) ** 2 * min(_HIGHEST - h / radius[k], 1.0)
        for row in range(max(0, math.ceil((y - reach) * along - 0.5)), min(rows, math.ceil((y + reach) * along))):
            b = ((row + 0.5) / along - y) / h
            for column in range(
                max(0, math.ceil((x - reach) * across - 0.5)), min(columns, math.ceil((x + reach) * across))
            ):
                a = ((column + 0.5) / across - x) / h
                d2 = a * a + b * b
                # Fades to nothing where it ends.
                fade = 1.0 - d2 / (_REACH * _REACH)
                if fade > 0.0:
                    hidden = share / ((1.0 + d2) * math.sqrt(1.0 + d2)) * fade
                    light[row, column] *= 1.0 - hidden
