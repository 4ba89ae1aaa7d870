"""Resting contacts: what gravity presses together does not fall, sink or tremble.

A ball that bounces with restitution below 1 makes infinitely many bounces in a finite time. They end here: what hardly
moves against an obstacle that gravity presses it against, and all that is near it (see active_set.py), is taken
together for a whole substep (see projected_solver.py).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from particlesim.dynamics.contact.active_set import add_displacements, expected_speeds, find_active_set, surface_speeds
from particlesim.dynamics.contact.contact_points import Motion, handed_down
from particlesim.dynamics.contact.end_of_step_correction import place_ahead, sunk_points
from particlesim.dynamics.contact.projected_solver import settle
from particlesim.dynamics.neighbour_list import NeighbourList
from particlesim.dynamics.settings import (
    MAX_ACTIVE_SET_SEARCHES,
    MAX_CORRECTIONS,
    RESTING_DISPLACEMENT,
    RESTITUTION_THRESHOLD_HEIGHT,
    SHORTEST_RESTING_SUBSTEP,
    SPEED_GAIN,
    SPEED_MARGIN,
)
from particlesim.dynamics.solver_state import FORCE, SolverState
from particlesim.model.bodies import angular_velocities
from particlesim.model.system import System


class ClearanceMemory(NamedTuple):
    """What is remembered of how near bodies are (see find_active_set)."""

    standing: np.ndarray  # (n,) int64
    displacement: np.ndarray  # (n,) [m]
    clearance: np.ndarray  # beside ``neighbours.other`` [m]


class _Settled(NamedTuple):
    """Contact points and what goes through them in a substep."""

    point: np.ndarray  # (m,) CONTACT_POINT
    impulse: np.ndarray  # (m,) [N s]
    steady: np.ndarray  # (m,) without what makes points part again [N s]
    spin: np.ndarray  # (n, 3) angular velocities with these impulses [rad/s]
    done: bool  # whether the impulses are good enough


class Borne(NamedTuple):
    """What resting contacts bore in a substep."""

    wall_impulse: np.ndarray  # (6,) [N s]
    virial: float  # [J s]
    unresolved: bool  # whether the bound on the work was reached


NOTHING_BORNE = Borne(np.zeros(6), 0.0, False)


class RestingContacts:
    """Carries what rests, one substep after the other, changing the records of the bodies and a ``state`` in place."""

    def __init__(self, system: System) -> None:
        self._system = system
        particles = system.body[: system.particles]
        self._gravity = float(np.linalg.norm(system.domain[0]["gravity"]))
        self._inradius = float(particles["inradius"].mean()) if len(particles) else 0.0
        self._last_bounces = self._time_of_last_bounces()
        self._ahead = system.body.copy() if self._gravity else system.body[:0]
        self._before = particles[:0]

    def _time_of_last_bounces(self) -> float:
        """What bounces to rest has done so after this time [s], in which it must be looked at; inf if nothing does."""
        lossless = self._system.law["restitution"].min(initial=1.0) == 1.0
        if self._gravity == 0.0 or lossless or not self._system.particles:
            return np.inf
        height = RESTITUTION_THRESHOLD_HEIGHT * self._inradius
        return 0.5 * float(np.sqrt(2.0 * height / self._gravity))

    @property
    def _resting(self) -> np.ndarray:
        """Which particles rest, (k,)."""
        return np.flatnonzero(self._system.body["resting"][: self._system.particles])

    def longest_substep(self, state: SolverState) -> float:
        """How long a substep may be [s]: not so long that what came to rest were not looked at."""
        if self._gravity == 0.0 or not len(self._resting):
            return self._last_bounces
        in_time = RESTING_DISPLACEMENT * self._inradius / max(state.pressed_speed, 1e-300)
        return min(max(in_time, SHORTEST_RESTING_SUBSTEP * self._last_bounces), self._last_bounces)

    def carry(self, state: SolverState, duration: float) -> Borne:
        """Carry what rests through a substep of ``duration`` [s]: its velocity changes and it does not fall."""
        if self._gravity == 0.0:
            return NOTHING_BORNE
        system, body, neighbours = self._system, self._system.body, state.neighbours
        self._let_fall(self._resting)
        add_displacements(system, state.seen, state.displacement)
        memory = ClearanceMemory(state.standing, state.displacement, state.clearance)
        spin = angular_velocities(body, len(body))
        gain = SPEED_GAIN * self._gravity * duration
        speed = expected_speeds(surface_speeds(body, spin, system.bounded), neighbours, gain)
        before = body[["velocity", "angular_momentum"]].copy()
        for search in range(1, MAX_ACTIVE_SET_SEARCHES + 1):
            motion = Motion(spin, speed, duration)
            point = find_active_set(system, neighbours, motion, memory)
            if not len(point):
                return NOTHING_BORNE
            settled = self._settle(state, point, motion, before)
            reached = surface_speeds(body, settled.spin, system.bounded)
            state.pressed_speed = float(reached[self._resting].max(initial=0.0))
            state.forces = self._forces_after(settled, duration)
            foreseen = bool((reached <= SPEED_MARGIN * speed).all())
            if foreseen or search == MAX_ACTIVE_SET_SEARCHES:
                return self._borne(settled, foreseen)
            np.maximum(speed, SPEED_MARGIN * reached, out=speed)
            self.release()
        raise AssertionError("the last search returns")

    def _borne(self, settled: _Settled, foreseen: bool) -> Borne:
        """What the contacts bore."""
        b = settled.point["b"]
        wall, on_particle = self._system.body["wall"][b], b < self._system.particles
        walls = np.bincount(wall[wall >= 0], settled.impulse[wall >= 0], minlength=6)
        virial = float((settled.impulse * settled.point["distance"])[on_particle].sum())
        return Borne(walls, virial, not (settled.done and foreseen))

    def _settle(self, state: SolverState, point: np.ndarray, motion: Motion, before: np.ndarray) -> _Settled:
        """Let bodies settle, and anew with more contact points where they would have sunk in at the end."""
        system, duration = self._system, motion.duration
        impulse = self._forces_before(state, point) * duration
        for correction in range(1, MAX_CORRECTIONS + 1):
            done, steady = settle(system, motion.spin, point, duration, impulse)
            self._before = before[: system.particles][self._resting]
            spin = angular_velocities(system.body, len(system.body))
            place_ahead(system, state.standing, duration, self._ahead)
            velocity = np.ascontiguousarray(before["velocity"])
            more, place = sunk_points(system, self._ahead, (velocity, motion.spin, spin), point, duration)
            if not len(more) or correction == MAX_CORRECTIONS:
                return _Settled(point, impulse, steady, spin, bool(done) and not len(more))
            point, impulse = np.insert(point, place, more), np.insert(steady, place, 0.0)
            self.release()
        raise AssertionError("the last correction returns")

    def _let_fall(self, indices: np.ndarray) -> None:
        """Let gravity act on particles again."""
        self._system.body["resting"][indices] = 0

    def release(self) -> None:
        """Undo what the last ``carry`` did to the bodies."""
        indices = self._resting
        if len(indices):
            for name in ("velocity", "angular_momentum"):
                self._system.body[name][indices] = self._before[name]
            self._let_fall(indices)

    def _contact_of(self, point: np.ndarray) -> np.ndarray:
        """A number for the pair of bodies at each contact point."""
        return point["a"] * len(self._system.body) + point["b"]

    def _forces_before(self, state: SolverState, point: np.ndarray) -> np.ndarray:
        """The forces [N] that these contact points had in the substep before; 0 for new ones."""
        contact, known = self._contact_of(point), state.forces["contact"]
        order = np.argsort(contact, kind="stable")
        first = np.searchsorted(contact, known, sorter=order)
        last = np.searchsorted(contact, known, side="right", sorter=order)
        return handed_down(point, order, first, last, state.forces)

    def _forces_after(self, settled: _Settled, duration: float) -> np.ndarray:
        """The forces of contact points for the substep after, (m,) FORCE."""
        forces = np.empty(len(settled.point), dtype=FORCE)
        forces["contact"], forces["lever"] = self._contact_of(settled.point), settled.point["lever_a"]
        forces["force"] = settled.steady / duration
        return forces


def forget_clearance(state: SolverState, neighbours: NeighbourList) -> None:
    """Nothing is known yet of how far apart new neighbours are."""
    state.clearance = np.full(len(neighbours.other) if len(state.seen) else 0, -np.inf)
