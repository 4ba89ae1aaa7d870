"""The commands. What they need is imported when they run: ``--help`` answers at once."""

from __future__ import annotations

import importlib.metadata
import json
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from particlesim.bench import Speed
    from particlesim.compare.command import Report
    from particlesim.scene import Scene
    from particlesim.summary import Summary

app = typer.Typer(
    name="particlesim",
    help="From a scene file to a movie of particles that bounce as physics says they do, without a screen.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # help in plain text: rich takes longer to import than all the rest
)


def _show_version(wanted: bool) -> None:
    if wanted:
        print(f"particlesim {importlib.metadata.version('particlesim')}")
        raise typer.Exit


def _at_least_one(threads: int | None) -> int | None:
    if threads is not None and threads < 1:
        raise typer.BadParameter("must be 1 or more")
    return threads


def _not_negative(drift: float | None) -> float | None:
    if drift is not None and not drift >= 0.0:
        raise typer.BadParameter("must be a number of 0 or more")
    return drift


SceneArgument = Annotated[Path, typer.Argument(metavar="SCENE", help="A scene file (TOML).")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")]
Threads = Annotated[
    int | None, typer.Option("--threads", callback=_at_least_one, help="Threads to simulate with.  [default: all]")
]
MaxDrift = Annotated[
    float | None,
    typer.Option(
        "--max-drift",
        metavar="X",
        callback=_not_negative,
        help="End with exit code 3 if the energy drifts by more than this fraction of it; the output is kept.",
    ),
]
Version = Annotated[
    bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version and exit.")
]


def main() -> None:
    """Run the command line.

    Exit code 2 for wrong input, 1 for what this machine cannot do, 3 for a drift of energy that was not allowed,
    130 for Ctrl-C.
    """
    app()


@app.callback()
def _options(version: Version = False) -> None:
    """Options of the program itself; its help text is that of ``app``."""


@contextmanager
def _one_line_errors(source: Path) -> Iterator[None]:
    """Expected failures as one line on standard error and an exit code; anything else is a bug and shows where."""
    try:
        from particlesim.rendering import RenderError  # noqa: PLC0415
        from particlesim.scene.file import SceneError  # noqa: PLC0415

        try:
            yield
        except SceneError as error:
            _fail(str(error if error.file else error.within(source)), 2)
        except BrokenPipeError:  # whoever reads the output has seen enough; typer ends the program
            raise
        except (RenderError, OSError) as error:
            _fail(_described(error), 1)
        except (ValueError, RuntimeError) as error:
            # Errors of other modules of ours, which need not be imported to catch them.
            if not type(error).__module__.startswith("particlesim."):
                raise
            _fail(str(error), 2 if isinstance(error, ValueError) else 1)
    except KeyboardInterrupt:
        _fail("interrupted; nothing was written", 130)


def _described(error: Exception) -> str:
    """An error of ours as it is, one of the system with the file it is about."""
    if isinstance(error, OSError) and error.strerror:
        return ": ".join([str(name) for name in (error.filename,) if name] + [error.strerror])
    return str(error)


def _fail(message: str, code: int) -> None:
    print(message, file=sys.stderr)
    raise typer.Exit(code)


@contextmanager
def _output(path: Path | None, source: Path, suffix: str) -> Iterator[Path]:
    """Where the result goes: as told, or to renders/ under the name of the source.

    A wrong place is found out before the work, not after it; renders/ does not stay behind if nothing comes of it.
    """
    if path is not None:
        path = path if path.suffix or path.is_dir() else path.with_suffix(suffix)
        _check_output(path, suffix)
        yield path
        return
    folder = Path("renders")
    path = folder / f"{source.stem}{suffix}"
    is_new = not folder.exists()
    folder.mkdir(exist_ok=True)
    _check_output(path, suffix)
    try:
        yield path
    except BaseException:
        if is_new and not any(folder.iterdir()):
            folder.rmdir()
        raise


def _check_output(path: Path, suffix: str) -> None:
    """Exit with a line if no file can appear at ``path``."""
    if path.is_dir():
        _fail(f"{path}: is a folder, not a file to write to", 2)
    if path.suffix.lower() != suffix:
        _fail(f"{path}: the output must end in {suffix}", 2)
    if not path.parent.is_dir():
        _fail(f"{path}: there is no folder {path.parent}", 2)
    if not os.access(path.parent, os.W_OK):
        _fail(f"{path}: the folder {path.parent} cannot be written to", 1)


def _check_drift(summary: Summary, path: Path, allowed: float | None) -> None:
    """Exit with a line if more energy came or went than is allowed. The output stays: it shows what went wrong."""
    drift = summary.forbidden_energy_drift
    # The other way round a drift that is not a number would pass.
    if allowed is not None and not drift <= allowed:
        way = "drifted" if summary.elastic else "rose"
        _fail(f"{path}: written, but its energy {way} by {drift:.1e} of all of it, more than {allowed:g}", 3)


def _load(source: Path) -> Scene:
    """The scene of a file. SceneError if it is wrong."""
    from particlesim.scene.file import SceneError, load_scene  # noqa: PLC0415

    if source.suffix.lower() in (".gsd", ".mp4"):
        raise SceneError("must be a scene file (TOML)", file=source)
    return load_scene(source)


@app.command(short_help="Make a movie of a scene or of a trajectory.")
def render(
    source: Annotated[Path, typer.Argument(metavar="SCENE|TRAJECTORY", help="A scene file or a .gsd trajectory.")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="The movie.  [default: renders/NAME.mp4]")
    ] = None,
    quiet: Quiet = False,
    threads: Threads = None,
    max_drift: MaxDrift = None,
) -> None:
    """Simulate a scene, or read a trajectory, and make a movie of it, with a poster (PNG) beside it."""
    with _one_line_errors(source):
        movable = source if source.suffix.lower() == ".gsd" else _load(source)
        from particlesim.pipeline import render as make_movie  # noqa: PLC0415

        with _output(output, source, ".mp4") as path:
            _make(make_movie, movable, path, quiet, threads, max_drift)


@app.command(short_help="Simulate a scene and write its trajectory.")
def simulate(
    scene: SceneArgument,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="The trajectory.  [default: renders/NAME.gsd]")
    ] = None,
    quiet: Quiet = False,
    threads: Threads = None,
    max_drift: MaxDrift = None,
) -> None:
    """Simulate a scene and write its trajectory (GSD): no OpenGL, no movie."""
    with _one_line_errors(scene):
        loaded = _load(scene)
        from particlesim.pipeline import simulate as write_trajectory  # noqa: PLC0415

        with _output(output, scene, ".gsd") as path:
            _make(write_trajectory, loaded, path, quiet, threads, max_drift)


def _make(
    make: Callable[..., Summary], source: Any, path: Path, quiet: bool, threads: int | None, max_drift: float | None
) -> None:
    """Make a movie or a trajectory, showing progress and what it amounted to."""
    from particlesim.progress import shown_progress  # noqa: PLC0415

    with shown_progress(quiet) as progress:
        summary = make(source, path, progress=progress, threads=threads)
    if not quiet:
        _print_summary(summary, path)
    _check_drift(summary, path, max_drift)


@app.command(short_help="Validate a scene and say what it amounts to.")
def check(scene: SceneArgument) -> None:
    """Validate a scene and say what it amounts to, without simulating it."""
    with _one_line_errors(scene):
        loaded = _load(scene)
        from particlesim.survey import survey  # noqa: PLC0415

        _print_table(scene.name, survey(loaded))


@app.command(short_help="Compare the broad phases on a scene, on a sweep or on a stream of boxes.")
def compare(
    source: Annotated[
        Path | None, typer.Argument(metavar="[SCENE|STREAM]", help="A scene file, or an .aabb stream (Broadmark).")
    ] = None,
    sweep: Annotated[
        str | None, typer.Option("--sweep", help="Instead: uniform, clustered or mixed boxes, 100 to a million.")
    ] = None,
    steps: Annotated[int | None, typer.Option("--steps", min=1, help="Time steps of a scene.  [default: 3 s]")] = None,
    largest: Annotated[int, typer.Option("--largest", min=100, help="Boxes a sweep ends with.")] = 1_000_000,
    limit: Annotated[float, typer.Option("--limit", min=0.0, help="Seconds after which a method is left out.")] = 10.0,
    stream: Annotated[
        Path | None, typer.Option("--stream", help="Also write the scene's frames as a stream (.aabb).")
    ] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="JSON, and SVG and PNG beside it.  [default: renders/]")
    ] = None,
    quiet: Quiet = False,
    threads: Threads = None,
) -> None:
    """Run every broad phase on the same boxes: seconds, tests, memory, and proof that all give the same.

    Exit code 1 if they do not.
    """
    if (source is None) == (sweep is None):
        _fail("give a scene, a stream or --sweep, and one of them only", 2)
    if stream is not None:
        _check_output(stream, ".aabb")
    with _one_line_errors(source or Path("compare")):
        from particlesim.compare.command import on_scene, on_stream, on_sweep  # noqa: PLC0415
        from particlesim.progress import shown_progress  # noqa: PLC0415

        is_stream = source is not None and source.suffix.lower() == ".aabb"
        scene = _load(source) if source is not None and not is_stream else None
        with _output(output, Path(f"compare_{source.stem if source else sweep}"), ".json") as path:
            with shown_progress(quiet, "particle" if sweep else "step") as progress:
                settings: dict[str, Any] = {"limit": limit, "threads": threads, "progress": progress}
                if scene is not None and source is not None:
                    report = on_scene(scene, source.stem, path, stream, steps=steps, **settings)
                elif source is not None:
                    report = on_stream(source, path, **settings)
                else:
                    report = on_sweep(str(sweep), path, largest=largest, **settings)
            if not quiet:
                _print_report(report)
    if not report.same:
        _fail("the broad phases do not agree", 1)


@app.command(short_help="Measure how fast this machine simulates.")
def bench(
    large: Annotated[bool, typer.Option("--large", help="Measure a million particles as well.")] = False,
    figures: Annotated[
        Path | None, typer.Option("--json", metavar="FILE", help="Write the figures to a file as well.")
    ] = None,
    quiet: Quiet = False,
    threads: Threads = None,
) -> None:
    """Measure how many whole time steps a second gases of spheres and of mixed shapes make on this machine.

    They are in a periodic box at unit temperature. In a step a particle moves a twentieth of its radius on average.
    """
    with _one_line_errors(Path("bench")):
        if figures is not None:
            _check_output(figures, ".json")
        from particlesim.bench import COUNTS, LARGE, run, write  # noqa: PLC0415
        from particlesim.progress import shown_progress  # noqa: PLC0415

        with shown_progress(quiet, "measurement") as progress:
            speeds = list(run((*COUNTS, LARGE) if large else COUNTS, threads, progress))
        if figures is not None:
            write(figures, speeds)
        if not quiet:
            _print_speeds(speeds)


@app.command(short_help="Say what this machine has and what is missing.")
def doctor() -> None:
    """Say what this machine has for simulating and drawing, and how to get what is missing."""
    from particlesim.diagnosis import diagnose  # noqa: PLC0415

    findings = diagnose()
    _print_table("particlesim", [(f.what, f.text if f.good else "missing, see below") for f in findings])
    missing = [f"{finding.what}: {finding.text}" for finding in findings if not finding.good]
    if missing:
        # Below the table and on a line of its own, so that a command can be copied whole.
        _fail("\n".join(missing), 1)


@app.command(short_help="Print the JSON Schema of scene files.")
def schema() -> None:
    """Print the JSON Schema of scene files, for editors that complete and check TOML."""
    from particlesim.scene import Scene  # noqa: PLC0415

    print(json.dumps(Scene.model_json_schema(), indent=2))


def _print_table(title: str, rows: list[tuple[str, Any]]) -> None:
    from rich.console import Console  # noqa: PLC0415
    from rich.table import Table  # noqa: PLC0415
    from rich.text import Text  # noqa: PLC0415

    table = Table(title=Text(title), show_header=False, title_justify="left")
    table.add_column(no_wrap=True)
    table.add_column(overflow="fold")
    for name, value in rows:
        # As Text: square brackets in names of groups and files are no markup.
        table.add_row(Text(name), Text(str(value)))
    Console().print(table)


def _print_report(report: Report) -> None:
    from rich.console import Console  # noqa: PLC0415

    Console().print(report.table)
    print("\n".join(str(path) for path in report.written))


def _print_speeds(speeds: list[Speed]) -> None:
    from rich.console import Console  # noqa: PLC0415
    from rich.table import Table  # noqa: PLC0415

    from particlesim.crew import available_threads  # noqa: PLC0415

    title = f"Whole steps, {available_threads()} threads"
    # Ten columns in the 80 letters of a plain terminal: no frame.
    table = Table(title=title, title_justify="left", box=None, pad_edge=False, padding=(0, 1, 0, 0))
    table.add_column("gas", no_wrap=True)
    phases = list(speeds[0].milliseconds)
    for name in ("particles", "M/s", "spread", *phases, "impacts", "bytes"):
        table.add_column(name, justify="right", no_wrap=True)
    for speed in speeds:
        table.add_row(
            speed.gas,
            f"{speed.particles:,}",
            f"{speed.rate:.2f}",
            f"{speed.spread:.0%}",
            *(f"{speed.milliseconds[phase]:.3g}" for phase in phases),
            f"{speed.impacts:.3f}",
            "" if speed.bytes is None else f"{speed.bytes:,.0f}",
        )
    console = Console()
    console.print(table)
    for line in (
        "M/s: million particle-steps a second, median; spread: from the least to the most",
        f"{', '.join(phases)}: milliseconds a step",
        "impacts: a particle and step; bytes: a particle, at the most",
    ):
        console.print(line, style="dim", highlight=False)


def _print_summary(summary: Summary, path: Path) -> None:
    rows: list[tuple[str, Any]] = [
        ("frames", summary.frames),
        ("simulated", f"{summary.simulated_seconds:g} s"),
        ("impacts", f"{summary.impacts:,}"),
        ("worst energy change", f"{summary.worst_energy_drift:.1e} of all of it"),
        ("momentum not accounted for", f"{summary.momentum_error:.1e}"),
        ("largest overlap", f"{summary.largest_overlap:.1e} m"),
    ]
    if summary.unresolved:
        rows.append(("steps with impacts left over", summary.unresolved))
    rows += [(name, f"{seconds:.1f} s") for name, seconds in summary.seconds.items()]
    _print_table(str(path), rows)
