"""A segment of a movie as a task: it depends on nothing but its values, whoever draws it, wherever, and how often."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from particlesim.core.constants import SEGMENT
from particlesim.jobs.frame_source import FrameSource, frame_source
from particlesim.jobs.pictures import Pictures
from particlesim.rendering.gl import platform
from particlesim.rendering.hud.history import History
from particlesim.rendering.video.segments import Segments, segment_file
from particlesim.scene import Scene
from particlesim.trajectory.gsd_file import Trajectory


class SegmentTask(NamedTuple):
    """What the pictures of a segment depend on."""

    trajectory: Path | bytes  # the file, or an excerpt of it: its first frame, then those of the segment
    look: Scene  # with scales that no frames are asked for
    ending: str  # of the movie
    wanted: range  # numbers of the frames of the whole movie
    places: range  # among these, of the segment's
    passed: dict[str, Any]  # the history before it, as plain values


class DrawnSegment(NamedTuple):
    """What comes of it."""

    content: bytes  # of the closed segment
    poster: np.ndarray | None  # of the movie, if its picture is in this segment


def draw_segment(task: SegmentTask) -> DrawnSegment:
    """Draw the pictures of a segment and encode them. RenderError, TrajectoryError as for ``render``."""
    platform.choose()
    movie, first = task.look.movie, task.places.start
    with (
        tempfile.TemporaryDirectory() as folder,
        _source(task) as source,
        Pictures(source, task.look, None, passed=History.of_table(task.passed)) as pictures,
        Segments(Path(folder), movie.fps, movie.size, movie.crf, first, first, task.ending, movie.channels) as film,
    ):
        for image in pictures.images():
            film.send(image)
        film.close_open_one()
        content = segment_file(Path(folder), first // SEGMENT).read_bytes()
        return DrawnSegment(content, pictures.poster if pictures.poster.size else None)


@contextmanager
def _source(task: SegmentTask) -> Iterator[FrameSource]:
    """The frames of a segment."""
    if isinstance(task.trajectory, Path):
        with Trajectory(task.trajectory) as whole:
            yield frame_source(whole, task.wanted, None, None, part=task.places)
        return
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "excerpt.gsd")
        path.write_bytes(task.trajectory)
        with Trajectory(path) as part:
            numbers = task.wanted[task.places.start : task.places.stop]
            frames = ((number, part[k]) for k, number in enumerate(numbers, start=1))
            of_movie = (task.places.stop, task.wanted, "reading")
            yield FrameSource(part.scene, part.header, part[0], frames, *of_movie, begin=task.places.start)
