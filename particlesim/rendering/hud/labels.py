"""Labels: text beside single particles, so that one can follow them."""

from __future__ import annotations

import numpy as np

from particlesim.rendering.camera import View
from particlesim.rendering.hud.panel import Panel, Style
from particlesim.scene import Scene
from particlesim.trajectory.frames import Frame, Header

# From the middle of a particle to the corner of its label, to the right and up, in its radii.
_BESIDE = 0.75


class Labels:
    """The labels of one movie, with a ``dark`` background or a light one.

    Those of particles that are hidden are seen all the same; none is of one whose middle is out of the picture.
    """

    def __init__(self, scene: Scene, header: Header, dark: bool) -> None:
        self._size, self._radius = scene.movie.size, header.radius
        self._style = style = Style(scene.movie.size, dark)
        self._panels: dict[int, Panel] = {}  # by the ids of their particles
        names = [group.name for group in scene.groups]
        for label in scene.show.labels:
            of_group = header.group == names.index(label.group) if label.group is not None else np.zeros(0, bool)
            labelled = [label.particle] if label.particle is not None else np.flatnonzero(of_group).tolist()
            for one in labelled:
                self._panels[one] = _panel(label.text or label.group or str(one), style)

    def draw(self, image: np.ndarray, view: View, frame: Frame) -> None:
        """Lay labels over ``image`` (h, w, 3 or 4) uint8, the nearest last."""
        ids = np.array(sorted(self._panels.keys() & set(frame.ids.tolist())), dtype=np.int64)
        position, radius = frame.position[frame.rows(ids)], self._radius[ids]
        across, up, depth = (view.pose[:3, :3].T @ (position - view.pose[:3, 3]).T) * np.array([[1.0], [1.0], [-1.0]])
        width, height = self._size
        with np.errstate(divide="ignore", invalid="ignore"):
            scale = 0.5 * height / np.tan(0.5 * view.field_of_view) / depth  # pixels per metre there
            x, y, beside = 0.5 * width + scale * across, 0.5 * height - scale * up, _BESIDE * scale * radius
        seen = (depth > view.near) & (x >= 0) & (x < width) & (y >= 0) & (y < height)
        for k in np.argsort(-depth, kind="stable"):
            if seen[k]:
                panel = self._panels[int(ids[k])]
                tall, wide = panel.size
                left, top = round(x[k] + beside[k]), round(y[k] - beside[k]) - tall
                panel.lay(image, max(min(left, width - wide), 0), max(min(top, height - tall), 0))


def _panel(text: str, style: Style) -> Panel:
    beside, above = style.pad // 2, style.pad // 4
    panel = Panel(style, style.line + 2 * above, style.width(text) + 2 * beside)
    panel.write(text, beside, above)
    return panel
