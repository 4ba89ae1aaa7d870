"""The colour of every particle, in linear light: by its shape, its group, a field, or as the scene names it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from PIL import ImageColor

from particlesim.rendering.shading.fields import field_of
from particlesim.scene import Scene
from particlesim.scene.groups import FIELDS
from particlesim.trajectory.frames import Frame, Header

# Eight colours that colour-blind people tell apart: M. Okabe and K. Ito, "Color Universal Design" (2008), less black.
PALETTE = ("#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7", "#56B4E9", "#F0E442")

# What comes after these: the same in other lightness, by shares of black (below 0) and of white mixed in.
_MIXED_IN = (0.0, -0.45, 0.5, -0.7, 0.75)

# Each shape keeps its colour from movie to movie; meshes and second shapes of a name take what is left.
_SHAPE_COLOUR = {"sphere": 0, "cube": 1, "pyramid": 2, "tetrahedron": 4, "box": 3}

# Nine evenly spaced values of the map 'viridis' of S. van der Walt and N. Smith (2015, public domain), whose
# lightness grows evenly.
_FIELD_MAP = (
    "#440154", "#472D7B", "#3B528B", "#2C728E", "#21918C", "#28AE80", "#5EC962", "#ADDC30", "#FDE725",
)  # fmt: skip


# Colours of the map have at least this contrast with a dark background: (L + 0.05) / (L' + 0.05), as in WCAG 2.2.
_CONTRAST, _FLARE = 2.5, 0.05

# More of the map than this is not left out for it.
_MOST_LEFT_OUT = 0.4


def encoded(colour: str) -> np.ndarray:
    """A colour name or '#rrggbb' as sRGB 0 .. 1, (3,) float64."""
    return np.array(ImageColor.getrgb(colour)[:3]) / 255.0


def parse(colour: str) -> np.ndarray:
    """A colour name or '#rrggbb' as linear light, (3,) float64. Squared, as the root is taken of light."""
    return encoded(colour) ** 2


def palette_colour(number: int) -> np.ndarray:
    """The colour of a group or shape by its number, sRGB 0 .. 1 (3,): 35 of them differ."""
    turn, place = divmod(number % (len(_MIXED_IN) * len(PALETTE)), len(PALETTE))
    share = _MIXED_IN[turn]
    return (1.0 - abs(share)) * encoded(PALETTE[place]) + max(share, 0.0)


class ParticleColours:
    """Colours for the frames of one movie. The scales of fields are settled by some of its frames, and kept.

    ``fields``: those that particles are coloured by; ``begin``: see ``map_colours``.
    """

    def __init__(self, scene: Scene, header: Header, frames: Sequence[Frame]) -> None:
        self._header = header
        self.begin = map_begin(encoded(scene.movie.background))
        # In linear light, fine enough that no step of 8 bits is left out.
        self._map = (map_colours(np.linspace(0.0, 1.0, 1024), self.begin) ** 2).astype(np.float32)
        self._fixed = fixed_colours(scene, header)
        kinds = [kind for kind in FIELDS if any(group.colour == kind for group in scene.groups)]
        self.fields = [field_of(kind, scene, header, frames) for kind in kinds]
        # Which of the fields a particle is coloured by, or -1.
        number = {kind: k for k, kind in enumerate(kinds)}
        self._field = np.array([number.get(group.colour, -1) for group in scene.groups])[header.group]

    def __call__(self, frame: Frame, members: np.ndarray) -> np.ndarray:
        """Linear RGB (k, 3) float32 of the particles whose ids are ``members`` (k,)."""
        colours = self._fixed[members]
        for number, field in enumerate(self.fields):
            mine = self._field[members] == number
            fraction = field.fractions(self._header, frame, members[mine])
            last = len(self._map) - 1
            colours[mine] = self._map[np.clip(np.rint(fraction * last), 0, last).astype(int)]
        return colours


def map_colours(fraction: np.ndarray, begin: float = 0.0) -> np.ndarray:
    """sRGB 0 .. 1 (n, 3) of numbers (n,) 0 .. 1, in colours whose lightness grows with the number.

    The first part of the map, up to ``begin``, is left out.
    """
    anchors = np.array([encoded(colour) for colour in _FIELD_MAP])
    place = np.linspace(0.0, 1.0, len(anchors))
    at = begin + (1.0 - begin) * np.asarray(fraction)
    return np.column_stack([np.interp(at, place, channel) for channel in anchors.T])


def map_begin(background: np.ndarray) -> float:
    """How much of the map is to be left out: what can hardly be seen on a ``background``, sRGB 0 .. 1 (3,)."""
    part = np.linspace(0.0, _MOST_LEFT_OUT, 64)
    contrast = (luminance(map_colours(part)) + _FLARE) / (luminance(background[None]) + _FLARE)
    # On what is light all of the map is seen; on what is as light as its middle no part of it would help.
    return float(part[np.argmax(contrast >= _CONTRAST)]) if contrast[-1] >= _CONTRAST else 0.0


def luminance(colours: np.ndarray) -> np.ndarray:
    """Relative luminance 0 .. 1 (n,) of sRGB colours 0 .. 1 (n, 3), as WCAG 2.2 has it."""
    linear = np.where(colours <= 0.04045, colours / 12.92, ((colours + 0.055) / 1.055) ** 2.4)
    return linear @ np.array([0.2126, 0.7152, 0.0722])


def shape_colours(header: Header) -> np.ndarray:
    """Linear RGB of each of the header's shapes, (s, 3)."""
    there = {_SHAPE_COLOUR.get(shape.name) for shape in header.shapes}
    free = [number for number in range(len(PALETTE) + len(header.shapes)) if number not in there]
    taken: set[int] = set()
    chosen = []
    for shape in header.shapes:
        entry = _SHAPE_COLOUR.get(shape.name)
        if entry is None or entry in taken:
            entry = free.pop(0)
        taken.add(entry)
        chosen.append(palette_colour(entry) ** 2)
    return np.array(chosen).reshape(-1, 3)


def fixed_colours(scene: Scene, header: Header) -> np.ndarray:
    """Linear RGB (n, 3) float32 of all particles by id; by shape where a field would say it anew at each time."""
    by_shape = shape_colours(header)
    colours = np.zeros((len(header.group), 3), dtype=np.float32)
    for number, group in enumerate(scene.groups):
        members = header.group == number
        if group.colour == "by_shape" or group.colour in FIELDS:
            colours[members] = by_shape[header.shape[members]]
        elif group.colour == "by_group":
            colours[members] = palette_colour(number) ** 2
        else:
            colours[members] = parse(group.colour)
    return colours
