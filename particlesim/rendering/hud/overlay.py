"""What lies over the picture: the readout in one corner, legends where they do not hide it."""

from __future__ import annotations

import numpy as np

from particlesim.rendering.hud.history import History
from particlesim.rendering.hud.legend import legend_panels
from particlesim.rendering.hud.panel import Panel, Style
from particlesim.rendering.hud.readout import readout_panel, readout_rows
from particlesim.rendering.look import Look
from particlesim.trajectory.frames import Frame


class Overlay:
    """The panels of one movie, for pictures with a ``dark`` background or a light one."""

    def __init__(self, look: Look, dark: bool) -> None:
        self._look = look
        self._style = Style(look.scene.movie.size, dark)
        self._legends = legend_panels(look.scene, look.header, look.colours, self._style)

    def draw(self, image: np.ndarray, frame: Frame, history: History) -> None:
        """Lay the panels for ``frame`` over ``image`` (h, w, 3) uint8."""
        margin = self._style.margin
        rows = readout_rows(self._look, frame, history)
        taken = (0, 0)
        if rows:
            panel = readout_panel(rows, self._style)
            panel.lay(image, margin, margin)
            taken = margin + panel.size[0], margin + panel.size[1]
        for legend, left, top in legend_places(self._legends, self._look.scene.movie.size, taken, margin):
            legend.lay(image, left, top)


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
