"""The command ``plot``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from particlesim.cli.errors import one_line_errors
from particlesim.cli.options import Quiet, Threads
from particlesim.cli.output import place_for
from particlesim.cli.run import load
from particlesim.core.constants import MOVIE_ENDINGS

if TYPE_CHECKING:
    from particlesim.scene import Scene


def plot(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="SCENE|TRAJECTORY|MOVIE", help="A scene file, a .gsd trajectory, or a movie that particlesim made."
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="SVG or PNG; both are written.  [default: renders/NAME_plot]"),
    ] = None,
    what: Annotated[
        str | None,
        typer.Option(
            "--what",
            metavar="PANEL",
            help="One panel: energy, drift, momentum, impacts, temperature, pressure, displacement, radial, speeds.",
        ),
    ] = None,
    csv: Annotated[Path | None, typer.Option("--csv", metavar="FILE", help="Write the numbers as CSV as well.")] = None,
    parquet: Annotated[
        Path | None, typer.Option("--parquet", metavar="FILE", help="Write the numbers as Parquet as well (pyarrow).")
    ] = None,
    quiet: Quiet = False,
    threads: Threads = None,
) -> None:
    """Draw figures of a run, as SVG and PNG: energy, temperature, radial distribution and more on a page.

    A scene is simulated for it, that of a movie again. Tables hold what is shown: of a page, a row for each frame.
    """
    name = source.with_name(f"{source.stem}_{what or 'plot'}")
    with one_line_errors(source), place_for(output, name, ".svg", ".png", beside=(".svg", ".png")) as path:
        from particlesim.cli.progress import shown_progress  # noqa: PLC0415

        subject = _run_of(source)
        from particlesim.jobs import figures  # noqa: PLC0415

        with shown_progress(quiet) as progress:
            written = figures.plot(
                subject, path, what=what, csv=csv, parquet=parquet, progress=progress, threads=threads
            )
    if not quiet:
        print("\n".join(str(file) for file in written))


def _run_of(source: Path) -> Path | Scene:
    """What figures are made of: the trajectory itself, or a scene, which a movie holds."""
    if source.suffix.lower() in MOVIE_ENDINGS and source.is_file():
        from particlesim.jobs.provenance import scene_of  # noqa: PLC0415

        return scene_of(source)
    return source if source.suffix.lower() == ".gsd" else load(source)
