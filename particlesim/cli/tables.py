"""What commands print when they are done."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from particlesim.benchmarks.broad_phase.command import Report
    from particlesim.benchmarks.drawing import Drawn
    from particlesim.benchmarks.obstacles import OnField
    from particlesim.benchmarks.settling import Settled
    from particlesim.benchmarks.steps import Speed
    from particlesim.jobs.summary import Summary


def print_table(title: str, rows: list[tuple[str, Any]]) -> None:
    """Names and values in two columns."""
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


def print_report(report: Report) -> None:
    """What a comparison of broad phases came to, and the files with it."""
    from rich.console import Console  # noqa: PLC0415

    Console().print(report.table)
    print("\n".join(str(path) for path in report.written))


def print_speeds(speeds: list[Speed]) -> None:
    """What a benchmark measured."""
    from rich.console import Console  # noqa: PLC0415
    from rich.table import Table  # noqa: PLC0415

    from particlesim.core.parallel import available_threads  # noqa: PLC0415

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


def print_pictures(pictures: list[Drawn]) -> None:
    """What a benchmark of drawing measured: a row for each crowd, a column for each that drew it."""
    from rich.console import Console  # noqa: PLC0415
    from rich.table import Table  # noqa: PLC0415

    from particlesim.benchmarks.drawing import SIZE  # noqa: PLC0415

    drawers = list(dict.fromkeys(drawn.drawer for drawn in pictures))
    crowds = list(dict.fromkeys((drawn.kind, drawn.particles) for drawn in pictures))
    seconds = {(drawn.kind, drawn.particles, drawn.drawer): drawn.median for drawn in pictures}
    table = Table(title=f"Seconds a picture of {SIZE[0]}x{SIZE[1]}", title_justify="left", box=None, pad_edge=False)
    for name in ("", "particles", *drawers):
        table.add_column(name, justify="right" if name else "left", no_wrap=True)
    for kind, count in crowds:
        table.add_row(kind, f"{count:,}", *(f"{seconds[kind, count, drawer]:.3f}" for drawer in drawers))
    console = Console()
    console.print(table)
    console.print("medians; ours with shadows and smooth edges, VTK without", style="dim", highlight=False)


def print_heaps(heaps: list[Settled]) -> None:
    """What a benchmark of heaps measured: a row for each engine and number of bodies."""
    from rich.console import Console  # noqa: PLC0415
    from rich.table import Table  # noqa: PLC0415

    from particlesim.benchmarks.settling import PIECE  # noqa: PLC0415

    table = Table(title="Seconds for a simulated second", title_justify="left", box=None, pad_edge=False)
    pieces = [f"to {PIECE * (k + 1):g} s" for k in range(len(heaps[0].seconds))]
    for name in ("", "bodies", "mean", *pieces, "overlap"):
        table.add_column(name, justify="right" if name else "left", no_wrap=True)
    for heap in heaps:
        overlap = f"{max(heap.overlaps):.1e}" if heap.overlaps else ""
        each = (f"{seconds:.2f}" for seconds in heap.seconds)
        table.add_row(heap.engine, f"{heap.bodies:,}", f"{heap.mean:.2f}", *each, overlap)
    console = Console()
    console.print(table)
    console.print("overlap: the deepest after any piece, in sizes", style="dim", highlight=False)


def print_fields(fields: list[OnField]) -> None:
    """What a benchmark of meshes measured: a row for each."""
    from rich.console import Console  # noqa: PLC0415
    from rich.table import Table  # noqa: PLC0415

    from particlesim.benchmarks.obstacles import COUNT  # noqa: PLC0415

    title = f"Milliseconds a step of {COUNT} bodies"
    table = Table(title=title, title_justify="left", box=None, pad_edge=False)
    for name in ("triangles", "falling", "lying", "overlap", "built in"):
        table.add_column(name, justify="right", no_wrap=True)
    for of in fields:
        steps = (f"{1e3 * seconds:.2f}" for seconds in (of.falling, of.lying))
        table.add_row(f"{of.triangles:,}", *steps, f"{of.overlap:.1e}", f"{of.building:.2f} s")
    Console().print(table)


def print_summary(summary: Summary, path: Path) -> None:
    """What a run amounted to that was written to ``path``."""
    rows: list[tuple[str, Any]] = [("frames", _frames(summary)), _times(summary)]
    if summary.has_ledger:
        rows += _ledger_rows(summary)
    rows += [(name, f"{seconds:.1f} s") for name, seconds in summary.seconds.items()]
    print_table(str(path), rows)


def _ledger_rows(summary: Summary) -> list[tuple[str, Any]]:
    """What is known of energy, momentum and impacts."""
    rows: list[tuple[str, Any]] = [
        ("impacts", f"{summary.impacts:,}"),
        *([("worst energy change", f"{summary.worst_energy_drift:.1e} of all of it")] if summary.is_closed else []),
        *((f"lost by {cause}", f"{share:.3g} of all of it") for cause, share in summary.dissipated.items() if share),
    ]
    came, went, waited = summary.flow
    if came or went:
        rows.append(("particles that came, went", f"{came:,}, {went:,}"))
    if waited:
        rows.append(("waited for room to come in", f"up to {waited:,} at a time"))
    if summary.work:
        rows.append(("worked by obstacles, fields", f"{summary.work:.3g} of all of it"))
    if not summary.obstructed:
        rows.append(("momentum not accounted for", f"{summary.momentum_error:.1e}"))
    rows.append(("largest overlap", f"{summary.largest_overlap:.1e} m"))
    if summary.unresolved:
        rows.append(("steps with impacts left over", summary.unresolved))
    return rows


def _times(summary: Summary) -> tuple[str, str]:
    """How long was simulated, or which times of a trajectory were read."""
    if "simulating" in summary.seconds:
        return "simulated", f"{summary.simulated_seconds:g} s"
    first, last = summary.times
    return "time", f"{last:g} s" if first == last else f"{first:g} to {last:g} s"


def _frames(summary: Summary) -> str:
    """How many frames there are, and how many of them were drawn if not all."""
    drawn = summary.drawn
    return f"{summary.frames:,}" if drawn in (0, summary.frames) else f"{drawn:,} drawn, of {summary.frames:,}"
