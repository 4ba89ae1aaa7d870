"""The command ``info``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from particlesim.cli.errors import OptionError, fail, one_line_errors
from particlesim.cli.options import Quiet, Threads
from particlesim.cli.tables import print_table


def info(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A movie, a picture or a trajectory.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print it as JSON.")] = False,
    verify: Annotated[bool, typer.Option("--verify", help="Simulate a trajectory again and compare a frame.")] = False,
    frame: Annotated[
        int | None, typer.Option("--frame", min=0, help="The frame that --verify compares.  [default: the last]")
    ] = None,
    quiet: Quiet = False,
    threads: Threads = None,
) -> None:
    """Say where a movie, a picture or a trajectory comes from.

    Exit code 1 if --verify finds that the scene does not give the same, to the bit.
    """
    with one_line_errors(file):
        from particlesim.jobs.provenance import read_provenance  # noqa: PLC0415
        from particlesim.jobs.whole_files import check_whole  # noqa: PLC0415

        if verify and file.suffix.lower() != ".gsd":
            raise OptionError(f"--verify: of a trajectory (.gsd), not of {file}")
        check_whole(file)
        values = read_provenance(file)
        if verify:
            values |= _verified(file, frame, quiet, threads)
    if as_json:
        print(json.dumps(values, indent=2))
    elif not quiet:
        told = values | _in_words(values)
        told.pop("keys", None)  # a page of them, as JSON
        print_table(str(file), list(told.items()))
    if verify and not values["same"]:
        fail(f"{file}: frame {values['compared']} is not what its scene gives", 1)


def _in_words(values: dict[str, Any]) -> dict[str, str]:
    """What is not told as it is."""
    first, end, step = values["frames"]
    frames = range(first, end, step)
    each = f", one in {step:,}" if step > 1 else ""
    words = {"frames": f"{frames[0]:,} to {frames[-1]:,}{each}" if len(frames) > 1 else f"{frames[0]:,}"}
    if values.get("energy_drift", 0.0) is None:
        words["energy_drift"] = "not told: particles come and go"
    return words


def _verified(file: Path, frame: int | None, quiet: bool, threads: int | None) -> dict[str, object]:
    from particlesim.cli.progress import shown_progress  # noqa: PLC0415
    from particlesim.jobs.provenance import replayed  # noqa: PLC0415
    from particlesim.trajectory.gsd_file import Trajectory  # noqa: PLC0415

    with Trajectory(file) as trajectory, shown_progress(quiet) as progress:
        last = len(trajectory) - 1
        if frame is not None and frame > last:
            raise OptionError(f"--frame {frame}: there are the frames 0 to {last:,}")
        number = last if frame is None else frame
        stored, again = replayed(trajectory, number, threads, progress)
    return {"compared": number, "hash": stored, "replayed": again, "same": stored == again}
