"""The loop: advance, find pairs, find contacts, respond."""

from __future__ import annotations

import hashlib
import math

import numpy as np

from particlesim.broad_phase import METHODS
from particlesim.build import build
from particlesim.constants import MAX_ROUNDS
from particlesim.crew import Crew, use_threads
from particlesim.ledger import Ledger, sums
from particlesim.motion import advance, longest_step, spins
from particlesim.narrow_phase.contacts import deepest_overlap, touching_pairs, touching_walls
from particlesim.response import Tally, respond, times_since_impact
from particlesim.scene import Scene
from particlesim.state import Particles
from particlesim.trajectory import Frame, Header


class SimulationError(RuntimeError):
    """The state has become impossible: a number that is not finite."""


class Simulation:
    """A scene in motion.

    ``broad_phase`` overrides the scene's: "naive", "grid" or "octree"; ``threads`` is how many it may use (one a
    processor if None). Neither changes the result by a bit. SceneError if the scene cannot be built.
    """

    def __init__(self, scene: Scene, broad_phase: str | None = None, threads: int | None = None) -> None:
        use_threads(threads)
        self._threads = threads
        self.scene = scene
        self.shapes, self.table, self.world, self.constants, self.state = build(scene)
        chosen = scene.solver.broad_phase
        if broad_phase not in (None, *METHODS):
            raise ValueError(f"unknown broad phase '{broad_phase}'; there are {', '.join(METHODS)}")
        self._find_pairs = METHODS[broad_phase or chosen.kind]
        self._parameters = chosen.model_dump(exclude={"kind"}) if broad_phase in (None, chosen.kind) else {}
        self._frame_time = 1.0 / scene.movie.fps
        n = len(self.constants.mass)
        self._lower, self._upper = np.empty((n, 3)), np.empty((n, 3))
        self._clock = np.empty(n)
        self._moved = np.empty(n, dtype=np.bool_)
        self._tally = Tally(np.zeros(1, dtype=np.int64), np.zeros(1), np.zeros(6))
        self._pairs_tested = self._candidate_pairs = self._unresolved = self.steps = 0
        self.time = 0.0
        self.time_step = self.next_time_step()
        self._advance(0.0)

    # ---- going forward -------------------------------------------------------------------------------------------

    def run(self, duration: float | None = None, steps: int | None = None) -> None:
        """Advance by ``duration`` [s], ending exactly there, or by a number of time steps."""
        if (duration is None) == (steps is None):
            raise ValueError("give a duration or a number of steps")
        if steps is not None:
            for _ in range(steps):
                self.step()
            return
        self.run_until(self.time + float(duration or 0.0))

    def run_until(self, end: float) -> None:
        """Advance to the time ``end`` [s], in equal steps as long as the automatic time step stays the same."""
        while self.time < end:
            left = end - self.time
            parts = math.ceil(left / self.next_time_step() - 1e-9)
            self.step(left / max(parts, 1))
            if parts <= 1:
                self.time = end

    def next_time_step(self) -> float:
        """The scene's time step, or the longest that lets nothing tunnel; at most one frame [s]."""
        if self.scene.solver.time_step != "auto":
            return self.scene.solver.time_step
        return min(longest_step(self.constants, self.state, self.world), self._frame_time)

    def step(self, time_step: float | None = None) -> None:
        """One time step [s], the automatic one if not given."""
        use_threads(self._threads)
        self.time_step = self.next_time_step() if time_step is None else time_step
        self._advance(self.time_step)
        self._respond()
        self.time += self.time_step
        self.steps += 1

    def _advance(self, time_step: float) -> None:
        """Move every particle along its free path and find the candidate pairs at its end."""
        where = self.table, self.constants, self.state, self.world
        with Crew(len(self._clock)) as crew:
            crew.each(
                lambda _, first, last: advance(*where, time_step, self._lower, self._upper, first, last),
                len(self._clock),
            )
        self._pairs, tested = self._find_pairs(self._lower, self._upper, self.world.period, **self._parameters)
        self._pairs_tested += int(tested)
        self._candidate_pairs += len(self._pairs)

    def _respond(self) -> None:
        """Answer the impacts of the step, round by round, until nothing that touches approaches."""
        where = self.table, self.world, self.constants, self.state
        self._clock[:] = self.time_step
        self._moved[:] = True
        for _ in range(MAX_ROUNDS):
            pairs = touching_pairs(*where, self._pairs, self._moved)
            walls = touching_walls(*where, self._moved)
            if not len(pairs) and not len(walls):
                return
            contacts = np.concatenate([pairs, walls])
            earlier = times_since_impact(*where, contacts, self._clock)
            # Stable: impacts at the same moment are taken in the canonical order of their pairs.
            order = np.argsort(-earlier, kind="stable")
            if not respond(*where, contacts, earlier, order, self._clock, self._tally, self._moved):
                return
        self._unresolved += 1

    # ---- looking ---------------------------------------------------------------------------------------------------

    @property
    def particles(self) -> Particles:
        """Constants and state side by side (see Particles): views of the arrays, but for the angular velocity."""
        return Particles(*self.constants, *self.state, angular_velocity=spins(self.constants, self.state))

    @property
    def ledger(self) -> Ledger:
        """Sums over all particles now, and counts since the start."""
        (translational, rotational, potential), momentum, angular = sums(self.world, self.constants, self.state)
        return Ledger(
            time=self.time,
            time_step=self.time_step,
            steps=self.steps,
            kinetic_translational=float(translational),
            kinetic_rotational=float(rotational),
            potential=float(potential),
            momentum=momentum,
            angular_momentum=angular,
            impacts=int(self._tally.impacts[0]),
            pairs_tested=self._pairs_tested,
            candidate_pairs=self._candidate_pairs,
            unresolved=self._unresolved,
            virial=float(self._tally.virial[0]),
            wall_impulse=self._tally.wall_impulse.copy(),
            largest_overlap=float(deepest_overlap(self.table, self.world, self.constants, self.state, self._pairs)),
        )

    @property
    def header(self) -> Header:
        """What stays the same from frame to frame."""
        c = self.constants
        return Header(self.scene.model_dump_json(), self.shapes, c.shape, c.size, c.group, c.mass, c.inertia)

    def frame(self) -> Frame:
        """The present moment, copied. SimulationError if a number in it is not finite."""
        self._check_finite()
        state = self.state
        return Frame(
            time=self.time,
            position=state.position.copy(),
            orientation=state.orientation.copy(),
            velocity=state.velocity.copy(),
            angular_momentum=state.angular_momentum.copy(),
            image=state.image.copy(),
            ledger=self.ledger.row(),
        )

    def state_hash(self) -> str:
        """SHA-256 of the raw state: two runs that agree in it agree in every bit."""
        digest = hashlib.sha256()
        for array in self.state:
            digest.update(np.ascontiguousarray(array).tobytes())
        return digest.hexdigest()

    def _check_finite(self) -> None:
        for name, array in zip(self.state._fields, self.state, strict=True):
            bad = np.flatnonzero(~np.isfinite(array).all(axis=1))
            if len(bad):
                i = int(bad[0])
                group = int(self.constants.group[i])
                raise SimulationError(
                    f"{name} of particle {i} (particles[{group}] of the scene) is not finite at {self.time:g} s"
                )
