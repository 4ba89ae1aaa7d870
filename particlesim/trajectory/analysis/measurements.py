"""What a run amounts to: a table over its time, and how its particles are spread, gathered as its frames pass."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from particlesim.core.constants import DISSIPATION
from particlesim.scene import Scene
from particlesim.trajectory.analysis.observables import WINDOW, energy_drift, pressure, temperature
from particlesim.trajectory.analysis.radial import RadialDistribution
from particlesim.trajectory.analysis.speeds import speed_table
from particlesim.trajectory.frames import Frame, Header, Ledger

# Columns of the table over time, all float64.
LOST = tuple(f"lost_by_{cause}" for cause in DISSIPATION)
COLUMNS = (
    *("time", "particles", "kinetic_translational", "kinetic_rotational", "potential", "energy", *LOST, "work"),
    *("energy_drift", "momentum_x", "momentum_y", "momentum_z"),
    *("angular_momentum_x", "angular_momentum_y", "angular_momentum_z"),
    *("impacts", "temperature", "pressure", "mean_speed", "mean_square_speed", "mean_square_displacement"),
)
TABLES = ("time", "radial", "speeds")

# Distributions are taken over so many frames of the second half of a run, when it has settled, and so many particles:
# leaving out some at random changes neither of the two.
_FRAMES = 16
_PARTICLES = 50_000


class Measurements:
    """Gathers frames as they pass: ``add`` each, in their order, then ask for a ``table``.

    Parameters
    ----------
    scene
        What they are of.
    header
        Of their particles.
    total
        How many frames there will be.
    """

    def __init__(self, scene: Scene, header: Header, total: int) -> None:
        self.scene, self.header = scene, header
        self._period = np.array(scene.world.period)
        self._rows: list[tuple[float, ...]] = []
        self._ledgers: list[Ledger] = []
        self._first: tuple[np.ndarray, np.ndarray] | None = None  # ids of those that were there at first, and where
        self._sampled = {round(k) for k in np.linspace(0.5 * (total - 1), total - 1, _FRAMES)}
        self._chosen = _some_of(len(header.mass))
        self._radial = RadialDistribution(self._period, 2.0 * float(header.radius.mean()))
        self._speeds: list[np.ndarray] = []
        self._masses: list[np.ndarray] = []

    def add(self, frame: Frame) -> None:
        """Take a frame into account."""
        if len(self._rows) in self._sampled:
            self._sample(frame)
        moved = self._displaced(frame)
        square = (frame.velocity**2).sum(axis=1)
        row = {
            "time": frame.time,
            "particles": len(frame.position),
            "mean_speed": _mean(np.sqrt(square)),
            "mean_square_speed": _mean(square),
            "mean_square_displacement": _mean((moved**2).sum(axis=1)),
            "temperature": temperature(frame),
            **({} if frame.ledger is None else self._of_ledger(frame.ledger)),
        }
        self._rows.append(tuple(float(row.get(name, np.nan)) for name in COLUMNS))

    def table(self, which: str = "time") -> np.ndarray:
        """The numbers as a structured array of float64. ValueError for a table that there is not.

        Parameters
        ----------
        which
            ``"time"``: a row for each frame, with the columns in ``COLUMNS`` in SI units; what is not known is not a
            number. ``"radial"``: ``density`` of particles at a ``distance`` [m] from one of them, over the mean.
            ``"speeds"``: ``density`` of a ``speed`` [m/s], and ``maxwell``'s. The last two are of the second half of
            the run.
        """
        if which not in TABLES:
            raise ValueError(f"which: must be one of {', '.join(TABLES)}, not {which!r}")
        if which == "radial":
            return self._radial.table()
        if which == "speeds":
            return speed_table(*(np.concatenate([np.zeros(0), *lists]) for lists in (self._speeds, self._masses)))
        return np.array(self._rows, dtype=[(name, np.float64) for name in COLUMNS])

    def _sample(self, frame: Frame) -> None:
        """Take a frame into the distributions."""
        ids = frame.ids
        kept = np.isin(ids, self._chosen)
        self._radial.add(frame.position[kept])
        speed = np.linalg.norm(frame.velocity[kept], axis=1)
        known = np.isfinite(speed)  # unless velocities are not in a file
        self._speeds.append(speed[known])
        self._masses.append(self.header.mass[ids[kept]][known])

    def _displaced(self, frame: Frame) -> np.ndarray:
        """How far the particles that were there at first, and still are, have come since, (m, 3) [m]."""
        place = frame.position + frame.image * self._period
        if self._first is None:
            self._first = frame.ids, place
        ids, start = self._first
        return place[np.isin(frame.ids, ids)] - start[np.isin(ids, frame.ids)]

    def _of_ledger(self, ledger: Ledger) -> dict[str, float]:
        self._ledgers.append(ledger)
        window = self._ledgers[-WINDOW - 1 :]
        found = pressure(self.scene, window) if ledger.time > window[0].time else None
        lost = np.full(len(LOST), np.nan) if ledger.dissipated is None else ledger.dissipated
        return {
            "kinetic_translational": ledger.kinetic_translational,
            "kinetic_rotational": ledger.kinetic_rotational,
            "potential": ledger.potential,
            "energy": ledger.energy,
            **dict(zip(LOST, lost.tolist(), strict=True)),
            "work": np.nan if ledger.work is None else ledger.work,
            "energy_drift": energy_drift(ledger, self._ledgers[0]),
            **{f"momentum_{axis}": p for axis, p in zip("xyz", ledger.momentum.tolist(), strict=True)},
            **{f"angular_momentum_{axis}": p for axis, p in zip("xyz", ledger.angular_momentum.tolist(), strict=True)},
            "impacts": ledger.impacts,
            "pressure": np.nan if found is None else found,
        }


def measured(scene: Scene, header: Header, frames: Iterable[Frame], total: int) -> Measurements:
    """What ``total`` frames of a scene amount to."""
    run = Measurements(scene, header, total)
    for frame in frames:
        run.add(frame)
    return run


def _some_of(count: int) -> np.ndarray:
    """Which of ``count`` particles distributions are taken of, always the same: ids, rising."""
    if count <= _PARTICLES:
        return np.arange(count)
    return np.sort(np.random.default_rng(0).choice(count, _PARTICLES, replace=False))


def _mean(values: np.ndarray) -> float:
    return float(values.mean()) if len(values) else np.nan
