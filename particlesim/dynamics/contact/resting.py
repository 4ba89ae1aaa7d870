"""Resting contacts: what gravity presses together does not fall, sink or tremble.

A ball that bounces with restitution below 1 makes infinitely many bounces in a finite time. They end here: what hardly
moves against a wall that gravity presses against, and all that is near it (see cluster.py), is taken together for a
whole stretch of time (see settling.py).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from particlesim.core.constants import FREE, RESTITUTION_THRESHOLD_HEIGHT
from particlesim.dynamics.contact.active_set import expected_paces, find_cluster, surface_paces, walk
from particlesim.dynamics.contact.contact_points import APART, FASTER, LEVER_I, handed_down
from particlesim.dynamics.contact.end_of_step_correction import fly, sunk_points
from particlesim.dynamics.contact.projected_solver import settle
from particlesim.dynamics.neighbour_list import Neighbours
from particlesim.geometry.shape_table import ShapeTable
from particlesim.model.bodies import Constants, State, World
from particlesim.model.free_motion import spins

# While anything rests, surfaces of what is pressed move by this fraction of the inscribed radius in a stretch of time:
# ways bend by the square of it. No stretch is shorter for it than this fraction of what it is where all lie still.
_WAY_PER_STRETCH = 0.01
_SHORTEST_STRETCH = 0.25

# What lies still is thought to become this much faster by others than by gravity in a stretch.
_HASTE = 4.0

# Looks at who may meet whom in a stretch, until no body becomes faster than was thought.
_MAX_LOOKS = 5

# How often velocities are sought in each of these looks, as long as bodies would sink in with those that were found.
_MOST_ATTEMPTS = 5


class _Settled(NamedTuple):
    """Contact points and what goes through them in a stretch."""

    partner: np.ndarray  # (m, 2) int64
    point: np.ndarray  # (m, COLUMNS)
    impulse: np.ndarray  # (m,) [N s]
    steady: np.ndarray  # (m,) without what makes points part again [N s]
    spin: np.ndarray  # (n, 3) angular velocities with these impulses [rad/s]
    done: bool  # whether the impulses are good enough


class Resting:
    """Holds what rests, one stretch of time after the other."""

    def __init__(self, table: ShapeTable, world: World, constants: Constants, state: State) -> None:
        count = len(constants.mass)
        self._table, self._world, self._constants, self._state = table, world, constants, state
        self._gravity = float(np.linalg.norm(world.gravity))
        # Of the last stretch: a number for the partners at each contact point, its levers and forces [N].
        self._contact, self._lever, self._force = np.empty(0, dtype=np.int64), np.empty((0, 3)), np.empty(0)
        self._inradius = float(constants.inradius.mean()) if count else 0.0
        self._fastest = 0.0  # of the surfaces of what is pressed [m/s]
        self._last_bounces = self._time_of_last_bounces()
        self.standing: np.ndarray = np.full(count, FREE, dtype=np.int64)  # of each particle in its cluster
        self._held = np.empty(0, dtype=np.int64)
        # Without gravity nothing is held, and nothing need be remembered of anybody.
        known = count if self._gravity else 0
        self._seen = state.position[:known].copy(), state.orientation[:known].copy()
        self._ahead = State(*(array[:known].copy() for array in state))
        self._way = np.zeros(known)
        self._neighbours: Neighbours | None = None
        self._clearance = np.empty(0)
        self.wall_impulse: np.ndarray = np.zeros(6)  # of the last stretch [N s]
        self.virial = 0.0  # of the last stretch [J s]
        self.unresolved = False  # whether the bound on the work of the last stretch was reached
        self._before = np.empty((0, 3)), np.empty((0, 3))

    def _time_of_last_bounces(self) -> float:
        """What bounces to rest has done so after this time [s], in which it must be looked at; inf if nothing does."""
        restitution = np.append(self._constants.restitution, self._world.restitution)
        if self._gravity == 0.0 or restitution.min() == 1.0 or not len(self._constants.mass):
            return np.inf
        return 0.5 * float(np.sqrt(2.0 * RESTITUTION_THRESHOLD_HEIGHT * self._inradius / self._gravity))

    @property
    def longest_stretch(self) -> float:
        """How long a stretch of time may be [s]: not so long that what came to rest were not looked at."""
        if not len(self._held):
            return self._last_bounces
        in_time = _WAY_PER_STRETCH * self._inradius / max(self._fastest, 1e-300)
        return min(max(in_time, _SHORTEST_STRETCH * self._last_bounces), self._last_bounces)

    def hold(self, neighbours: Neighbours, acceleration: np.ndarray, duration: float) -> None:
        """Hold what rests for a stretch of ``duration`` [s]: its velocity changes and its acceleration (n, 3) is 0."""
        if self._gravity == 0.0:
            return
        constants, state = self._constants, self._state
        acceleration[self._held] = self._world.gravity
        self._held = np.empty(0, dtype=np.int64)
        self.wall_impulse, self.virial, self.unresolved = np.zeros(6), 0.0, False
        self._keep_clearance(neighbours)
        spin = spins(constants, state)
        pace = expected_paces(
            surface_paces(constants, state, spin), neighbours.lists, _HASTE * self._gravity * duration
        )
        before = state.velocity.copy(), state.angular_momentum.copy()
        for look in range(1, _MAX_LOOKS + 1):
            partner, point = find_cluster(
                self._table, self._world, constants, state, spin, neighbours.lists, duration,
                pace, self._way, self._clearance, self.standing,
            )  # fmt: skip
            if not len(partner):
                return
            impulse = self._forces_of(self._contact_of(partner), point) * duration
            settled = self._settle(partner, point, spin, duration, before, impulse, acceleration)
            self._contact, self._force = self._contact_of(settled.partner), settled.steady / duration
            self._lever = settled.point[:, LEVER_I : LEVER_I + 3].copy()
            reached = surface_paces(constants, state, settled.spin)
            self._fastest = float(reached[self._held].max(initial=0.0))
            foreseen = bool((reached <= FASTER * pace).all())
            self.unresolved = not (settled.done and foreseen)
            if foreseen or look == _MAX_LOOKS:
                break
            np.maximum(pace, FASTER * reached, out=pace)
            self._undo(acceleration)
        on_wall = settled.partner[:, 1] < 0
        self.wall_impulse = np.bincount(-1 - settled.partner[on_wall, 1], settled.impulse[on_wall], minlength=6)
        self.virial = float((settled.impulse * settled.point[:, APART])[~on_wall].sum())

    def _settle(
        self,
        partner: np.ndarray,
        point: np.ndarray,
        spin: np.ndarray,
        duration: float,
        before: tuple[np.ndarray, np.ndarray],
        impulse: np.ndarray,
        acceleration: np.ndarray,
    ) -> _Settled:
        """Let bodies settle, and anew with more contact points where they would have sunk in at the end."""
        where = self._table, self._world, self._constants, self._state
        for attempt in range(1, _MOST_ATTEMPTS + 1):
            pressed, done, steady = settle(*where[1:], spin, partner, point, duration, impulse, acceleration)
            self._held = np.flatnonzero(pressed)
            self._before = before[0][self._held], before[1][self._held]
            turning = spins(self._constants, self._state)
            fly(self._constants, self._state, acceleration, self.standing, duration, self._ahead)
            more, of, place = sunk_points(*where, self._ahead, turning, (before[0], spin), partner, point, duration)
            if not len(more) or attempt == _MOST_ATTEMPTS:
                break
            partner, point = np.insert(partner, place, of, axis=0), np.insert(point, place, more, axis=0)
            impulse = np.insert(steady, place, 0.0)
            self._undo(acceleration)
        return _Settled(partner, point, impulse, steady, turning, done and not len(more))

    def _keep_clearance(self, neighbours: Neighbours) -> None:
        """Bring up to date how far surfaces have come; of new neighbours nothing is known yet."""
        walk(self._constants, self._state, self._world.period, *self._seen, self._way)
        if neighbours is not self._neighbours:
            self._neighbours = neighbours
            self._clearance = np.full(len(neighbours.lists.other), -np.inf)

    def _undo(self, acceleration: np.ndarray) -> None:
        self.release()
        acceleration[self._held] = self._world.gravity

    def release(self) -> None:
        """Undo what the last ``hold`` did to the state."""
        if len(self._held):
            self._state.velocity[self._held], self._state.angular_momentum[self._held] = self._before

    def _contact_of(self, partner: np.ndarray) -> np.ndarray:
        """A number for the partners at each contact point."""
        return partner[:, 0] * (len(self._constants.mass) + 6) + partner[:, 1] + 6

    def _forces_of(self, contact: np.ndarray, point: np.ndarray) -> np.ndarray:
        """The forces [N] that these contact points had in the stretch before; 0 for new ones."""
        order = np.argsort(contact, kind="stable")
        first = np.searchsorted(contact, self._contact, sorter=order)
        last = np.searchsorted(contact, self._contact, side="right", sorter=order)
        return handed_down(point, order, first, last, self._lever, self._force)
