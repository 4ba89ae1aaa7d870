"""Particles on their way: everything that is met in a stretch of time, at the time when it is met.

First every particle is followed along its free path, and who meets whom is found. Particles that meet are islands,
each carried through its impacts in the order of time, independently of the others. A deflected particle may then
meet one of another island after all: such islands are joined and carried through once more from the start. When
nothing new is met, the result is the one that following all impacts in one order of time would have given, whatever
the order in which the islands were taken and however many threads shared them.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np

from particlesim.constants import LONGEST_STRETCH, MAX_HALVINGS, MAX_ROUNDS
from particlesim.crew import Crew
from particlesim.impacts.course import Log, empty_log, extended, forget, new_course, rewind
from particlesim.impacts.event_loop import run_islands
from particlesim.impacts.free_flight import all_on_leash, fly_on, paces
from particlesim.impacts.islands import Islands, unite
from particlesim.impacts.meetings import Where, first_meetings, missed_meetings
from particlesim.impacts.neighbours import FindPairs, find_neighbours, leashes
from particlesim.impacts.response import IMPACTS, TALLY, VIRIAL, WALLS
from particlesim.impacts.resting import Resting
from particlesim.state import Constants, ShapeTable, State, World

# Particles whose paces are summed at a time: sums depend on the order, and must not on the number of threads.
_ROWS = 4096


# What the time goes into: finding neighbours, who meets whom, answering impacts, moving on.
PHASES = ("pairs", "contacts", "respond", "advance")


@dataclass
class Counts:
    """What was done since the start."""

    impacts: int = 0
    virial: float = 0.0  # sum of r_ij . impulse over pair impacts [J s]
    wall_impulse: np.ndarray = field(default_factory=lambda: np.zeros(6))  # outward, on each wall [N s]
    pairs_tested: int = 0  # boxes compared by the broad phase
    candidate_pairs: int = 0  # pairs it found
    unresolved: int = 0  # stretches of time in which more happened than was worked through (see MAX_IMPACTS)


class Flight:
    """Moves particles on, changing ``state`` in place."""

    def __init__(
        self, table: ShapeTable, world: World, constants: Constants, state: State, find_pairs: FindPairs
    ) -> None:
        count = len(constants.mass)
        self._table, self._world, self._constants, self._state = table, world, constants, state
        self._find_pairs = find_pairs
        self._course = new_course(count, world.gravity)
        self._leash = np.empty(count)
        self._first_met = np.full(count, -1, dtype=np.int64)
        self._tally = np.zeros((count, TALLY))
        self._resting = Resting(table, world, constants, state)
        self.counts = Counts()
        self.seconds = dict.fromkeys(PHASES, 0.0)
        self._on_leash = -1.0
        self._look_around(0.0)

    @property
    def pairs(self) -> np.ndarray:
        """Candidate pairs (m, 2), i < j: nothing else can touch at present."""
        return self._neighbours.pairs

    def longest_stretch(self, fraction: float) -> float:
        """In how long [s] the surfaces move by ``fraction`` of the bounding radius on average; inf if never.

        The surface of a particle moves at most (|v| + |w| R) t + g t^2 / 2. On periodic axes nothing goes so
        far that it could meet another image of a particle than the nearest.
        """
        count = len(self._constants.mass)
        if not count:
            return math.inf
        sums = np.empty((-(-count // _ROWS), 2))
        fastest = paces(self._constants, self._state, self._world, sums, _ROWS)
        pace, pull = sums.sum(axis=0) / count
        time = _time_for(fraction, pace, pull)
        time = min(time, self._resting.longest_stretch)
        around = self._world.period[self._world.period > 0.0]
        if len(around):
            # A quarter of the room to the next image of another, for two that close in on it at twice the speed.
            room = 0.5 * around.min() - 2.0 * self._constants.radius.max()
            way = max(0.25 * room, 1e-3 * self._constants.radius.min())
            gravity = float(np.linalg.norm(self._world.gravity))
            time = min(time, _time_for(way, fastest, gravity))
        return time

    def advance(self, duration: float) -> None:
        """Move all on by ``duration`` [s], in as many equal stretches as that is long."""
        parts = max(1, math.ceil(duration / self.longest_stretch(LONGEST_STRETCH) - 1e-9))
        for _ in range(parts):
            self._stretch(duration / parts)

    @contextmanager
    def _spent_on(self, phase: str) -> Iterator[None]:
        begun = time.perf_counter()
        yield
        self.seconds[phase] += time.perf_counter() - begun

    def _stretch(self, duration: float, halvings: int = 0) -> None:
        if duration > self._on_leash:
            with self._spent_on("pairs"):
                self._look_around(duration)
        if not self._follow(duration, halvings == MAX_HALVINGS):
            # Too much hangs together, or happens: less does in half the time.
            self._stretch(0.5 * duration, halvings + 1)
            self._stretch(0.5 * duration, halvings + 1)

    def _follow(self, duration: float, anyhow: bool) -> bool:
        """Move all on by ``duration`` [s]; False, with nothing moved, if that takes too much but not ``anyhow``."""
        course, state = self._course, self._state
        log = empty_log()
        with self._spent_on("respond"):
            self._resting.hold(self._neighbours, course.acceleration, duration)
        with self._spent_on("contacts"):
            met, times = first_meetings(self._where(log), self._neighbours, self._resting.standing, duration)
        touched = np.unique(met[met >= 0])
        starts = np.flatnonzero(np.diff(met[:, 0], prepend=-1))
        self._first_met[met[starts, 0]] = starts
        linked = met
        rounds = unfinished = 0
        while len(linked) and (anyhow or (rounds < MAX_ROUNDS and not unfinished)):
            with self._spent_on("respond"):
                islands = unite(course.island, linked, touched)
                rewind(course, log, state, islands.member)
                self._tally[islands.member] = 0.0
                first_piece = len(log.particle)
                log, left = self._run(islands, log, met, times, duration)
                unfinished += left
            with self._spent_on("contacts"):
                linked = self._missed(log, first_piece, duration)
            touched = np.union1d(touched, linked.ravel())
            rounds += 1
        done = not len(linked) and (anyhow or not unfinished)
        if done:
            self._book(touched, unfinished)
            with self._spent_on("advance"):
                self._fly_on(duration)
        else:
            rewind(course, log, state, touched)
            self._resting.release()
        self._first_met[met[starts, 0]] = -1
        self._tally[touched] = 0.0
        forget(course, touched)
        return done

    def _where(self, log: Log) -> Where:
        return self._table, self._world, self._constants, self._state, self._course, log

    def _run(self, islands: Islands, log: Log, met: np.ndarray, times: np.ndarray, duration: float) -> tuple[Log, int]:
        """Carry islands through their impacts; the log with the paths, and how many islands were left unfinished."""
        where = self._where(log)[:-1]
        neighbours, count = self._neighbours, len(islands.start) - 1
        arguments = neighbours.start, neighbours.other, met, times, self._first_met, islands.start, islands.member
        with Crew(len(islands.member)) as crew:
            parts = crew.each(
                lambda _, first, last: run_islands(*where, *arguments, duration, self._tally, first, last), count
            )
        log = extended(self._course, log, [piece for piece, _, _ in parts], [whose for _, whose, _ in parts])
        return log, sum(left for _, _, left in parts)

    def _missed(self, log: Log, first_piece: int, duration: float) -> np.ndarray:
        """Pairs (m, 2) of different islands that meet after all, of those whose pieces of path start there."""
        course = self._course
        deflected = np.unique(log.particle[first_piece:])
        on_leash = all_on_leash(
            log.piece, log.particle, self._state, course.clock, course.acceleration,
            self._neighbours.anchor, self._neighbours.leash, self._world.period, duration, first_piece, deflected,
        )  # fmt: skip
        if on_leash:
            return missed_meetings(self._where(log), self._neighbours, deflected, duration)
        # Longer leashes for those that went astray: nobody goes farther than at his greatest speed all the time.
        speed = np.linalg.norm(log.piece[:, 8:11], axis=1) + np.linalg.norm(self._world.gravity) * duration
        np.maximum.at(self._leash, log.particle, 1.1 * speed * duration)
        position = self._state.position.copy()
        moved = np.flatnonzero(course.head >= 0)
        position[moved] = log.piece[course.head[moved], 1:4]
        self._meet_neighbours(position)
        return missed_meetings(self._where(log), self._neighbours, moved, duration)

    def _book(self, touched: np.ndarray, unfinished: int) -> None:
        """Add what the islands tallied, in their order, and what resting contacts bore to the counts."""
        total = self._tally[touched].sum(axis=0)
        self.counts.impacts += int(total[IMPACTS])
        self.counts.virial += float(total[VIRIAL]) + self._resting.virial
        self.counts.wall_impulse += total[WALLS:] + self._resting.wall_impulse
        self.counts.unresolved += unfinished > 0 or self._resting.unresolved

    def _fly_on(self, duration: float) -> None:
        """Bring everyone to the end of the stretch."""
        course, neighbours = self._course, self._neighbours
        count = len(self._constants.mass)
        with Crew(count) as crew:
            times = crew.each(
                lambda _, first, last: fly_on(
                    self._constants, self._state, self._world, course.clock, course.acceleration,
                    neighbours.anchor, neighbours.leash, duration, first, last,
                ),
                count,
            )  # fmt: skip
        self._on_leash = min(times)

    def _look_around(self, duration: float) -> None:
        """Find the neighbours of all, with leashes for a stretch of ``duration``."""
        count = len(self._constants.mass)
        with Crew(count) as crew:
            crew.each(
                lambda _, first, last: leashes(
                    self._constants.radius, self._state.velocity, self._course.acceleration, duration,
                    self._leash, first, last,
                ),
                count,
            )  # fmt: skip
        self._meet_neighbours(self._state.position)

    def _meet_neighbours(self, position: np.ndarray) -> None:
        self._neighbours, tested = find_neighbours(
            position, self._constants.radius, self._leash, self._world.period, self._find_pairs
        )
        self.counts.pairs_tested += int(tested)
        self.counts.candidate_pairs += len(self._neighbours.pairs)


def _time_for(way: float, speed: float, acceleration: float) -> float:
    """How long a way takes from ``speed`` at ``acceleration``; inf without either."""
    denominator = speed + math.sqrt(speed * speed + 2.0 * acceleration * way)
    return 2.0 * way / denominator if denominator > 0.0 else math.inf
