"""The solver: one time step is four verbs, and everything that is struck is struck at its time.

First the impacts on the free paths of all bodies are predicted. Particles that collide are islands, each carried
through its impacts in the order of time, independently of the others. A deflected particle may then collide with one of
another island after all: such islands are joined and carried through once more from the start. When no collision
across islands is left, the result is the one that following all impacts in one order of time would have given, whatever
the order in which the islands were taken and however many threads shared them.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from particlesim.core.parallel import ThreadTeam
from particlesim.dynamics.advance import advance, time_within_skins, typical_speeds
from particlesim.dynamics.ccd.swept_bounds import BOUND
from particlesim.dynamics.ccd.undisturbed import check_work, longest_stretch
from particlesim.dynamics.contact.booking import Borne, columns_needed
from particlesim.dynamics.contact.lasting_islands import forces_of
from particlesim.dynamics.contact.resting import RestingContacts, forget_clearance
from particlesim.dynamics.events.collision_prediction import Predicted, bound_paths, predict, predict_across
from particlesim.dynamics.events.event_queue import run_islands
from particlesim.dynamics.events.islands import Islands, add_up, newly_touched, unite
from particlesim.dynamics.events.paths import Paths, extended, forget, new_clocks, no_segments, rewind, with_room
from particlesim.dynamics.kicks import Kicks
from particlesim.dynamics.neighbour_list import (
    FindPairs,
    NeighbourList,
    Order,
    Spheres,
    find_neighbours,
    order_of,
    pairs_of,
    sort_neighbours,
    write_skins,
)
from particlesim.dynamics.scales import periodic_room, set_tolerances, time_for
from particlesim.dynamics.settings import (
    ASK_AGAIN,
    FEW_IMPACTS,
    ISLAND_COST,
    LASTING_STEP,
    LEAST_PART,
    MAX_IMPACTS,
    MAX_ISLAND_ROUNDS,
    MAX_LASTING_ROUNDS,
    MAX_SUBSTEP_BISECTIONS,
    MAX_SUBSTEP_DISPLACEMENT,
    SEARCHES_PER_SORT,
    STRAYED_SKIN,
)
from particlesim.dynamics.solver_state import Counts, SolverState, nothing_remembered
from particlesim.model.prescribed_motion import changes_within, place_kinematic
from particlesim.model.system import Model

# What the computing time goes into.
PHASES = ("pairs", "contacts", "respond", "advance")


class Solver:
    """Moves the bodies of a model on, changing their records in place.

    Parameters
    ----------
    model : Model
        The bodies and what they are made of; their records are changed.
    find_pairs : callable
        A broad phase: lower and upper corners (n, 3) [m] and periods (3,) [m] to pairs (m, 2) and boxes compared.
    state : SolverState, optional
        To go on from; by default that of a start at time 0.
    """

    def __init__(self, model: Model, find_pairs: FindPairs, state: SolverState | None = None) -> None:
        self._find_pairs = find_pairs
        self.counts = Counts(np.zeros(model.system.particles, dtype=np.int64))
        self.seconds = dict.fromkeys(PHASES, 0.0)
        self.kicks = Kicks()
        self._take(model)
        self.state = self._begin(0.0) if state is None else state

    def _take(self, model: Model) -> None:
        """Make room for the bodies of a model."""
        system = model.system
        self.model, self._system = model, system
        set_tolerances(system)
        self._resting = RestingContacts(system)
        self._clock = new_clocks(len(system.body))
        self._accumulator = np.zeros((system.particles, columns_needed(system)))
        self._friction = system.law if (system.law["friction"] > 0.0).any() else None
        self._bound = np.zeros(system.bounded, dtype=BOUND)  # scratch, by place
        self._segments = no_segments()  # scratch, with room for those of the substeps so far
        self._periodic_room = periodic_room(system)

    def change_particles(self, particles: np.ndarray, origin: np.ndarray) -> None:
        """Let there be other particles from now on; those that stay are held by the forces that they were held by.

        Parameters
        ----------
        particles : (n,) BODY
            Their records.
        origin : (n,) int
            Which of the particles before each of them was, -1 for new ones.
        """
        before, bodies = self.state, len(self._system.body)
        self.counts.each = np.where(origin >= 0, np.append(self.counts.each, 0)[origin], 0).astype(np.int64)
        self._take(self.model.with_particles(particles))
        self.state = self._begin(before.time)
        self.state.remember(before, origin)
        self.state.forces = forces_of(before.forces, origin, bodies, len(self._system.body))

    def _begin(self, now: float) -> SolverState:
        """The state of a start at a time [s]."""
        system, body = self._system, self._system.body
        body["resting"] = body["disturbed"] = body["time"] = 0
        place_kinematic(body, system.motion, now)
        order = order_of(np.ascontiguousarray(body["position"][: system.bounded]), system.domain[0]["period"])
        skin = np.empty(system.bounded)
        self._write_skins(skin, 0.0)
        neighbours = self._search(body["position"], skin, order)
        state = SolverState(now, order, 1, skin, -1.0, neighbours, *nothing_remembered(system, self._resting.known))
        forget_clearance(state, neighbours)
        return state

    @property
    def pairs(self) -> np.ndarray:
        """Pairs of neighbours (m, 2), i < j: no other bounded bodies can touch at present."""
        return pairs_of(self.state.neighbours)

    def longest_substep(self, displacement: float) -> float:
        """In how long [s] surfaces move by ``displacement`` of the bounding radius (root mean square); inf if never.

        Where few are fast among many at rest, it is they that strike others. The surface of a particle moves at most
        (|v| + |w| R) t + g t^2 / 2. On periodic axes nothing goes so far that it could touch another image of a body
        than the nearest.
        """
        system = self._system
        if not system.particles:
            return math.inf
        speed, falls, fastest = typical_speeds(system)
        lasting = self._resting.longest_substep(self.state, self.kicks.there_are(self.model))
        longest = min(time_for(displacement, speed, falls), lasting)
        if self._periodic_room == math.inf:
            return longest
        return min(longest, time_for(self._periodic_room, fastest, float(np.linalg.norm(system.domain[0]["gravity"]))))

    def longest_step(self, displacement: float, most: float) -> float:
        """As ``longest_substep``, or for how long nothing touches anything if that is far longer, up to ``most``."""
        longest = self.longest_substep(displacement)
        return min(max(longest, self._longest_stretch(longest, most)), most)

    def _longest_stretch(self, substep: float, wanted: float) -> float:
        return 0.0 if self.kicks.there_are(self.model) else longest_stretch(self._system, substep, wanted)

    def step(self, duration: float) -> None:
        """Move all bodies on by ``duration`` [s], from one change of an obstacle's motion to the next.

        Where nothing touches anything for many substeps they go in one stretch. ValueError for too many of them.
        """
        begin = self.state.time
        if len(self._system.motion):
            self._place_obstacles()
        for change in changes_within(self._system.motion, begin, begin + duration):
            self._go_on(change - self.state.time)
            self.state.time = change
            self._place_obstacles()
        self._go_on(duration - (self.state.time - begin))

    def _place_obstacles(self) -> None:
        """Let obstacles move as they do from now on."""
        state, system = self.state, self._system
        place_kinematic(system.body[system.particles :], system.motion, state.time)
        still = time_within_skins(system, state.neighbours.reference, system.particles, system.bounded)
        state.time_within_skins = min(state.time_within_skins, still)

    def _go_on(self, duration: float) -> None:
        """Move all bodies on by ``duration`` [s], in equal substeps or freely; after some it is asked again which."""
        while duration > 0.0:
            longest = self.longest_substep(MAX_SUBSTEP_DISPLACEMENT)
            stretch = self._longest_stretch(longest, duration)
            check_work(duration, max(longest, stretch))
            if stretch > 0.0:
                with self._spent_on("advance"):
                    self._disturbed = np.zeros(0, dtype=np.int64)
                    self._advance(stretch)
                duration -= stretch
                continue
            parts = max(1, math.ceil(duration / longest - 1e-9))
            part = duration / parts
            for _ in range(min(parts, ASK_AGAIN)):
                self._kick(0.5 * part, backwards=False)
                self._substep(part)
                self._kick(0.5 * part, backwards=True)
            duration *= max(parts - ASK_AGAIN, 0) / parts

    def _kick(self, duration: float, backwards: bool) -> None:
        """Let fields and other forces act on all particles in place (see kicks.py)."""
        if not self.kicks.there_are(self.model):
            return
        system, state = self._system, self.state
        work, acceleration = self.kicks.act(self.model, duration, backwards)
        self.counts.work += work
        if not backwards:
            self._resting.let_fields_act(acceleration, state.time + duration)
        state.time_within_skins = time_within_skins(system, state.neighbours.reference, 0, system.bounded)

    @contextmanager
    def _spent_on(self, phase: str) -> Iterator[None]:
        begun = time.perf_counter()
        yield
        self.seconds[phase] += time.perf_counter() - begun

    # ---- the four verbs ----------------------------------------------------------------------------------------------

    def _substep(self, duration: float, bisections: int = 0, again: int = 0) -> None:
        with self._spent_on("pairs"):
            self._find_pairs_for(duration)
        if self._respond(duration, anyhow=bisections >= MAX_SUBSTEP_BISECTIONS, again=again):
            with self._spent_on("advance"):
                self._advance(duration)
        elif self._resting.foreseen and self._resting.loses and duration <= LASTING_STEP and again < MAX_LASTING_ROUNDS:
            # What meets over and over is in lasting contact from then on.
            often, until = self._often, self._until
            if until > 0.0:
                self._substep(until, bisections, again + 1)
            self.state.lasting[often] = 1
            self._substep(duration - until, bisections, again + 1)
        else:
            # Too much hangs together, or happens, or meets unforeseen: less does in half the time.
            self._substep(0.5 * duration, bisections + 1, again)
            self._substep(0.5 * duration, bisections + 1, again)

    def _find_pairs_for(self, duration: float) -> None:
        """Search neighbours anew if any body may leave its skin within ``duration`` [s]."""
        state, system = self.state, self._system
        if duration <= state.time_within_skins:
            return
        self._write_skins(state.skin, duration)
        if state.searches % SEARCHES_PER_SORT == 0:
            position = np.ascontiguousarray(system.body["position"][: system.bounded])
            state.order = order_of(position, system.domain[0]["period"])
        state.searches += 1
        self._renew_neighbours(system.body["position"])

    def _find_contacts(self, paths: Paths, duration: float) -> Predicted:
        """The first impacts on the free paths of all bodies."""
        state = self.state
        return predict(self._system, paths, state.neighbours, self._bound, state.standing, duration)

    def _respond(self, duration: float, anyhow: bool, again: int) -> bool:
        """Carry all that is struck through its impacts; False, with nothing else changed, if it is too much.

        Then it is known what met over and over, and until when it did not, unless that was tried ``again`` and again.
        """
        system, clock, state = self._system, self._clock, self.state
        paths = Paths(clock, no_segments())
        with self._spent_on("respond"):
            borne = self._resting.carry(state, duration)
        if not (self._resting.foreseen or anyhow):
            self._resting.release(state)
            return False
        with self._spent_on("contacts"):
            predicted = self._find_contacts(paths, duration)
        few = self._resting.loses and again < MAX_LASTING_ROUNDS
        anyhow = anyhow and not few
        linked, touched = predicted.pair, [newly_touched(clock, predicted.pair, system.particles)]
        rounds = unfinished = 0
        while len(linked) and (anyhow or (rounds < MAX_ISLAND_ROUNDS and not unfinished)):
            with self._spent_on("respond"):
                islands = unite(clock, linked, system.particles)
                rewind(paths, system.body, islands.member)
                self._accumulator[islands.member[islands.start[:-1]]] = 0.0
                first_segment = len(paths.segment)
                paths, left, until = self._run(islands, paths, predicted, duration, FEW_IMPACTS if few else MAX_IMPACTS)
                unfinished += left
            with self._spent_on("contacts"):
                linked = self._predict_across(paths, islands.member, first_segment, duration, again=rounds > 0)
                touched.append(newly_touched(clock, linked, system.particles))
            rounds += 1
        disturbed = np.concatenate(touched)
        done = not len(linked) and (anyhow or not unfinished)
        total = add_up(self._accumulator, clock, disturbed)
        if done:
            self._book(total, disturbed, borne, unfinished)
        else:
            self._often = disturbed[clock["stamp"][disturbed] >= FEW_IMPACTS]
            self._until = until if LEAST_PART * duration < until < duration else 0.0
            rewind(paths, system.body, disturbed)
            self._resting.release(state)
            forget(clock, system.body, disturbed)
        self._disturbed = disturbed
        return done

    def _advance(self, duration: float) -> None:
        """Bring every body to the end of the substep."""
        state, system = self.state, self._system
        state.time += duration
        times = ThreadTeam(system.particles).each(
            lambda _, first, last: advance(system, state.neighbours.reference, duration, first, last),
            system.particles,
        )
        place_kinematic(system.body[system.particles :], system.motion, state.time)
        first = system.particles
        if self._resting.carried:
            self.counts.bear(self._resting.finish(state))
            first = 0
        times.append(time_within_skins(system, state.neighbours.reference, first, system.bounded))
        state.time_within_skins = min(times)
        forget(self._clock, system.body, self._disturbed)

    # ---- neighbours --------------------------------------------------------------------------------------------------

    def _write_skins(self, skin: np.ndarray, duration: float) -> None:
        system = self._system
        ThreadTeam(len(skin)).each(lambda _, first, last: write_skins(system, duration, skin, first, last), len(skin))

    def _search(self, position: np.ndarray, skin: np.ndarray, order: Order) -> NeighbourList:
        """The neighbour list of bodies at ``position`` (n, 3)."""
        system = self._system
        count, domain = system.bounded, system.domain[0]
        spheres = Spheres(
            np.ascontiguousarray(position[:count]),
            np.ascontiguousarray(system.body["radius"][:count]),
            skin,
            system.particles,
        )
        neighbours, tested, candidates = find_neighbours(
            spheres, domain["period"], order, self.model.has_polyhedra, self._find_pairs
        )
        if self._resting.known:
            # Lasting contacts are gone through in this order.
            sort_neighbours(neighbours)
        self.counts.pairs_tested += int(tested)
        self.counts.candidate_pairs += candidates
        return neighbours

    def _renew_neighbours(self, position: np.ndarray) -> None:
        state = self.state
        del state.neighbours  # which takes as much memory as what it takes to make a new one
        state.neighbours = self._search(position, state.skin, state.order)
        forget_clearance(state, state.neighbours)

    # ---- islands -----------------------------------------------------------------------------------------------------

    def _run(
        self, islands: Islands, paths: Paths, predicted: Predicted, duration: float, most: int
    ) -> tuple[Paths, int, float]:
        """Carry islands through their impacts, so many a member.

        Returns the paths, how many islands were left unfinished, and when the first had half of its impacts [s].
        """
        system, neighbours, count = self._system, self.state.neighbours, len(islands.start) - 1
        team = ThreadTeam(ISLAND_COST * count)
        accumulator, limits = self._accumulator, (most, self._friction)
        parts = team.each(
            lambda _, first, last: run_islands(
                system, paths.clock, neighbours, predicted, islands, duration, accumulator, (first, last, *limits)
            ),
            count,
            4 * team.threads,
        )
        segments = [segments for segments, _, _ in parts]
        self._segments = with_room(self._segments, len(paths.segment), sum(map(len, segments)))
        unfinished, until = sum(left for _, left, _ in parts), min(until for _, _, until in parts)
        return extended(paths, segments, self._segments), unfinished, until

    def _predict_across(
        self, paths: Paths, members: np.ndarray, first_segment: int, duration: float, again: bool
    ) -> np.ndarray:
        """Pairs (m, 2) of different islands that collide after all, of those whose path segments start there.

        They are among the ``members`` of the islands that have just been carried through. Where that was done
        ``again``, some of them may be deflected no more, and collide with others on the paths that they are on instead.
        """
        state, system, clock = self.state, self._system, self._clock
        indices = members if again else members[clock["first_segment"][members] >= 0]
        if not bound_paths(system, paths, state.neighbours, self._bound, members, duration):
            # Wider skins for those that strayed: none goes farther than at its greatest speed all the time.
            segment = paths.segment
            speed = np.linalg.norm(segment["velocity"], axis=1)
            speed += np.linalg.norm(system.domain[0]["gravity"]) * duration
            np.maximum.at(state.skin, segment["particle"], STRAYED_SKIN * speed * duration)
            position = system.body["position"].copy()
            deflected = np.flatnonzero(clock["first_segment"] >= 0)
            position[deflected] = segment["position"][clock["first_segment"][deflected]]
            indices = np.union1d(deflected, members)
            self._renew_neighbours(position)
            first_segment = 0
        moved = indices, first_segment
        return predict_across(system, paths, state.neighbours, self._bound, moved, duration)

    def _book(self, total: np.ndarray, disturbed: np.ndarray, borne: Borne, unfinished: int) -> None:
        """Add what the islands accumulated, and what resting contacts bore, to the counts."""
        self.counts.each[disturbed] += self._clock["impacts"][disturbed]
        self.counts.add(total, borne)
        self.counts.unresolved += unfinished > 0 or borne.unresolved
