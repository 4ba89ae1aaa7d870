"""What a run amounted to: the ledger over all its frames in a few numbers."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from particlesim.core.constants import DISSIPATION
from particlesim.jobs.display import html_of, png_of
from particlesim.trajectory.frames import Frame, Ledger, ledger_of, ledger_table


class Summary:
    """Gathers frames as they pass: ``add`` each, then read the attributes.

    Energies are compared with what there was at first, or with the largest kinetic energy seen if that is more.
    ``elastic`` says that no impact may take energy, ``obstructed`` that there are obstacles or fields, or that
    particles come and go. A notebook shows the movie or the picture at ``path``.
    """

    def __init__(self, total_mass: float, gravity: Any, elastic: bool = True, obstructed: bool = False) -> None:
        self._mass, self._gravity = total_mass, tuple(gravity)
        self.elastic, self.obstructed = elastic, obstructed
        self._first: Ledger | None = None
        self._last: Ledger | None = None
        self._largest_kinetic = self._largest_change = self._largest_gain = 0.0
        self._least, self._most_waiting = math.inf, 0
        self.frames = 0
        self.drawn = 0  # how many of the frames there are pictures of
        self.largest_overlap = 0.0
        self.seconds: dict[str, float] = {}  # spent in each part, but for what was done beside another
        self.times = (0.0, 0.0)  # of the first frame and the last [s]
        self.path: Path | None = None  # of what came of it, once that is whole

    def __repr__(self) -> str:
        known = f", {self.impacts:,} impacts" if self._last else ""
        if self._last and self.is_closed:
            known += f", worst energy change {self.worst_energy_drift:.1e}"
        first, last = self.times
        of = f" of {self.path}" if self.path else ""
        return f"<Summary{of}: {self.frames:,} frames, {self.drawn:,} drawn, {first:g} to {last:g} s{known}>"

    def _repr_html_(self) -> str | None:
        return html_of(self.path, repr(self)[1:-1]) if self.path else None

    def _repr_png_(self) -> bytes | None:
        return png_of(self.path) if self.path else None

    def table(self) -> dict[str, Any]:
        """What has passed as plain values."""
        return {name: ledger_table(value) if isinstance(value, Ledger) else value for name, value in vars(self).items()}

    def go_on(self, table: dict[str, Any]) -> None:
        """Go on after what had passed when ``table`` was made."""
        vars(self).update({name: ledger_of(v) if name in ("_first", "_last") and v else v for name, v in table.items()})

    def add(self, frame: Frame) -> None:
        """Take a frame into account."""
        self.add_moment(frame.time, frame.ledger)

    def add_moment(self, time: float, ledger: Ledger | None) -> None:
        """Take a frame into account of which only the time [s] and the ledger are read."""
        self.times = (self.times[0] if self.frames else time, time)
        self.frames += 1
        if ledger is not None:
            self._account(ledger)

    def _account(self, ledger: Ledger) -> None:
        self._first = self._first or ledger
        self._last = ledger
        self._most_waiting = max(self._most_waiting, ledger.waiting or 0)
        self.largest_overlap = max(self.largest_overlap, ledger.largest_overlap or 0.0)
        self._largest_kinetic = max(self._largest_kinetic, ledger.kinetic)
        self._largest_change = max(self._largest_change, abs(ledger.own_energy - self._first.own_energy))
        self._least = min(self._least, ledger.own_energy)
        self._largest_gain = max(self._largest_gain, ledger.own_energy - self._least)

    @property
    def first(self) -> Ledger | None:
        """The ledger of the first frame, where there was one that had one."""
        return self._first

    @property
    def has_ledger(self) -> bool:
        """Whether energies and impacts are known; of what other programs wrote they are not."""
        return self._last is not None

    @property
    def simulated_seconds(self) -> float:
        """Time between the first frame and the last [s]."""
        return self._last.time - self._first.time if self._first and self._last else 0.0

    @property
    def impacts(self) -> int:
        """Impacts up to the last frame."""
        return self._last.impacts if self._last else 0

    @property
    def unresolved(self) -> int:
        """Steps that ended while something still approached."""
        return self._last.unresolved if self._last else 0

    @property
    def worst_energy_drift(self) -> float:
        """Largest change of the total energy since the first frame, as a fraction of it.

        What moving obstacles worked is not counted.
        """
        return self._of_all(self._largest_change)

    @property
    def forbidden_energy_drift(self) -> float:
        """What of the change of energy should not be, as a fraction of all: if not ``elastic``, only what came back.

        That is the largest rise above the least energy of the frames before.
        """
        return self._of_all(self._largest_change if self.elastic else self._largest_gain)

    @property
    def dissipated(self) -> dict[str, float]:
        """What each cause took of the energy up to the last frame, as a fraction of all; empty if it is not known."""
        if not (self._first and self._last) or self._first.dissipated is None or self._last.dissipated is None:
            return {}
        taken = self._last.dissipated - self._first.dissipated
        return {cause: self._of_all(float(energy)) for cause, energy in zip(DISSIPATION, taken, strict=True)}

    @property
    def flow(self) -> tuple[int, int, int]:
        """Particles that came and went up to the last frame, and the most that ever waited for room."""
        last = self._last
        return (last.released or 0, last.removed or 0, self._most_waiting) if last else (0, 0, 0)

    @property
    def is_closed(self) -> bool:
        """Whether nothing came and nothing went: else a change of the energy is no fraction of what there was."""
        return not any(self.flow[:2])

    @property
    def work(self) -> float:
        """What moving obstacles gave up to the last frame, as a fraction of all energy."""
        return self._of_all(self._last.work or 0.0) if self._last else 0.0

    def _of_all(self, energy: float) -> float:
        scale = max(self._largest_kinetic, self._first.energy if self._first else 0.0)
        return energy / scale if scale else 0.0

    @property
    def momentum_error(self) -> float:
        """Change of momentum that neither walls nor gravity account for, over the momentum of the fastest motion.

        Obstacles take some as well, which is not counted.
        """
        if not (self._first and self._last and self._largest_kinetic):
            return 0.0
        first, last = self._first, self._last
        to_walls = last.given_to_walls - first.given_to_walls
        fallen = self._mass * np.array(self._gravity) * (last.time - first.time)
        error = last.momentum - first.momentum + to_walls - fallen
        return float(np.linalg.norm(error) / np.sqrt(2.0 * self._mass * self._largest_kinetic))
