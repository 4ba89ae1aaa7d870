"""The comparison as tables on the terminal."""

from __future__ import annotations

from rich.console import Group
from rich.table import Table
from rich.text import Text

from particlesim.benchmarks.broad_phase.measure import machine_words
from particlesim.benchmarks.broad_phase.runs import SceneComparison
from particlesim.benchmarks.broad_phase.sweep import FITTED_FROM, Sweep


def scene_table(comparison: SceneComparison) -> Group:
    """One row a broad phase, and below it whether they agree."""
    about = f"{comparison.name}: {comparison.boxes:,} boxes, {comparison.frames} frames, "
    steps = f"{comparison.steps} steps, " if comparison.steps else ""
    table = Table(title=Text(f"{about}{steps}{machine_words(comparison.machine)}"), title_justify="left")
    table.add_column("broad phase")
    for heading in ("a step", "a search", "tested", "pairs", "memory"):
        table.add_column(heading, justify="right")
    for result in comparison.results:
        if result.left_out:
            table.add_row(result.method, Text(f"left out: {result.left_out}"))
        else:
            table.add_row(
                result.method,
                _milliseconds(result.step_seconds),
                _milliseconds(result.search_seconds),
                f"{result.tested or 0:,}",
                f"{result.pairs or 0:,}",
                f"{(result.memory or 0) / max(comparison.boxes, 1):,.0f} bytes a box",
            )
    verdict = [("pairs", comparison.same_pairs)]
    if comparison.steps:
        verdict.append(("trajectory", comparison.same_trajectory))
    lines = [f"{what}: {'the same, to the last bit' if same else 'NOT THE SAME'}" for what, same in verdict]
    return Group(table, Text("\n".join(lines)))


def sweep_table(sweep: Sweep) -> Group:
    """Seconds, and tests of those that count them: one row a number of boxes, one column a method."""
    notes = [f"{method} {reason}" for method, reason in sweep.stopped.items()]
    same = f"NOT THE SAME: {', '.join(sweep.disagree)}" if sweep.disagree else "the same, to the last bit"
    return Group(
        _columns(sweep, "seconds", f"{sweep.kind} boxes, {machine_words(sweep.machine)}: a search"),
        _columns(sweep, "tested", "pairs of boxes tested"),
        Text("\n".join([*notes, f"pairs: {same}"])),
    )


def _columns(sweep: Sweep, value: str, title: str) -> Table:
    table = Table(title=Text(title), title_justify="left")
    table.add_column("boxes", justify="right", no_wrap=True)
    methods = [method for method in sweep.methods if len(sweep.of(method, value)[0])]
    for method in methods:
        table.add_column(method, justify="right", no_wrap=True)
    shown = _milliseconds if value == "seconds" else _short
    cells = {(row["boxes"], row["method"]): shown(row[value]) for row in sweep.rows if row[value] is not None}
    for count in sorted({row["boxes"] for row in sweep.rows}):
        table.add_row(f"{count:,}", *(cells.get((count, method), "") for method in methods))
    exponents = [sweep.exponent(method, value) for method in methods]
    if any(exponent is not None for exponent in exponents):
        table.add_section()
        table.add_row("~ n^p, p =", *("" if p is None else f"{p:.2f}" for p in exponents))
        table.caption = f"p from {FITTED_FROM:,} boxes on"
    return table


def _milliseconds(seconds: float | None) -> str:
    if seconds is None:
        return ""
    milliseconds = 1e3 * seconds
    return f"{milliseconds:,.0f} ms" if milliseconds >= 100 else f"{milliseconds:.3g} ms"


def _short(number: int) -> str:
    """A number to two figures with its thousands as letters."""
    for letter, size in (("T", 1e12), ("G", 1e9), ("M", 1e6), ("k", 1e3)):
        if number >= size:
            return f"{number / size:.3g} {letter}"
    return str(number)
