"""What readouts need of the frames before the one that is drawn."""

from __future__ import annotations

from dataclasses import dataclass

from particlesim.trajectory.analysis.observables import WINDOW
from particlesim.trajectory.frames import Ledger


@dataclass(frozen=True)
class History:
    """Ledgers of frames that have passed, the latest last; of the oldest no more than ``WINDOW`` are kept."""

    ledgers: tuple[Ledger, ...] = ()

    def then(self, ledger: Ledger | None) -> History:
        """The history after one more frame, if its ledger is known and it is later than those before."""
        if ledger is None or (self.ledgers and ledger.time <= self.ledgers[-1].time):
            return self
        return History((*self.ledgers, ledger)[-WINDOW:])

    def up_to(self, ledger: Ledger) -> tuple[Ledger, ...]:
        """The ledgers before that of the present frame, and it."""
        return (*(passed for passed in self.ledgers if passed.time < ledger.time), ledger)
