"""The loop: one time step after another, and what there is to see in between."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from particlesim.broad_phase import METHODS
from particlesim.core.arguments import checked_arguments, real_numbers, shown
from particlesim.core.output_path import check_place
from particlesim.core.parallel import limit_threads
from particlesim.dynamics.settings import STEP_DISPLACEMENT
from particlesim.dynamics.solver import Solver
from particlesim.dynamics.solver_state import SolverState, digest
from particlesim.model.bodies import Particles, angular_velocities
from particlesim.model.overlap import deepest_overlap
from particlesim.model.system import Model
from particlesim.scene import Scene
from particlesim.setup.build import build
from particlesim.setup.limits import MOST_STEPS
from particlesim.simulation.checkpoint import Checkpoint, read_checkpoint, write_checkpoint
from particlesim.simulation.conserved import conserved
from particlesim.simulation.flow import Flow, FlowState
from particlesim.simulation.soundness import check_particles, too_fast
from particlesim.trajectory.frames import Frame, Header, Ledger


class Simulation:
    """A scene in motion.

    ``broad_phase`` overrides the scene's: "naive", "grid" or "octree"; ``threads`` is how many it may use (one a
    processor if None). Neither changes the result by a bit. SceneError if the scene cannot be built.
    """

    @checked_arguments
    def __init__(self, scene: Scene, broad_phase: str | None = None, threads: int | None = None) -> None:
        with limit_threads(threads):
            self._begin(scene, build(scene), broad_phase, threads)

    @classmethod
    @checked_arguments
    def of_model(
        cls, scene: Scene, model: Model, broad_phase: str | None = None, threads: int | None = None
    ) -> Simulation:
        """A simulation of a model that was built from ``scene`` and changed, such as by obstacles."""
        simulation = cls.__new__(cls)
        with limit_threads(threads):
            simulation._begin(scene, model, broad_phase, threads)
        return simulation

    def _begin(
        self,
        scene: Scene,
        model: Model,
        broad_phase: str | None,
        threads: int | None,
        states: tuple[SolverState, FlowState] | None = None,
    ) -> None:
        """Start from a model, or go on from the state of a solver and of what came and went."""
        self.scene, self._threads = scene, threads
        chosen = scene.solver.broad_phase
        if broad_phase not in (None, *METHODS):
            raise ValueError(f"unknown broad_phase {shown(broad_phase)}; there are {', '.join(METHODS)}")
        self.broad_phase = broad_phase or chosen.kind
        parameters = chosen.model_dump(exclude={"kind"}) if broad_phase in (None, chosen.kind) else {}
        state, flow_state = (None, None) if states is None else states
        self._frame_time = scene.time_of(1)
        self._solver = Solver(model, partial(METHODS[self.broad_phase], **parameters), state)
        self._flow = Flow(scene, model, flow_state)
        self.steps = 0
        self.time_step = self.next_time_step()

    def __repr__(self) -> str:
        done = (
            f"{self.time:g} of {self.scene.duration:g} s, {self.steps:,} steps, {self._solver.counts.impacts:,} impacts"
        )
        return f"<Simulation: {self.model.system.particles:,} particles, {done}, {self.broad_phase}>"

    # ---- checkpoints -------------------------------------------------------------------------------------------------

    @checked_arguments
    def save(self, path: str | Path) -> None:
        """Write a checkpoint (NPZ): the model and everything that the next step depends on.

        Parameters
        ----------
        path : str or Path
            The file, which appears whole or not at all.

        Raises
        ------
        OutputError
            If no file can appear there.
        OSError
            If it cannot be written.
        """
        check_place(Path(path))
        done = {"steps": self.steps, "time_step": self.time_step, "broad_phase": self.broad_phase}
        write_checkpoint(
            path, Checkpoint(self.scene, self.model, self._solver.state, self._solver.counts, self._flow.state, done)
        )

    @classmethod
    @checked_arguments
    def load(cls, path: str | Path, broad_phase: str | None = None, threads: int | None = None) -> Simulation:
        """Go on from a checkpoint: the same bytes as if the simulation had never been interrupted.

        Parameters
        ----------
        path : str or Path
            A file that ``save`` wrote.
        broad_phase, threads
            As for Simulation; neither changes the result.

        Raises
        ------
        CheckpointError
            If the file is not a checkpoint, is damaged, or is one of another version.
        OSError
            If it cannot be read.
        """
        found = read_checkpoint(path)
        simulation = cls.__new__(cls)
        chosen = found.done["broad_phase"] if broad_phase is None else broad_phase
        with limit_threads(threads):
            simulation._begin(found.scene, found.model, chosen, threads, (found.state, found.flow))
        simulation._solver.counts = found.counts
        simulation.steps, simulation.time_step = found.done["steps"], found.done["time_step"]
        return simulation

    # ---- going forward -------------------------------------------------------------------------------------------

    @checked_arguments
    def run(self, duration: float | None = None, steps: int | None = None) -> None:
        """Advance by ``duration`` [s], ending exactly there, or by a number of time steps.

        ValueError for neither or both, for less than none, or for what there would be no end to.
        """
        if (duration is None) == (steps is None):
            raise ValueError("give a duration or a number of steps")
        if steps is not None:
            if not 0 <= steps <= MOST_STEPS:
                raise ValueError(f"steps must be a whole number from 0 to {MOST_STEPS:.0e}, not {shown(steps)}")
            for _ in range(steps):
                self._step(self.next_time_step())
            return
        seconds = float(duration or 0.0)
        if not 0.0 <= seconds < math.inf:
            raise ValueError(f"duration must be a finite number of seconds of 0 or more, not {duration!r}")
        self._check_end(seconds, "duration", seconds)
        self._run_until(self.time + seconds)

    @checked_arguments
    def steps_of(self, duration: float) -> float:
        """About how many time steps a ``duration`` [s] takes, as long as they stay as they are.

        ValueError if it is not finite.
        """
        if not math.isfinite(duration):
            raise ValueError(f"duration must be a finite number of seconds, not {duration!r}")
        step = self.next_time_step()
        steps = duration / step if step > 0.0 else math.inf
        return math.ceil(steps - 1e-9) if steps < math.inf else math.inf

    @checked_arguments
    def run_until(self, end: float) -> None:
        """Advance to the time ``end`` [s], in equal steps as long as the automatic time step stays the same.

        ValueError for what there would be no end to.
        """
        self._check_end(end - self.time, "end", end)
        self._run_until(end)

    def _run_until(self, end: float) -> None:
        while self.time < end:
            self._step_towards(end)

    def _check_end(self, left: float, name: str, value: float) -> None:
        """ValueError, which names an argument and its value, for what it takes years to come to."""
        if not math.isfinite(left):
            raise ValueError(f"{name} must be a finite number of seconds, not {value!r}")
        if left > 0.0 and self.steps_of(left) > MOST_STEPS:
            raise ValueError(f"{name} = {value:g} s takes about {self.steps_of(left):.0e} time steps")

    @checked_arguments
    def step_towards(self, end: float) -> None:
        """One of the time steps of ``run_until``: it ends at the time ``end`` [s] or before.

        ValueError if that has passed.
        """
        left = end - self.time
        if not 0.0 < left < math.inf:
            raise ValueError(f"end = {end:g} s is not after the present, {self.time:g} s")
        self._step_towards(end)

    def _step_towards(self, end: float) -> None:
        left = end - self.time
        parts = self.steps_of(left)
        if parts > MOST_STEPS:
            check_particles(self.scene, self.model, self.time)
            raise too_fast(self.scene, self.model, self.time)
        self._step(left / max(parts, 1))
        if parts <= 1:
            self._solver.state.time = end

    def next_time_step(self) -> float:
        """The scene's time step, or one in which particles move a little (STEP_FRACTION); at most one frame [s].

        It does not decide what happens: impacts are placed at their own times within it.
        """
        if self.scene.solver.time_step != "auto":
            return self.scene.solver.time_step
        if self.scene.is_open:  # what is in a sink after a time step is taken out
            return min(self._solver.longest_substep(STEP_DISPLACEMENT), self._frame_time)
        return self._solver.longest_step(STEP_DISPLACEMENT, self._frame_time)

    @checked_arguments
    def step(self, time_step: float | None = None) -> None:
        """One time step [s], the automatic one if not given.

        ValueError for one that is not above 0, or so long that it would take millions of substeps.
        """
        if time_step is not None and not 0.0 < time_step < math.inf:
            raise ValueError(f"time_step must be a finite number of seconds above 0, not {time_step!r}")
        self._step(self.next_time_step() if time_step is None else time_step)

    def _step(self, time_step: float) -> None:
        with limit_threads(self._threads):
            self.time_step = time_step
            self._solver.step(time_step)
            changed = self._flow.exchange(self.model, self.time)
            if changed is not None:
                self._solver.change_particles(*changed)
        self.steps += 1

    @checked_arguments
    def add_force(self, force: Callable[[Particles], np.ndarray]) -> None:
        """Let a force act on the particles from now on, in kicks between their free paths.

        A checkpoint does not hold it: after ``load`` it is to be added again.

        Parameters
        ----------
        force : callable
            Takes the particles as they are and returns the force on each, (n, 3) [N].

        Raises
        ------
        ValueError
            When a step is made, if what it returns is not (n, 3) finite numbers.
        """

        def checked() -> np.ndarray:
            found = real_numbers("what force returns", force(self.particles))
            expected = (self.model.system.particles, 3)
            if found.shape != expected or not np.isfinite(found).all():
                raise ValueError(f"force must return finite numbers of the shape {expected}, not {found.shape}")
            return found

        self._solver.kicks.forces.append(checked)

    # ---- looking ---------------------------------------------------------------------------------------------------

    @property
    def removed(self) -> np.ndarray:
        """How many particles of each group sinks have taken out, (groups,) int64."""
        return self._flow.state.removed.copy()

    @property
    def model(self) -> Model:
        """What is simulated, as arrays."""
        return self._solver.model

    @property
    def time(self) -> float:
        """Time since the start of the scene [s]."""
        return self._solver.state.time

    @property
    def particles(self) -> Particles:
        """The dynamic bodies (see Particles): views of their records, but for what is computed from them."""
        b, system = self.model.particles, self.model.system
        return Particles(
            shape=b["shape_row"],
            group=b["group"],
            size=b["scale"],
            mass=b["mass"],
            inertia=b["principal_inertia"],
            restitution=self.model.restitution[b["material"]],
            radius=b["radius"],
            inradius=b["inradius"],
            position=b["position"],
            orientation=b["orientation"],
            velocity=b["velocity"],
            angular_momentum=b["angular_momentum"],
            image=b["image"],
            angular_velocity=angular_velocities(system.body, system.particles),
            impacts=self._solver.counts.each,
        )

    @property
    def ledger(self) -> Ledger:
        """Sums over all particles now, and counts since the start."""
        counts, flow = self._solver.counts, self._flow.state
        (translational, rotational, potential), momentum, angular = conserved(self.model.system)
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
            dissipated=counts.dissipated.copy(),
            wall_shear=counts.wall_shear.copy(),
            work=counts.work,
            flow_mass=flow.mass.copy(),
            flow_energy=flow.energy.copy(),
            released=int(flow.released.sum()),
            removed=int(flow.removed.sum()),
            waiting=int(flow.waiting.sum()),
        )

    def largest_overlap(self) -> float:
        """The largest overlap of two bodies now [m]; 0 if nothing overlaps. It looks at every pair of neighbours."""
        return deepest_overlap(self.model.system, self._solver.pairs)

    @property
    def seconds(self) -> dict[str, float]:
        """Wall-clock time [s] spent so far on pairs, contacts, respond and advance."""
        return dict(self._solver.seconds)

    @property
    def header(self) -> Header:
        """What stays the same from frame to frame."""
        b = self.model.population if self.scene.is_open else self.model.particles
        return Header(
            self.scene.model_dump_json(),
            self.model.shapes,
            b["shape_row"].astype(np.int64),
            b["scale"].copy(),
            b["group"].astype(np.int64),
            b["mass"].copy(),
            b["principal_inertia"].copy(),
            self.model.obstacle_shapes,
        )

    def frame(self) -> Frame:
        """The present moment, copied. SimulationError if it cannot be, such as for a number that is not finite."""
        check_particles(self.scene, self.model, self.time)
        b = self.model.particles
        return Frame(
            time=self.time,
            position=b["position"].copy(),
            orientation=b["orientation"].copy(),
            velocity=b["velocity"].copy(),
            angular_momentum=b["angular_momentum"].copy(),
            image=b["image"].astype(np.int64),
            impacts=self._solver.counts.each.copy(),
            ledger=replace(self.ledger, largest_overlap=self.largest_overlap()),
            present=b["id"].astype(np.int64) if self.scene.is_open else None,
        )

    def state_hash(self) -> str:
        """SHA-256 of everything that the next step depends on: two runs that agree in it go on the same to the bit."""
        system, states = self.model.system, (self._solver.state, self._flow.state)
        arrays = [array for state in states for array in state.arrays().values()]
        return digest(system.body, system.law, system.motion, system.domain, *arrays)
