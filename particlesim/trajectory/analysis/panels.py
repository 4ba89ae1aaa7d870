"""Figures of a run: one panel for each thing that one looks at, or all that are known on a page."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from particlesim.core.figure import AMBER, BLUE, GREEN, GREYS, ORANGE, PURPLE, SKY, new_figure
from particlesim.trajectory.analysis.measurements import LOST, Measurements

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Panels of a page beside each other, and the size of one [inch].
_COLUMNS, _WIDTH, _HEIGHT = 3, 4.4, 3.1


class _Panel(NamedTuple):
    """What is drawn: the table and the column of it that must be known, the words beside it, and how."""

    table: str
    column: str
    title: str
    across: str
    up: str
    draw: Callable[[Any, np.ndarray, Measurements], None]


def _energy(axes: Any, table: np.ndarray, run: Measurements) -> None:
    lost = np.sum([table[name] for name in LOST], axis=0)
    parts = (
        ("translation", table["kinetic_translational"], BLUE),
        ("rotation", table["kinetic_rotational"], SKY),
        ("potential", table["potential"], GREEN),
        ("dissipated", lost, ORANGE),
        ("worked by obstacles and fields", table["work"], PURPLE),
    )
    seen = 1e-9 * np.abs(table["energy"]).max()
    for name, values, colour in parts:
        if np.nan_to_num(np.abs(values)).max() > seen:
            axes.plot(table["time"], values, color=colour, label=name)
    axes.plot(table["time"], table["energy"], color="k", ls="--", label="kinetic and potential")
    # Changes by rounding alone would fill the panel.
    lower, upper = axes.get_ylim()
    axes.set_ylim(min(1.05 * lower, 0.0), max(1.05 * upper, 0.0))
    axes.legend(frameon=False, fontsize=7)


def _one(column: str, colour: str = BLUE) -> Callable[[Any, np.ndarray, Measurements], None]:
    def draw(axes: Any, table: np.ndarray, run: Measurements) -> None:
        axes.plot(table["time"], table[column], color=colour)

    return draw


def _momentum(axes: Any, table: np.ndarray, run: Measurements) -> None:
    for axis, colour in zip("xyz", (ORANGE, GREEN, BLUE), strict=True):
        axes.plot(table["time"], table[f"momentum_{axis}"], color=colour, label=axis)
    axes.legend(frameon=False, fontsize=7, ncols=3)


def _temperature(axes: Any, table: np.ndarray, run: Measurements) -> None:
    axes.plot(table["time"], table["temperature"], color=BLUE)
    _from_zero(axes)


def _pressure(axes: Any, table: np.ndarray, run: Measurements) -> None:
    axes.plot(table["time"], table["pressure"], color=BLUE, label="measured")
    ideal = table["particles"] * table["temperature"] / math.prod(run.scene.world.size)
    axes.plot(table["time"], ideal, color=GREYS[0], ls="--", label="ideal gas, N T / V")
    _from_zero(axes)
    axes.legend(frameon=False, fontsize=7)


def _from_zero(axes: Any) -> None:
    """Let what is above 0 be seen in proportion, and the largest of it not at the edge."""
    axes.set_ylim(0.0, 1.05 * axes.get_ylim()[1])


def _displacement(axes: Any, table: np.ndarray, run: Measurements) -> None:
    later = table[table["mean_square_displacement"] > 0.0]
    since = later["time"] - table["time"][0]
    axes.plot(since, later["mean_square_displacement"], color=BLUE, label="measured")
    flying = table["mean_square_speed"][0] * since**2
    axes.plot(since, flying, color=GREYS[0], ls="--", label="free flight")
    axes.set(xscale="log", yscale="log")
    axes.legend(frameon=False, fontsize=7)


def _radial(axes: Any, table: np.ndarray, run: Measurements) -> None:
    axes.axhline(1.0, color=GREYS[1], lw=0.8)
    axes.plot(table["distance"], table["density"], color=BLUE)
    axes.set(xlim=(0.0, None), ylim=(0.0, None))


def _speeds(axes: Any, table: np.ndarray, run: Measurements) -> None:
    width = 2.0 * table["speed"][0]
    axes.bar(table["speed"], table["density"], width=width, color=SKY, label="measured")
    axes.plot(table["speed"], table["maxwell"], color=AMBER, lw=2.0, label="Maxwell")
    axes.set(xlim=(0.0, None), ylim=(0.0, None))
    axes.legend(frameon=False, fontsize=7)


_TIME = "time [s]"
_PANELS = {
    "energy": _Panel("time", "energy", "Energy", _TIME, "J", _energy),
    "drift": _Panel(
        "time", "energy_drift", "Energy not accounted for", _TIME, "part of all of it", _one("energy_drift", ORANGE)
    ),
    "momentum": _Panel("time", "momentum_x", "Momentum", _TIME, "kg m/s", _momentum),
    "impacts": _Panel("time", "impacts", "Impacts", _TIME, "since the start", _one("impacts")),
    "temperature": _Panel("time", "temperature", "Temperature", _TIME, "J", _temperature),
    "pressure": _Panel("time", "pressure", "Pressure", _TIME, "Pa", _pressure),
    "displacement": _Panel(
        "time", "mean_square_displacement", "Mean square displacement", "time since the start [s]", "m²", _displacement
    ),
    "radial": _Panel("radial", "density", "Radial distribution, second half", "distance [m]", "g", _radial),
    "speeds": _Panel("speeds", "density", "Speeds, second half", "speed [m/s]", "s/m", _speeds),
}
PANELS = tuple(_PANELS)


class PlotError(ValueError):
    """A panel that there is not, or of which nothing is known; the message is one line."""


def table_of(panel: str | None) -> str:
    """The table that a panel shows; the one over time for a page of them. PlotError for a panel that there is not."""
    if panel is None:
        return "time"
    if panel not in _PANELS:
        raise PlotError(f"what: must be one of {', '.join(PANELS)}, not {panel!r}")
    return _PANELS[panel].table


def draw_panels(run: Measurements, what: str | None = None) -> Figure:
    """A figure of one panel, or a page of all that are known.

    Parameters
    ----------
    run
        What is drawn.
    what
        One of ``PANELS``, or None.

    Raises
    ------
    PlotError
        For a panel that there is not, or of which nothing is known.
    """
    table_of(what)
    panels = [panel for name, panel in _PANELS.items() if what in (None, name) and _is_known(panel, run)]
    if not panels:
        raise PlotError(f"what: of {what or 'any of it'}, nothing is known here that could be drawn")
    columns = min(_COLUMNS, len(panels))
    rows = math.ceil(len(panels) / columns)
    figure = new_figure(_WIDTH * columns, _HEIGHT * rows)
    every = figure.subplots(rows, columns, squeeze=False).flat
    for axes, panel in zip(every, panels, strict=False):
        axes.set_title(panel.title, fontsize=10)
        axes.set(xlabel=panel.across, ylabel=panel.up)
        axes.grid(True, color=GREYS[2])
        axes.set_axisbelow(True)
        panel.draw(axes, run.table(panel.table), run)
    for axes in list(every)[len(panels) :]:
        axes.set_axis_off()
    if what is None:
        figure.suptitle(f"{run.scene.title}, {len(run.header.mass):,} particles", fontsize=12)
    return figure


def _is_known(panel: _Panel, run: Measurements) -> bool:
    """Whether there is more than a point to draw."""
    known = run.table(panel.table)[panel.column]
    several = np.isfinite(known).sum() > 1
    return bool(several and (panel.draw is not _displacement or (known > 0.0).any()))
