"""Gases for tests: how they are made, what is measured of them, and the equations of state they are held against.

Units: spheres of diameter 1 and mass 1, temperatures are energies (Boltzmann's constant is 1).
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from particlesim.simulation.simulation import Simulation
from tests.worlds import scene


class Measured(NamedTuple):
    """The mean over blocks of time, and its standard error from how the blocks differ."""

    mean: float
    error: float


def over_blocks(values: Any) -> Measured:
    """Mean and standard error of values that do not depend on each other."""
    values = np.asarray(values, dtype=np.float64)
    return Measured(float(values.mean()), float(values.std(ddof=1) / math.sqrt(len(values))))


def spheres(count: int, fill: float, *, diameters: tuple[float, ...] = (1.0,), **settings: Any) -> Simulation:
    """So many spheres of each diameter that fill this fraction of a cube, at temperature 1; masses go by volume."""
    edge = (count * sum(math.pi / 6.0 * d**3 for d in diameters) / fill) ** (1.0 / 3.0)
    groups = [
        {"shape": "sphere", "size": d, "count": count, "mass": d**3, "velocity": {"kind": "maxwell", "temperature": 1}}
        for d in diameters
    ]
    return Simulation(scene(*groups, **{"size": (edge,) * 3, "boundary": "periodic", "seed": 1, **settings}))


def temperature_of(sim: Simulation) -> float:
    """Two thirds of the kinetic energy about the centre of mass, shared among N - 1 of the N particles."""
    ledger, mass = sim.ledger, sim.particles.mass
    drift = float(ledger.momentum @ ledger.momentum) / (2.0 * mass.sum())
    return (ledger.kinetic_translational - drift) / (1.5 * (len(mass) - 1))


def blocks(sim: Simulation, count: int, duration: float, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Compressibility and impacts a second in each of ``count`` blocks of time.

    Z = P V / (N T) = 1 + W / (3 N T t) with W the sum of r_ij . impulse over the impacts of a time t (B. J. Alder,
    T. E. Wainwright, J. Chem. Phys. 33 (1960) 1439, eq. 5): every impulse presses the two apart, so W is above 0.
    """
    steps = round(duration / step)
    virials, impacts = [sim.ledger.virial], [sim.ledger.impacts]
    for _ in range(count):
        for _ in range(steps):
            sim.step(step)
        virials.append(sim.ledger.virial)
        impacts.append(sim.ledger.impacts)
    particles, passed = len(sim.particles.mass), steps * step
    return 1.0 + np.diff(virials) / (3.0 * particles * temperature_of(sim) * passed), np.diff(impacts) / passed


# ---- what theory says ------------------------------------------------------------------------------------------


def carnahan_starling(fill: float) -> float:
    """Z of the hard-sphere fluid (N. F. Carnahan, K. E. Starling, J. Chem. Phys. 51 (1969) 635, eq. 10)."""
    return (1.0 + fill + fill**2 - fill**3) / (1.0 - fill) ** 3


def crowding(fill: float) -> float:
    """How much more often spheres meet than at low density: chi, from Z = 1 + 4 fill chi."""
    return (carnahan_starling(fill) - 1.0) / (4.0 * fill)


def impact_rate(count: int, fill: float) -> float:
    """Impacts a second of ``count`` spheres of diameter, mass and temperature 1.

    A sphere meets others 4 n chi sqrt(pi T / m) d^2 times a second (D. Enskog 1922; S. Chapman, T. G. Cowling, The
    Mathematical Theory of Non-Uniform Gases, 3rd ed., eq. 16.21,1), and each impact is one of two spheres.
    """
    density = fill / (math.pi / 6.0)
    return 0.5 * count * 4.0 * density * crowding(fill) * math.sqrt(math.pi)


def _moments(diameters: tuple[float, ...], fill: float) -> list[float]:
    """pi/6 sum of n_i d_i^k for k = 0 .. 3, of as many spheres of each diameter."""
    density = fill / sum(math.pi / 6.0 * d**3 for d in diameters)
    return [math.pi / 6.0 * density * sum(d**k for d in diameters) for k in range(4)]


def mixture(diameters: tuple[float, ...], fill: float) -> float:
    """Z of hard spheres, as many of each diameter (T. Boublik, J. Chem. Phys. 53 (1970) 471, eq. 3; G. A. Mansoori,
    N. F. Carnahan, K. E. Starling, T. W. Leland, J. Chem. Phys. 54 (1971) 1523)."""
    a, b, c, filled = _moments(diameters, fill)
    empty = 1.0 - filled
    return 1.0 / empty + 3.0 * b * c / (a * empty**2) + (3.0 - filled) * c**3 / (a * empty**3)


def mixed_impact_rate(count: int, diameters: tuple[float, ...], fill: float) -> float:
    """Impacts a second of ``count`` spheres of each diameter and of mass d^3, at temperature 1.

    Of spheres i with spheres j: n_i n_j d_ij^2 chi_ij sqrt(8 pi T / mu_ij) a volume, half of it if i = j, with
    chi_ij = 1 / (1 - x3) + 3 x2 / (1 - x3)^2 D + 2 x2^2 / (1 - x3)^3 D^2 and D = d_i d_j / (d_i + d_j) (Boublik 1970).
    """
    _, _, c, filled = _moments(diameters, fill)
    empty = 1.0 - filled
    volume = count * sum(math.pi / 6.0 * d**3 for d in diameters) / fill
    rate = 0.0
    for i in diameters:
        for j in diameters:
            width = i * j / (i + j)
            chi = 1.0 / empty + 3.0 * c / empty**2 * width + 2.0 * c**2 / empty**3 * width**2
            reduced = i**3 * j**3 / (i**3 + j**3)
            rate += 0.5 * (count / volume) ** 2 * (0.5 * (i + j)) ** 2 * chi * math.sqrt(8.0 * math.pi / reduced)
    return rate * volume
