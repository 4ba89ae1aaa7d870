"""The command ``sweep``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from particlesim.cli.errors import OptionError, fail, one_line_errors
from particlesim.cli.options import Quiet, Scheduler, Threads, WorkerCount
from particlesim.cli.output import place_for
from particlesim.cli.tables import print_table

if TYPE_CHECKING:
    from particlesim.jobs.sweep.run import SweepResult


def sweep(
    source: Annotated[Path, typer.Argument(metavar="SWEEP", help="A sweep file (TOML).")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="The table, CSV or Parquet.  [default: renders/NAME.csv]")
    ] = None,
    figure: Annotated[
        tuple[str, str] | None,
        typer.Option("--figure", metavar="x=KEY y=COLUMN", help="Draw mean and spread of a column over another."),
    ] = None,
    workers: WorkerCount = None,
    scheduler: Scheduler = None,
    quiet: Quiet = False,
    threads: Threads = None,
) -> None:
    """Simulate a scene with other values under some of its keys, case by case, and write a row of each to a table.

    Cases that were done before are not run again.
    """
    with one_line_errors(source):
        axes = None if figure is None else _axes(figure)
        beside = () if axes is None else (".svg", ".png")
        with place_for(output, source, ".csv", ".parquet", beside=beside) as path:
            from particlesim.cli.progress import shown_progress  # noqa: PLC0415
            from particlesim.jobs.sweep.run import sweep as run_sweep  # noqa: PLC0415

            with shown_progress(quiet, "case") as progress:
                result = run_sweep(
                    source,
                    path,
                    figure=axes,
                    workers=workers,
                    scheduler=scheduler,
                    threads=threads,
                    progress=progress,
                )
    if not quiet:
        _print(result)
    if result.failed:
        fail(f"{path}: written, but {len(result.failed)} of {len(result.rows)} cases failed; {result.failed[0]}", 1)


def _axes(figure: tuple[str, str]) -> tuple[str, str]:
    """The columns of a figure. OptionError if it does not say which is which."""
    named = dict(part.partition("=")[::2] for part in figure)
    if set(named) != {"x", "y"}:
        raise OptionError(f"--figure {' '.join(figure)}: must be x=KEY y=COLUMN")
    return named["x"], named["y"]


def _print(result: SweepResult) -> None:
    """What a sweep came to."""
    seconds = sum(row["seconds"] for row in result.rows)
    rows = [
        ("cases", f"{len(result.rows):,}"),
        ("run now", f"{result.ran:,}"),
        ("simulating", f"{seconds:.1f} s, one after the other"),
    ]
    print_table(", ".join(str(path) for path in result.written), rows)
