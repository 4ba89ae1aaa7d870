"""The commands. What they need is imported when they run: ``--help`` answers at once."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from particlesim.summary import Summary

app = typer.Typer(
    name="particlesim",
    help="From a scene file to a movie of particles that bounce as physics says they do, without a screen.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

SceneArgument = Annotated[Path, typer.Argument(metavar="SCENE", help="A scene file (TOML).")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")]
Threads = Annotated[int | None, typer.Option("--threads", min=1, help="Threads to simulate with.  [default: all]")]


def main() -> None:
    """Run the command line. Exit code 2 for wrong input, 1 for what this machine cannot do."""
    app()


@contextmanager
def _one_line_errors() -> Iterator[None]:
    """Expected failures as one line on standard error and an exit code."""
    from particlesim.render import RenderError  # noqa: PLC0415
    from particlesim.scene.file import SceneError  # noqa: PLC0415

    try:
        yield
    except SceneError as error:
        _fail(str(error), 2)
    except (RenderError, OSError) as error:
        _fail(str(error), 1)
    except KeyboardInterrupt:
        _fail("interrupted; nothing was written", 130)
    except (ValueError, RuntimeError) as error:
        if type(error).__module__.startswith("particlesim."):
            _fail(str(error), 2 if isinstance(error, ValueError) else 1)
        raise


def _fail(message: str, code: int) -> None:
    print(message, file=sys.stderr)
    raise typer.Exit(code)


def _output(path: Path | None, source: Path, suffix: str) -> Path:
    """Where the result goes: as told, or to renders/ under the name of the source."""
    if path is not None:
        return path if path.suffix else path.with_suffix(suffix)
    folder = Path("renders")
    folder.mkdir(exist_ok=True)
    return folder / f"{source.stem}{suffix}"


@app.command()
def render(
    source: Annotated[Path, typer.Argument(metavar="SCENE|TRAJECTORY", help="A scene file or a .gsd trajectory.")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="The movie.  [default: renders/NAME.mp4]")
    ] = None,
    quiet: Quiet = False,
    threads: Threads = None,
) -> None:
    """Simulate a scene, or read a trajectory, and make a movie of it, with a poster (PNG) beside it."""
    with _one_line_errors():
        from particlesim.progress import shown_progress  # noqa: PLC0415
        from particlesim.scene.file import load_scene  # noqa: PLC0415

        scene = None if source.suffix == ".gsd" else load_scene(source)
        from particlesim.pipeline import render as make_movie  # noqa: PLC0415

        path = _output(output, source, ".mp4")
        with shown_progress(quiet) as progress:
            summary = make_movie(scene or source, path, progress=progress, threads=threads)
        if not quiet:
            _print_summary(summary, path)


@app.command()
def simulate(
    scene: SceneArgument,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="The trajectory.  [default: renders/NAME.gsd]")
    ] = None,
    quiet: Quiet = False,
    threads: Threads = None,
) -> None:
    """Simulate a scene and write its trajectory (GSD): no OpenGL, no movie."""
    with _one_line_errors():
        from particlesim.progress import shown_progress  # noqa: PLC0415
        from particlesim.scene.file import load_scene  # noqa: PLC0415

        loaded = load_scene(scene)
        from particlesim.pipeline import simulate as write_trajectory  # noqa: PLC0415

        path = _output(output, scene, ".gsd")
        with shown_progress(quiet) as progress:
            summary = write_trajectory(loaded, path, progress=progress, threads=threads)
        if not quiet:
            _print_summary(summary, path)


@app.command()
def check(scene: SceneArgument) -> None:
    """Validate a scene and say what it amounts to, without simulating it."""
    with _one_line_errors():
        from particlesim.scene.file import load_scene  # noqa: PLC0415

        loaded = load_scene(scene)
        from particlesim.survey import survey  # noqa: PLC0415

        _print_table(scene.name, survey(loaded))


@app.command()
def doctor() -> None:
    """Say what this machine has for simulating and drawing, and how to get what is missing."""
    from particlesim.diagnosis import diagnose  # noqa: PLC0415

    findings = diagnose()
    _print_table("particlesim", [(finding.what, finding.text) for finding in findings])
    if not all(finding.good for finding in findings):
        raise typer.Exit(1)


@app.command()
def schema() -> None:
    """Print the JSON Schema of scene files, for editors that complete and check TOML."""
    from particlesim.scene import Scene  # noqa: PLC0415

    print(json.dumps(Scene.model_json_schema(), indent=2))


def _print_table(title: str, rows: list[tuple[str, Any]]) -> None:
    from rich.console import Console  # noqa: PLC0415
    from rich.table import Table  # noqa: PLC0415

    table = Table(title=title, show_header=False, title_justify="left")
    table.add_column(no_wrap=True)
    table.add_column(overflow="fold")
    for name, value in rows:
        table.add_row(name, str(value))
    Console().print(table)


def _print_summary(summary: Summary, path: Path) -> None:
    rows: list[tuple[str, Any]] = [
        ("frames", summary.frames),
        ("simulated", f"{summary.simulated_seconds:g} s"),
        ("impacts", f"{summary.impacts:,}"),
        ("worst energy change", f"{summary.worst_energy_drift:.1e} of the kinetic energy"),
        ("momentum not accounted for", f"{summary.momentum_error:.1e}"),
        ("largest overlap", f"{summary.largest_overlap:.1e} m"),
    ]
    if summary.unresolved:
        rows.append(("steps with impacts left over", summary.unresolved))
    rows += [(name, f"{seconds:.1f} s") for name, seconds in summary.seconds.items()]
    _print_table(str(path), rows)
