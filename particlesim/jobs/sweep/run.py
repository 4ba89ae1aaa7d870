"""A sweep from its file to its table: cases that are not done yet are run, those that are done are kept."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from particlesim.core.arguments import checked_arguments
from particlesim.core.atomic_write import atomic_write
from particlesim.core.extras import require
from particlesim.core.output_path import check_output
from particlesim.jobs.compiling import compile_kernels
from particlesim.jobs.frame_source import Progress, tell
from particlesim.jobs.sweep.figure import check_columns, curves, draw
from particlesim.jobs.sweep.row import COLUMNS, case_hash, run_case
from particlesim.jobs.sweep.table import SUFFIXES, write_rows
from particlesim.jobs.workers import shared_among
from particlesim.scene.sweep import Case, case_text, load_sweep


class SweepResult(NamedTuple):
    """What a sweep came to."""

    rows: list[dict[str, Any]]  # of all cases, in their order
    ran: int  # how many of them were run, and not done before
    failed: list[str]  # what went wrong, a line for each case that failed
    written: list[Path]  # the table, and the files of the figure


@checked_arguments
def sweep(
    source: str | Path | Sequence[Case],
    path: str | Path,
    *,
    figure: tuple[str, str] | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> SweepResult:
    """Simulate the cases of a sweep and write a row of each to a table; cases that were done before are not run again.

    Rows are kept in a folder beside the table, ``NAME.cases``, by the hashes of their scenes. A case that fails, which
    its row says, is tried again the next time. With ``workers`` a script needs ``if __name__ == "__main__"``, as all
    that start processes do.

    Parameters
    ----------
    source
        The path of a sweep file, or cases.
    path
        The table, ending in .csv or .parquet; it appears when it is whole.
    figure
        (x, y): columns to draw, y over x, as SVG and PNG beside the table.
    workers, scheduler, threads
        As for ``shared_among``.
    progress
        Called with what is going on, how many cases are done, and how many there are.

    Returns
    -------
    SweepResult
        The rows, and what was written.

    Raises
    ------
    ValueError
        If there are no cases.
    SceneError
        If the sweep file or a case is wrong; found out before any work.
    FigureError
        For columns that there are not, before any work; or that are no numbers.
    MissingExtraError, WorkersError
        As for ``shared_among``; for Parquet without pyarrow.
    OutputError, OSError
        If the table cannot be written.
    """
    path = Path(path)
    check_output(path, *SUFFIXES, beside=(".svg", ".png") if figure is not None else ())
    if path.suffix == ".parquet":
        require("pyarrow", "parquet")
    cases = load_sweep(source) if isinstance(source, str | Path) else list(source)
    if not cases:
        raise ValueError("sweep: source has no cases")
    values = list(dict.fromkeys(key for case in cases for key in case.values))
    if figure is not None:
        check_columns([*values, *COLUMNS], *figure)
    folder = path.with_name(f"{path.stem}.cases")
    hashes = [case_hash(case.scene) for case in cases]
    found = {digest: _kept(folder / f"{digest}.json") for digest in hashes}
    missing = {digest: case for digest, case in zip(hashes, cases, strict=True) if found[digest] is None}
    _run(missing, found, folder, (workers, scheduler, threads), progress)
    rows = [
        {"case": number, **dict.fromkeys(values), **case.values, **(found[digest] or {})}
        for number, (case, digest) in enumerate(zip(cases, hashes, strict=True), start=1)
    ]
    write_rows(path, rows)
    drawn = [] if figure is None else draw(curves(rows, values, *figure), *figure, path)
    failed = [f"case {row['case']} ({_text(row, values)}): {row['error']}" for row in rows if row["error"] is not None]
    return SweepResult(rows, len(missing), failed, [path, *drawn])


def _run(
    missing: dict[str, Case],
    found: dict[str, dict[str, Any] | None],
    folder: Path,
    by: tuple[int | None, str | None, int | None],
    progress: Progress | None,
) -> None:
    """Run cases that are missing, and put their rows among those that are found; each is kept as soon as it is done."""
    if not missing:
        return
    folder.mkdir(exist_ok=True)
    done, digests = len(found) - len(missing), list(missing)
    # Here, so that it is done once: processes share what is compiled.
    compile_kernels(next(iter(missing.values())).scene, None, progress)
    try:
        with shared_among(*by) as workers:
            tell(progress, "simulating", done, len(found))
            for number, row in workers.each(run_case, (case.scene for case in missing.values())):
                digest = digests[number]
                found[digest] = row
                if row["error"] is None:
                    _keep(folder / f"{digest}.json", row)
                done += 1
                tell(progress, "simulating", done, len(found))
    except BaseException as error:
        error.add_note(f"{done:,} of {len(found):,} cases are kept in {folder}; the same command goes on with them")
        raise


def _kept(path: Path) -> dict[str, Any] | None:
    """The row of a case that was done before; None if there is none."""
    try:
        row: dict[str, Any] = json.loads(path.read_text())
    except FileNotFoundError:
        return None
    return row


def _keep(path: Path, row: dict[str, Any]) -> None:
    with atomic_write(path) as hidden:
        hidden.write_text(json.dumps(row))


def _text(row: dict[str, Any], values: list[str]) -> str:
    return case_text({key: row[key] for key in values})
