"""A curve over the time of the scene, on a panel that fills from picture to picture."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from PIL import Image, ImageDraw

from particlesim.core.figure import BLUE, GREEN, GREYS, ORANGE, SKY
from particlesim.rendering.hud.panel import Panel, Style
from particlesim.rendering.shading.colour_maps import encoded
from particlesim.scene import Scene
from particlesim.trajectory.frames import Ledger

# Width and height of what the curves are drawn on, room for figures at its left, and edge of a swatch, in heights of
# letters.
_WIDTH, _HEIGHT, _LEFT, _SWATCH = 13.0, 6.0, 4.2, 0.7

# Thickness of curves and of axes, in heights of letters, and samples of a pixel along each axis.
_CURVE, _AXIS, _SAMPLES = 0.13, 0.06, 4

# Ends that an axis may have, in powers of ten: it holds still while the curves grow, and seldom jumps.
_ENDS = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)


class Line(NamedTuple):
    """One of the curves: its name, its colour, and its value at a time."""

    name: str
    colour: str
    value: Callable[[Ledger], float]


class Plot(NamedTuple):
    """What is drawn over the time, and in which unit."""

    name: str
    unit: str
    lines: tuple[Line, ...]


_PLOTS = {
    "energy": Plot(
        "energy",
        "J",
        (
            Line("translation", BLUE, lambda ledger: ledger.kinetic_translational),
            Line("rotation", SKY, lambda ledger: ledger.kinetic_rotational),
            Line("potential", GREEN, lambda ledger: ledger.potential),
            Line("sum", GREYS[0], lambda ledger: ledger.energy),
        ),
    ),
    "momentum": Plot(
        "momentum",
        "kg m/s",
        (
            Line("x", ORANGE, lambda ledger: float(ledger.momentum[0])),
            Line("y", GREEN, lambda ledger: float(ledger.momentum[1])),
            Line("z", BLUE, lambda ledger: float(ledger.momentum[2])),
        ),
    ),
    "impacts": Plot("impacts", "", (Line("", BLUE, lambda ledger: float(ledger.impacts)),)),
}


def curve_panel(scene: Scene, ledgers: Sequence[Ledger], style: Style) -> Panel:
    """The panel with the curves of a scene's plot through what has passed, the present last; always of one size."""
    plot = _PLOTS[str(scene.show.plot)]
    lines = [line for line in plot.lines if line.name != "potential" or any(scene.world.gravity)]
    em, pad = style.em, style.pad
    width, height, left = round(_WIDTH * em), round(_HEIGHT * em), pad + round(_LEFT * em)
    columns = 2 if len(lines) % 2 == 0 else 3
    rows = math.ceil(len(lines) / columns) if len(lines) > 1 else 0
    top = pad + round(1.5 * style.line)
    panel = Panel(style, top + height + (1 + rows) * style.line + pad, left + width + pad)
    panel.write(f"{plot.name} [{plot.unit}]" if plot.unit else plot.name, pad, pad, faint=True)
    values = np.array([[line.value(ledger) for line in lines] for ledger in ledgers])
    low, high = _ends(values)
    across = width * np.array([ledger.time for ledger in ledgers]) / scene.duration
    up = height * (high - values) / (high - low)
    zero = height * high / (high - low)
    for axis in ([(0.0, 0.0), (0.0, height)], [(0.0, zero), (width, zero)]):
        panel.stain(_ink(np.array(axis), (width, height), _AXIS * em), style.faint, left, top)
    for line, heights in zip(lines, up.T, strict=True):
        ink = _ink(np.column_stack([across, heights]), (width, height), _CURVE * em)
        panel.stain(ink, 255.0 * encoded(line.colour), left, top)
    for value, place in ((high, 0.0), (low, float(height))):
        text = f"{value:,.6g}"
        beside = left - round(0.3 * em) - style.width(text)
        panel.write(text, beside, top + round(place - 0.5 * style.line), faint=True)
    end = f"{scene.duration:g} s"
    below = top + height + round(0.1 * em)
    panel.write("0", left, below, faint=True)
    panel.write(end, left + width - style.width(end), below, faint=True)
    for number, line in enumerate(lines if rows else []):
        row, column = divmod(number, columns)
        start, high_up = pad + column * (left + width - pad) // columns, below + (1 + row) * style.line
        edge = round(_SWATCH * em)
        panel.fill(np.tile(255.0 * encoded(line.colour), (edge, edge, 1)), start, high_up + round(0.35 * em))
        panel.write(line.name, start + edge + round(0.5 * em), high_up)
    return panel


def _ends(values: np.ndarray) -> tuple[float, float]:
    """The ends of an axis with 0 and all values on it."""
    low, high = min(0.0, float(values.min())), max(0.0, float(values.max()))
    if low == high:
        return 0.0, 1.0
    # One step for both, so that 0 is not at an odd place; what is next to nothing beside the other is nothing.
    scale = max(-low, high)
    return (-_end(-low) if -low > 1e-6 * scale else 0.0), (_end(high) if high > 1e-6 * scale else 0.0)


def _end(value: float) -> float:
    power = 10.0 ** math.floor(math.log10(value))
    return next(end * power for end in _ENDS if end * power >= value or end == _ENDS[-1])


def _ink(points: np.ndarray, size: tuple[int, int], thick: float) -> np.ndarray:
    """How much ink a line through points (k, 2) [pixels] leaves, (h, w) float32 0 .. 1."""
    width, height = size
    tile = Image.new("L", (_SAMPLES * width, _SAMPLES * height))
    # What lies on an edge is seen as whole as what lies within.
    inside = np.clip(points, 0.5 * thick, np.array(size) - 0.5 * thick)
    flat = [(float(x), float(y)) for x, y in _SAMPLES * inside]
    flat *= 2 if len(flat) == 1 else 1
    ImageDraw.Draw(tile).line(flat, fill=255, width=max(1, round(_SAMPLES * thick)), joint="curve")
    return np.asarray(tile.resize(size, Image.Resampling.BOX), dtype=np.float32) / 255.0
