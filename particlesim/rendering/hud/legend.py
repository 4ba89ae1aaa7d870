"""Legends: what the colours of a movie mean, on panels that stay the same from frame to frame."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from particlesim.rendering.hud.panel import Panel, Style
from particlesim.rendering.shading.colour import PALETTE, ParticleColours, encoded, map_colours, shape_colours
from particlesim.rendering.shading.fields import Field, figures
from particlesim.scene import Scene
from particlesim.scene.groups import FIELDS
from particlesim.trajectory.frames import Header

# Width of a scale, height of its bar and of the marks below it, and edge of a swatch, in heights of letters.
_SCALE, _BAR, _MARK, _SWATCH = 11.0, 0.7, 0.25, 0.8

# More names than this are left out: they would hide the picture.
_MOST_SWATCHES = 12


class Swatch(NamedTuple):
    """A colour and what has it."""

    colour: np.ndarray  # (3,) sRGB 0 .. 1
    name: str


def legend_panels(scene: Scene, header: Header, colours: ParticleColours, style: Style) -> list[Panel]:
    """The legends that the scene wants: a scale for each field; if it asks for legends, the names of colours too."""
    if scene.show.legend is False:
        return []
    panels = [_scale_panel(field, style) for field in colours.fields]
    named = swatches(scene, header) if scene.show.legend else []
    return [*panels, _swatch_panel(named[:_MOST_SWATCHES], style)] if named else panels


def swatches(scene: Scene, header: Header) -> list[Swatch]:
    """The colours that do not stand for a field, in the order of groups: of shapes by their name, else of groups."""
    found: list[Swatch] = []
    of_shapes = np.sqrt(shape_colours(header))
    for number, group in enumerate(scene.particles):
        members = np.flatnonzero(header.group == number)
        if not len(members) or group.colour in FIELDS:
            continue
        name = group.name or f"group {number + 1}"
        if group.colour == "by_shape":
            shape = int(header.shape[members[0]])
            found.append(Swatch(of_shapes[shape], header.shapes[shape].name))
        elif group.colour == "by_group":
            found.append(Swatch(encoded(PALETTE[number % len(PALETTE)]), name))
        else:
            found.append(Swatch(encoded(group.colour), name))
    # Groups of one shape share a line.
    return [swatch for k, swatch in enumerate(found) if not any(_same(swatch, other) for other in found[:k])]


def _same(one: Swatch, other: Swatch) -> bool:
    return one.name == other.name and np.array_equal(one.colour, other.colour)


def _scale_panel(field: Field, style: Style) -> Panel:
    """Name and unit, a bar with the colours of the scale, and round values below it."""
    em, pad = style.em, style.pad
    width, bar, mark = round(_SCALE * em), round(_BAR * em), max(2, round(_MARK * em))
    panel = Panel(style, 2 * style.line + bar + mark + 2 * pad, width + 2 * pad)
    panel.write(f"{field.name} [{field.unit}]" if field.unit else field.name, pad, pad, faint=True)
    top = pad + style.line
    colours = 255.0 * map_colours(np.linspace(0.0, 1.0, width))
    panel.fill(np.tile(colours, (bar, 1, 1)), pad, top)
    thick = max(1, round(0.08 * em))
    for value, text in figures(field.low, field.high):
        place = round((value - field.low) / (field.high - field.low) * (width - thick))
        panel.fill(np.tile(style.faint, (mark, thick, 1)), pad + place, top + bar)
        # In the middle below its mark, as far as the panel goes.
        wide = style.width(text)
        left = min(max(place - wide // 2, -pad // 2), width + pad // 2 - wide)
        panel.write(text, pad + left, top + bar + mark + round(0.1 * em))
    return panel


def _swatch_panel(named: list[Swatch], style: Style) -> Panel:
    """A patch of colour and a name on each line."""
    edge, pad = round(_SWATCH * style.em), style.pad
    gap = round(0.6 * style.em)
    widest = max(style.width(swatch.name) for swatch in named)
    panel = Panel(style, style.line * len(named) + 2 * pad, edge + gap + widest + 2 * pad)
    for number, swatch in enumerate(named):
        top = pad + number * style.line
        panel.fill(np.tile(255.0 * swatch.colour, (edge, edge, 1)), pad, top + round(0.25 * style.em))
        panel.write(swatch.name, pad + edge + gap, top)
    return panel
