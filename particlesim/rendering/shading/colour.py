"""The colour of every particle, in linear light: by its shape, its group, a field, or as the scene names it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from particlesim.rendering.shading.colour_maps import encoded, map_colours
from particlesim.rendering.shading.fields import field_colours, field_of
from particlesim.scene import Scene
from particlesim.scene.colours import FIELDS, FieldColour
from particlesim.trajectory.frames import Frame, Header

# Eight colours that colour-blind people tell apart: M. Okabe and K. Ito, "Color Universal Design" (2008), less black.
PALETTE = ("#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7", "#56B4E9", "#F0E442")

# What comes after these: the same in other lightness, by shares of black (below 0) and of white mixed in.
_MIXED_IN = (0.0, -0.45, 0.5, -0.7, 0.75)

# Each shape keeps its colour from movie to movie; meshes and second shapes of a name take what is left.
_SHAPE_COLOUR = {"sphere": 0, "cube": 1, "pyramid": 2, "tetrahedron": 4, "box": 3}


def parse(colour: str) -> np.ndarray:
    """A colour name or '#rrggbb' as linear light, (3,) float64. Squared, as the root is taken of light."""
    return encoded(colour) ** 2


def obstacle_colours(scene: Scene) -> np.ndarray:
    """Linear RGB (k, 3) float64 of the obstacles of a scene."""
    return np.array([parse(obstacle.colour) for obstacle in scene.obstacles]).reshape(-1, 3)


def palette_colour(number: int) -> np.ndarray:
    """The colour of a group or shape by its number, sRGB 0 .. 1 (3,): 35 of them differ."""
    turn, place = divmod(number % (len(_MIXED_IN) * len(PALETTE)), len(PALETTE))
    share = _MIXED_IN[turn]
    return (1.0 - abs(share)) * encoded(PALETTE[place]) + max(share, 0.0)


class ParticleColours:
    """Colours for the frames of one movie. The scales of fields are settled by some of its frames, and kept.

    ``fields``: those that particles are coloured by; ``background``: sRGB 0 .. 1 (3,), that scales stand off from.
    """

    def __init__(self, scene: Scene, header: Header, frames: Sequence[Frame]) -> None:
        self._header = header
        self.background = encoded(scene.movie.behind)
        self._fixed = fixed_colours(scene, header)
        shown = {colour.field: colour for colour in reversed(field_colours(scene)) if colour is not None}
        kinds = [kind for kind in FIELDS if kind in shown]
        self.fields = [field_of(shown[kind], scene, header, frames) for kind in kinds]
        # In linear light, fine enough that no step of 8 bits is left out.
        even = np.linspace(0.0, 1.0, 1024)
        self._maps = [(map_colours(even, field.map, self.background) ** 2).astype(np.float32) for field in self.fields]
        # Which of the fields a particle is coloured by, or -1.
        number = [-1 if colour is None else kinds.index(colour.field) for colour in field_colours(scene)]
        self._field = np.array(number)[header.group]

    def __call__(self, frame: Frame, members: np.ndarray) -> np.ndarray:
        """Linear RGB (k, 3) float32 of the particles whose ids are ``members`` (k,)."""
        colours = self._fixed[members]
        for number, (field, colour) in enumerate(zip(self.fields, self._maps, strict=True)):
            mine = self._field[members] == number
            fraction = field.fractions(self._header, frame, members[mine])
            last = len(colour) - 1
            colours[mine] = colour[np.clip(np.rint(fraction * last), 0, last).astype(int)]
        return colours


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
        if group.colour == "by_shape" or isinstance(group.colour, FieldColour):
            colours[members] = by_shape[header.shape[members]]
        elif group.colour == "by_group":
            colours[members] = palette_colour(number) ** 2
        else:
            colours[members] = parse(group.colour)
    return colours
