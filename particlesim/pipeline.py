"""From a scene to a trajectory, and from either to a movie."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np

from particlesim.jit import CACHE_FOLDER
from particlesim.rendering import Renderer, write_image, write_movie
from particlesim.rendering.cells import octree_cells
from particlesim.scene import Scene
from particlesim.simulation import Simulation
from particlesim.summary import Summary
from particlesim.trajectory import Frame, Header, Trajectory, TrajectoryWriter

# Called with what is going on, how many frames are done, and how many there will be.
Progress = Callable[[str, int, int], None]


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
        for frame in watch.timed("simulating", _frames(simulation)):
            writer.append(frame)
            summary.add(frame)
            _tell(progress, "simulating", summary.frames, scene.frames)
    return summary


def render(
    source: Scene | Trajectory | str | Path,
    path: str | Path,
    *,
    progress: Progress | None = None,
    threads: int | None = None,
) -> Summary:
    """Make a movie (MP4) of a scene, simulating it, or of a trajectory, as it was; and a poster (PNG) beside it.

    Errors as for ``simulate``; RenderError if this machine cannot draw or encode.
    """
    with ExitStack() as stack:
        if isinstance(source, str | Path):
            source = stack.enter_context(Trajectory(source))
        if isinstance(source, Trajectory):
            scene, header, total = _scene_of(source), source.header, len(source)
            frames: Iterable[Frame] = source
        else:
            simulation = _start(source, threads, progress)
            scene, header, total = source, simulation.header, source.frames
            frames = _frames(simulation)
        summary = _summary(scene, header)
        watch = _Stopwatch(summary)
        phase = "reading" if isinstance(source, Trajectory) else "simulating"
        renderer = stack.enter_context(Renderer(scene, header))
        poster: list[np.ndarray] = []

        def images() -> Iterator[np.ndarray]:
            for frame in watch.timed(phase, frames):
                with watch.running("drawing"):
                    cells = octree_cells(scene, header, frame) if scene.show.cells else None
                    image = renderer.draw(frame, cells)
                # A third of the way in, things have begun to happen.
                if summary.frames == total // 3:
                    poster.append(image)
                summary.add(frame)
                yield image
                _tell(progress, "rendering", summary.frames, total)

        times = write_movie(path, images(), scene.movie.fps, scene.movie.size, scene.movie.crf)
        summary.seconds["encoding"] = times.encoding
        write_image(Path(path).with_suffix(".png"), poster[0])
    return summary


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


def _frames(simulation: Simulation) -> Iterator[Frame]:
    """The frames of a scene: at time zero and at every tick of its movie."""
    yield simulation.frame()
    for k in range(1, simulation.scene.frames):
        simulation.run_until(k / simulation.scene.movie.fps)
        yield simulation.frame()


def _scene_of(trajectory: Trajectory) -> Scene:
    return Scene.model_validate_json(trajectory.header.scene_json)


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
        start = time.perf_counter()
        yield
        self._seconds[name] = self._seconds.get(name, 0.0) + time.perf_counter() - start

    def timed(self, name: str, frames: Iterable[Frame]) -> Iterator[Frame]:
        """Pass frames on and count how long each was in coming."""
        source = iter(frames)
        while True:
            with self.running(name):
                frame = next(source, None)
            if frame is None:
                return
            yield frame
