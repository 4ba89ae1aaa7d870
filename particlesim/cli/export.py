"""The command ``export``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from particlesim.cli.errors import one_line_errors
from particlesim.cli.options import Every, Quiet, SomeFrames, Threads
from particlesim.cli.output import place_for
from particlesim.cli.render_options import frames_asked
from particlesim.cli.run import load
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

        subject = source if source.suffix.lower() == ".gsd" else load(source)
        from particlesim.jobs import export as job  # noqa: PLC0415
        from particlesim.jobs.frame_source import opened  # noqa: PLC0415
        from particlesim.scene import Scene  # noqa: PLC0415

        with opened(subject) as run, shown_progress(quiet) as progress:
            chosen = frames_asked(run.frames if isinstance(run, Scene) else len(run), frames, every)
            written = job.export(run, path, frames=chosen, progress=progress, threads=threads)
    if not quiet:
        print("\n".join(str(file) for file in written))
