"""The readout: what the particles of a frame amount to, line by line."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from particlesim.rendering.hud.panel import Panel, Style
from particlesim.scene import Scene
from particlesim.trajectory.gsd_file import Frame, Header

_ENERGIES = ("kinetic_translational", "kinetic_rotational", "potential")

# Pressure is an average over so many of the frames drawn last: walls and partners are hit one by one.
_WINDOW = 30

# Methods as the readout calls them and as the library does.
_METHODS = {"naive": "naive", "boxing": "grid", "octree": "octree"}


class Row(NamedTuple):
    """A line: name, value, and the longest value that one expects, so that the panel need not grow."""

    name: str
    value: str
    longest: str = ""


class Moment(NamedTuple):
    """What is kept of a frame that has passed."""

    time: float  # [s]
    ledger: dict[str, Any]


class Readout:
    """Rows of one movie's readout, as the scene lists them. Frames must come in the order of the movie.

    ``first`` is the frame at the start, which changes refer to.
    """

    def __init__(self, scene: Scene, header: Header, first: Frame) -> None:
        self._scene = scene
        self._header = header
        self._first = first
        self._passed = deque([Moment(first.time, first.ledger)], maxlen=_WINDOW + 1)
        rows: dict[str, Callable[[Frame], Iterator[Row]]] = {
            "time": self._time,
            "particles": _particles,
            "impacts": _impacts,
            "energy change": self._energy_change,
            "temperature": _temperature,
            "pressure": self._pressure,
            "speed": _speed,
            "pairs tested": self._pairs_tested,
            "broad phases": self._broad_phases,
        }
        self._rows = [rows[name] for name in scene.show.rows]

    def __call__(self, frame: Frame) -> list[Row]:
        """The rows of a frame; what its ledger does not tell is left out."""
        if frame.time > self._passed[-1].time:
            self._passed.append(Moment(frame.time, frame.ledger))
        return [row for rows in self._rows for row in rows(frame)]

    def _time(self, frame: Frame) -> Iterator[Row]:
        # As many places as tell one frame from the next, and no fewer than two.
        places = max(2, math.ceil(-math.log10(self._scene.time_of(1))))
        yield Row("time", f"{frame.time:.{places}f} s")

    def _energy_change(self, frame: Frame) -> Iterator[Row]:
        if any(key in frame.ledger for key in _ENERGIES):
            yield Row("energy change", _change_text(energy_change(frame, self._first)), "+100.0 %")

    def _pressure(self, frame: Frame) -> Iterator[Row]:
        if len(self._passed) > 1 and (found := pressure(self._scene, self._passed)) is not None:
            yield Row("pressure", f"{_figure(found)} Pa", "0.000e+00 Pa")

    def _pairs_tested(self, frame: Frame) -> Iterator[Row]:
        chosen = self._scene.solver.broad_phase
        tested = self._tested(frame, chosen.kind, **chosen.model_dump(exclude={"kind"}))
        every = _pairs(len(frame.position))
        yield Row("pairs tested", f"{100.0 * tested / every if every else 0.0:.2f} %", "100.00 %")

    def _broad_phases(self, frame: Frame) -> Iterator[Row]:
        longest = f"{_pairs(len(frame.position)):,}"
        for name, method in _METHODS.items():
            yield Row(f"{name} tests", f"{self._tested(frame, method):,}", longest)

    def _tested(self, frame: Frame, method: str, **parameters: int | None) -> int:
        """Pairs of boxes that a broad phase compares in this frame."""
        if method == "naive":
            return _pairs(len(frame.position))
        from particlesim.broad_phase import METHODS  # noqa: PLC0415  (numba is slow to import)
        from particlesim.trajectory.frame_aabb import frame_boxes  # noqa: PLC0415

        world = self._scene.world
        period = np.where(np.array(world.boundary) == "periodic", world.size, 0.0)
        lower, upper = frame_boxes(self._header, frame)
        return int(METHODS[method](lower, upper, period, **parameters)[1])


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


def energy_change(frame: Frame, first: Frame) -> float:
    """Change of the total energy since ``first``, relative to the kinetic energy and depth of potential there."""
    now, then = ([f.ledger.get(key, 0.0) for key in _ENERGIES] for f in (frame, first))
    scale = sum(abs(part) for part in then) or sum(abs(part) for part in now)
    return (sum(now) - sum(then)) / scale if scale else 0.0


def pressure(scene: Scene, moments: Sequence[Moment]) -> float | None:
    """Mean pressure [Pa] over two moments or more; None if the world has no walls and is not periodic all round.

    On walls: the momentum given to them over area and time. Without walls: from the virial theorem,
    P V = (2 K + W) / 3 with the mean energy of translation K and the sum W of r . impulse over pairs and time
    (J.-P. Hansen, I. R. McDonald, Theory of Simple Liquids, 4th ed., eq. 2.2.10).
    """
    before, after = moments[0].ledger, moments[-1].ledger
    if not {"wall_impulse", "virial", "kinetic_translational"} <= after.keys():
        return None
    duration = moments[-1].time - moments[0].time
    size, boundary = np.array(scene.world.size), np.array(scene.world.boundary)
    if (walls := boundary == "wall").any():
        area = 2.0 * float((size.prod() / size)[walls].sum())
        given = (after["wall_impulse"] - before["wall_impulse"]).reshape(3, 2)[walls].sum()
        return float(given) / (area * duration)
    if (boundary == "periodic").all():
        kinetic = float(np.mean([moment.ledger["kinetic_translational"] for moment in moments]))
        virial = (after["virial"] - before["virial"]) / duration
        return float((2.0 * kinetic + virial) / (3.0 * size.prod()))
    return None


def _particles(frame: Frame) -> Iterator[Row]:
    yield Row("particles", f"{len(frame.position):,}", f"{len(frame.position):,}")


def _impacts(frame: Frame) -> Iterator[Row]:
    if "impacts" in frame.ledger:
        yield Row("impacts", f"{round(frame.ledger['impacts']):,}")


def _temperature(frame: Frame) -> Iterator[Row]:
    """Two thirds of the mean energy of translation: the temperature, with a Boltzmann constant of 1."""
    if "kinetic_translational" in frame.ledger and len(frame.position):
        value = 2.0 / 3.0 * frame.ledger["kinetic_translational"] / len(frame.position)
        yield Row("temperature", f"{_figure(value)} J", "0.000e+00 J")


def _speed(frame: Frame) -> Iterator[Row]:
    if len(frame.velocity):
        yield Row("mean speed", f"{_figure(np.linalg.norm(frame.velocity, axis=1).mean())} m/s", "0.000e+00 m/s")


def _pairs(count: int) -> int:
    return count * (count - 1) // 2


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
