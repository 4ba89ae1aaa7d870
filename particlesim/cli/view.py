"""The command ``view``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from particlesim.cli.errors import one_line_errors
from particlesim.cli.options import Every, Quiet, SomeFrames, Threads
from particlesim.cli.output import place_for
from particlesim.cli.run import run_asked


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

        with run_asked(source, frames, every) as (run, chosen), shown_progress(quiet) as progress:
            from particlesim.jobs import view as job  # noqa: PLC0415

            job.view(run, path, frames=chosen, progress=progress, threads=threads)
    if not quiet:
        print(path)
