"""What a scene amounts to, before it is simulated."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence

import numpy as np

from particlesim.core.durations import in_words
from particlesim.core.jit import is_compiled
from particlesim.scene import Scene
from particlesim.scene.camera import Movie
from particlesim.setup.limits import check_limits, check_steps
from particlesim.setup.memory import BYTES_PER_PARTICLE
from particlesim.simulation.needs import movie_bytes, trajectory_bytes
from particlesim.simulation.simulation import Simulation

# Seconds for which steps are measured, but for the slowest.
_MEASURED = 1.0

# A mesh so many times as large as the world, or as much smaller, is likely in another unit.
_ODD_SIZE = 100.0

# Bytes of the process before any particle: interpreter, numpy, numba, compiled kernels, OpenGL.
_BYTES_OF_PROCESS = 400e6


def estimate(scene: Scene) -> list[tuple[str, str]]:
    """Name and value of what one wants to know of a scene. SceneError if it cannot be built."""
    check_limits(scene)
    simulation = Simulation(scene)
    check_end(simulation)
    world, movie = scene.world, scene.movie
    return [
        *([("title", scene.title)] if scene.title else []),
        *_particle_rows(simulation),
        *_mesh_rows(simulation),
        ("world", f"{' x '.join(f'{edge:g}' for edge in world.size)} m, {', '.join(world.boundary)}"),
        ("volume fraction", f"{_volume(simulation) / math.prod(world.size):.3g}"),
        ("broad phase", scene.solver.broad_phase.kind),
        ("time step", _time_step(simulation)),
        ("duration", f"{scene.duration:g} s"),
        ("frames", f"{scene.frames:,} of {movie.size[0]} x {movie.size[1]} at {movie.fps:g} a second{_speed(movie)}"),
        ("memory", f"about {_bytes(scene) / 1e6:,.0f} MB"),
        ("disk", _disk(scene)),
        ("computing", _computing(simulation)),
    ]


def check_end(simulation: Simulation) -> None:
    """SceneError if there is no end to the simulation of a scene."""
    check_steps(simulation.scene, simulation.steps_of(simulation.scene.duration), "about")


def _computing(simulation: Simulation) -> str:
    """How long the simulation takes, from a few of its steps, which are taken."""
    if not is_compiled("dynamics.events.event_queue"):
        return "not known before the kernels are compiled, which the first run does"
    duration = simulation.scene.duration
    simulation.step(min(simulation.next_time_step(), duration))  # the first step also loads kernels
    walls: list[float] = []
    passed: list[float] = []
    # The slowest step does not count: kernels may have been compiled or loaded in it that none before had need of.
    while sum(walls) - max(walls, default=0.0) < _MEASURED and simulation.time < duration:
        begun, start = simulation.time, time.perf_counter()
        simulation.step()
        walls.append(time.perf_counter() - start)
        passed.append(simulation.time - begun)
    if len(walls) < 2:
        return "a step or two"
    slowest = int(np.argmax(walls))
    reached = sum(passed) - passed[slowest]
    seconds = (sum(walls) - walls[slowest]) / reached * duration
    about = "about " if seconds >= 1.0 else ""
    return f"{about}{in_words(seconds)} to simulate, as the first {reached:.3g} s of the scene go; pictures come on top"


def _particle_rows(simulation: Simulation) -> list[tuple[str, str]]:
    """How many particles there are in all and in each group, with their shape, sizes and mass."""
    model = simulation.model
    particles = model.population if simulation.scene.is_open else model.particles
    rows = [("particles", f"{len(particles):,}")]
    for g, group in enumerate(simulation.scene.groups):
        members = particles[particles["group"] == g]
        rows.append(
            (f"  {group.name or simulation.scene.key(g)}", _group(simulation, members) if len(members) else "none")
        )
    return rows


def _mesh_rows(simulation: Simulation) -> list[tuple[str, str]]:
    """What obstacles that are meshes amount to, and what is odd about each."""
    scene, rows = simulation.scene, []
    for k, (said, shape) in enumerate(zip(scene.obstacles, simulation.model.obstacle_shapes, strict=True)):
        if not len(shape.triangles):
            continue
        extent = np.ptp(shape.vertices, axis=0) * said.size
        spans = " x ".join(f"{length:.3g}" for length in extent)
        name = said.name or f"obstacles[{k}]"
        rows.append((f"  {name}", f"{len(shape.triangles):,} triangles, {spans} m"))
        rows += [("    odd", remark) for remark in (*shape.remarks, *_size_remarks(extent, scene.world.size))]
    return [("meshes", f"{len({name for name, _ in rows if name != '    odd'}):,}"), *rows] if rows else []


def _size_remarks(extent: np.ndarray, world: Sequence[float]) -> list[str]:
    """What is odd about how large a mesh is in a world [m]."""
    factor = float(extent.max() / max(world))
    if 1.0 / _ODD_SIZE < factor < _ODD_SIZE:
        return []
    times = f"{factor:,.0f} times as large as" if factor > 1.0 else f"{1.0 / factor:,.0f} times smaller than"
    return [f"{times} the world: is its file in the unit that its shape says?"]


def _group(simulation: Simulation, members: np.ndarray) -> str:
    """What the particles of a group (m,) BODY amount to."""
    shape, sizes = simulation.model.shapes[int(members["shape_row"][0])], members["scale"]
    span = f"{sizes.min():g}" if sizes.min() == sizes.max() else f"{sizes.min():g} to {sizes.max():g}"
    mass = f"{members['mass'].sum():.4g} kg{' in all' if len(members) > 1 else ''}"
    return "; ".join([f"{len(members):,} x {shape.name}, size {span}, mass {mass}", *shape.remarks])


def _volume(simulation: Simulation) -> float:
    """Of all particles [m^3]."""
    particles = simulation.model.particles
    volumes = np.array([shape.volume for shape in simulation.model.shapes])
    return float((volumes[particles["shape_row"]] * particles["scale"] ** 3).sum()) if len(particles) else 0.0


def _time_step(simulation: Simulation) -> str:
    step, scene = simulation.next_time_step(), simulation.scene
    chosen = "given" if scene.solver.time_step != "auto" else "automatic, at the start"
    return f"{step:.3g} s ({chosen}), about {math.ceil(scene.duration / step):,} steps"


def _speed(movie: Movie) -> str:
    """How fast a movie shows what happens, if not as fast as it does."""
    return "" if movie.speed == 1.0 else f", {movie.speed:g} times as fast as it happens"


def _disk(scene: Scene) -> str:
    trajectory, movie = trajectory_bytes(scene), movie_bytes(scene.movie, scene.frames)
    return f"about {_megabytes(trajectory)} as a trajectory, {_megabytes(movie)} as a movie"


def _megabytes(count: float) -> str:
    return f"{count / 1e6:,.{0 if count > 1e7 else 1}f} MB"


def _bytes(scene: Scene) -> float:
    """Memory that a run takes."""
    pixels = 3 * math.prod(scene.movie.size)
    return _BYTES_OF_PROCESS + BYTES_PER_PARTICLE * scene.number + 30 * pixels
