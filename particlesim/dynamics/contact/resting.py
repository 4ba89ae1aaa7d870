"""Lasting contacts: what is pressed together, or meets over and over, does not fall, sink or tremble.

A ball that bounces with restitution below 1 makes infinitely many bounces in a finite time. They end here: what hardly
moves against an obstacle that gravity presses it against, what had too many impacts in a step, and all that is near
it, is taken together for a whole step (see island_step.py).
"""

from __future__ import annotations

from functools import partial

import numpy as np

from particlesim.core.parallel import ThreadTeam
from particlesim.dynamics.contact.booking import NOTHING_BORNE, Borne, together
from particlesim.dynamics.contact.clearance import add_displacements, changes_ahead, expected_changes
from particlesim.dynamics.contact.cone_solver import MOVER
from particlesim.dynamics.contact.foreseen import unforeseen
from particlesim.dynamics.contact.island_step import (
    Islands,
    finish,
    step_islands,
    take_over,
    write_obstacles,
)
from particlesim.dynamics.contact.lasting_contacts import Motion, Search, contacts_of, new_search, resting_on_obstacles
from particlesim.dynamics.contact.lasting_islands import (
    borne_impulses,
    forces_after,
    gathered,
    joined,
    mean_forces,
    warm_start,
)
from particlesim.dynamics.contact.position_correction import place_obstacles_ahead
from particlesim.dynamics.contact.sleep import (
    borne_asleep,
    disturbed,
    fall_asleep,
    held_bodies,
    kept_forces,
    note_still,
    unbalanced,
    wake,
)
from particlesim.dynamics.neighbour_list import NeighbourList
from particlesim.dynamics.settings import (
    CHANGE_MARGIN,
    CORRECTED_DEPTH,
    LASTING_STEP,
    MAX_CONTACT_SEARCHES,
    PAIR_COST,
    RESTING_SUBSTEPS,
    SLEEP_SPEED,
    SPEED_GAIN,
    UNRESOLVED_VELOCITY,
    WAKE_AT_ONCE,
    WAKE_BALANCE,
)
from particlesim.dynamics.solver_state import SolverState
from particlesim.dynamics.standing import LOOSE, SETTLES
from particlesim.model.bodies import angular_velocities
from particlesim.model.system import System


class RestingContacts:
    """Carries what is in lasting contact, changing the records of the bodies and a ``state`` in place."""

    def __init__(self, system: System) -> None:
        self._system = system
        self._pull = float(np.linalg.norm(system.domain["gravity"]))  # the largest [m/s^2]
        self.loses = bool(system.law["restitution"].min(initial=1.0) < 1.0)
        self.known = self._pull > 0.0 or self.loses
        self._mover = np.zeros(len(system.body) if self.known else 0, dtype=MOVER)
        self._mover["pull"] = system.domain[0]["gravity"]
        self._fields = False  # whether anything but gravity acts: then nothing sleeps
        self._fields_until = 0.0
        self._inradius = float(system.body["inradius"][: system.particles].min(initial=np.inf))  # the smallest [m]
        self._ahead = np.zeros_like(self._system.body[: len(self._mover)])  # scratch: at the end of the step
        self._member = np.empty(0, dtype=np.int64)
        self._before = system.body[:0]
        self.foreseen = True  # whether nothing met unforeseen in the last substep

    def longest_substep(self, state: SolverState, fields: bool) -> float:
        """How long a substep may be [s] with what is in lasting contact, or soon may be; whether there are fields."""
        return LASTING_STEP if self.loses and (self._pull > 0.0 or fields or state.lasting.any()) else np.inf

    def let_fields_act(self, acceleration: np.ndarray, until: float) -> None:
        """Say what fields do to particles (n, 3) [m/s^2], and until when the velocities have it [s]."""
        if self.known:
            self._set_pulls(self._system.domain["gravity"] + acceleration)
            self._fields, self._fields_until = True, until

    def _set_pulls(self, pulls: np.ndarray) -> None:
        """Take over accelerations of particles (n, 3), or of all (1, 3) [m/s^2]."""
        self._mover["pull"][: self._system.particles] = pulls
        self._pull = float(np.linalg.norm(pulls, axis=1).max(initial=0.0))

    def carry(self, state: SolverState, duration: float) -> Borne:
        """Carry what is in lasting contact through a substep of ``duration`` [s]: its velocity changes."""
        self._member, self.foreseen = self._member[:0], True
        self._known_before = state.forces, state.lasting.copy()
        state.standing[:] = 0
        if not self.known:
            return NOTHING_BORNE
        system, body = self._system, self._system.body
        if not self._fields:
            self._set_pulls(system.domain["gravity"])
        body["resting"][: system.particles] = 0
        if state.asleep.any():
            woken = state.asleep if self._fields else disturbed(system, state)
            wake(state, woken, 0, len(body))
        motion = self._motion(state, duration)
        seeds = self._seeds(state, motion, self._fields_until - state.time)
        if not len(seeds):
            return NOTHING_BORNE
        add_displacements(system, state.seen, state.displacement)
        note_still(system, state)
        islands, search, woken, unresolved = self._solve(state, motion, seeds)
        body["resting"][: system.particles] = state.asleep
        self._take_over(islands.member)
        state.standing[islands.member] = np.where(search.loose[islands.member] > 0, LOOSE, SETTLES)
        state.standing[: system.particles][state.asleep] = SETTLES
        state.standing[system.particles :] = SETTLES
        self._mark_lasting(state, islands)
        on_sleepers = islands.terms["impulse"][self._presses(state, islands.points)].sum(axis=0)
        borne = together(self._borne(islands, unresolved), borne_asleep(system, state, on_sleepers, duration))
        wake(state, woken, 0, len(body))
        return borne

    def _motion(self, state: SolverState, duration: float) -> Motion:
        """How bodies move at the start of a step, and by how much that may change."""
        system, held = self._system, held_bodies(self._system, state.asleep)
        spin = angular_velocities(system.body, len(system.body))
        gain = SPEED_GAIN * self._pull * duration
        return Motion(spin, expected_changes(system, state.neighbours, spin, held, duration, gain), held, duration)

    def _solve(self, state: SolverState, motion: Motion, seeds: np.ndarray) -> tuple[Islands, Search, np.ndarray, bool]:
        """Take islands through a step, until nothing meets unforeseen, and none that sleeps should wake at once.

        Returns which particles the step wakes (n,), and whether something was left undone, too.
        """
        system, neighbours, bodies, duration = self._system, state.neighbours, len(self._mover), motion.duration
        write_obstacles(system.body, self._mover, state.asleep)
        place_obstacles_ahead(system, state.asleep, duration, self._ahead)
        searches = wakes = 0
        while True:
            search = new_search(state, bodies)
            points, terms = self._contacts(neighbours, motion, search, seeds)
            woken = self._struck(state, points, terms)
            if not woken.any():
                islands = gathered(points, terms, seeds, state.asleep)
                warm_start(islands, state.forces, bodies)
                left = self._step(islands, duration, self._fields_until - state.time)
                kept = kept_forces(state.forces, motion.held)
                means = joined([kept, mean_forces(islands, bodies, duration)])
                woken = unbalanced(system, means, motion.held, state.asleep, (WAKE_AT_ONCE, np.inf))
            if woken.any():
                wake(state, woken, wakes, bodies)
                wakes, motion = wakes + 1, self._motion(state, duration)
                continue
            searches += 1
            carried = motion.held.copy()
            carried[system.particles :] = carried[islands.member] = True
            self.foreseen = not unforeseen(system, neighbours, motion, search, self._ahead, carried)
            if self.foreseen or searches == MAX_CONTACT_SEARCHES:
                break
            found = changes_ahead(system, motion.spin, duration, islands.member, self._ahead)
            motion = motion._replace(change=np.maximum(CHANGE_MARGIN * motion.change, CHANGE_MARGIN * found))
        state.forces = joined([kept, forces_after(islands, bodies)])
        # What is less does not sink in by more than is corrected.
        counts = max(self._pull * duration, CORRECTED_DEPTH * self._inradius * RESTING_SUBSTEPS / duration)
        woken = unbalanced(system, means, motion.held, state.asleep, (WAKE_BALANCE, SLEEP_SPEED))
        return islands, search, woken, not self.foreseen or left > UNRESOLVED_VELOCITY * counts

    def _presses(self, state: SolverState, points: np.ndarray) -> np.ndarray:
        """Which contact points (m,) are on sleepers."""
        presses = points["b"] < self._system.particles
        presses[presses] = state.asleep[points["b"][presses]]
        return presses

    def _struck(self, state: SolverState, points: np.ndarray, terms: np.ndarray) -> np.ndarray:
        """Sleepers that something meets fast, or an obstacle that moves, (n,) bool."""
        struck = np.zeros(len(state.asleep), dtype=np.bool_)
        fast = self._presses(state, points) & (terms["approach"] < -terms["threshold"])
        struck[points["b"][fast]] = struck[points["a"]] = True
        return struck & state.asleep

    def _seeds(self, state: SolverState, motion: Motion, until_fields: float) -> np.ndarray:
        """Particles that are in lasting contact to begin with, (k,)."""
        system, near, pulled = self._system, state.neighbours, (self._mover["pull"], until_fields)
        rests = state.lasting.astype(np.bool_)
        if self._pull > 0.0:
            ThreadTeam(system.particles).each(
                lambda _, first, last: resting_on_obstacles(system, near, motion, pulled, rests, first, last),
                system.particles,
            )
        return np.flatnonzero(rests)

    def _contacts(
        self, neighbours: NeighbourList, motion: Motion, search: Search, seeds: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Contact points of all that may come to touch the seeds, and their terms."""
        system = self._system
        parts: list[tuple[np.ndarray, np.ndarray]] = []
        indices, number = seeds, 0
        while len(indices):
            search.round[indices] = number
            team = ThreadTeam(PAIR_COST * len(indices))
            found = team.each(partial(self._contacts_in_round, neighbours, motion, search, indices), len(indices))
            parts += found
            ends = np.concatenate([part[0][end] for part in found for end in ("a", "b")])
            ends = ends[ends < system.particles]
            indices = np.unique(ends[search.round[ends] < 0]).astype(np.int64)
            number += 1
        return joined([p for p, _ in parts]), joined([t for _, t in parts])

    def _contacts_in_round(
        self,
        neighbours: NeighbourList,
        motion: Motion,
        search: Search,
        indices: np.ndarray,
        _: int,
        first: int,
        last: int,
    ) -> tuple[np.ndarray, np.ndarray]:
        return contacts_of(self._system, neighbours, motion, search, indices, first, last)

    def _step(self, islands: Islands, duration: float, until_fields: float) -> float:
        """Take islands through a step; the largest velocity that their last sweeps changed anything by [m/s]."""
        system, interval = self._system, (duration, until_fields)
        team = ThreadTeam(PAIR_COST * len(islands.points))
        left = team.each(
            lambda _, first, last: step_islands(system, islands, self._mover, interval, self._ahead, first, last),
            len(islands.first_point) - 1,
            4 * team.threads,
        )
        return max(left)

    def _take_over(self, member: np.ndarray) -> None:
        """Let particles (k,) go on as they move at the end of the step."""
        body = self._system.body
        self._member = member
        self._before = body[["velocity", "angular_momentum"]][member]
        take_over(body, member, self._ahead)

    def finish(self, state: SolverState) -> Borne:
        """Put what was carried where it is at the end of the substep, after it has gone on at its velocity.

        What has been still for long falls asleep; returns what that took.
        """
        finish(self._system, self._member, self._ahead)
        if self._fields:
            return NOTHING_BORNE
        asleep, borne = fall_asleep(self._system, state, self._member)
        if asleep.any():
            add_displacements(self._system, state.seen, state.displacement)
        return borne

    @property
    def carried(self) -> bool:
        """Whether anything was."""
        return len(self._member) > 0

    def release(self, state: SolverState) -> None:
        """Undo what the last ``carry`` did to the bodies, and to what is known of their contacts."""
        state.forces, state.lasting = self._known_before
        if not self.carried:
            return
        for name in ("velocity", "angular_momentum"):
            self._system.body[name][self._member] = self._before[name]
        self._system.body["resting"][self._member] = 0
        self._member = self._member[:0]

    def _mark_lasting(self, state: SolverState, islands: Islands) -> None:
        """Particles that were pushed by what does not rebound in full are in lasting contact."""
        pushed = (islands.terms["pushed"] > 0.0) & (islands.terms["restitution"] < 1.0)
        state.lasting[:] = state.asleep
        for end in ("a", "b"):
            indices = islands.points[end][pushed]
            state.lasting[indices[indices < self._system.particles]] = 1

    def _borne(self, islands: Islands, unresolved: bool) -> Borne:
        """What the contacts bore."""
        wall, shear, virial = borne_impulses(self._system, islands.points, islands.terms)
        return Borne(wall, shear, virial, islands.lost.sum(axis=0), float(islands.work.sum()), unresolved)


def forget_clearance(state: SolverState, neighbours: NeighbourList) -> None:
    """Nothing is known yet of how far apart new neighbours are."""
    state.clearance = np.full(len(neighbours.other) if len(state.seen) else 0, -np.inf)
