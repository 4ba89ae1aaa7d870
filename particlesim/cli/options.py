"""Options that several commands have."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from particlesim.core.constants import MOST_THREADS


def _at_least_one(count: int | None) -> int | None:
    if count is not None and count < 1:
        raise typer.BadParameter("must be 1 or more")
    return count


def _threads(count: int | None) -> int | None:
    if count is not None and not 1 <= count <= MOST_THREADS:
        raise typer.BadParameter(f"must be 1 to {MOST_THREADS:,}")
    return count


def _not_negative(drift: float | None) -> float | None:
    if drift is not None and not drift >= 0.0:
        raise typer.BadParameter("must be a number of 0 or more")
    return drift


SceneArgument = Annotated[Path, typer.Argument(metavar="SCENE", help="A scene file (TOML).")]
SomeFrames = Annotated[
    str | None, typer.Option("--frames", metavar="A:B", help="Take frames A to B - 1 only; either may be left out.")
]
Every = Annotated[
    str | None, typer.Option("--every", metavar="N", help="Take each Nth frame only: a movie is N times as fast.")
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")]
Threads = Annotated[
    int | None, typer.Option("--threads", callback=_threads, help="Threads to simulate with.  [default: all]")
]
WorkerCount = Annotated[
    int | None,
    typer.Option("--workers", metavar="N", callback=_at_least_one, help="Processes of this machine to share it among."),
]
Scheduler = Annotated[
    str | None, typer.Option("--scheduler", metavar="ADDRESS", help="A Dask scheduler whose workers do it instead.")
]
Resume = Annotated[bool, typer.Option("--resume", help="Go on with a partial run of the same, if there is one.")]
MaxDrift = Annotated[
    float | None,
    typer.Option(
        "--max-drift",
        metavar="X",
        callback=_not_negative,
        help="End with exit code 3 if the energy drifts by more than this fraction of it; the output is kept.",
    ),
]
