"""The readout: what the particles of a frame amount to, line by line."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from particlesim.broad_phase import METHODS
from particlesim.core.constants import DISSIPATION
from particlesim.rendering.hud.history import History
from particlesim.rendering.hud.panel import Panel, Style
from particlesim.trajectory.analysis.observables import all_energy, energy_change, has_pressure, pressure, temperature
from particlesim.trajectory.frame_aabb import frame_boxes
from particlesim.trajectory.frames import Frame

if TYPE_CHECKING:
    from particlesim.rendering.look import Look


class Row(NamedTuple):
    """A line: name, value, and the longest value that one expects, so that the panel need not grow."""

    name: str
    value: str
    longest: str = ""


def readout_rows(look: Look, frame: Frame, history: History) -> list[Row]:
    """The rows of a frame, as the scene lists them; what is not known is left out."""
    return [row for name in look.scene.show.rows for row in _ROWS[name](look, frame, history)]


def _time(look: Look, frame: Frame, history: History) -> Iterator[Row]:
    # As many places as tell one frame from the next, and no fewer than two.
    places = max(2, math.ceil(-math.log10(look.scene.time_of(1))))
    yield Row("time", f"{frame.time:.{places}f} s")


def _particles(look: Look, frame: Frame, history: History) -> Iterator[Row]:
    yield Row("particles", f"{len(frame.position):,}", f"{len(frame.position):,}")


def _impacts(look: Look, frame: Frame, history: History) -> Iterator[Row]:
    if frame.ledger:
        yield Row("impacts", f"{frame.ledger.impacts:,}")


def _energy_change(look: Look, frame: Frame, history: History) -> Iterator[Row]:
    if frame.ledger and look.start:
        yield Row("energy change", _change_text(energy_change(frame.ledger, look.start)), "+100.0 %")


def _temperature(look: Look, frame: Frame, history: History) -> Iterator[Row]:
    if frame.ledger and len(frame.position):
        yield Row("temperature", f"{_figure(temperature(frame))} J", "0.000e+00 J")


def _pressure(look: Look, frame: Frame, history: History) -> Iterator[Row]:
    if frame.ledger is None or not has_pressure(look.scene):
        return
    window = history.up_to(frame.ledger)
    found = pressure(look.scene, window) if len(window) > 1 else None
    # In the first frame there is none yet, but its line: nothing jumps when there is.
    yield Row("pressure", "-" if found is None else f"{_figure(found)} Pa", "0.000e+00 Pa")


def _speed(look: Look, frame: Frame, history: History) -> Iterator[Row]:
    if len(frame.velocity):
        yield Row("mean speed", f"{_figure(np.linalg.norm(frame.velocity, axis=1).mean())} m/s", "0.000e+00 m/s")


def _pairs_tested(look: Look, frame: Frame, history: History) -> Iterator[Row]:
    chosen = look.scene.solver.broad_phase
    tested = _tested(look, frame, chosen.kind, **chosen.model_dump(exclude={"kind"}))
    every = _pairs(len(frame.position))
    yield Row("pairs tested", f"{100.0 * tested / every if every else 0.0:.2f} %", "100.00 %")


def _broad_phases(look: Look, frame: Frame, history: History) -> Iterator[Row]:
    longest = f"{_pairs(len(frame.position)):,}"
    for name in METHODS:
        yield Row(f"{name} tests", f"{_tested(look, frame, name):,}", longest)


def _dissipation(look: Look, frame: Frame, history: History) -> Iterator[Row]:
    """What each cause that there can be in the scene took of the energy."""
    if frame.ledger is None or frame.ledger.dissipated is None or look.start is None:
        return
    scale = all_energy(look.start)
    for cause, energy in zip(DISSIPATION, frame.ledger.dissipated.tolist(), strict=True):
        if cause in look.causes:
            yield Row(f"lost by {cause}", f"{100.0 * energy / scale if scale else 0.0:.1f} %", "100.0 %")


# Rows by the names that a scene lists them under.
_ROWS: dict[str, Callable[[Look, Frame, History], Iterator[Row]]] = {
    "time": _time,
    "particles": _particles,
    "impacts": _impacts,
    "energy change": _energy_change,
    "dissipation": _dissipation,
    "temperature": _temperature,
    "pressure": _pressure,
    "speed": _speed,
    "pairs tested": _pairs_tested,
    "broad phases": _broad_phases,
}


def _tested(look: Look, frame: Frame, method: str, **parameters: int | None) -> int:
    """Pairs of AABBs that a broad phase compares in this frame."""
    if method == "naive":
        return _pairs(len(frame.position))
    world = look.scene.world
    period = np.where(np.array(world.boundary) == "periodic", world.size, 0.0)
    lower, upper = frame_boxes(look.header, frame)
    return int(METHODS[method](lower, upper, period, **parameters)[1])


def _pairs(count: int) -> int:
    return count * (count - 1) // 2


def readout_panel(rows: list[Row], style: Style) -> Panel:
    """Names to the left, values to the right: where they end stays the same from frame to frame."""
    pad = style.pad
    names = max(round(6.4 * style.em), *(style.width(row.name) + round(style.em) for row in rows))
    values = max(round(5.2 * style.em), *(style.width(row.longest) for row in rows))
    panel = Panel(style, style.line * len(rows) + 2 * pad, names + values + 2 * pad)
    for number, row in enumerate(rows):
        top = pad + number * style.line
        panel.write(row.name, pad, top, faint=True)
        panel.write(row.value, pad + names + values - style.width(row.value), top)
    return panel


def _figure(value: float) -> str:
    """A number in four figures, all of them written, so that the text does not jump."""
    if value == 0.0:
        return "0"
    if not 1e-3 <= abs(value) < 1e5:
        return f"{value:.3e}"
    return f"{value:,.{max(0, 3 - math.floor(math.log10(abs(value))))}f}"


def _change_text(change: float) -> str:
    if change == 0.0:
        return "0"
    # With the hyphen for a minus sign: the font has no other in every version of its library.
    return f"{100.0 * change:+.1f} %" if abs(change) >= 1e-3 else f"{change:+.0e}"
