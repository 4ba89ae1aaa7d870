"""How the speeds of particles are distributed, and Maxwell's distribution at their temperature."""

from __future__ import annotations

import numpy as np

# Masses that stand for those of all particles where there are more.
_MASSES = 200


def maxwell_density(speed: np.ndarray, mass: np.ndarray, temperature: float) -> np.ndarray:
    """Maxwell's distribution of the speeds of a mixture: the mean of those of its particles.

    Parameters
    ----------
    speed : (k,) float64
        Where it is asked for [m/s].
    mass : (n,) float64
        Of the particles [kg].
    temperature : float
        Two thirds of the mean energy of translation [J], above 0.

    Returns
    -------
    Density (k,) float64 [s/m]: 4 pi (m / 2 pi T)^(3/2) v^2 exp(-m v^2 / 2 T) for one mass m
    (L. D. Landau, E. M. Lifshitz, Statistical Physics, Part 1, 3rd ed., eq. 29.6).
    """
    ratio = mass / temperature
    each = np.sqrt(2.0 / np.pi) * ratio**1.5 * np.exp(-0.5 * ratio * speed[:, None] ** 2)
    return speed**2 * each.mean(axis=1)


def speed_table(speed: np.ndarray, mass: np.ndarray) -> np.ndarray:
    """How speeds are distributed, beside Maxwell's distribution.

    Parameters
    ----------
    speed : (n,) float64
        Of particles, at one time or at many [m/s].
    mass : (n,) float64
        Theirs [kg].

    Returns
    -------
    Structured array with ``speed``, the middle of a bin [m/s], and the densities ``density`` and ``maxwell`` [s/m];
    empty if nothing moves.
    """
    energy = 0.5 * mass @ speed**2
    # By Rice's rule: twice the cube root of how many there are.
    bins = int(np.clip(2.0 * len(speed) ** (1.0 / 3.0), 8, 80)) if energy > 0.0 else 0
    table = np.zeros(bins, dtype=[(name, np.float64) for name in ("speed", "density", "maxwell")])
    if bins:
        table["density"], edges = np.histogram(speed, bins, (0.0, float(speed.max())), density=True)
        table["speed"] = 0.5 * (edges[1:] + edges[:-1])
        standing = mass if len(mass) <= _MASSES else np.quantile(mass, (np.arange(_MASSES) + 0.5) / _MASSES)
        table["maxwell"] = maxwell_density(table["speed"], standing, 2.0 / 3.0 * energy / len(speed))
    return table
