"""The commands. What they need is imported when they run: ``--help`` answers at once."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer
import typer.core

from particlesim.cli.bench import measure_drawing, measure_obstacles, measure_settling, measure_steps
from particlesim.cli.clean import clean
from particlesim.cli.errors import fail, one_line_errors
from particlesim.cli.export import export
from particlesim.cli.info import info
from particlesim.cli.join import join
from particlesim.cli.options import MaxDrift, Quiet, Resume, SceneArgument, Threads
from particlesim.cli.output import place_for
from particlesim.cli.plot import plot
from particlesim.cli.render import render
from particlesim.cli.run import load, make_file
from particlesim.cli.streams import one_line_output, open_streams, warn_in_one_line
from particlesim.cli.sweep import sweep
from particlesim.cli.tables import print_report, print_table
from particlesim.cli.view import view
from particlesim.core.interrupts import ended_by, interruption
from particlesim.core.last_words import watched
from particlesim.core.output_path import check_output

# What Typer raises for a wrong command line.
_UsageError: Any = typer.BadParameter.__base__


class _OneLineUsage(typer.core.TyperGroup):
    """The program: a wrong command line gets one line, as wrong scenes do, and not the four that Typer prints."""

    def make_context(self, *args: Any, **options: Any) -> Any:
        """The options of the program itself."""
        return _in_one_line(super().make_context, *args, **options)

    def invoke(self, ctx: Any) -> Any:
        """A command with its options."""
        return _in_one_line(super().invoke, ctx)


def _in_one_line(call: Callable[..., Any], *args: Any, **options: Any) -> Any:
    """What ``call`` returns; a wrong command line ends the program in one line that says where there is help.

    So does an interruption, of which Typer would say nothing.
    """
    try:
        return call(*args, **options)
    except _UsageError as error:
        message = error.format_message()
        if "\n" in message:  # the help itself, for no arguments at all
            raise
        command = error.ctx.command_path if error.ctx else "particlesim"
        fail(f"{message.rstrip('.')}; see {command} --help", 2)
    except typer.Exit:
        raise
    except BaseException as error:
        if (stopped := interruption(error)) is None:
            raise
        fail(*ended_by(stopped))


app = typer.Typer(
    name="particlesim",
    cls=_OneLineUsage,
    help="From a scene file to a movie of particles that bounce as physics says they do, without a screen.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # help in plain text: rich takes longer to import than all the rest
)


def _show_version(wanted: bool) -> None:
    if wanted:
        import importlib.metadata  # noqa: PLC0415

        print(f"particlesim {importlib.metadata.version('particlesim')}")
        raise typer.Exit


Version = Annotated[
    bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version and exit.")
]


def main() -> None:
    """Run the command line: see ``particlesim.__main__``, which is ready for signals before this module is read."""
    open_streams()
    warn_in_one_line()
    with watched(), one_line_output():
        app()


@app.callback()
def _options(version: Version = False) -> None:
    """Options of the program itself; its help text is that of ``app``."""


app.command(short_help="Make a movie of a scene or of a trajectory.")(render)


app.command(short_help="Make a movie of the parts that render --shard made.")(join)


@app.command(short_help="Simulate a scene and write its trajectory.")
def simulate(
    scene: SceneArgument,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="The trajectory.  [default: renders/NAME.gsd]")
    ] = None,
    resume: Resume = False,
    quiet: Quiet = False,
    threads: Threads = None,
    max_drift: MaxDrift = None,
) -> None:
    """Simulate a scene and write its trajectory (GSD): no OpenGL, no movie."""
    with one_line_errors(scene), place_for(output, scene, ".gsd") as path:
        loaded = load(scene)
        from particlesim.simulation.needs import check_simulation  # noqa: PLC0415

        check_simulation(loaded, path)
        from particlesim.jobs.movie import simulate as write_trajectory  # noqa: PLC0415

        make_file(partial(write_trajectory, resume=resume), loaded, path, quiet, threads, max_drift)


@app.command(short_help="Validate a scene and say what it amounts to.")
def check(scene: SceneArgument) -> None:
    """Validate a scene and say what it amounts to, without simulating it."""
    with one_line_errors(scene):
        loaded = load(scene)
        from particlesim.setup.memory import check_memory  # noqa: PLC0415

        check_memory(loaded.number)
        from particlesim.simulation.estimate import estimate  # noqa: PLC0415

        print_table(scene.name, estimate(loaded))


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
        fail("give a scene, a stream or --sweep, and one of them only", 2)
    with one_line_errors(source or Path("compare")):
        if stream is not None:
            check_output(stream, ".aabb")
        from particlesim.benchmarks.broad_phase.command import on_scene, on_stream, on_sweep  # noqa: PLC0415
        from particlesim.cli.progress import shown_progress  # noqa: PLC0415

        is_stream = source is not None and source.suffix.lower() == ".aabb"
        scene = load(source) if source is not None and not is_stream else None
        name = f"{source.stem}_stream" if source and is_stream else source.stem if source else sweep
        with place_for(output, Path(f"compare_{name}"), ".json", beside=(".svg", ".png")) as path:
            with shown_progress(quiet, "particle" if sweep else "step") as progress:
                settings: dict[str, Any] = {"limit": limit, "threads": threads, "progress": progress}
                if scene is not None and source is not None:
                    report = on_scene(scene, source.stem, path, stream, steps=steps, **settings)
                elif source is not None:
                    report = on_stream(source, path, **settings)
                else:
                    report = on_sweep(str(sweep), path, largest=largest, **settings)
            if not quiet:
                print_report(report)
    if not report.same:
        fail("the broad phases do not agree", 1)


@app.command(short_help="Measure how fast this machine simulates, or draws.")
def bench(
    large: Annotated[bool, typer.Option("--large", help="Measure a million particles as well.")] = False,
    drawing: Annotated[bool, typer.Option("--drawing", help="Measure the drawing of pictures instead.")] = False,
    resting: Annotated[bool, typer.Option("--resting", help="Measure heaps that come to rest instead.")] = False,
    obstacles: Annotated[bool, typer.Option("--obstacles", help="Measure meshes of triangles instead.")] = False,
    figures: Annotated[
        Path | None, typer.Option("--json", metavar="FILE", help="Write the figures to a file as well.")
    ] = None,
    quiet: Quiet = False,
    threads: Threads = None,
) -> None:
    """Measure how many whole time steps a second gases of spheres and of mixed shapes make on this machine.

    They are in a periodic box at unit temperature. In a step a particle moves a twentieth of its radius on average.

    With --drawing, measure how long a picture of 1280x720 pixels takes, beside VTK where it is installed.

    With --resting, measure how long mixed bodies that are dropped into a box take, beside Rapier where it is installed.

    With --obstacles, measure what a step takes of bodies on meshes of a hundred to a hundred thousand triangles.
    """
    with one_line_errors(Path("bench")):
        if figures is not None:
            check_output(figures, ".json")
        if drawing:
            measure_drawing(large, figures, quiet)
        elif resting:
            measure_settling(large, figures, quiet, threads)
        elif obstacles:
            measure_obstacles(figures, quiet, threads)
        else:
            measure_steps(large, figures, quiet, threads)


@app.command(short_help="Say what this machine has and what is missing.")
def doctor() -> None:
    """Say what this machine has for simulating and drawing, and how to get what is missing."""
    from particlesim.cli.doctor import diagnose  # noqa: PLC0415

    findings = diagnose()
    print_table("particlesim", [(f.what, f.text if f.good else "missing, see below") for f in findings])
    missing = [f"{finding.what}: {finding.text}" for finding in findings if not finding.good]
    if missing:
        # Below the table and on a line of its own, so that a command can be copied whole.
        fail("\n".join(missing), 1)


app.command(short_help="Simulate many cases of a scene.")(sweep)
app.command(short_help="Draw figures of a run, and write its numbers.")(plot)
app.command(short_help="Write a run for ParaView, Blender, OVITO and others.")(export)
app.command(short_help="Make a page that shows a run in a browser.")(view)
app.command(short_help="Say where a movie, a picture or a trajectory comes from.")(info)
app.command(short_help="Show partial runs, and remove them.")(clean)


@app.command(short_help="Print the JSON Schema of scene files.")
def schema() -> None:
    """Print the JSON Schema of scene files, for editors that complete and check TOML."""
    from particlesim.scene import Scene  # noqa: PLC0415

    print(json.dumps(Scene.model_json_schema(), indent=2))
