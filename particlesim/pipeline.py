"""From a scene to a trajectory, and from either to a movie."""

from __future__ import annotations

import bisect
import json
import time as clock
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import NamedTuple, TypeVar

import numpy as np

from particlesim.jit import CACHE_FOLDER
from particlesim.rendering import Renderer, write_image, write_movie
from particlesim.rendering.cells import octree_cells
from particlesim.rendering.colour import encoded
from particlesim.rendering.fade import faded, strength
from particlesim.scene import Scene
from particlesim.scene.file import parse_scene
from particlesim.simulation import Simulation
from particlesim.summary import Summary
from particlesim.trajectory import Frame, Header, Trajectory, TrajectoryWriter

# Called with what is going on, how many frames are done, and how many there will be.
Progress = Callable[[str, int, int], None]

_T = TypeVar("_T")


def simulate(
    scene: Scene, path: str | Path, *, progress: Progress | None = None, threads: int | None = None
) -> Summary:
    """Simulate ``scene`` and write its trajectory to ``path`` (GSD). Needs neither OpenGL nor ffmpeg.

    SceneError if the scene cannot be built, SimulationError if it runs away, OSError if the file cannot be written.
    """
    simulation = _start(scene, threads, progress)
    summary = _summary(scene, simulation.header)
    watch = _Stopwatch(summary)
    with TrajectoryWriter(path, simulation.header) as writer:
        for _, frame in watch.timed("simulating", _frames(simulation, scene.frames)):
            writer.append(frame)
            summary.add(frame)
            _tell(progress, "simulating", summary.frames, scene.frames)
    return summary


def render(
    source: Scene | Trajectory | str | Path,
    path: str | Path,
    *,
    look: Scene | None = None,
    frames: range | None = None,
    progress: Progress | None = None,
    threads: int | None = None,
) -> Summary:
    """Make a movie (MP4) of a scene, simulating it, or of a trajectory, as it was; and a poster (PNG) beside it.

    ``look`` draws a trajectory as this scene says, in place of its own; ``frames`` are the numbers of those to draw,
    all if not given: a scene is simulated from its start to the last of them. Errors as for ``simulate``; RenderError
    if this machine cannot draw or encode.
    """
    with ExitStack() as stack:
        source = _opened(source, stack)
        scene = look or (scene_of(source) if isinstance(source, Trajectory) else source)
        wanted = frames or range(len(source) if isinstance(source, Trajectory) else source.frames)
        reel = _reel(source, wanted, threads, progress)
        summary = _summary(scene, reel.header)
        watch = _Stopwatch(summary)
        renderer = stack.enter_context(Renderer(scene, reel.header, reel.first))
        background = encoded(scene.movie.background)
        poster: list[np.ndarray] = []

        def images() -> Iterator[np.ndarray]:
            for number, frame in watch.timed(reel.phase, reel.frames):
                if number in wanted:
                    with watch.running("drawing"):
                        image = _drawn(scene, reel.header, renderer, frame)
                    # A third of the way in, things have begun to happen.
                    if summary.drawn == len(wanted) // 3:
                        poster.append(image)
                    seen = strength(summary.drawn, len(wanted), scene.movie.fade * scene.movie.fps)
                    summary.drawn += 1
                    yield faded(image, seen, background)
                summary.add(frame)
                _tell(progress, "rendering", summary.frames, reel.total)

        times = write_movie(path, images(), scene.movie.fps, scene.movie.size, scene.movie.crf)
        summary.seconds["encoding"] = times.encoding
        write_image(Path(path).with_suffix(".png"), poster[0])
    return summary


def still(
    source: Scene | Trajectory | str | Path,
    path: str | Path,
    time: float,
    *,
    look: Scene | None = None,
    progress: Progress | None = None,
    threads: int | None = None,
) -> Summary:
    """Make one picture (PNG): of a scene at ``time`` [s], simulating it until then, or of a trajectory's nearest frame.

    Otherwise like ``render``.
    """
    with ExitStack() as stack:
        source = _opened(source, stack)
        scene = look or (scene_of(source) if isinstance(source, Trajectory) else source)
        if isinstance(source, Trajectory):
            nearest = _nearest(source, time)
            reel = _reel(source, range(nearest, nearest + 1), threads, progress)
        else:
            reel = _simulated_until(time, source, threads, progress)
        summary = _summary(scene, reel.header)
        watch = _Stopwatch(summary)
        renderer = stack.enter_context(Renderer(scene, reel.header, reel.first))
        for _, frame in watch.timed(reel.phase, reel.frames):
            summary.add(frame)
            _tell(progress, reel.phase, summary.frames, reel.total)
        with watch.running("drawing"):
            image = _drawn(scene, reel.header, renderer, frame)
        write_image(path, image)
        summary.drawn = 1
    return summary


def scene_of(trajectory: Trajectory) -> Scene:
    """The scene that a trajectory is of. SceneError if this version cannot read it."""
    return parse_scene(json.loads(trajectory.header.scene_json))


class _Reel(NamedTuple):
    """What passes before the camera."""

    header: Header
    first: Frame  # of the whole run: what scales and changes refer to
    frames: Iterator[tuple[int, Frame]]  # with their numbers, all that are simulated or read
    total: int  # how many there are of them
    phase: str  # what takes the time until the next


def _opened(source: Scene | Trajectory | str | Path, stack: ExitStack) -> Scene | Trajectory:
    return stack.enter_context(Trajectory(source)) if isinstance(source, str | Path) else source


def _reel(source: Scene | Trajectory, wanted: range, threads: int | None, progress: Progress | None) -> _Reel:
    """All frames of a scene up to the last wanted one; of a trajectory those alone."""
    if isinstance(source, Trajectory):
        stored = ((k, source[k]) for k in wanted)
        return _Reel(source.header, source[0], stored, len(wanted), "reading")
    simulation = _start(source, threads, progress)
    total = max(wanted) + 1
    return _Reel(simulation.header, simulation.frame(), _frames(simulation, total), total, "simulating")


def _simulated_until(time: float, scene: Scene, threads: int | None, progress: Progress | None) -> _Reel:
    """The frames of a scene up to ``time`` [s], and last the particles at that very time."""
    simulation = _start(scene, threads, progress)
    before = int(time * scene.movie.fps) + 1

    def frames() -> Iterator[tuple[int, Frame]]:
        yield from _frames(simulation, before)
        simulation.run_until(time)
        yield before, simulation.frame()

    return _Reel(simulation.header, simulation.frame(), frames(), before + 1, "simulating")


def _nearest(trajectory: Trajectory, time: float) -> int:
    """The frame whose time is nearest to ``time`` [s]."""
    after = bisect.bisect_left(range(len(trajectory) - 1), time, key=trajectory.time)
    return min(range(max(after - 1, 0), after + 1), key=lambda k: abs(trajectory.time(k) - time))


def _drawn(scene: Scene, header: Header, renderer: Renderer, frame: Frame) -> np.ndarray:
    """The picture of a frame, with the octree's cells if they are shown."""
    return renderer.draw(frame, octree_cells(scene, header, frame) if scene.show.cells else None)


def _start(scene: Scene, threads: int | None, progress: Progress | None) -> Simulation:
    if not any(Path(CACHE_FOLDER).rglob("*.nbi")):
        _tell(progress, "compiling, this once", 0, scene.frames)
        _compile(scene)
    _tell(progress, "preparing", 0, scene.frames)
    return Simulation(scene, threads=threads)


def _compile(scene: Scene) -> None:
    """Run two cubes into each other, so that the kernels a scene needs are compiled before its clock runs."""
    at, towards = [0.3, 0.3, 0.3], [-1.0, -1.0, -1.0]
    poses = [{"position": [-1.0, -1.0, -1.0]}, {"position": at, "velocity": towards}]
    table = {
        "world": {"size": [4.0, 4.0, 4.0]},
        "solver": scene.solver,
        "particles": [
            {"shape": "cube", "placement": {"kind": "list", "poses": poses}},
            {"shape": "sphere", "count": 1},
        ],
    }
    Simulation(Scene.model_validate(table)).run(duration=0.5)


def _frames(simulation: Simulation, total: int) -> Iterator[tuple[int, Frame]]:
    """The first frames of a scene and their numbers: at time zero and at every tick of its movie."""
    yield 0, simulation.frame()
    for k in range(1, total):
        simulation.run_until(k / simulation.scene.movie.fps)
        yield k, simulation.frame()


def _summary(scene: Scene, header: Header) -> Summary:
    restitutions = [scene.world.restitution, *(group.restitution for group in scene.particles)]
    elastic = all(restitution in (None, 1.0) for restitution in restitutions)
    return Summary(float(header.mass.sum()), scene.world.gravity, elastic)


def _tell(progress: Progress | None, phase: str, done: int, total: int) -> None:
    if progress is not None:
        progress(phase, done, total)


class _Stopwatch:
    """Adds up the seconds spent in each part of the work, in ``summary.seconds``."""

    def __init__(self, summary: Summary) -> None:
        self._seconds = summary.seconds

    @contextmanager
    def running(self, name: str) -> Iterator[None]:
        """Count how long the ``with`` block takes."""
        start = clock.perf_counter()
        yield
        self._seconds[name] = self._seconds.get(name, 0.0) + clock.perf_counter() - start

    def timed(self, name: str, passing: Iterable[_T]) -> Iterator[_T]:
        """Pass things on and count how long each was in coming."""
        source = iter(passing)
        while True:
            with self.running(name):
                thing = next(source, None)
            if thing is None:
                return
            yield thing
