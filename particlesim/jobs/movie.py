"""From a scene to a trajectory, and from either to a movie."""

from __future__ import annotations

import time as clock
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TypeVar

import numpy as np

from particlesim.jobs.frame_source import Progress, Reel, frames_of, opened, reel_of, reel_until, start, tell
from particlesim.jobs.summary import Summary
from particlesim.rendering import Renderer, write_image, write_movie
from particlesim.rendering.octree_cells import octree_cells
from particlesim.rendering.shading.colour import encoded
from particlesim.rendering.video.fade import faded, strength
from particlesim.scene import Scene
from particlesim.trajectory.gsd_file import Frame, Header, Trajectory, TrajectoryWriter

_T = TypeVar("_T")


def simulate(
    scene: Scene, path: str | Path, *, progress: Progress | None = None, threads: int | None = None
) -> Summary:
    """Simulate ``scene`` and write its trajectory to ``path`` (GSD). Needs neither OpenGL nor ffmpeg.

    SceneError if the scene cannot be built, SimulationError if it runs away, OSError if the file cannot be written.
    """
    simulation = start(scene, threads, progress)
    summary = _summary(scene, simulation.header)
    watch = _Stopwatch(summary)
    with TrajectoryWriter(path, simulation.header) as writer:
        for _, frame in watch.timed("simulating", frames_of(simulation, scene.frames)):
            writer.append(frame)
            summary.add(frame)
            tell(progress, "simulating", summary.frames, scene.frames)
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
    if this machine cannot draw or encode; ValueError for frames that are not there.
    """
    with opened(source) as movable:
        reel = reel_of(movable, frames, threads, progress)
        scene = look or reel.scene
        with _Studio(reel, scene, progress) as studio:
            times = write_movie(path, studio.images(), scene.movie.fps, scene.movie.size, scene.movie.crf)
            studio.summary.seconds["encoding"] = times.encoding
            write_image(Path(path).with_suffix(".png"), studio.poster)
    return studio.summary


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
    with opened(source) as movable:
        reel = reel_until(time, movable, threads, progress)
        with _Studio(reel, look or reel.scene, progress) as studio:
            for _ in studio.images():
                pass
            write_image(path, studio.poster)
    return studio.summary


class _Studio:
    """Where pictures are taken of a reel, ``scene`` saying how. A context manager: it holds a Renderer.

    ``summary``: what the frames that have passed amount to. RenderError if this machine cannot draw.
    """

    def __init__(self, reel: Reel, scene: Scene, progress: Progress | None) -> None:
        self._reel, self._scene, self._progress = reel, scene, progress
        self._renderer = Renderer(scene, reel.header, reel.first)
        self.summary = _summary(scene, reel.header)
        self.poster = np.zeros((0, 0, 3), dtype=np.uint8)  # of the movie that images() gives

    def __enter__(self) -> _Studio:
        return self

    def __exit__(self, *_: object) -> None:
        self._renderer.close()

    def images(self) -> Iterator[np.ndarray]:
        """The pictures of the movie, (h, w, 3) uint8, with its fades; all frames are taken into account on the way."""
        reel, movie, summary = self._reel, self._scene.movie, self.summary
        watch = _Stopwatch(summary)
        background, count = encoded(movie.background), len(reel.wanted)
        for number, frame in watch.timed(reel.phase, reel.frames):
            if number in reel.wanted:
                with watch.running("drawing"):
                    image = self._picture(frame)
                # A third of the way in, things have begun to happen.
                if summary.drawn == count // 3:
                    self.poster = image
                seen = strength(summary.drawn, count, movie.fade * movie.fps)
                summary.drawn += 1
                yield faded(image, seen, background)
            summary.add(frame)
            tell(self._progress, "rendering", summary.frames, reel.total)

    def _picture(self, frame: Frame) -> np.ndarray:
        """A frame as it looks, with the octree's cells if they are shown."""
        cells = octree_cells(self._scene, self._reel.header, frame) if self._scene.show.cells else None
        return self._renderer.draw(frame, cells)


def _summary(scene: Scene, header: Header) -> Summary:
    restitutions = [scene.world.restitution, *(group.restitution for group in scene.particles)]
    elastic = all(restitution in (None, 1.0) for restitution in restitutions)
    return Summary(float(header.mass.sum()), scene.world.gravity, elastic)


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
