"""The loop: one time step after another, and what there is to see in between."""

from __future__ import annotations

import hashlib
import math
from dataclasses import replace

import numpy as np

from particlesim.broad_phase import METHODS
from particlesim.core.constants import STEP_FRACTION
from particlesim.core.parallel import use_threads
from particlesim.dynamics import Flight
from particlesim.model.bodies import Particles
from particlesim.model.free_motion import spins
from particlesim.model.touching import deepest_overlap
from particlesim.scene import Scene
from particlesim.setup.build import build
from particlesim.simulation.diagnostics import sums
from particlesim.trajectory.frames import Frame, Header, Ledger


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
        self._frame_time = scene.time_of(1)
        self._flight = Flight(self.table, self.world, self.constants, self.state, self._candidate_pairs)
        self.steps = 0
        self.time = 0.0
        self.time_step = self.next_time_step()

    def _candidate_pairs(self, lower: np.ndarray, upper: np.ndarray, period: np.ndarray) -> tuple[np.ndarray, int]:
        return self._find_pairs(lower, upper, period, **self._parameters)

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
        """The scene's time step, or one in which particles move a little (STEP_FRACTION); at most one frame [s].

        It does not decide what happens: impacts are placed at their own times within it.
        """
        if self.scene.solver.time_step != "auto":
            return self.scene.solver.time_step
        return min(self._flight.longest_stretch(STEP_FRACTION), self._frame_time)

    def step(self, time_step: float | None = None) -> None:
        """One time step [s], the automatic one if not given."""
        use_threads(self._threads)
        self.time_step = self.next_time_step() if time_step is None else time_step
        self._flight.advance(self.time_step)
        self.time += self.time_step
        self.steps += 1

    # ---- looking ---------------------------------------------------------------------------------------------------

    @property
    def particles(self) -> Particles:
        """Constants and state side by side (see Particles): views of the arrays, but for the angular velocity."""
        return Particles(
            *self.constants,
            *self.state,
            angular_velocity=spins(self.constants, self.state),
            impacts=self._flight.counts.each,
        )

    @property
    def ledger(self) -> Ledger:
        """Sums over all particles now, and counts since the start."""
        counts = self._flight.counts
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
            impacts=counts.impacts,
            pairs_tested=counts.pairs_tested,
            candidate_pairs=counts.candidate_pairs,
            unresolved=counts.unresolved,
            virial=counts.virial,
            wall_impulse=counts.wall_impulse.copy(),
        )

    def largest_overlap(self) -> float:
        """The largest overlap of two particles, or of a particle and a wall, now [m]."""
        return float(deepest_overlap(self.table, self.world, self.constants, self.state, self._flight.pairs))

    @property
    def seconds(self) -> dict[str, float]:
        """Wall-clock time [s] spent so far on pairs, contacts, respond and advance."""
        return dict(self._flight.seconds)

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
            impacts=self._flight.counts.each.copy(),
            ledger=replace(self.ledger, largest_overlap=self.largest_overlap()),
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
