"""The pictures of the frames of a source, in their order, and what the frames amount to."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Iterable, Iterator
from typing import Any, TypeVar

import numpy as np

from particlesim.jobs.drawers import Drawers
from particlesim.jobs.frame_source import Frames, FrameSource, Progress, frames_after, frames_ahead, tell
from particlesim.jobs.partial_run import PartialRun
from particlesim.jobs.summary import Summary
from particlesim.rendering.hud.history import History
from particlesim.rendering.hud.title import Title
from particlesim.rendering.look import look_of
from particlesim.rendering.shading.environment import Environment
from particlesim.rendering.shading.fields import is_settled_by_frames
from particlesim.rendering.transparency import straight
from particlesim.rendering.video.fade import faded, strength, title_strength
from particlesim.scene import Scene
from particlesim.setup.build import contact_laws_of
from particlesim.simulation.soundness import SimulationError
from particlesim.trajectory.frames import Frame, Header

_T = TypeVar("_T")

# Where a run keeps the poster of its movie.
POSTER = "poster.npy"


class Pictures:
    """Makes the pictures of the frames of a source, as ``scene`` says. A context manager: it holds Drawers.

    With a ``run`` it goes on where that was left, and keeps in it what is done. What has ``passed`` before a part of a
    movie is read, if it is not given, and so is what comes after it. ``summary``: what the frames that have passed
    amount to. RenderError if this machine cannot draw.
    """

    def __init__(
        self,
        source: FrameSource,
        scene: Scene,
        progress: Progress | None,
        run: PartialRun | None = None,
        passed: History | None = None,
    ) -> None:
        self._source, self._movie, self._progress, self._run = source, scene.movie, progress, run
        around = Environment(scene)
        self._background = np.zeros(4) if scene.movie.transparent else around.background
        self._title = Title(source.scene.title if scene.show.title else "", scene.movie.size, around.dark)
        self.summary = summary_of(scene, source.header)
        self._history = History.of_movie(source.wanted, source.first.ledger, scene.show.plot is not None)
        self.poster = np.zeros((0, 0, 3), dtype=np.uint8)  # of the movie that images() gives; a part may have none
        if run is not None and run.kept:
            self._go_on(run, run.kept["values"])
        else:
            if passed is None:
                self._pass_over(source.wanted[: source.begin])
            else:
                self._history = passed
            self.summary.drawn = source.begin
        self._reads_all = passed is None
        self._wrong: SimulationError | None = None  # why there are no more frames
        self._frames = self._sound(timed(self.summary, source.phase, source.frames))
        # What is simulated ahead is not where the pictures are: such a run is simulated anew when it is gone on with.
        self._simulation = None if is_settled_by_frames(scene) else source.simulation
        sample: list[Frame] = []
        if is_settled_by_frames(scene):
            self._frames, sample = frames_ahead(source, self._frames, progress, self.summary.frames)
        elif source.simulation is not None:
            self._frames = frames_after(self._frames, self.summary.frames)
        self._ended = False
        self._drawers = Drawers(look_of(scene, source.header, source.first, sample), len(source.wanted))
        self._drawers.seconds = self.summary.seconds.get("drawing", 0.0)

    def __enter__(self) -> Pictures:
        return self

    def __exit__(self, *error: Any) -> None:
        self._drawers.__exit__(*error)

    def images(self, flush: Callable[[], None] = lambda: None) -> Iterator[np.ndarray]:
        """The pictures of the movie, (h, w, 3) uint8, with its fades and its title; all frames are taken into account.

        Without a background they have a fourth channel, 0 where nothing is.

        Of a part of a movie only its pictures are given, though all frames of the movie are taken into account.

        ``flush`` is called when all that came before is to be kept.
        """
        movie, summary, count = self._movie, self.summary, len(self._source.wanted)
        while not self._ended:
            for image in self._drawers.draw(self._until_due()):
                if summary.drawn == poster_place(count):
                    self._keep_poster(image)
                seen = strength(summary.drawn, count, movie.fade * movie.fps)
                titled = title_strength(summary.drawn, count, movie.fps)
                summary.drawn += 1
                summary.seconds["drawing"] = self._drawers.seconds
                self._tell()
                yield straight(self._title.over(faded(image, seen, self._background), titled))
            if self._run is not None and (self._run.due() or (self._ended and self._wrong)):
                flush()
                self._keep(self._run)
        if self._wrong is not None:
            raise self._wrong
        if self._reads_all:
            self._pass_over(self._source.wanted[self._source.total :])
        summary.drawn -= self._source.begin

    def _pass_over(self, numbers: range) -> None:
        """Take frames of a trajectory into account that another part of the movie draws."""
        for k in numbers:
            assert self._source.trajectory is not None
            ledger = self._source.trajectory.ledger(k)
            self.summary.add_moment(self._source.trajectory.time(k), ledger)
            self._history = self._history.then(ledger)

    def _until_due(self) -> Iterator[tuple[Frame, History]]:
        """Frames to draw, each with what its readout needs of those before it, until something is to be kept.

        One that cannot be ends them: those before it are drawn first.
        """
        for number, frame in self._frames:
            if frame is not None:
                self.summary.add(frame)
                if number in self._source.wanted:
                    yield frame, self._history
                    self._history = self._history.then(frame.ledger)
                else:
                    self._tell()
            if self._run is not None and self._run.due():
                return
        self._ended = True

    def _sound(self, frames: Frames) -> Frames:
        """The frames until one that cannot be."""
        try:
            yield from frames
        except SimulationError as error:
            self._wrong, self._simulation = error, None

    def _keep(self, run: PartialRun) -> None:
        values = {"summary": self.summary.table(), "history": self._history.table()}
        run.keep(self.summary.frames, self._source.total, self._simulation, values)

    def _go_on(self, run: PartialRun, values: dict[str, Any]) -> None:
        self.summary.go_on(values["summary"])
        self._history = History.of_table(values["history"])
        if (run.folder / POSTER).exists():
            self.poster = np.load(run.folder / POSTER)

    def _keep_poster(self, image: np.ndarray) -> None:
        self.poster = straight(image)
        if self._run is not None:
            np.save(self._run.folder / POSTER, self.poster)

    def _tell(self) -> None:
        """Say how many frames are done: those that have passed, but for the pictures that are yet to come."""
        before = self._source.begin
        done = self.summary.frames - len(self._drawers.waiting) - before
        tell(self._progress, "rendering", done, self._source.total - before)


def poster_place(pictures: int) -> int:
    """Which picture of a movie is its poster: a third of the way in, things have begun to happen."""
    return pictures // 3


def summary_of(scene: Scene, header: Header) -> Summary:
    """The summary of a run of a scene, before its first frame."""
    laws = contact_laws_of(scene)
    elastic = bool((laws["restitution"] == 1.0).all() and (laws["friction"] == 0.0).all())
    forced = bool(scene.obstacles or scene.fields) or scene.is_open
    return Summary(float(header.mass.sum()), scene.world.gravity, elastic, forced)


def timed(summary: Summary, name: str, passing: Iterable[_T]) -> Iterator[_T]:
    """Pass things on and add up how long they were in coming, in ``summary.seconds``."""
    source, seconds = iter(passing), summary.seconds
    while True:
        start = clock.perf_counter()
        thing = next(source, None)
        seconds[name] = seconds.get(name, 0.0) + clock.perf_counter() - start
        if thing is None:
            return
        yield thing
        del thing  # which may be large
