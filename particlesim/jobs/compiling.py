"""Kernels compiled before they are needed: once, on two cores, and with a count of those that are done.

Numba compiles one function at a time in a process. So two processes apart compile into the same cache: one draws a
picture, and one lets spheres collide, while this one builds a small scene and looks closer at its polyhedra.
"""

from __future__ import annotations

import os
import selectors
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from typing import Any

import numba
import numpy as np
from numba.core import event

from particlesim.core.constants import COMPILING
from particlesim.core.jit import is_compiled
from particlesim.geometry import shapes
from particlesim.jobs.frame_source import Progress, tell
from particlesim.rendering import Renderer
from particlesim.rendering.look import look_of
from particlesim.rendering.quality import quality_of
from particlesim.scene import Scene
from particlesim.scene.world import Solver
from particlesim.simulation.simulation import Simulation
from particlesim.trajectory.frames import Frame, Header

# How many compilations there are, counted with an empty cache: this package's kernels and functions of numba's own.
COMPILATIONS = {"simulating": 440, "drawing": 170, "occlusion": 20, "soft light": 50, "outlines": 2}

# Modules of the kernels of each part that take longest; with one missing, the part has yet to be compiled.
_SIGNS = {
    "simulating": ("dynamics.events.collision_prediction", "dynamics.events.event_queue"),
    "drawing": ("rendering.visibility.rasterise", "rendering.shading.shade"),
    "occlusion": ("rendering.shading.ambient_occlusion",),
    "soft light": ("rendering.shading.pixel_light",),
    "outlines": ("rendering.shading.outlines",),
}


def compile_kernels(scene: Scene | None, look: Scene | None, progress: Progress | None) -> None:
    """Compile what simulating a scene and drawing a look run, as far as that was not done before; None for neither.

    ``progress`` is told how many kernels are compiled, and about how many there will be.
    """
    simulating = _missing([] if scene is None else ["simulating"])
    drawing = _missing([] if look is None else _parts_of(look))
    total = sum(COMPILATIONS[part] for part in simulating + drawing)
    # What is not on disk, as numba's own functions, is compiled by each process, and counted by each.
    with _Tally(lambda done: tell(progress, COMPILING, min(done, total - 1), total)) as tally:
        drawn = tally.apart("draw", _like(look)) if look is not None and drawing and simulating else nullcontext()
        if scene is not None and simulating:
            with tally.apart("collide", scene.solver), drawn:
                simulation = _small("cube", scene.solver)
                simulation.run(duration=1.0)
                simulation.frame()
        elif look is not None and drawing:
            _draw(_like(look))


def _missing(parts: list[str]) -> list[str]:
    """Those parts of the work of which kernels have yet to be compiled."""
    config: Any = numba.config
    return [part for part in parts if not config.DISABLE_JIT and not all(map(is_compiled, _SIGNS[part]))]


def _parts_of(look: Scene) -> list[str]:
    """The parts of the work that pictures take that look like this."""
    quality = quality_of(look)
    light = "soft light" if quality.sky else "occlusion" if quality.ambient_occlusion else None
    return [part for part in ("drawing", light, "outlines" if look.show.outlines else None) if part]


class _Listener(event.Listener):
    """Calls back at each compilation of this process. A context manager."""

    def __init__(self, compiled: Callable[[], object]) -> None:
        self._compiled = compiled

    def on_start(self, event: Any) -> None:
        """Nothing is done yet."""

    def on_end(self, event: Any) -> None:
        """One is done."""
        self._compiled()


class _Tally:
    """Counts compilations, here and in processes apart. A context manager, which counts those here."""

    def __init__(self, count: Callable[[int], None]) -> None:
        self._count, self._done = count, 0
        self._selector = selectors.DefaultSelector()
        self._listener = event.install_listener("numba:compile", _Listener(self._compiled))

    def __enter__(self) -> _Tally:
        self._listener.__enter__()
        return self

    def __exit__(self, *error: Any) -> None:
        self._listener.__exit__(*error)
        self._selector.close()

    @contextmanager
    def apart(self, part: str, model: Scene | Solver) -> Iterator[None]:
        """Have a part compiled by a process of its own, and wait for it at the end of the block.

        Where that fails, kernels are compiled when they are called, and what is wrong is said then.
        """
        code = f"from particlesim.jobs.compiling import compile_apart; compile_apart({part!r})"
        command = [sys.executable, "-c", code, model.model_dump_json()]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as process:
            said: Any = process.stdout
            self._selector.register(said, selectors.EVENT_READ)
            try:
                yield
                while said in self._selector.get_map():
                    self._hear(None)
                process.wait()
            finally:
                process.kill()

    def _compiled(self) -> None:
        self._add(1)
        self._hear(0.0)

    def _add(self, compiled: int) -> None:
        self._done += compiled
        self._count(self._done)

    def _hear(self, timeout: float | None) -> None:
        """Count what processes apart say within ``timeout`` [s]: a byte for each compilation, nothing at the end."""
        for key, _ in self._selector.select(timeout):
            said = os.read(key.fd, 4096)
            self._add(len(said))
            if not said:
                self._selector.unregister(key.fileobj)


def compile_apart(part: str) -> None:
    """What a process apart does: compile a part, and say so."""
    table = sys.argv[1]
    with event.install_listener("numba:compile", _Listener(lambda: os.write(1, b"."))):
        if part == "draw":
            os.nice(10)  # others wait for the kernels of collisions
            _draw(Scene.model_validate_json(table))
        else:
            _small("sphere", Solver.model_validate_json(table)).run(duration=1.0)


def _small(shape: str, solver: Solver) -> Simulation:
    """Two particles of a shape that are about to collide; with cubes, a sphere that is placed at random."""
    at, towards = [0.3, 0.3, 0.3], [-1.0, -1.0, -1.0]
    poses = [{"position": [-1.0, -1.0, -1.0]}, {"position": at, "velocity": towards}]
    groups: list[Any] = [{"shape": shape, "placement": {"kind": "list", "poses": poses}}]
    if shape == "cube":
        groups.append({"shape": "sphere", "count": 1})
    return Simulation(Scene(world={"size": [4.0, 4.0, 4.0]}, solver=solver, particles=groups))


def _like(look: Scene) -> Scene:
    """A cube and a sphere in a small world, to be drawn like a scene."""
    groups = [{"shape": "cube", "count": 1}, {"shape": "sphere", "count": 1}]
    show = {"readout": False, "outlines": look.show.outlines}
    return Scene(world={"size": [4.0, 4.0, 4.0]}, particles=groups, movie=look.movie, show=show)


def _draw(scene: Scene) -> None:
    """Draw the cube and the sphere."""
    one, zero, number = np.ones(2), np.zeros((2, 3)), np.arange(2)
    header = Header("", (shapes.box(), shapes.sphere()), number, one, number, one, np.ones((2, 3)))
    position, orientation = np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]]), np.tile([1.0, 0.0, 0.0, 0.0], (2, 1))
    frame = Frame(0.0, position, orientation, zero, zero, zero.astype(np.int64), np.zeros(2, dtype=np.int64))
    with Renderer(look_of(scene, header, frame)) as renderer:
        renderer.draw(frame)
