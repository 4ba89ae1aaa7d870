"""Resting contacts: what gravity presses together does not fall, sink or tremble.

A ball that bounces with restitution below 1 makes infinitely many bounces in a finite time. They end here: what hardly
moves against a wall that gravity presses against, and all that is near it (see cluster.py), is taken together for a
whole stretch of time (see settling.py).
"""

from __future__ import annotations

import numpy as np

from particlesim.constants import FREE, MAX_MANIFOLD, RESTING_DROP
from particlesim.impacts.cluster import APART, FASTER, find_cluster, surface_paces
from particlesim.impacts.neighbours import Neighbours
from particlesim.impacts.settling import settle
from particlesim.motion import spins
from particlesim.state import Constants, ShapeTable, State, World

# While anything rests, a stretch of time is this fraction of what bounces to rest takes.
_SETTLING_STRETCH = 0.25

# Looks at who may meet whom in a stretch, until no body becomes faster than was thought.
_MAX_LOOKS = 5


class Resting:
    """Holds what rests, one stretch of time after the other."""

    def __init__(self, table: ShapeTable, world: World, constants: Constants, state: State) -> None:
        count = len(constants.mass)
        self._table, self._world, self._constants, self._state = table, world, constants, state
        self._gravity = float(np.linalg.norm(world.gravity))
        self._keys, self._forces = np.empty(0, dtype=np.int64), np.empty(0)
        self._last_bounces = self._time_of_last_bounces()
        self.standing: np.ndarray = np.full(count, FREE, dtype=np.int64)  # of each particle in its cluster
        self._held = np.empty(0, dtype=np.int64)
        self.wall_impulse: np.ndarray = np.zeros(6)  # of the last stretch [N s]
        self.virial = 0.0  # of the last stretch [J s]
        self._before = np.empty((0, 3)), np.empty((0, 3))

    def _time_of_last_bounces(self) -> float:
        """What bounces to rest has done so after this time [s], in which it must be looked at; inf if nothing does."""
        restitution = np.append(self._constants.restitution, self._world.restitution)
        if self._gravity == 0.0 or restitution.min() == 1.0 or not len(self._constants.mass):
            return np.inf
        return 0.5 * float(np.sqrt(2.0 * RESTING_DROP * self._constants.inradius.mean() / self._gravity))

    @property
    def longest_stretch(self) -> float:
        """How long a stretch of time may be [s]: not so long that what came to rest were not looked at."""
        return self._last_bounces * (_SETTLING_STRETCH if len(self._held) else 1.0)

    def hold(self, neighbours: Neighbours, acceleration: np.ndarray, duration: float) -> None:
        """Hold what rests for a stretch of ``duration`` [s]: its velocity changes and its acceleration (n, 3) is 0."""
        if self._gravity == 0.0:
            return
        constants, state = self._constants, self._state
        acceleration[self._held] = self._world.gravity
        self._held = np.empty(0, dtype=np.int64)
        self.wall_impulse, self.virial = np.zeros(6), 0.0
        spin = spins(constants, state)
        pace = surface_paces(constants, state, spin) + self._gravity * duration
        before = state.velocity.copy(), state.angular_momentum.copy()
        for _ in range(_MAX_LOOKS):
            partner, point = find_cluster(
                self._table, self._world, constants, state, spin, neighbours.start, neighbours.other, duration,
                pace, self.standing,
            )  # fmt: skip
            if not len(partner):
                return
            keys = self._keys_of(partner)
            impulse = self._forces_of(keys) * duration
            pressed = settle(self._world, constants, state, spin, partner, point, duration, impulse, acceleration)
            self._held = np.flatnonzero(pressed)
            self._before = before[0][self._held], before[1][self._held]
            self._keys, self._forces = keys, impulse / duration
            reached = surface_paces(constants, state, spins(constants, state))
            if (reached <= FASTER * pace).all():
                break
            np.maximum(pace, reached, out=pace)
            self.release()
        on_wall = partner[:, 1] < 0
        self.wall_impulse = np.bincount(-1 - partner[on_wall, 1], impulse[on_wall], minlength=6)
        self.virial = float((impulse * point[:, APART])[~on_wall].sum())

    def release(self) -> None:
        """Undo what the last ``hold`` did to the state."""
        if len(self._held):
            self._state.velocity[self._held], self._state.angular_momentum[self._held] = self._before

    def _keys_of(self, partner: np.ndarray) -> np.ndarray:
        """A number for each contact point that stays the same from stretch to stretch."""
        count = len(self._constants.mass) + 6
        contact = partner[:, 0] * count + partner[:, 1] + 6
        starts = np.flatnonzero(np.diff(contact, prepend=-1))
        within = np.arange(len(contact)) - np.repeat(starts, np.diff(starts, append=len(contact)))
        return contact * MAX_MANIFOLD + within

    def _forces_of(self, keys: np.ndarray) -> np.ndarray:
        """The forces [N] that these contact points had in the stretch before; 0 for new ones."""
        if not len(self._keys):
            return np.zeros(len(keys))
        order = np.argsort(self._keys)
        place = np.minimum(np.searchsorted(self._keys, keys, sorter=order), len(order) - 1)
        known = self._keys[order[place]] == keys
        return np.where(known, self._forces[order[place]], 0.0)
