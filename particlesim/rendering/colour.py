"""The colour of every particle, in linear light: by its shape, its group, its speed, or as the scene names it."""

from __future__ import annotations

import numpy as np
from PIL import ImageColor

from particlesim.scene import Scene
from particlesim.trajectory import Frame, Header

# Eight colours that colour-blind people tell apart: M. Okabe and K. Ito, "Color Universal Design" (2008), less black.
PALETTE = ("#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7", "#56B4E9", "#F0E442")

# Each shape keeps its colour from movie to movie; meshes and second shapes of a name take what is left.
_SHAPE_COLOUR = {"sphere": 0, "cube": 1, "pyramid": 2, "tetrahedron": 4, "box": 3}

# Nine evenly spaced values of the map 'viridis' of S. van der Walt and N. Smith (2015, public domain), whose
# lightness grows evenly.
_SPEED_MAP = (
    "#440154", "#472D7B", "#3B528B", "#2C728E", "#21918C", "#28AE80", "#5EC962", "#ADDC30", "#FDE725",
)  # fmt: skip


def encoded(colour: str) -> np.ndarray:
    """A colour name or '#rrggbb' as sRGB 0 .. 1, (3,) float64."""
    return np.array(ImageColor.getrgb(colour)[:3]) / 255.0


def parse(colour: str) -> np.ndarray:
    """A colour name or '#rrggbb' as linear light, (3,) float64. Squared, as the shaders take the root."""
    return encoded(colour) ** 2


class ParticleColours:
    """Colours for the frames of one movie. The scale of speeds is settled by its first frame and kept."""

    def __init__(self, scene: Scene, header: Header, first: Frame) -> None:
        self._fixed = _fixed_colours(scene, header)
        by_speed = np.array([group.colour == "by_speed" for group in scene.particles])
        self._by_speed = np.flatnonzero(by_speed[header.group])
        self._fastest = _top_speed(scene, first)

    def __call__(self, frame: Frame) -> np.ndarray:
        """Linear RGB of every particle, (n, 3) float32. The array is used again for the next frame."""
        if len(self._by_speed):
            speed = np.linalg.norm(frame.velocity[self._by_speed], axis=1)
            self._fixed[self._by_speed] = speed_colours(speed / self._fastest)
        return self._fixed


def speed_colours(fraction: np.ndarray) -> np.ndarray:
    """Linear RGB (n, 3) float32 of speeds (n,) given as fractions of the fastest; faster ones are cut there."""
    return (map_colours(fraction) ** 2).astype(np.float32)


def map_colours(fraction: np.ndarray) -> np.ndarray:
    """sRGB 0 .. 1 (n, 3) of numbers (n,) 0 .. 1, in colours whose lightness grows with the number."""
    anchors = np.array([encoded(colour) for colour in _SPEED_MAP])
    place = np.linspace(0.0, 1.0, len(anchors))
    return np.column_stack([np.interp(fraction, place, channel) for channel in anchors.T])


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
        elif group.colour != "by_speed":
            colours[members] = parse(group.colour)
    return colours


def _top_speed(scene: Scene, first: Frame) -> float:
    """The speed [m/s] of the last colour: twice the first r.m.s., and what a fall through the world adds to it."""
    mean_square = float(np.mean(np.sum(first.velocity**2, axis=1))) if len(first.velocity) else 0.0
    fall = float(np.abs(scene.world.gravity) @ np.asarray(scene.world.size))
    return float(np.sqrt(4.0 * mean_square + 2.0 * fall)) or 1.0
