"""What one reads off a ledger, or off some in a row: the change of the energy, temperature, pressure."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from particlesim.scene import Scene
from particlesim.trajectory.frames import Frame, Ledger

# Averages over time reach over so many frames before the present one: walls and partners are hit one by one.
WINDOW = 30


def all_energy(ledger: Ledger) -> float:
    """Kinetic energy and depth of the potential [J]."""
    return ledger.kinetic + abs(ledger.potential)


def energy_change(now: Ledger, start: Ledger) -> float:
    """Change of the total energy since ``start``, relative to the kinetic energy and depth of potential there."""
    return _relative(now.energy - start.energy, now, start)


def energy_drift(now: Ledger, start: Ledger) -> float:
    """The same of what should not change: the energy, what was dissipated, worked, and came and went all counted."""
    return _relative(_accounted(now) - _accounted(start), now, start)


def temperature(frame: Frame) -> float:
    """Two thirds of the mean energy of translation [J]: the temperature, with a Boltzmann constant of 1.

    Not a number if there are no particles or their ledger is not known.
    """
    if frame.ledger is None or not len(frame.position):
        return float("nan")
    return 2.0 / 3.0 * frame.ledger.kinetic_translational / len(frame.position)


def has_pressure(scene: Scene) -> bool:
    """Whether there are walls, or a period all round."""
    boundary = np.array(scene.world.boundary)
    return bool((boundary == "wall").any() or (boundary == "periodic").all())


def pressure(scene: Scene, window: Sequence[Ledger]) -> float | None:
    """Mean pressure [Pa] over two frames or more; None if the world has no walls and is not periodic all round.

    On walls: the momentum given to them over area and time. Without walls: from the virial theorem,
    P V = (2 K + W) / 3 with the mean energy of translation K and the sum W of r . impulse over pairs and time
    (J.-P. Hansen, I. R. McDonald, Theory of Simple Liquids, 4th ed., eq. 2.2.10).
    """
    before, after = window[0], window[-1]
    duration = after.time - before.time
    size, boundary = np.array(scene.world.size), np.array(scene.world.boundary)
    if (walls := boundary == "wall").any():
        area = 2.0 * float((size.prod() / size)[walls].sum())
        given = (after.wall_impulse - before.wall_impulse).reshape(3, 2)[walls].sum()
        return float(given) / (area * duration)
    if (boundary == "periodic").all():
        kinetic = float(np.mean([ledger.kinetic_translational for ledger in window]))
        virial = (after.virial - before.virial) / duration
        return float((2.0 * kinetic + virial) / (3.0 * size.prod()))
    return None


def _relative(change: float, now: Ledger, start: Ledger) -> float:
    scale = all_energy(start) or all_energy(now)
    return change / scale if scale else 0.0


def _accounted(ledger: Ledger) -> float:
    """The energy, and what impacts took of it, less what was worked and what came with particles [J]."""
    return ledger.own_energy + (0.0 if ledger.dissipated is None else float(ledger.dissipated.sum()))
