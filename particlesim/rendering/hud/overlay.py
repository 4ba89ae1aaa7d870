"""What lies over the picture: the readout in one corner, legends where they do not hide it."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np

from particlesim.rendering.camera import WHOLE, Camera, Window, frames_freely
from particlesim.rendering.hud.curve import curve_panel
from particlesim.rendering.hud.history import History
from particlesim.rendering.hud.legend import legend_panels
from particlesim.rendering.hud.panel import Panel, Style
from particlesim.rendering.hud.readout import readout_panel, readout_rows
from particlesim.trajectory.frames import Frame

if TYPE_CHECKING:
    from particlesim.rendering.look import Look

# The readout takes this share of the picture's height at the most; rows that would go beyond are left out.
_READOUT = 0.5

# What is framed is placed beside panels where that leaves it this share of the picture's width and height.
_LEAST = 0.3


class Overlay:
    """The panels of one movie, for pictures with a ``dark`` background or a light one."""

    def __init__(self, look: Look, dark: bool) -> None:
        self._look = look
        self._style = Style(look.scene.movie.size, dark)
        self._legends = legend_panels(look.scene, look.header, look.colours, self._style)

    def draw(self, image: np.ndarray, frame: Frame, history: History) -> None:
        """Lay the panels for ``frame`` over ``image`` (h, w, 3) uint8."""
        for panel, left, top in self._places(frame, history):
            panel.lay(image, left, top)

    def window(self, first: Frame) -> Window:
        """Where a camera that frames by itself places what it shows: beside or below the panels for ``first``."""
        scene, margin = self._look.scene, self._style.margin
        places = self._places(first, History())
        if not places or not frames_freely(scene):
            return WHOLE
        size = np.array(scene.movie.size)
        windows = []
        for choice in itertools.product((0, 1), repeat=len(places)):
            lower, upper = WHOLE.lower.copy(), WHOLE.upper.copy()
            for (panel, left, top), axis in zip(places, choice, strict=True):
                # In pixels from the lower left corner of the picture.
                tall, wide = panel.size
                low, high = (left - margin, size[1] - top - tall - margin)[axis], (left + wide, size[1] - top)[axis]
                if low + high < size[axis]:
                    lower[axis] = max(lower[axis], 2.0 * (high + margin) / size[axis] - 1.0)
                else:
                    upper[axis] = min(upper[axis], 2.0 * low / size[axis] - 1.0)
            if (upper - lower >= 2.0 * _LEAST).all():
                windows.append(Window(lower, upper))
        aspect = size[0] / size[1]
        return Camera(scene, aspect, self._look.subject).in_the_largest(aspect, windows) if windows else WHOLE

    def _places(self, frame: Frame, history: History) -> list[tuple[Panel, int, int]]:
        """The panels for a frame with their left and top [pixels]."""
        style, size = self._style, self._look.scene.movie.size
        most = max(1, int((_READOUT * size[1] - style.margin - 2 * style.pad) / style.line))
        rows = readout_rows(self._look, frame, history)[:most]
        legends = [*self._legends, *self._curves(frame, history)]
        if not rows:
            return legend_places(legends, size, (0, 0), style.margin)
        panel = readout_panel(rows, style)
        taken = style.margin + panel.size[0], style.margin + panel.size[1]
        placed = legend_places(legends, size, taken, style.margin)
        return [(panel, style.margin, style.margin), *placed]

    def _curves(self, frame: Frame, history: History) -> list[Panel]:
        """The panel with the curves that the scene wants; none where what they show is not known."""
        scene = self._look.scene
        if scene.show.plot is None or frame.ledger is None:
            return []
        return [curve_panel(scene, history.curve_to(frame.ledger), self._style)]


def legend_places(
    legends: list[Panel], size: tuple[int, int], taken: tuple[int, int], margin: int
) -> list[tuple[Panel, int, int]]:
    """Legends with their left and top [pixels]: below each other at the right, or else upwards at the lower left.

    ``taken`` is how far down and to the right the readout reaches. Those that would touch it or each other are left
    out: the picture is too small for them.
    """
    width, height = size
    top, bottom = margin, height - margin
    places = []
    for legend in legends:
        tall, wide = legend.size
        left = width - margin - wide
        if left >= taken[1] + margin and top + tall <= height - margin:
            places.append((legend, left, top))
            top += tall + margin
        elif bottom - tall >= taken[0] + margin and margin + wide <= (left if top > margin else width) - margin:
            places.append((legend, margin, bottom - tall))
            bottom -= tall + margin
    return places
