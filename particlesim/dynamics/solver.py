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

from particlesim.core.constants import (
    MAX_ISLAND_ROUNDS,
    MAX_MANIFOLD,
    MAX_SUBSTEP_BISECTIONS,
    MAX_SUBSTEP_DISPLACEMENT,
    SPHERE,
    WALL,
)
from particlesim.core.parallel import ThreadTeam
from particlesim.dynamics.advance import fly_on, paces
from particlesim.dynamics.contact.impact import IMPACTS, TALLY, VIRIAL, WALLS
from particlesim.dynamics.contact.resting import Resting
from particlesim.dynamics.events.collision_prediction import Where, first_meetings, follow_paths, missed_meetings
from particlesim.dynamics.events.event_queue import run_islands
from particlesim.dynamics.events.islands import Islands, add_up, newly_touched, unite
from particlesim.dynamics.events.paths import Log, empty_log, extended, forget, new_course, rewind
from particlesim.dynamics.neighbour_list import FindPairs, find_neighbours, in_order, leashes, pairs_of, places_of
from particlesim.geometry.shape_table import ShapeTable
from particlesim.model.bodies import Constants, State, World

# Particles whose paces are summed at a time: sums depend on the order, and must not on the number of threads.
_ROWS = 4096


# Neighbours are looked up so often before particles get new places: they go far slower than that.
_PLACES_LAST = 16

# To carry an island through its impacts takes as long as other work on so many particles.
_ISLAND = 32

# What the time goes into: finding neighbours, who meets whom, answering impacts, moving on.
PHASES = ("pairs", "contacts", "respond", "advance")


@dataclass
class Counts:
    """What was done since the start."""

    each: np.ndarray  # (n,) int64, impacts of each particle
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
        self._hulls = bool((table.kind[constants.shape] != SPHERE).any())
        self._course = new_course(count, world.gravity)
        self._leash = np.empty(count)
        self._first_met = np.full(count, -1, dtype=np.int64)
        self._tally = np.zeros((count, TALLY if (world.boundary == WALL).any() else WALLS))
        self._resting = Resting(table, world, constants, state)
        self.counts = Counts(np.zeros(count, dtype=np.int64))
        self.seconds = dict.fromkeys(PHASES, 0.0)
        self._ball = np.empty((count, 8))  # by place, what each particle cannot leave in the present stretch
        self._looked = 0  # how often neighbours were looked up
        self._on_leash = -1.0
        self._look_around(0.0)

    @property
    def pairs(self) -> np.ndarray:
        """Pairs of neighbours (m, 2), i < j: nothing else can touch at present."""
        return pairs_of(self._neighbours)

    def longest_stretch(self, fraction: float) -> float:
        """In how long [s] the surfaces move by ``fraction`` of the bounding radius (root mean square); inf if never.

        Where few are fast among many at rest, it is they who meet others. The surface of a particle moves at most
        (|v| + |w| R) t + g t^2 / 2. On periodic axes nothing goes so far that it could meet another image of a
        particle than the nearest.
        """
        count = len(self._constants.mass)
        if not count:
            return math.inf
        sums = np.empty((-(-count // _ROWS), 2))
        of_blocks = ThreadTeam(count).each(
            lambda _, first, last: paces(self._constants, self._state, self._world, sums, _ROWS, first, last), len(sums)
        )
        fastest = max(of_blocks)
        square, pull = sums.sum(axis=0) / count
        time = _time_for(fraction, math.sqrt(square), pull)
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
        parts = max(1, math.ceil(duration / self.longest_stretch(MAX_SUBSTEP_DISPLACEMENT) - 1e-9))
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
                del self._neighbours  # which take as much memory as what it takes to make new ones
                self._look_around(duration)
        if not self._follow(duration, halvings == MAX_SUBSTEP_BISECTIONS):
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
            met, times = first_meetings(
                self._where(log), self._neighbours, self._ball, self._resting.standing, duration
            )
            starts = np.flatnonzero(np.diff(met[:, 0], prepend=-1))
            self._first_met[met[starts, 0]] = starts
        touched = [newly_touched(course.touched, met)]
        linked = met
        rounds = unfinished = 0
        while len(linked) and (anyhow or (rounds < MAX_ISLAND_ROUNDS and not unfinished)):
            with self._spent_on("respond"):
                islands = unite(course, linked)
                rewind(course, log, state, islands.member)
                self._tally[islands.member[islands.start[:-1]]] = 0.0
                first_piece = len(log.particle)
                log, left = self._run(islands, log, met, times, duration)
                unfinished += left
            with self._spent_on("contacts"):
                linked = self._missed(log, islands.member, first_piece, duration, again=rounds > 0)
                touched.append(newly_touched(course.touched, linked))
            rounds += 1
        done = not len(linked) and (anyhow or not unfinished)
        everyone = np.concatenate(touched)
        tallied = add_up(self._tally, course.island, everyone)
        if done:
            self._book(tallied, everyone, unfinished)
            with self._spent_on("advance"):
                self._fly_on(duration)
        else:
            rewind(course, log, state, everyone)
            self._resting.release()
        self._first_met[met[starts, 0]] = -1
        forget(course, everyone)
        return done

    def _where(self, log: Log) -> Where:
        return self._table, self._world, self._constants, self._state, self._course, log

    def _run(self, islands: Islands, log: Log, met: np.ndarray, times: np.ndarray, duration: float) -> tuple[Log, int]:
        """Carry islands through their impacts; the log with the paths, and how many islands were left unfinished."""
        where = self._where(log)[:-1]
        neighbours, count = self._neighbours, len(islands.start) - 1
        meetings = met, times, self._first_met, islands.start, islands.member
        crew = ThreadTeam(_ISLAND * count)
        parts = crew.each(
            lambda _, first, last: run_islands(
                *where, neighbours.lists, *meetings, duration, self._tally, np.empty((MAX_MANIFOLD, 3)), first, last
            ),
            count,
            4 * crew.threads,
        )
        log = extended(self._course, log, [piece for piece, _, _ in parts], [whose for _, whose, _ in parts])
        return log, sum(left for _, _, left in parts)

    def _missed(self, log: Log, members: np.ndarray, first_piece: int, duration: float, again: bool) -> np.ndarray:
        """Pairs (m, 2) of different islands that meet after all, of those whose pieces of path start there.

        They are among the ``members`` of the islands that have just been carried through. Where that was done
        ``again``, some of them may be deflected no more, and meet others on the paths that they are on instead.
        """
        course, where = self._course, self._where(log)
        whom = members if again else members[course.head[members] >= 0]
        if not follow_paths(where, self._neighbours, self._ball, members, duration):
            # Longer leashes for those that went astray: nobody goes farther than at his greatest speed all the time.
            speed = np.linalg.norm(log.piece[:, 8:11], axis=1) + np.linalg.norm(self._world.gravity) * duration
            np.maximum.at(self._leash, log.particle, 1.1 * speed * duration)
            position = self._state.position.copy()
            deflected = np.flatnonzero(course.head >= 0)
            position[deflected] = log.piece[course.head[deflected], 1:4]
            whom = np.union1d(deflected, members)
            del self._neighbours
            self._meet_neighbours(position)
            first_piece = 0
        return missed_meetings(where, self._neighbours, self._ball, whom, first_piece, duration)

    def _book(self, total: np.ndarray, touched: np.ndarray, unfinished: int) -> None:
        """Add what the islands tallied, and what resting contacts bore to the counts."""
        self.counts.each[touched] += self._course.impacts[touched]
        self.counts.impacts += int(total[IMPACTS])
        self.counts.virial += float(total[VIRIAL]) + self._resting.virial
        self.counts.wall_impulse[: len(total) - WALLS] += total[WALLS:]
        self.counts.wall_impulse += self._resting.wall_impulse
        self.counts.unresolved += unfinished > 0 or self._resting.unresolved

    def _fly_on(self, duration: float) -> None:
        """Bring everyone to the end of the stretch."""
        course, neighbours = self._course, self._neighbours
        count = len(self._constants.mass)
        crew = ThreadTeam(count)
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
        crew = ThreadTeam(count)
        crew.each(
            lambda _, first, last: leashes(
                self._constants.radius, self._state.velocity, self._course.acceleration, duration,
                self._leash, first, last,
            ),
            count,
        )  # fmt: skip
        if self._looked % _PLACES_LAST == 0:
            self._places = places_of(self._state.position, self._world.period)
        self._looked += 1
        self._meet_neighbours(self._state.position)

    def _meet_neighbours(self, position: np.ndarray) -> None:
        self._neighbours, tested, candidates = find_neighbours(
            position,
            self._constants.radius,
            self._leash,
            self._world.period,
            self._places,
            self._hulls,
            self._find_pairs,
        )
        if self._world.gravity.any():
            # Resting contacts are gone through in this order.
            in_order(self._neighbours)
        self.counts.pairs_tested += int(tested)
        self.counts.candidate_pairs += candidates


def _time_for(way: float, speed: float, acceleration: float) -> float:
    """How long a way takes from ``speed`` at ``acceleration``; inf without either."""
    denominator = speed + math.sqrt(speed * speed + 2.0 * acceleration * way)
    return 2.0 * way / denominator if denominator > 0.0 else math.inf
