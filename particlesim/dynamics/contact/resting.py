"""Lasting contacts: what is pressed together, or meets over and over, does not fall, sink or tremble.

A ball that bounces with restitution below 1 makes infinitely many bounces in a finite time. They end here: what hardly
moves against an obstacle that gravity presses it against, what had too many impacts in a step, and all that is near
it, is taken together for a whole step (see island_step.py).
"""

from __future__ import annotations

from functools import partial

import numpy as np

from particlesim.core.parallel import ThreadTeam
from particlesim.dynamics.contact.booking import NOTHING_BORNE, Borne
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
from particlesim.dynamics.contact.lasting_islands import forces_after, gathered, warm_start
from particlesim.dynamics.contact.position_correction import place_obstacles_ahead
from particlesim.dynamics.neighbour_list import NeighbourList
from particlesim.dynamics.settings import (
    CHANGE_MARGIN,
    CORRECTED_DEPTH,
    LASTING_STEP,
    MAX_CONTACT_SEARCHES,
    PAIR_COST,
    RESTING_SUBSTEPS,
    SPEED_GAIN,
    UNRESOLVED_VELOCITY,
)
from particlesim.dynamics.solver_state import SolverState
from particlesim.dynamics.standing import LOOSE, SETTLES
from particlesim.model.bodies import angular_velocities
from particlesim.model.system import System


class RestingContacts:
    """Carries what is in lasting contact, changing the records of the bodies and a ``state`` in place."""

    def __init__(self, system: System) -> None:
        self._system = system
        self._pull = float(np.linalg.norm(system.domain[0]["gravity"]))  # the largest [m/s^2]
        self.loses = bool(system.law["restitution"].min(initial=1.0) < 1.0)
        self.known = self._pull > 0.0 or self.loses
        self._mover = np.zeros(len(system.body) if self.known else 0, dtype=MOVER)
        self._mover["pull"] = system.domain[0]["gravity"]
        self._fields_until = 0.0
        self._inradius = float(system.body["inradius"][: system.particles].min(initial=np.inf))  # the smallest [m]
        self._ahead = np.zeros_like(self._system.body[: len(self._mover)])  # scratch: at the end of the step
        self._member = np.empty(0, dtype=np.int64)
        self._before = system.body[:0]

    def longest_substep(self, state: SolverState, fields: bool) -> float:
        """How long a substep may be [s] with what is in lasting contact, or soon may be; whether there are fields."""
        return LASTING_STEP if self.loses and (self._pull > 0.0 or fields or state.lasting.any()) else np.inf

    def let_fields_act(self, acceleration: np.ndarray, until: float) -> None:
        """Say what fields do to particles (n, 3) [m/s^2], and until when the velocities have it [s]."""
        if self.known:
            pulls = self._system.domain[0]["gravity"] + acceleration
            self._mover["pull"][: len(pulls)] = pulls
            self._pull = float(np.linalg.norm(pulls, axis=1).max(initial=0.0))
            self._fields_until = until

    def carry(self, state: SolverState, duration: float) -> Borne:
        """Carry what is in lasting contact through a substep of ``duration`` [s]: its velocity changes."""
        self._member = self._member[:0]
        state.standing[:] = 0
        if not self.known:
            return NOTHING_BORNE
        system, body, neighbours = self._system, self._system.body, state.neighbours
        body["resting"][: system.particles] = 0
        spin = angular_velocities(body, len(body))
        change = expected_changes(system, neighbours, spin, duration, SPEED_GAIN * self._pull * duration)
        seeds = self._seeds(state, Motion(spin, change, duration), self._fields_until - state.time)
        if not len(seeds):
            return NOTHING_BORNE
        add_displacements(system, state.seen, state.displacement)
        write_obstacles(body, self._mover, system.particles)
        place_obstacles_ahead(system, duration, self._ahead)
        for attempt in range(1, MAX_CONTACT_SEARCHES + 1):
            motion = Motion(spin, change, duration)
            search = new_search(state, len(body))
            points, terms = self._contacts(neighbours, motion, search, seeds)
            islands = gathered(points, terms, seeds, system.particles)
            warm_start(islands, state.forces, len(body))
            left = self._step(islands, duration, self._fields_until - state.time)
            carried = np.arange(len(body)) >= system.particles
            carried[islands.member] = True
            foreseen = not unforeseen(system, neighbours, motion, search, self._ahead, carried)
            if foreseen or attempt == MAX_CONTACT_SEARCHES:
                break
            found = changes_ahead(system, spin, duration, islands.member, self._ahead)
            change = np.maximum(CHANGE_MARGIN * change, CHANGE_MARGIN * found)
        self._take_over(islands.member)
        state.standing[islands.member] = np.where(search.loose[islands.member] > 0, LOOSE, SETTLES)
        state.standing[system.particles :] = SETTLES
        state.forces = forces_after(islands, len(body))
        self._mark_lasting(state, islands)
        # What is less does not sink in by more than is corrected.
        counts = max(self._pull * duration, CORRECTED_DEPTH * self._inradius * RESTING_SUBSTEPS / duration)
        return self._borne(islands, not foreseen or left > UNRESOLVED_VELOCITY * counts)

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
        return np.concatenate([p for p, _ in parts]), np.concatenate([t for _, t in parts])

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

    def finish(self) -> None:
        """Put what was carried where it is at the end of the substep, after it has gone on at its velocity."""
        if len(self._member):
            finish(self._system, self._member, self._ahead)

    @property
    def carried(self) -> bool:
        """Whether anything was."""
        return len(self._member) > 0

    def release(self) -> None:
        """Undo what the last ``carry`` did to the bodies."""
        if not self.carried:
            return
        for name in ("velocity", "angular_momentum"):
            self._system.body[name][self._member] = self._before[name]
        self._system.body["resting"][self._member] = 0
        self._member = self._member[:0]

    def _mark_lasting(self, state: SolverState, islands: Islands) -> None:
        """Particles that were pushed by what does not rebound in full are in lasting contact."""
        pushed = (islands.terms["pushed"] > 0.0) & (islands.terms["restitution"] < 1.0)
        state.lasting[:] = 0
        for end in ("a", "b"):
            indices = islands.points[end][pushed]
            state.lasting[indices[indices < self._system.particles]] = 1

    def _borne(self, islands: Islands, unresolved: bool) -> Borne:
        """What the contacts bore."""
        points, impulse = islands.points, islands.terms["impulse"]
        along = (points["normal"] * impulse).sum(axis=1)
        wall = self._system.body["wall"][points["b"]]
        on_wall, on_particle = wall >= 0, points["b"] < self._system.particles
        shear = np.zeros((6, 3))
        np.add.at(shear, wall[on_wall], (impulse - along[:, None] * points["normal"])[on_wall])
        return Borne(
            np.bincount(wall[on_wall], along[on_wall], minlength=6),
            shear,
            float(((points["arm_a"] - points["arm_b"]) * impulse)[on_particle].sum()),
            islands.lost.sum(axis=0),
            float(islands.work.sum()),
            unresolved,
        )


def forget_clearance(state: SolverState, neighbours: NeighbourList) -> None:
    """Nothing is known yet of how far apart new neighbours are."""
    state.clearance = np.full(len(neighbours.other) if len(state.seen) else 0, -np.inf)
