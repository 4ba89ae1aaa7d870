"""A movie whose segments are drawn by workers: those that are not done are handed out, and kept as they come back."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from particlesim.core.constants import SEGMENT
from particlesim.core.output_path import is_sequence
from particlesim.jobs.frame_source import FrameSource, Progress, frame_source, frames_ahead, tell
from particlesim.jobs.partial_run import PartialRun
from particlesim.jobs.pictures import POSTER, summary_of
from particlesim.jobs.provenance import as_tags, as_text, provenance
from particlesim.jobs.segment_task import SegmentTask, draw_segment
from particlesim.jobs.summary import Summary
from particlesim.jobs.workers import Workers, shared_among
from particlesim.rendering import write_image
from particlesim.rendering.hud.history import History
from particlesim.rendering.shading.fields import is_settled_by_frames, settled
from particlesim.rendering.video.segments import Segments, segment_file
from particlesim.scene import Scene
from particlesim.simulation.needs import check_movie
from particlesim.trajectory.gsd_excerpt import excerpt
from particlesim.trajectory.gsd_file import Trajectory

# How many processes, the address of a scheduler, and threads of a task, as for ``shared_among``.
By = tuple[int | None, str | None, int | None]


class SharingError(ValueError):
    """A movie that workers cannot share; the message is one line."""


def check_shared(source: Scene | Trajectory | str | Path, path: Path, shard: tuple[int, int] | None) -> None:
    """SharingError if workers cannot share the movie of a source that is to be at ``path``."""
    if isinstance(source, Scene) or (isinstance(source, str | Path) and Path(source).suffix.lower() == ".toml"):
        made = "such as 'particlesim simulate' makes of a scene"
        raise SharingError(f"workers share the movie of a trajectory only, {made}, which is simulated from its start")
    if shard is not None:
        raise SharingError("workers share a whole movie, not the part of it that a shard is")
    if is_sequence(path):
        raise SharingError(f"{path}: workers share a movie, not numbered pictures")


def render_shared(
    trajectory: Trajectory,
    path: Path,
    look: Scene,
    frames: range | None,
    run: PartialRun,
    by: By,
    progress: Progress | None,
) -> Summary:
    """Let workers draw the movie of a trajectory and its poster: the other arguments are as for ``render``."""
    source, movie = frame_source(trajectory, frames, None, None), look.movie
    wanted, ending = source.wanted, path.suffix.lower()
    check_movie(look, path, len(wanted), simulated=False)
    shared = SharedMovie(source, look, run, ending)
    shared.draw(by, progress)
    summary, origin = shared.summary, provenance(source.header, shared.summary, wanted)
    with Segments(run.folder, movie.fps, movie.size, movie.crf, len(wanted), 0, ending, movie.channels) as film:
        film.join(as_tags(origin))
    summary.seconds["encoding"] = film.seconds
    write_image(path.with_suffix(".png"), np.load(run.folder / POSTER), as_text(origin))
    film.appear(path)
    summary.path = path
    return summary


class SharedMovie:
    """The segments of a movie of a trajectory, in the folder of a run. ``summary``: what its frames amount to.

    Parameters
    ----------
    source
        A trajectory, and which of its frames are wanted.
    look
        How they look.
    run
        What was kept of the movie is not drawn again.
    ending
        Of the movie.
    """

    def __init__(self, source: FrameSource, look: Scene, run: PartialRun, ending: str) -> None:
        assert source.trajectory is not None
        self._trajectory, self._wanted, self._run, self._ending = source.trajectory, source.wanted, run, ending
        self._look = look
        if is_settled_by_frames(look):
            self._look = settled(look, source.header, frames_ahead(source, source.frames, None, 0)[1])
        self.summary = summary_of(look, source.header)
        self._history = History.of_movie(source.wanted, source.first.ledger, look.show.plot is not None)
        self._count = -(-len(source.wanted) // SEGMENT)
        self._missing = [k for k in range(self._count) if not segment_file(run.folder, k).exists()]
        # What has passed before each segment, from the first missing one to that which frames have passed to.
        self._reached = 0
        self._before: dict[int, dict[str, Any]] = {0: self._passed()}

    def draw(self, by: By, progress: Progress | None) -> None:
        """Let workers, as for ``shared_among``, draw what is missing; as much as they did is kept, whatever happens."""
        start, total = time.perf_counter(), len(self._wanted)
        with shared_among(*by) as workers:
            tell(progress, "rendering", self._done, total)
            handed_out = list(self._missing)
            try:
                for number, drawn in workers.each(draw_segment, self._tasks(workers)):
                    if drawn.poster is not None:
                        np.save(self._run.folder / POSTER, drawn.poster)
                    self._keep_segment(handed_out[number], drawn.content)
                    tell(progress, "rendering", self._done, total)
                    if self._run.due():
                        self._keep()
            finally:
                self._keep()
        self.summary.drawn = total
        self.summary.seconds["drawing"] = time.perf_counter() - start

    @property
    def _done(self) -> int:
        """Pictures that are drawn."""
        return len(self._wanted) - sum(len(self._places(k)) for k in self._missing)

    def _places(self, segment: int) -> range:
        return range(len(self._wanted))[SEGMENT * segment : SEGMENT * (segment + 1)]

    def _tasks(self, workers: Workers) -> Iterator[SegmentTask]:
        """The tasks of all segments that are missing."""
        path = self._trajectory.path
        seen = workers.see(path)
        for segment in list(self._missing):
            self._pass_to(segment)
            places = self._places(segment)
            numbers = self._wanted[places.start : places.stop]
            source = path.absolute() if seen else excerpt(path, numbers)
            history = self._before[segment]["history"]
            yield SegmentTask(source, self._look, self._ending, self._wanted, places, history)

    def _pass_to(self, segment: int) -> None:
        """Let the frames before a segment pass, as their times and ledgers."""
        while self._reached < segment:
            for place in self._places(self._reached):
                number = self._wanted[place]
                ledger = self._trajectory.ledger(number)
                self.summary.add_moment(self._trajectory.time(number), ledger)
                self._history = self._history.then(ledger)
            self._reached += 1
            self._before[self._reached] = self._passed()

    def _passed(self) -> dict[str, Any]:
        """What has passed, as a run in one process keeps it."""
        return {"summary": {**self.summary.table(), "drawn": self.summary.frames}, "history": self._history.table()}

    def _keep_segment(self, segment: int, content: bytes) -> None:
        path = segment_file(self._run.folder, segment)
        hidden = path.with_suffix(".part")
        hidden.write_bytes(content)
        os.replace(hidden, path)
        self._missing.remove(segment)

    def _keep(self) -> None:
        """Say in the folder of the run what counts: all before the first missing segment; others are met again."""
        if len(self._missing) == self._count:
            return
        first = min(self._missing, default=self._count)
        self._pass_to(first)
        for segment in [segment for segment in self._before if segment < first]:
            del self._before[segment]
        self._run.keep(self._places(first).start, len(self._wanted), None, self._before[first])
