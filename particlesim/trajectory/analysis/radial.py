"""The radial distribution: how many particles have another one at a distance, over how many would by chance."""

from __future__ import annotations

import numpy as np

from particlesim.broad_phase import find_pairs

# Bins of distance, and how far they reach in mean diameters of the particles.
_BINS = 80
_REACH = 5.0


class RadialDistribution:
    """Counts pairs of particles by their distance, frame by frame.

    Parameters
    ----------
    period : (3,) float64
        Edges of the world along axes that wrap [m], 0 along others.
    diameter : float
        Of the particles, on average [m].
    """

    def __init__(self, period: np.ndarray, diameter: float) -> None:
        self._period = period
        # A pair is counted at its nearest image: no further than half a period.
        self._reach = min([_REACH * diameter, *(0.5 * period[period > 0.0])])
        self._edges = np.linspace(0.0, self._reach, _BINS + 1)
        self._found, self._expected = np.zeros(_BINS), np.zeros(_BINS)

    def add(self, position: np.ndarray) -> None:
        """Take the particles at these places (n, 3) [m] into account."""
        count = len(position)
        if count < 2:
            return
        box = self._box(position)
        if not box.all():
            return
        half = 0.5 * self._reach
        pairs = find_pairs(position - half, position + half, period=self._period)
        apart = position[pairs[:, 1]] - position[pairs[:, 0]]
        wraps = self._period > 0.0
        apart[:, wraps] -= self._period[wraps] * np.round(apart[:, wraps] / self._period[wraps])
        found, _ = np.histogram(np.linalg.norm(apart, axis=1), self._edges)
        # Further apart than an edge of the box is long, what follows does not hold.
        told = self._edges[1:] <= min([np.inf, *box[~wraps]])
        chance = np.diff(_share_of_pairs(self._edges, box, wraps))
        self._found += np.where(told, found, 0)
        self._expected += np.where(told, 0.5 * count * (count - 1) * chance, 0.0)

    def table(self) -> np.ndarray:
        """Structured array with ``distance``, the middle of a bin [m], and ``density``, over that of chance.

        Bins of which nothing can be told are left out.
        """
        told = self._expected > 0.0
        table = np.zeros(int(told.sum()), dtype=[("distance", np.float64), ("density", np.float64)])
        table["distance"] = (0.5 * (self._edges[1:] + self._edges[:-1]))[told]
        table["density"] = self._found[told] / self._expected[told]
        return table

    def _box(self, position: np.ndarray) -> np.ndarray:
        """Edges of the box that the particles are in (3,) [m]: the period, or what they span.

        n random points span (n - 1) / (n + 1) of an edge, on average.
        """
        count = len(position)
        return np.where(self._period > 0.0, self._period, np.ptp(position, axis=0) * (count + 1) / (count - 1))


def _share_of_pairs(distance: np.ndarray, box: np.ndarray, wraps: np.ndarray) -> np.ndarray:
    """The share of pairs of random points in a box no further apart than these distances (k,) [m], (k,).

    Moved by r in a direction u, a box with edges a overlaps itself in the product of 1 - r |u| / a over the axes that
    do not wrap; over all directions |u_x| is 1/2 on average, |u_x u_y| 2 / (3 pi), |u_x u_y u_z| 1 / (4 pi). That many
    of the points at r are in the box as well.
    """
    x, y, z = np.where(wraps, 0.0, 1.0 / box)
    one, two, three = (x + y + z) / 2.0, (x * y + y * z + z * x) * 2.0 / (3.0 * np.pi), x * y * z / (4.0 * np.pi)
    moved = distance**3 / 3.0 - one * distance**4 / 4.0 + two * distance**5 / 5.0 - three * distance**6 / 6.0
    return 4.0 * np.pi * moved / box.prod()
