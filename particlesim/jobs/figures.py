"""From a scene or a trajectory to figures of the run, and to the numbers in them."""

from __future__ import annotations

from pathlib import Path

from particlesim.core.arguments import checked_arguments
from particlesim.core.extras import require
from particlesim.core.figure import save_figure
from particlesim.core.output_path import check_output
from particlesim.jobs.compiling import compile_kernels
from particlesim.jobs.frame_source import Progress, frame_source, opened, told
from particlesim.scene import Scene
from particlesim.trajectory.analysis.measurements import measured
from particlesim.trajectory.analysis.panels import draw_panels, table_of
from particlesim.trajectory.analysis.table_files import write_csv, write_parquet
from particlesim.trajectory.gsd_file import Trajectory


@checked_arguments
def plot(
    source: Scene | Trajectory | str | Path,
    path: Path,
    *,
    what: str | None = None,
    csv: Path | None = None,
    parquet: Path | None = None,
    progress: Progress | None = None,
    threads: int | None = None,
) -> list[Path]:
    """Draw figures of a scene, simulating it, or of a trajectory, as SVG and PNG; and write the numbers.

    Parameters
    ----------
    source
        A scene, a trajectory, or the path of one of them (.toml, .gsd).
    path
        Of either file, ending in .svg or .png; the other lies beside it.
    what
        One panel, by its name; all that are known on a page if None.
    csv, parquet
        Files for the table that is shown; of a page, that over time.
    progress, threads
        As for ``simulate``.

    Returns
    -------
    The files written.

    Raises
    ------
    PlotError
        For a panel that there is not, or of which nothing is known.
    MissingExtraError
        For Parquet without pyarrow, before any work.
    OutputError, TrajectoryError, SceneError, SimulationError, OSError
        As for ``simulate`` and ``render``.
    """
    which = table_of(what)
    check_output(path, ".svg", ".png", beside=(".svg", ".png"))
    tables = [(csv, ".csv", write_csv), (parquet, ".parquet", write_parquet)]
    for file, suffix, _ in tables:
        if file is not None:
            check_output(file, suffix)
    if parquet is not None:
        require("pyarrow", "parquet")
    with opened(source) as movable:
        if isinstance(movable, Scene):
            compile_kernels(movable, None, progress)
        chosen = frame_source(movable, None, threads, progress)
        run = measured(chosen.scene, chosen.header, told(chosen, progress), chosen.total)
    written = save_figure(draw_panels(run, what), path)
    for file, _, write in tables:
        if file is not None:
            write(file, run.table(which))
            written.append(file)
    return written
