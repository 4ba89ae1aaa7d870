"""A figure of a sweep: a column over another, mean and spread of the cases that differ in their seeds alone."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from particlesim.core.figure import AMBER, BLUE, GREEN, GREYS, ORANGE, PURPLE, SKY, new_figure, save_figure
from particlesim.jobs.sweep.row import COLUMNS
from particlesim.scene.messages import hint
from particlesim.scene.sweep import case_text

_COLOURS, _LINES = (BLUE, ORANGE, GREEN, PURPLE, AMBER, SKY), ("-", "--", ":")


class FigureError(ValueError):
    """A figure of columns that there are not, or that are no numbers; the message is one line."""


def check_columns(columns: Sequence[str], x: str, y: str) -> None:
    """FigureError for a column that there is not."""
    for axis, name in (("x", x), ("y", y)):
        if name not in columns:
            raise FigureError(f"--figure {axis}={name}: there is no such column{_instead(name, columns)}")


class Curve(NamedTuple):
    """A curve of a figure: at each place the mean of some cases and their standard deviation, 0 of a single one."""

    label: str  # the values that all its cases have in common
    places: list[Any]
    mean: list[float]
    spread: list[float]
    cases: int


def curves(rows: Sequence[dict[str, Any]], values: Sequence[str], x: str, y: str) -> list[Curve]:
    """``y`` over ``x``, a curve for each combination of the other ``values``: cases at a place differ in their seeds.

    Cases of which ``y`` is not known are left out. FigureError if nothing is left, or if it is no number.
    """
    groups: dict[str, dict[Any, list[float]]] = {}
    for row in rows:
        if row[x] is None or row[y] is None:
            continue
        if isinstance(row[y], bool | str) or not isinstance(row[y], int | float):
            raise FigureError(f"--figure y={y}: must be a column of numbers")
        others = case_text({key: row[key] for key in values if key not in (x, y, "seed")})
        place = row[x] if isinstance(row[x], int | float) else str(row[x])
        groups.setdefault(others, {}).setdefault(place, []).append(float(row[y]))
    if not groups:
        raise FigureError(f"--figure x={x} y={y}: there are no cases of which both are known")
    return [_curve(label, points) for label, points in groups.items()]


def draw(found: Sequence[Curve], x: str, y: str, path: Path) -> list[Path]:
    """Draw curves of ``y`` over ``x`` as SVG and PNG beside ``path``."""
    figure = new_figure(6.4, 4.4)
    axes: Any = figure.subplots()
    for k, curve in enumerate(found):
        style = {"color": _COLOURS[k % len(_COLOURS)], "ls": _LINES[k // len(_COLOURS) % len(_LINES)]}
        axes.errorbar(
            curve.places, curve.mean, curve.spread, label=curve.label, marker="o", ms=4.0, capsize=3.0, **style
        )
    axes.set(xlabel=_with_unit(x), ylabel=_with_unit(y))
    axes.grid(True, color=GREYS[2])
    if len(found) > 1:
        axes.legend(frameon=False, fontsize=8)
    axes.set_title(f"{sum(curve.cases for curve in found):,} cases, mean and standard deviation", fontsize=10)
    return save_figure(figure, path)


def _curve(label: str, points: dict[Any, list[float]]) -> Curve:
    places = _sorted(list(points))
    mean = [float(np.mean(points[place])) for place in places]
    spread = [float(np.std(points[place], ddof=1)) if len(points[place]) > 1 else 0.0 for place in places]
    return Curve(label, places, mean, spread, sum(map(len, points.values())))


def _with_unit(column: str) -> str:
    unit = COLUMNS.get(column)
    return f"{column} [{unit}]" if unit else column


def _sorted(places: list[Any]) -> list[Any]:
    """Numbers in their order, words in that of the cases."""
    return places if any(isinstance(place, str) for place in places) else sorted(places)


def _instead(name: str, columns: Sequence[str]) -> str:
    return hint(name, list(columns)) or f"; there are {', '.join(columns)}"
