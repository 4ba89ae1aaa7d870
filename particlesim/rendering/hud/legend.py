"""Legends: what the colours of a movie mean, on panels that stay the same from frame to frame."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from particlesim.core.text import shortened
from particlesim.rendering.hud.panel import Panel, Style
from particlesim.rendering.shading.colour import ParticleColours, palette_colour, shape_colours
from particlesim.rendering.shading.colour_maps import encoded, map_colours
from particlesim.rendering.shading.fields import Field, figures
from particlesim.scene import Scene
from particlesim.scene.colours import FieldColour
from particlesim.trajectory.frames import Header

# Width of a scale, height of its bar and of the marks below it, and edge of a swatch, in heights of letters.
_SCALE, _BAR, _MARK, _SWATCH = 11.0, 0.7, 0.25, 0.8

# Names take this share of the picture's height at the most, in so many columns; what is left is said in a line.
_NAMES, _COLUMNS = 0.6, 2

# Letters of a name that are shown: more would hide the picture.
_LETTERS = 31


class Swatch(NamedTuple):
    """A colour and what has it."""

    colour: np.ndarray  # (3,) sRGB 0 .. 1
    name: str


def legend_panels(scene: Scene, header: Header, colours: ParticleColours, style: Style) -> list[Panel]:
    """The legends that the scene wants: a scale for each field; if it asks for legends, the names of colours too."""
    if scene.show.legend is False:
        return []
    panels = [_scale_panel(field, colours.background, style) for field in colours.fields]
    named = swatches(scene, header, style.can_write) if scene.show.legend else []
    rows = max(1, int(_NAMES * scene.movie.size[1] / style.line))
    return [*panels, _swatch_panel(named, rows, style)] if named else panels


def swatches(scene: Scene, header: Header, can_write: Callable[[str], bool]) -> list[Swatch]:
    """The colours that do not stand for a field, in the order of groups: of shapes by their name, else of groups.

    A group whose name cannot be written, as no font has its letters, goes by its number as one without a name does.
    """
    found: list[Swatch] = []
    of_shapes = np.sqrt(shape_colours(header))
    for number, group in enumerate(scene.groups):
        members = np.flatnonzero(header.group == number)
        if not len(members) or isinstance(group.colour, FieldColour):
            continue
        name = group.name if group.name and can_write(group.name) else f"group {number + 1}"
        if group.colour == "by_shape":
            shape = int(header.shape[members[0]])
            found.append(Swatch(of_shapes[shape], header.shapes[shape].name))
        elif group.colour == "by_group":
            found.append(Swatch(palette_colour(number), name))
        else:
            found.append(Swatch(encoded(group.colour), name))
    # Groups of one shape share a line.
    return [swatch for k, swatch in enumerate(found) if not any(_same(swatch, other) for other in found[:k])]


def _same(one: Swatch, other: Swatch) -> bool:
    return one.name == other.name and np.array_equal(one.colour, other.colour)


def _scale_panel(field: Field, background: np.ndarray, style: Style) -> Panel:
    """Name and unit, a bar with the colours of the scale, and values in the middle below their marks."""
    em, pad = style.em, style.pad
    width, bar, mark = round(_SCALE * em), round(_BAR * em), max(2, round(_MARK * em))
    panel = Panel(style, 2 * style.line + bar + mark + 2 * pad, width + 2 * pad)
    panel.write(f"{field.name} [{field.unit}]" if field.unit else field.name, pad, pad, faint=True)
    labels = figures(field.low, field.high)
    # At both ends there is room for half of the value there.
    left, right = (style.width(text) // 2 for _, text in (labels[0], labels[-1]))
    start, top, width = pad + left, pad + style.line, width - left - right
    colours = 255.0 * map_colours(np.linspace(0.0, 1.0, width), field.map, background)
    panel.fill(np.tile(colours, (bar, 1, 1)), start, top)
    thick = max(1, round(0.08 * em))
    for middle, text in _apart(labels, field, width - 1, style):
        panel.fill(np.tile(style.faint, (mark, thick, 1)), start + middle - thick // 2, top + bar)
        panel.write(text, start + middle - style.width(text) // 2, top + bar + mark + round(0.1 * em))
    return panel


def _apart(labels: list[tuple[float, str]], field: Field, width: int, style: Style) -> list[tuple[int, str]]:
    """Where marks are on a bar [pixels], with their values: both ends, and those that do not run together."""
    places = [(round((value - field.low) / (field.high - field.low) * width), text) for value, text in labels]
    gap = 0.5 * style.em

    def are_apart(one: tuple[int, str], other: tuple[int, str]) -> bool:
        return other[0] - one[0] >= 0.5 * (style.width(one[1]) + style.width(other[1])) + gap

    shown = places[:1]
    for place in places[1:-1]:
        if are_apart(shown[-1], place) and are_apart(place, places[-1]):
            shown.append(place)
    return [*shown, places[-1]]


def _swatch_panel(named: list[Swatch], rows: int, style: Style) -> Panel:
    """A patch of colour and a name on each line, down to ``rows`` and then in the next column."""
    edge, pad = round(_SWATCH * style.em), style.pad
    gap = round(0.6 * style.em)
    shown = named if len(named) <= _COLUMNS * rows else named[: _COLUMNS * rows - 1]
    names = [shortened(swatch.name, _LETTERS) for swatch in shown]
    texts = names if len(shown) == len(named) else [*names, f"and {len(named) - len(shown)} more"]
    rows = -(-len(texts) // -(-len(texts) // rows))  # as many in each column
    columns = [texts[first : first + rows] for first in range(0, len(texts), rows)]
    widths = [edge + gap + max(style.width(text) for text in column) for column in columns]
    starts = [pad + sum(widths[:k]) + 2 * gap * k for k in range(len(columns))]
    panel = Panel(style, style.line * len(columns[0]) + 2 * pad, starts[-1] + widths[-1] + pad)
    for number, text in enumerate(texts):
        left, top = starts[number // rows], pad + number % rows * style.line
        if number < len(shown):
            panel.fill(np.tile(255.0 * shown[number].colour, (edge, edge, 1)), left, top + round(0.25 * style.em))
        panel.write(text, left + edge + gap, top)
    return panel
