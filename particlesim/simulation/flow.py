"""Particles that come and go between time steps: what emitters put in, and what sinks take out."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from particlesim.geometry.aabb import aabbs_of
from particlesim.model.overlap import put_where_free
from particlesim.model.system import Model
from particlesim.scene import Scene
from particlesim.scene.file import SceneError
from particlesim.scene.flow import Emitter
from particlesim.scene.placements import RandomPlacement, Region
from particlesim.setup.build import space_of
from particlesim.setup.placement import Trials, from_middle
from particlesim.simulation.conserved import conserved

# Places that a particle is tried at in a time step before it waits for the next one; and at the start, beside obstacles
# alone, before its emitter is said to have no room.
_TRIALS, _TRIALS_AT_FIRST = 16, 2000


@dataclass
class FlowState:
    """What has come and gone since the start."""

    released: np.ndarray  # (e,) int64, particles that each emitter has put in
    waiting: np.ndarray  # (e,) int64, those that are due but found no room yet
    rounds: np.ndarray  # (e,) int64, how often each emitter has looked for places: what its random numbers follow from
    removed: np.ndarray  # (g,) int64, particles of each group that were taken out
    mass: np.ndarray  # (2,) that came and that went [kg]
    energy: np.ndarray  # (2,) kinetic and potential energy that came and that went [J]

    def arrays(self) -> dict[str, np.ndarray]:
        """Everything by name."""
        return {f.name: getattr(self, f.name) for f in fields(self)}


class Flow:
    """The emitters and sinks of a scene.

    Parameters
    ----------
    scene : Scene
    model : Model
        As it is at first, with its population.
    state : FlowState, optional
        To go on from; by default that of a start, at which SceneError is raised if an emitter has no room.
    """

    def __init__(self, scene: Scene, model: Model, state: FlowState | None = None) -> None:
        self._scene, self._world = scene, space_of(model.system.domain)
        # The ids of an emitter's particles follow each other.
        counts = [emitter.number for emitter in scene.emitters]
        self._first = len(model.population) - sum(counts) + np.cumsum(counts, dtype=np.int64) - counts
        self.state = _nothing_yet(scene) if state is None else state
        if state is None:
            for e in range(len(counts)):
                self._check_room(model, e)

    def exchange(self, model: Model, time: float) -> tuple[np.ndarray, np.ndarray] | None:
        """What is to be instead of a model's particles after a step until ``time`` [s]; None if nothing comes or goes.

        Returns
        -------
        particles : (n,) BODY
            In the order of their ids.
        origin : (n,) int64
            Where each was among those before, -1 if it is new.
        """
        if not self._scene.is_open:
            return None
        state, here = self.state, model.particles
        gone = self._in_sinks(here["position"])
        stays, leaving = np.flatnonzero(~gone), here[gone]
        bodies = [here[stays], model.system.body[model.system.particles :]]
        for e in range(len(self._scene.emitters)):
            bodies.append(self._coming(model, np.concatenate(bodies), e, time))
        coming = np.concatenate([here[:0], *bodies[2:]])
        if not len(leaving) and not len(coming):
            return None
        state.removed += np.bincount(leaving["group"], minlength=len(state.removed))
        state.mass += coming["mass"].sum(), leaving["mass"].sum()
        state.energy += _energy(model, coming), _energy(model, leaving)
        together = np.concatenate([bodies[0], coming])
        order = np.argsort(together["id"], kind="stable")
        return together[order], np.append(stays, np.full(len(coming), -1))[order]

    def _coming(self, model: Model, others: np.ndarray, e: int, time: float) -> np.ndarray:
        """The particles that emitter ``e`` puts between ``others`` (k,) BODY by a time [s], (m,) BODY."""
        state, emitter = self.state, self._scene.emitters[e]
        first = self._first[e] + state.released[e]
        due = model.population[first : self._first[e] + _due(emitter, time)].copy()
        put = 0
        if len(due):
            put = self._put(model, others, e, due, _TRIALS)
            state.rounds[e] += 1
        state.released[e] += put
        state.waiting[e] = len(due) - put
        return due[:put]

    def _put(self, model: Model, others: np.ndarray, e: int, bodies: np.ndarray, tries: int) -> int:
        """Put bodies (m,) BODY, one after the other, into the region of emitter ``e``; how many found room in a row."""
        emitter, count = self._scene.emitters[e], len(bodies)
        g = len(self._scene.particles) + e
        random = np.random.default_rng([self._scene.seed, g, int(self.state.rounds[e])])
        shape, size, turned = (np.ascontiguousarray(bodies[name]) for name in ("shape_row", "scale", "orientation"))
        extent = aabbs_of(model.system.shapes, shape.astype(np.int64), size, turned)
        where = RandomPlacement(kind="random", region=emitter.region)
        trials = Trials(self._scene.key(g), emitter, where, self._world, extent, np.arange(count), random)
        proposals = trials.draw(np.repeat(np.arange(count), tries)).reshape(count, tries, 3)
        near = others[_is_near(emitter.region, others, self._world.period)]
        return int(put_where_free(model.system, np.concatenate([near, bodies]), len(near), bodies, proposals))

    def _check_room(self, model: Model, e: int) -> None:
        """SceneError if the first particle of an emitter finds no room beside obstacles and walls."""
        first = model.population[self._first[e] :][: self._scene.emitters[e].number][:1].copy()
        fixed = model.system.body[model.system.particles :]
        if len(first) and not self._put(model, fixed, e, first, _TRIALS_AT_FIRST):
            key = self._scene.key(len(self._scene.particles) + e)
            raise SceneError("is inside an obstacle or a wall: its particles find no room", f"{key}.region")

    def _in_sinks(self, position: np.ndarray) -> np.ndarray:
        """Which positions (n, 3) are in a sink, (n,)."""
        inside = np.zeros(len(position), dtype=bool)
        for sink in self._scene.sinks:
            inside |= _is_in(sink.region, position)
        return inside


def _nothing_yet(scene: Scene) -> FlowState:
    """The state of a start."""
    released, waiting, rounds = np.zeros((3, len(scene.emitters)), dtype=np.int64)
    removed = np.zeros(len(scene.groups), dtype=np.int64)
    return FlowState(released, waiting, rounds, removed, mass=np.zeros(2), energy=np.zeros(2))


def _due(emitter: Emitter, time: float) -> int:
    """How many particles an emitter should have put in by a time [s]."""
    end = time if emitter.until is None else min(time, emitter.until)
    # In the last step before a whole number, rounding does not decide.
    return min(max(int(emitter.rate * (end - emitter.begin) + 1e-9), 0), emitter.number)


def _is_in(region: Region, position: np.ndarray) -> np.ndarray:
    """Which positions (n, 3) are in a region, (n,)."""
    lower, upper = np.array(region.lower), np.array(region.upper)
    if region.form == "ellipsoid":
        return np.asarray(from_middle(position, lower, upper) <= 1.0)
    return np.asarray(((position >= lower) & (position <= upper)).all(axis=1))


def _is_near(region: Region, bodies: np.ndarray, period: np.ndarray) -> np.ndarray:
    """Which bodies (n,) BODY may reach into a region, (n,)."""
    lower, upper = np.array(region.lower), np.array(region.upper)
    offset = bodies["position"] - 0.5 * (lower + upper)
    round_ = np.where(period > 0.0, period, np.inf)
    offset -= np.where(period > 0.0, period, 0.0) * np.rint(offset / round_)
    return (np.abs(offset) <= 0.5 * (upper - lower) + bodies["radius"][:, None]).all(axis=1)


def _energy(model: Model, bodies: np.ndarray) -> float:
    """Kinetic and potential energy of bodies (n,) BODY in the field of a model [J]."""
    system = model.system._replace(body=bodies, particles=len(bodies), bounded=len(bodies))
    return float(conserved(system)[0].sum())
