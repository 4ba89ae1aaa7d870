"""The command ``render``."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from particlesim.cli.errors import OptionError, one_line_errors
from particlesim.cli.options import Every, MaxDrift, Quiet, Resume, Scheduler, SomeFrames, Threads, WorkerCount
from particlesim.cli.output import place_for
from particlesim.cli.render_options import RenderOptions, frames_asked, scene_as_asked, shard_asked, still_time
from particlesim.cli.run import load, make_file
from particlesim.core.constants import MOVIE_ENDINGS
from particlesim.core.output_path import check_sequence

if TYPE_CHECKING:
    from particlesim.scene import Scene
    from particlesim.trajectory.gsd_file import Trajectory


def render(
    source: Annotated[Path, typer.Argument(metavar="SCENE|TRAJECTORY", help="A scene file or a .gsd trajectory.")],
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            help="The movie (.mp4, .webm, .gif, or NAME_%05d.png), or the picture.  [default: renders/NAME.mp4]",
        ),
    ] = None,
    frames: SomeFrames = None,
    every: Every = None,
    still: Annotated[
        str | None, typer.Option("--still", metavar="T", help="Make one picture (PNG), of the time T in seconds.")
    ] = None,
    shard: Annotated[
        str | None,
        typer.Option("--shard", metavar="K/N", help="Draw part K of N of a trajectory's movie, for 'join'."),
    ] = None,
    look: Annotated[
        Path | None,
        typer.Option("--look", metavar="SCENE", help="Take camera, movie, show and colours from another scene file."),
    ] = None,
    quality: Annotated[
        str | None,
        typer.Option("--quality", metavar="WORD", help="draft (640x360), normal (1280x720), high or best (1920x1080)."),
    ] = None,
    size: Annotated[
        str | None, typer.Option("--size", metavar="WIDTHxHEIGHT", help="Size of the pictures in pixels.")
    ] = None,
    camera: Annotated[
        str | None, typer.Option("--camera", metavar="KIND|TABLE", help="fixed, orbit or '{kind = \"look-at\", ...}'.")
    ] = None,
    colour: Annotated[
        str | None, typer.Option("--colour", metavar="COLOUR", help="Of all particles: by_speed, by_shape, a name ...")
    ] = None,
    scale: Annotated[
        str | None,
        typer.Option("--scale", metavar="S", help="Simulate S times as many particles, sized to fill as much."),
    ] = None,
    workers: WorkerCount = None,
    scheduler: Scheduler = None,
    resume: Resume = False,
    quiet: Quiet = False,
    threads: Threads = None,
    max_drift: MaxDrift = None,
) -> None:
    """Simulate a scene, or read a trajectory, and make a movie of it, with a poster (PNG) beside it."""
    options = RenderOptions(frames, every, still, shard, look, quality, size, camera, colour, scale)
    beside = (".png",) if still is None else ()
    endings = MOVIE_ENDINGS[: 1 if shard else None] if still is None else (".png",)
    with (
        one_line_errors(source),
        place_for(output, _named(source, shard_asked(options)), *endings, beside=beside) as path,
        _opened(source, options, quiet) as (subject, scene, total),
    ):
        time = still_time(scene.duration, options)
        for option, value in (("--resume", resume), ("--workers", workers), ("--scheduler", scheduler)):
            if time is not None and value:
                raise OptionError(f"{option}: of a movie, not of the one picture that --still asks for")
        chosen = None if time is not None else frames_asked(total, frames, every)
        if chosen is not None:
            check_sequence(path, len(chosen))
        from particlesim.simulation.needs import check_movie  # noqa: PLC0415

        check_movie(scene, path, 1 if chosen is None else len(chosen), simulated=subject is scene)
        from particlesim.jobs import movie  # noqa: PLC0415

        if time is None:
            make = partial(
                movie.render,
                look=scene,
                frames=chosen,
                shard=shard_asked(options),
                workers=workers,
                scheduler=scheduler,
                resume=resume,
            )
        else:
            make = partial(movie.still, look=scene, time=time)
        make_file(make, subject, path, quiet, threads, max_drift)


def _named(source: Path, shard: tuple[int, int] | None) -> Path:
    """What the output is named after."""
    return source if shard is None else source.with_stem(f"{source.stem}_{shard[0]}_of_{shard[1]}")


@contextmanager
def _opened(source: Path, options: RenderOptions, quiet: bool) -> Iterator[tuple[Scene | Trajectory, Scene, int]]:
    """What to make a movie of, the scene as it is to be drawn, and how many frames there are.

    What is assumed of a trajectory that another program wrote is printed, if not ``quiet``. SceneError or
    TrajectoryError if the source cannot be read, OptionError for a value that is not allowed.
    """
    if source.suffix.lower() != ".gsd":
        scene = scene_as_asked(load(source), options, of_trajectory=False)
        yield scene, scene, scene.frames
        return
    from particlesim.trajectory.gsd_file import Trajectory  # noqa: PLC0415

    with Trajectory(source) as trajectory:
        for line in () if quiet else trajectory.assumed:
            print(f"{source}: assumed: {line}", file=sys.stderr)
        yield trajectory, scene_as_asked(trajectory.scene, options, of_trajectory=True), len(trajectory)
