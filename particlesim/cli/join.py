"""The command ``join``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from particlesim.cli.errors import one_line_errors
from particlesim.cli.options import Quiet
from particlesim.cli.output import place_for
from particlesim.cli.tables import print_table


def join(
    parts: Annotated[list[Path], typer.Argument(metavar="PART...", help="All parts of a movie (.mp4), in any order.")],
    output: Annotated[Path, typer.Option("--output", "-o", help="The movie.")],
    quiet: Quiet = False,
) -> None:
    """Make a movie of the parts that 'render --shard' made, without encoding again, with a poster (PNG) beside it."""
    with one_line_errors(output), place_for(output, output, ".mp4", beside=(".png",)) as path:
        from particlesim.jobs.shards import join as join_parts  # noqa: PLC0415

        origin = join_parts(parts, path)
    if not quiet:
        print_table(str(path), [("parts", f"{len(parts):,}"), *origin.items()])
