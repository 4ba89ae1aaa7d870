"""From a scene to a trajectory, and from either to a movie."""

from __future__ import annotations

import math
import os
from pathlib import Path

from particlesim.core.arguments import checked_arguments
from particlesim.core.constants import MOVIE_ENDINGS
from particlesim.core.output_path import check_output, check_sequence, is_sequence
from particlesim.jobs.compiling import compile_kernels
from particlesim.jobs.frame_source import (
    FrameSource,
    Progress,
    frame_source,
    frame_source_until,
    frames_of,
    opened,
    start,
    tell,
)
from particlesim.jobs.kept import check_kept, uses_of_pictures
from particlesim.jobs.partial_run import PartialRun
from particlesim.jobs.pictures import Pictures, summary_of, timed
from particlesim.jobs.provenance import as_tags, as_text, provenance, texts_of_pictures
from particlesim.jobs.shards import part_of, shard_table
from particlesim.jobs.shared_movie import check_shared, render_shared
from particlesim.jobs.summary import Summary
from particlesim.jobs.task import task_of
from particlesim.rendering import write_image
from particlesim.rendering.gl import platform
from particlesim.rendering.video.picture_files import PictureFiles
from particlesim.rendering.video.segments import Segments
from particlesim.scene import Scene
from particlesim.scene.camera import Movie
from particlesim.scene.file import load_scene
from particlesim.setup.limits import check_limits
from particlesim.simulation.needs import check_movie, check_simulation, check_transparency
from particlesim.simulation.simulation import Simulation
from particlesim.simulation.soundness import SimulationError
from particlesim.trajectory.gsd_file import Trajectory, TrajectoryWriter


@checked_arguments
def simulate(
    scene: Scene | str | Path,
    path: str | Path,
    *,
    resume: bool = False,
    progress: Progress | None = None,
    threads: int | None = None,
) -> Summary:
    """Simulate a scene and write its trajectory (GSD). Needs neither OpenGL nor ffmpeg.

    Parameters
    ----------
    scene
        What to simulate, to its end, or the path of its file.
    path
        The file, which must end in .gsd; it appears when it is whole.
    resume
        Go on with a partial run, if there is one: the result is that of a run that was never interrupted.
    progress
        Called with what is going on, how many frames are done, and how many there will be.
    threads
        How many threads to simulate with; one a processor if None.

    Returns
    -------
    Summary
        What the run amounted to.

    Raises
    ------
    OutputError
        If no trajectory can be written to ``path``; found out before any work.
    PartialRunError
        If there is a partial run that is not to be gone on with, or is of another scene.
    SceneError
        If the scene cannot be built.
    SimulationError
        If the simulation runs away.
    OSError
        If the file cannot be written.
    """
    check_output(path, ".gsd")
    scene = scene if isinstance(scene, Scene) else load_scene(scene)
    check_simulation(scene, Path(path))
    with PartialRun(path, task_of(scene), resume) as run:
        growing = run.folder / "trajectory.gsd"
        if not growing.exists():  # it has become the output, if that run was killed right then
            run.forget()
        compile_kernels(scene, None, progress)
        simulation = Simulation.load(run.state, threads=threads) if run.state else start(scene, threads, progress)
        summary = summary_of(scene, simulation.header)
        if run.kept and run.state:
            summary.go_on(run.kept["values"])
        frames = frames_of(simulation, summary.first or simulation.ledger, scene.frames, summary.frames)
        kept = scene.trajectory.kept(summary.frames)
        with TrajectoryWriter(growing, simulation.header, kept) as writer:
            try:
                for number, frame in timed(summary, "simulating", frames):
                    if frame is not None:
                        if scene.trajectory.keeps(number):
                            writer.append(frame)
                        summary.add(frame)
                        tell(progress, "simulating", summary.frames, scene.frames)
                        del frame  # millions of particles need the memory
                    if run.due():
                        writer.flush()
                        run.keep(summary.frames, scene.frames, simulation, summary.table())
            except SimulationError:
                writer.flush()
                run.keep(summary.frames, scene.frames, None, summary.table())
                raise
        os.replace(growing, path)
    summary.path = Path(path)
    return summary


@checked_arguments
def render(
    source: Scene | Trajectory | str | Path,
    path: str | Path,
    *,
    look: Scene | None = None,
    frames: range | None = None,
    shard: tuple[int, int] | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    resume: bool = False,
    progress: Progress | None = None,
    threads: int | None = None,
) -> Summary:
    """Make a movie of a scene, simulating it, or of a trajectory, as it was; and a poster (PNG) beside it.

    Parameters
    ----------
    source
        A scene, a trajectory, or the path of one of them (.toml, .gsd).
    path
        The movie, which appears when it is whole. Its ending says the format: .mp4 (H.264), .webm (VP9), .gif, or .png
        of numbered pictures, whose name has a place for their number, such as ``x_%05d.png``; they have no poster.
    look
        Draws a trajectory as this scene says, in place of its own.
    frames
        Numbers of the frames to draw, all if None; a scene is simulated from its start to the last of them.
    shard
        (k, n): only part k of n of the movie of a trajectory, 1 the first; ``join`` makes the movie of all parts. The
        poster lies beside the one that has its picture. A part must be .mp4.
    workers, scheduler
        Let so many processes of this machine, or the workers of a Dask scheduler, draw the segments of the movie of a
        trajectory, as for ``shared_among``: its bytes are the same. A script needs ``if __name__ == "__main__"``.
    resume, progress, threads
        As for ``simulate``.

    Returns
    -------
    Summary
        What the run amounted to; in a notebook it shows the movie.

    Raises
    ------
    RenderError
        If this machine cannot draw or cannot encode, found out before any work, or can no longer.
    TrajectoryError
        If the source is a file that is no trajectory, or damaged, or has not kept what is to be drawn.
    ValueError
        For frames or a part that are not there, or for what workers cannot share.
    MissingExtraError, WorkersError
        As for ``shared_among``.
    OutputError, PartialRunError, SceneError, SimulationError, OSError
        As for ``simulate``.
    """
    check_output(path, *(MOVIE_ENDINGS if shard is None else MOVIE_ENDINGS[:1]), beside=(".png",))
    path = Path(path)
    check_sequence(path)
    is_shared = (workers, scheduler) != (None, None)
    if is_shared:
        check_shared(source, path, shard)
    with opened(source) as movable, PartialRun(path, task_of(movable, look, frames, shard), resume) as run:
        scene = look or _scene_of(movable)
        check_kept(movable, uses_of_pictures(scene))
        part = None if shard is None else part_of(movable, frames, shard)
        platform.choose()
        platform.describe_ffmpeg()  # which fails now, if it does, and not when all is simulated
        _compile(movable, scene, progress)
        check_transparency(path, scene.movie)
        if is_shared and isinstance(movable, Trajectory):
            by = workers, scheduler, threads
            return render_shared(movable, path, scene, frames, run, by, progress)
        chosen = frame_source(movable, frames, threads, progress, run, part)
        check_movie(scene, path, len(chosen.wanted), chosen.trajectory is None)
        check_sequence(path, len(chosen.wanted))
        with (
            Pictures(chosen, scene, progress, run) as pictures,
            _film(run.folder, path, scene.movie, chosen, pictures.summary.drawn) as film,
        ):
            for image in pictures.images(film.flush):
                film.send(image)
            origin = provenance(chosen.header, pictures.summary, chosen.drawn)
            if shard is not None and isinstance(movable, Trajectory):
                origin["shard"] = shard_table(shard, movable, scene, chosen.wanted)
            film.join(as_tags(origin))
        pictures.summary.seconds["encoding"] = film.seconds
        if pictures.poster.size and not is_sequence(path):
            write_image(path.with_suffix(".png"), pictures.poster, as_text(origin))
        film.appear(path)
    pictures.summary.path = path
    return pictures.summary


def _film(folder: Path, path: Path, movie: Movie, source: FrameSource, sent: int) -> Segments | PictureFiles:
    """What takes the pictures of a movie that is to be at ``path``, of which so many were sent before it was left."""
    if is_sequence(path):
        return PictureFiles(folder, texts_of_pictures(source.header, source.wanted), sent)
    return Segments(folder, movie.fps, movie.size, movie.crf, sent, source.begin, path.suffix.lower(), movie.channels)


@checked_arguments
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
        A scene, a trajectory, or the path of one of them (.toml, .gsd).
    path
        The picture, which must end in .png; it appears when it is whole.
    time
        Of the scene [s].
    look, progress, threads
        As for ``render``.

    Returns
    -------
    Summary
        What the run amounted to; in a notebook it shows the picture.

    Raises
    ------
    ValueError
        For a time that is not finite.
    OutputError, RenderError, TrajectoryError, SceneError, SimulationError, OSError
        As for ``render``.
    """
    check_output(path, ".png")
    if not math.isfinite(time):
        raise ValueError(f"time must be a finite number of seconds, not {time!r}")
    with opened(source) as movable:
        scene = look or _scene_of(movable)
        check_kept(movable, uses_of_pictures(scene))
        platform.choose()
        _compile(movable, scene, progress)
        chosen = frame_source_until(time, movable, threads, progress)
        # What a curve would show passes without being drawn, or is not read.
        bare = scene.model_copy(update={"show": scene.show.model_copy(update={"plot": None})})
        with Pictures(chosen, bare, progress) as pictures:
            for _ in pictures.images():
                pass
            write_image(path, pictures.poster, as_text(provenance(chosen.header, pictures.summary, chosen.wanted)))
    pictures.summary.path = Path(path)
    return pictures.summary


def _compile(source: Scene | Trajectory, look: Scene, progress: Progress | None) -> None:
    """Compile what pictures of a source need that look like this."""
    if isinstance(source, Scene):
        check_limits(source)
    compile_kernels(source if isinstance(source, Scene) else None, look, progress)


def _scene_of(source: Scene | Trajectory) -> Scene:
    return source if isinstance(source, Scene) else source.scene
