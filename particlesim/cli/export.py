"""The command ``export``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from particlesim.cli.errors import one_line_errors
from particlesim.cli.options import Every, Quiet, SomeFrames, Threads
from particlesim.cli.output import place_for
from particlesim.cli.run import run_asked
from particlesim.core.constants import EXPORT_ENDINGS


def export(
    source: Annotated[Path, typer.Argument(metavar="SCENE|TRAJECTORY", help="A scene file or a .gsd trajectory.")],
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", help="A .pvd (VTK), .glb (glTF), .usda (USD) or .xyz file.  [default: renders/NAME.pvd]"
        ),
    ] = None,
    frames: SomeFrames = None,
    every: Every = None,
    quiet: Quiet = False,
    threads: Threads = None,
) -> None:
    """Write a run for other programs: ParaView (.pvd), viewers (.glb), Blender (.usda), OVITO and ASE (.xyz).

    A scene is simulated for it.
    """
    with one_line_errors(source), place_for(output, source, *EXPORT_ENDINGS) as path:
        from particlesim.cli.progress import shown_progress  # noqa: PLC0415

        with run_asked(source, frames, every) as (run, chosen), shown_progress(quiet) as progress:
            from particlesim.jobs import export as job  # noqa: PLC0415

            written = job.export(run, path, frames=chosen, progress=progress, threads=threads)
    if not quiet:
        print("\n".join(str(file) for file in written))
