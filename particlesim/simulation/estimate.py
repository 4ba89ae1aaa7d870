"""What a scene amounts to, before it is simulated."""

from __future__ import annotations

import math

import numpy as np

from particlesim.scene import Scene
from particlesim.setup.build import BYTES_PER_PARTICLE
from particlesim.simulation.simulation import Simulation

# Bytes of the process before any particle: interpreter, numpy, numba, compiled kernels, OpenGL.
_BYTES_OF_PROCESS = 400e6


def survey(scene: Scene) -> list[tuple[str, str]]:
    """Name and value of what one wants to know of a scene. SceneError if it cannot be built."""
    simulation = Simulation(scene)
    c, world = simulation.constants, scene.world
    volume = math.prod(world.size)
    volumes = np.array([s.volume for s in simulation.shapes])[c.shape] * c.size**3 if len(c.size) else np.zeros(0)
    rows = [("particles", f"{len(c.size):,}")]
    for g, group in enumerate(scene.particles):
        members = c.group == g
        name = group.name or f"particles[{g}]"
        if not members.any():
            rows.append((f"  {name}", "none"))
            continue
        shape = simulation.shapes[int(c.shape[members][0])]
        sizes = c.size[members]
        span = f"{sizes.min():g}" if sizes.min() == sizes.max() else f"{sizes.min():g} to {sizes.max():g}"
        rows.append(
            (f"  {name}", f"{members.sum():,} x {shape.name}, size {span}, mass {c.mass[members].sum():.4g} kg")
        )
    width, height = scene.movie.size
    pixels = 3 * width * height
    chosen = "given" if scene.solver.time_step != "auto" else "automatic, at the start"
    step = simulation.next_time_step()
    return [
        *rows,
        ("world", f"{' x '.join(f'{edge:g}' for edge in world.size)} m, {', '.join(world.boundary)}"),
        ("volume fraction", f"{volumes.sum() / volume:.3g}"),
        ("broad phase", scene.solver.broad_phase.kind),
        ("time step", f"{step:.3g} s ({chosen}), about {math.ceil(scene.duration / step):,} steps"),
        ("duration", f"{scene.duration:g} s"),
        ("frames", f"{scene.frames:,} of {width} x {height} at {scene.movie.fps:g} a second{_pace(scene.movie.speed)}"),
        ("memory", f"about {(_BYTES_OF_PROCESS + BYTES_PER_PARTICLE * len(c.size) + 30 * pixels) / 1e6:,.0f} MB"),
    ]


def _pace(speed: float) -> str:
    """How fast a movie shows what happens, if not as fast as it does."""
    return "" if speed == 1.0 else f", {speed:g} times as fast as it happens"
