"""A second opinion: spheres in a periodic box, one impact of all after the other, in plain numpy.

Nothing is shared with the package: no neighbours, no islands, no stretches of time, no tolerance.
"""

from __future__ import annotations

import math

import numpy as np


class Spheres:
    """Smooth elastic spheres. Arrays: position, velocity (n, 3), mass, radius (n,); ``edge`` of the box [m]."""

    def __init__(
        self, position: np.ndarray, velocity: np.ndarray, mass: np.ndarray, radius: np.ndarray, edge: float
    ) -> None:
        self.position, self.velocity = position.copy(), velocity.copy()
        self._mass, self._edge = mass.copy(), edge
        self._reach = radius[:, None] + radius[None, :]
        # Images of each partner in the boxes around.
        self._shifts = edge * np.array([(i, j, k) for i in (-1, 0, 1) for j in (-1, 0, 1) for k in (-1, 0, 1)])
        self.time = 0.0

    def _meetings(self) -> tuple[np.ndarray, np.ndarray]:
        """When each pair next meets, by any image: times (27, n, n), inf if never; and the offsets (27, n, n, 3)."""
        inside = self.position - self._edge * np.round(self.position / self._edge)
        offset = inside[None, None, :, :] - inside[None, :, None, :] + self._shifts[:, None, None, :]
        relative = self.velocity[None, :, :] - self.velocity[:, None, :]
        closing = (offset * relative).sum(axis=-1)
        speed2 = (relative**2).sum(axis=-1)
        root2 = closing**2 - speed2 * ((offset**2).sum(axis=-1) - self._reach**2)
        meet = (closing < 0.0) & (root2 >= 0.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            times = np.where(meet, (-closing - np.sqrt(root2)) / speed2, math.inf)
        return times, offset

    def impact(self) -> tuple[float, int, int]:
        """Go on to the next impact of all and carry it out: its time [s] and the two."""
        times, offset = self._meetings()
        upper = np.triu(np.ones(times.shape[1:], dtype=bool), 1)
        times = np.where(upper, times, math.inf)
        image, i, j = np.unravel_index(np.argmin(times), times.shape)
        wait = times[image, i, j]
        self.position += wait * self.velocity
        self.time += wait
        apart = offset[image, i, j] + wait * (self.velocity[j] - self.velocity[i])
        normal = apart / np.linalg.norm(apart)
        approach = normal @ (self.velocity[i] - self.velocity[j])
        impulse = 2.0 * approach / (1.0 / self._mass[i] + 1.0 / self._mass[j])
        self.velocity[i] -= impulse / self._mass[i] * normal
        self.velocity[j] += impulse / self._mass[j] * normal
        return self.time, int(i), int(j)

    def run_until(self, end: float) -> None:
        """Go on to the time ``end`` [s], before which no impact may be left."""
        self.position += (end - self.time) * self.velocity
        self.time = end
