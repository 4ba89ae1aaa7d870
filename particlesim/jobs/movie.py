"""From a scene to a trajectory, and from either to a movie."""

from __future__ import annotations

import time as clock
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from particlesim.core.output_path import check_output
from particlesim.jobs.compiling import compile_kernels
from particlesim.jobs.drawers import Drawers
from particlesim.jobs.frame_source import (
    FrameSource,
    Progress,
    frame_source,
    frame_source_until,
    frames_ahead,
    frames_of,
    opened,
    start,
    tell,
)
from particlesim.jobs.summary import Summary
from particlesim.rendering import write_image, write_movie
from particlesim.rendering.gl import platform
from particlesim.rendering.hud.history import History
from particlesim.rendering.look import look_of
from particlesim.rendering.shading.colour import encoded
from particlesim.rendering.shading.fields import is_settled_by_frames
from particlesim.rendering.video.fade import faded, strength
from particlesim.scene import Scene
from particlesim.setup.build import contact_laws_of
from particlesim.trajectory.frames import Frame, Header
from particlesim.trajectory.gsd_file import Trajectory, TrajectoryWriter

_T = TypeVar("_T")


def simulate(
    scene: Scene, path: str | Path, *, progress: Progress | None = None, threads: int | None = None
) -> Summary:
    """Simulate a scene and write its trajectory (GSD). Needs neither OpenGL nor ffmpeg.

    Parameters
    ----------
    scene
        What to simulate, to its end.
    path
        The file, which must end in .gsd; it appears when it is whole.
    progress
        Called with what is going on, how many frames are done, and how many there will be.
    threads
        How many threads to simulate with; one a processor if None.

    Returns
    -------
    What the run amounted to.

    Raises
    ------
    OutputError
        If no trajectory can be written to ``path``; found out before any work.
    SceneError
        If the scene cannot be built.
    SimulationError
        If the simulation runs away.
    OSError
        If the file cannot be written.
    """
    check_output(path, ".gsd")
    compile_kernels(scene, None, progress)
    simulation = start(scene, threads, progress)
    summary = _summary(scene, simulation.header)
    with TrajectoryWriter(path, simulation.header) as writer:
        for _, frame in _timed(summary, "simulating", frames_of(simulation, scene.frames)):
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

    Parameters
    ----------
    source
        A scene, a trajectory, or the path of a trajectory.
    path
        The movie, which must end in .mp4; it appears when it is whole.
    look
        Draws a trajectory as this scene says, in place of its own.
    frames
        Numbers of the frames to draw, all if None; a scene is simulated from its start to the last of them.
    progress, threads
        As for ``simulate``.

    Returns
    -------
    What the run amounted to.

    Raises
    ------
    RenderError
        If this machine cannot draw, found out before any work, or cannot encode.
    TrajectoryError
        If the source is a file that is no trajectory, or damaged.
    ValueError
        For frames that are not there.
    OutputError, SceneError, SimulationError, OSError
        As for ``simulate``.
    """
    check_output(path, ".mp4", ".png")
    with opened(source) as movable:
        platform.choose()
        _compile(movable, look, progress)
        chosen = frame_source(movable, frames, threads, progress)
        scene = look or chosen.scene
        with MovieJob(chosen, scene, progress) as job:
            times = write_movie(path, job.images(), scene.movie.fps, scene.movie.size, scene.movie.crf)
            job.summary.seconds["encoding"] = times.encoding
            write_image(Path(path).with_suffix(".png"), job.poster)
    return job.summary


def still(
    source: Scene | Trajectory | str | Path,
    path: str | Path,
    time: float,
    *,
    look: Scene | None = None,
    progress: Progress | None = None,
    threads: int | None = None,
) -> Summary:
    """Make one picture (PNG) of a scene at a time, simulating it until then, or of a trajectory's nearest frame.

    Parameters
    ----------
    source
        A scene, a trajectory, or the path of a trajectory.
    path
        The picture, which must end in .png; it appears when it is whole.
    time
        Of the scene [s].
    look, progress, threads
        As for ``render``.

    Returns
    -------
    What the run amounted to.

    Raises
    ------
    OutputError, RenderError, TrajectoryError, SceneError, SimulationError, OSError
        As for ``render``.
    """
    check_output(path, ".png")
    with opened(source) as movable:
        platform.choose()
        _compile(movable, look, progress)
        chosen = frame_source_until(time, movable, threads, progress)
        with MovieJob(chosen, look or chosen.scene, progress) as job:
            for _ in job.images():
                pass
            write_image(path, job.poster)
    return job.summary


def _compile(source: Scene | Trajectory, look: Scene | None, progress: Progress | None) -> None:
    """Compile what pictures of a source need, its own or with the ``look`` of another scene."""
    own, simulated = (source.scene, None) if isinstance(source, Trajectory) else (source, source)
    compile_kernels(simulated, (look or own).movie, progress)


class MovieJob:
    """Makes the pictures of the frames of a source, as ``scene`` says. A context manager: it holds Drawers.

    ``summary``: what the frames that have passed amount to. RenderError if this machine cannot draw.
    """

    def __init__(self, source: FrameSource, scene: Scene, progress: Progress | None) -> None:
        self._source, self._movie, self._progress = source, scene.movie, progress
        self.summary = _summary(scene, source.header)
        self._frames = _timed(self.summary, source.phase, source.frames)
        sample: list[Frame] = []
        if is_settled_by_frames(scene):
            self._frames, sample = frames_ahead(source, self._frames, progress)
        self._drawers = Drawers(look_of(scene, source.header, source.first, sample), len(source.wanted))
        self.poster = np.zeros((0, 0, 3), dtype=np.uint8)  # of the movie that images() gives

    def __enter__(self) -> MovieJob:
        return self

    def __exit__(self, *error: Any) -> None:
        self._drawers.__exit__(*error)

    def images(self) -> Iterator[np.ndarray]:
        """The pictures of the movie, (h, w, 3) uint8, with its fades; all frames are taken into account on the way."""
        movie, summary, count = self._movie, self.summary, len(self._source.wanted)
        background = encoded(movie.background)
        for image in self._drawers.draw(self._wanted()):
            # A third of the way in, things have begun to happen.
            if summary.drawn == count // 3:
                self.poster = image
            seen = strength(summary.drawn, count, movie.fade * movie.fps)
            summary.drawn += 1
            summary.seconds["drawing"] = self._drawers.seconds
            self._tell()
            yield faded(image, seen, background)

    def _wanted(self) -> Iterator[tuple[Frame, History]]:
        """The frames to draw, each with what its readout needs of those drawn before it."""
        source, summary = self._source, self.summary
        history = History().then(source.first.ledger)
        for number, frame in self._frames:
            summary.add(frame)
            if number in source.wanted:
                yield frame, history
                history = history.then(frame.ledger)
            else:
                self._tell()

    def _tell(self) -> None:
        """Say how many frames are done: those that have passed, but for the pictures that are yet to come."""
        tell(self._progress, "rendering", self.summary.frames - len(self._drawers.waiting), self._source.total)


def _summary(scene: Scene, header: Header) -> Summary:
    laws = contact_laws_of(scene)
    elastic = bool((laws["restitution"] == 1.0).all() and (laws["friction"] == 0.0).all())
    return Summary(float(header.mass.sum()), scene.world.gravity, elastic)


def _timed(summary: Summary, name: str, passing: Iterable[_T]) -> Iterator[_T]:
    """Pass things on and add up how long they were in coming, in ``summary.seconds``."""
    source, seconds = iter(passing), summary.seconds
    while True:
        start = clock.perf_counter()
        thing = next(source, None)
        seconds[name] = seconds.get(name, 0.0) + clock.perf_counter() - start
        if thing is None:
            return
        yield thing
