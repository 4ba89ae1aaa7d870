"""The command ``clean``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from particlesim.cli.errors import one_line_errors
from particlesim.cli.tables import print_table

Places = Annotated[
    list[Path] | None,
    typer.Argument(metavar="[OUTPUT|FOLDER]...", help="Of these outputs, or in these folders.  [default: . renders]"),
]


def clean(
    places: Places = None,
    remove: Annotated[bool, typer.Option("--remove", help="Remove them, but for those that are at work.")] = False,
) -> None:
    """Show the partial runs that were left beside their outputs, and remove them if told to."""
    with one_line_errors(Path("clean")):
        from particlesim.jobs.partial_run import partial_runs, remove_run  # noqa: PLC0415

        found = [run for place in places or [Path(), Path("renders")] for run in partial_runs(place)]
        if not found:
            print("no partial runs")
            return
        for run in found:
            if remove and not run.at_work:
                remove_run(run.folder)
        state = {True: "at work", False: "removed" if remove else "left"}
        rows = [(str(run.folder), f"{run.frames}, {run.size / 1e6:,.1f} MB, {state[run.at_work]}") for run in found]
        print_table("partial runs", rows)
