"""The comparison as a figure, drawn without a screen: SVG and PNG."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from particlesim.benchmarks.broad_phase.measure import machine_words
from particlesim.benchmarks.broad_phase.runs import SceneComparison
from particlesim.benchmarks.broad_phase.sweep import Sweep
from particlesim.core.figure import AMBER, BLUE, GREEN, GREYS, ORANGE, PURPLE, SKY, YELLOW, new_figure, save_figure

_COLOURS = {"naive": ORANGE, "grid": BLUE, "octree": GREEN}
_FURTHER = (PURPLE, AMBER, SKY, YELLOW)  # for broad phases that join the registry


def draw_sweep(sweep: Sweep, path: Path) -> list[Path]:
    """Seconds and tests over the number of boxes, both axes logarithmic, as SVG and PNG."""
    figure = new_figure(10.0, 4.4)
    left, right = figure.subplots(1, 2)
    for axes, value, label in ((left, "seconds", "seconds for one search"), (right, "tested", "pairs of boxes tested")):
        others = iter(GREYS[:2])
        for method in sweep.methods:
            counts, measured = sweep.of(method, value)
            if len(counts):
                _curve(
                    axes, counts, measured, sweep, method, value, next(others, "k") if method not in _COLOURS else ""
                )
        axes.set(xscale="log", yscale="log", xlabel="boxes n", ylabel=label)
        axes.grid(True, which="major", color=GREYS[2])
    counts = np.array(sorted({row["boxes"] for row in sweep.rows}), dtype=float)
    right.plot(counts, counts * (counts - 1.0), color="k", lw=0.8, ls=":", label="n (n - 1), as the paper counts naive")
    for axes in (left, right):
        axes.legend(frameon=False, fontsize=8)
    figure.suptitle(f"{sweep.kind} boxes, {machine_words(sweep.machine)}", fontsize=11)
    return save_figure(figure, path)


def draw_scene(comparison: SceneComparison, path: Path) -> list[Path]:
    """Bars: seconds of a search, tests, memory of each broad phase that ran, as SVG and PNG."""
    from matplotlib.ticker import EngFormatter  # noqa: PLC0415  (slow to import)

    figure = new_figure(9.0, 3.0)
    panels = (
        ("search_seconds", "time of one search", "s"),
        ("tested", "pairs of boxes tested, all frames", ""),
        ("memory", "memory", "B"),
    )
    names = [result.method for result in comparison.ran]
    for axes, (value, label, unit) in zip(figure.subplots(1, len(panels)), panels, strict=True):
        heights = [getattr(result, value) for result in comparison.ran]
        bars = axes.bar(names, heights, color=_bar_colours(names), width=0.6)
        # Lengths of bars are compared: they start at 0 and are in proportion; what is too short to see has its number.
        axes.bar_label(bars, labels=[EngFormatter(unit, places=1)(height) for height in heights], fontsize=8)
        axes.yaxis.set_major_formatter(EngFormatter(unit))
        axes.set(title=label, ylim=(0.0, 1.12 * max(heights, default=1.0)))
        axes.title.set_size(9)
    about = f"{comparison.name}: {comparison.boxes:,} boxes, {comparison.frames} frames"
    figure.suptitle(f"{about}, {machine_words(comparison.machine)}", fontsize=10)
    return save_figure(figure, path)


def _bar_colours(names: Sequence[str]) -> list[str]:
    """A colour for each broad phase: its own, or the next that is free."""
    further = itertools.cycle(_FURTHER)
    return [_COLOURS.get(name) or next(further) for name in names]


def _curve(
    axes: Any, counts: np.ndarray, measured: np.ndarray, sweep: Sweep, method: str, value: str, other: str
) -> None:
    exponent = sweep.exponent(method, value)
    fitted = "" if exponent is None else f", n^{exponent:.2f}"
    style = {"color": other, "lw": 1.0, "ls": "--"} if other else {"color": _COLOURS[method], "lw": 1.8}
    axes.plot(counts, measured, marker="o", ms=3.0, label=f"{method}{fitted}", **style)
