"""What readouts and curves need of the frames before the one that is drawn."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from particlesim.trajectory.analysis.observables import WINDOW
from particlesim.trajectory.frames import Ledger, ledger_of, ledger_table

# Points of a curve at the most: about as many as there are pixels across it.
_POINTS = 256


@dataclass(frozen=True)
class History:
    """Ledgers of frames that have passed.

    Attributes
    ----------
    ledgers
        The latest ``WINDOW`` of them, the latest last.
    curve
        Of all of them one in ``every``, from the first on; none if that is 0.
    passed
        How many have passed.
    """

    ledgers: tuple[Ledger, ...] = ()
    curve: tuple[Ledger, ...] = ()
    every: int = 0
    passed: int = 0

    @classmethod
    def of_movie(cls, wanted: range, first: Ledger | None, has_curve: bool) -> History:
        """That of a movie of these frames of a run, before the first of them; ``first`` is the ledger of frame 0."""
        begun = cls(every=-(-len(wanted) // _POINTS) if has_curve else 0).then(first)
        # What passed before the movie is not known, and no line leads over it.
        return replace(begun, curve=()) if wanted[0] > 0 else begun

    def then(self, ledger: Ledger | None) -> History:
        """The history after one more frame, if its ledger is known and it is later than those before."""
        if ledger is None or (self.ledgers and ledger.time <= self.ledgers[-1].time):
            return self
        is_kept = self.every and self.passed % self.every == 0
        return replace(
            self,
            ledgers=(*self.ledgers, ledger)[-WINDOW:],
            curve=(*self.curve, ledger) if is_kept else self.curve,
            passed=self.passed + 1,
        )

    def up_to(self, ledger: Ledger) -> tuple[Ledger, ...]:
        """The latest ledgers before that of the present frame, and it."""
        return _up_to(self.ledgers, ledger)

    def curve_to(self, ledger: Ledger) -> tuple[Ledger, ...]:
        """The points of a curve before the present frame, and it."""
        return _up_to(self.curve, ledger)

    def table(self) -> dict[str, Any]:
        """The history as plain values."""
        kept = {name: [ledger_table(ledger) for ledger in getattr(self, name)] for name in ("ledgers", "curve")}
        return {**kept, "every": self.every, "passed": self.passed}

    @classmethod
    def of_table(cls, table: dict[str, Any]) -> History:
        """The history of plain values."""
        kept = {name: tuple(ledger_of(values) for values in table[name]) for name in ("ledgers", "curve")}
        return cls(**{**table, **kept})


def _up_to(passed: tuple[Ledger, ...], ledger: Ledger) -> tuple[Ledger, ...]:
    return (*(before for before in passed if before.time < ledger.time), ledger)
