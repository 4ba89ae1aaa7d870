"""The colour of every particle, in linear light: by its shape, its group, a field, or as the scene names it."""

from __future__ import annotations

import numpy as np
from PIL import ImageColor

from particlesim.rendering.shading.fields import field_of
from particlesim.scene import Scene
from particlesim.scene.groups import FIELDS
from particlesim.trajectory.frames import Frame, Header

# Eight colours that colour-blind people tell apart: M. Okabe and K. Ito, "Color Universal Design" (2008), less black.
PALETTE = ("#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7", "#56B4E9", "#F0E442")

# Each shape keeps its colour from movie to movie; meshes and second shapes of a name take what is left.
_SHAPE_COLOUR = {"sphere": 0, "cube": 1, "pyramid": 2, "tetrahedron": 4, "box": 3}

# Nine evenly spaced values of the map 'viridis' of S. van der Walt and N. Smith (2015, public domain), whose
# lightness grows evenly.
_FIELD_MAP = (
    "#440154", "#472D7B", "#3B528B", "#2C728E", "#21918C", "#28AE80", "#5EC962", "#ADDC30", "#FDE725",
)  # fmt: skip


def encoded(colour: str) -> np.ndarray:
    """A colour name or '#rrggbb' as sRGB 0 .. 1, (3,) float64."""
    return np.array(ImageColor.getrgb(colour)[:3]) / 255.0


def parse(colour: str) -> np.ndarray:
    """A colour name or '#rrggbb' as linear light, (3,) float64. Squared, as the root is taken of light."""
    return encoded(colour) ** 2


class ParticleColours:
    """Colours for the frames of one movie. The scales of fields are settled by its first frame and kept.

    ``fields``: those that particles are coloured by.
    """

    def __init__(self, scene: Scene, header: Header, first: Frame) -> None:
        self._header = header
        self._fixed = _fixed_colours(scene, header)
        kinds = [kind for kind in FIELDS if any(group.colour == kind for group in scene.particles)]
        self.fields = [field_of(kind, scene, header, first) for kind in kinds]
        # Which of the fields a particle is coloured by, or -1.
        number = {kind: k for k, kind in enumerate(kinds)}
        self._field = np.array([number.get(group.colour, -1) for group in scene.particles])[header.group]

    def __call__(self, frame: Frame, members: np.ndarray) -> np.ndarray:
        """Linear RGB (k, 3) float32 of the particles ``members`` (k,)."""
        colours = self._fixed[members]
        for number, field in enumerate(self.fields):
            mine = self._field[members] == number
            fraction = field.fractions(self._header, frame, members[mine])
            colours[mine] = _LINEAR[np.clip(np.rint(fraction * (len(_LINEAR) - 1)), 0, len(_LINEAR) - 1).astype(int)]
        return colours


def map_colours(fraction: np.ndarray) -> np.ndarray:
    """sRGB 0 .. 1 (n, 3) of numbers (n,) 0 .. 1, in colours whose lightness grows with the number."""
    anchors = np.array([encoded(colour) for colour in _FIELD_MAP])
    place = np.linspace(0.0, 1.0, len(anchors))
    return np.column_stack([np.interp(fraction, place, channel) for channel in anchors.T])


# The map in linear light, fine enough that no step of 8 bits is left out.
_LINEAR = (map_colours(np.linspace(0.0, 1.0, 1024)) ** 2).astype(np.float32)


def shape_colours(header: Header) -> np.ndarray:
    """Linear RGB of each of the header's shapes, (s, 3)."""
    free = [i for i in range(len(PALETTE)) if i not in {_SHAPE_COLOUR.get(s.name) for s in header.shapes}]
    taken: set[int] = set()
    chosen = []
    for place, shape in enumerate(header.shapes):
        entry = _SHAPE_COLOUR.get(shape.name)
        if entry is None or entry in taken:
            entry = free.pop(0) if free else place % len(PALETTE)
        taken.add(entry)
        chosen.append(parse(PALETTE[entry]))
    return np.array(chosen).reshape(-1, 3)


def _fixed_colours(scene: Scene, header: Header) -> np.ndarray:
    by_shape = shape_colours(header)
    colours = np.zeros((len(header.group), 3), dtype=np.float32)
    for number, group in enumerate(scene.particles):
        members = header.group == number
        if group.colour == "by_shape":
            colours[members] = by_shape[header.shape[members]]
        elif group.colour == "by_group":
            colours[members] = parse(PALETTE[number % len(PALETTE)])
        elif group.colour not in FIELDS:
            colours[members] = parse(group.colour)
    return colours
