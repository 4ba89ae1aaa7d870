"""The command ``view``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from particlesim.cli.errors import one_line_errors
from particlesim.cli.options import Every, Quiet, SomeFrames, Threads
from particlesim.cli.output import place_for
from particlesim.cli.render_options import frames_asked
from particlesim.cli.run import load


def view(
    source: Annotated[Path, typer.Argument(metavar="SCENE|TRAJECTORY", help="A scene file or a .gsd trajectory.")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="The page (.html).  [default: renders/NAME.html]")
    ] = None,
    frames: SomeFrames = None,
    every: Every = None,
    quiet: Quiet = False,
    threads: Threads = None,
) -> None:
    """Make a page (HTML) that shows a run in a browser: play it, turn it, click on a particle for its numbers.

    A scene is simulated for it. The page needs nothing else, and no network.
    """
    with one_line_errors(source), place_for(output, source, ".html") as path:
        from particlesim.cli.progress import shown_progress  # noqa: PLC0415

        subject = source if source.suffix.lower() == ".gsd" else load(source)
        from particlesim.jobs import view as job  # noqa: PLC0415
        from particlesim.jobs.frame_source import opened  # noqa: PLC0415
        from particlesim.scene import Scene  # noqa: PLC0415

        with opened(subject) as run, shown_progress(quiet) as progress:
            chosen = frames_asked(run.frames if isinstance(run, Scene) else len(run), frames, every)
            job.view(run, path, frames=chosen, progress=progress, threads=threads)
    if not quiet:
        print(path)
