"""Quantities that particles can be coloured by: what they are called, their values, and the scale they are shown on."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from particlesim.scene import Scene
from particlesim.scene.colours import FieldColour
from particlesim.scene.groups import Group
from particlesim.scene.overrides import grouped
from particlesim.trajectory.frames import Frame, Header

# A scale is divided evenly into so many parts at the most, with figures between them and at its ends.
_MOST_PARTS = 4

# Round ends are multiples of these, times a power of ten.
_STEPS = (1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)

# What lies beyond a scale that a movie settles, as a share of all its particles at all times.
_BEYOND = 0.02


class Field(NamedTuple):
    """A quantity with its scale; what lies beyond the scale has the colour of its end."""

    name: str
    unit: str
    low: float
    high: float
    map: str  # of colours, see colour_maps.py
    values: Callable[[Header, Frame, np.ndarray], np.ndarray]  # of particles by their ids

    def fractions(self, header: Header, frame: Frame, members: np.ndarray) -> np.ndarray:
        """Where on the scale the particles with the ids ``members`` (k,) are, (k,), 0 at its low end, 1 at its high."""
        return (self.values(header, frame, members) - self.low) / (self.high - self.low)


def field_colours(scene: Scene) -> list[FieldColour | None]:
    """How each group shows a quantity, None for those that do not."""
    return [group.colour if isinstance(group.colour, FieldColour) else None for group in scene.groups]


def is_settled_by_frames(scene: Scene) -> bool:
    """Whether a scale of the scene depends on how its particles fare."""
    return any(colour and colour.field in _CHANGING and colour.range is None for colour in field_colours(scene))


def field_of(colour: FieldColour, scene: Scene, header: Header, frames: Sequence[Frame]) -> Field:
    """The field that a colour shows; its scale is the scene's, or settled by some frames."""
    unit, values, scale = _FIELDS[colour.field]
    low, high = colour.range or scale(scene, header, frames)
    return Field(colour.field, unit, float(low), float(high), colour.map, values)


def settled(scene: Scene, header: Header, frames: Sequence[Frame]) -> Scene:
    """The scene with the scales that ``frames`` settle, in the order of time, as if it said them."""

    def with_range(group: Group) -> Group:
        colour = group.colour
        if not isinstance(colour, FieldColour) or colour.field not in _CHANGING:
            return group
        field = field_of(colour, scene, header, frames)
        return group.model_copy(update={"colour": colour.model_copy(update={"range": (field.low, field.high)})})

    return scene.model_copy(update=grouped(scene, [with_range(group) for group in scene.groups]))


def figures(low: float, high: float) -> list[tuple[float, str]]:
    """Values that divide the scale from ``low`` to ``high`` evenly, its ends included, and how they are written.

    There are as many as have the fewest figures.
    """
    parts = min(range(_MOST_PARTS, 1, -1), key=lambda parts: _count_figures((high - low) / parts))
    values = np.linspace(low, high, parts + 1).tolist()
    if not 1e-3 <= max(abs(low), abs(high)) < 1e6:
        return [(value, f"{value:.3g}") for value in values]
    # As many places as tell them exactly, or else to a thousandth of the scale.
    most = max(0, 3 - math.floor(math.log10(high - low)))
    exact = 1e-6 * (high - low)
    fitting = (p for p in range(most) if all(abs(round(value, p) - value) <= exact for value in values))
    places = next(fitting, most)
    return [(value, f"{round(value, places) + 0.0:.{places}f}") for value in values]


def _count_figures(step: float) -> int:
    """How many figures a number has, not counting noughts at both ends; as many as nine."""
    return len(f"{step:.8e}".split("e")[0].replace(".", "").rstrip("0"))


def _rounded(low: float, high: float) -> tuple[float, float]:
    """The nearest round ends of a scale that has ``low`` and ``high`` on it: multiples of a quarter of it or more."""
    if low == high:
        # One value for all: in the middle of a scale that shows it.
        low, high = low - (0.5 * abs(low) or 0.5), high + (0.5 * abs(high) or 0.5)
    power = 10.0 ** math.floor(math.log10((high - low) / _MOST_PARTS))
    steps = [number * power * ten for ten in (1.0, 10.0) for number in _STEPS]
    ends = [(math.floor(low / step + 1e-9), math.ceil(high / step - 1e-9), step) for step in steps]
    first, last, step = min((end for end in ends if end[1] - end[0] <= _MOST_PARTS), key=lambda e: (e[1] - e[0]) * e[2])
    return first * step, last * step


def _reached(
    values: Callable[[Header, Frame, np.ndarray], np.ndarray], header: Header, frames: Sequence[Frame]
) -> float:
    """What no more than the share _BEYOND of the particles at all times goes beyond; 0 if there are none."""
    of_all = np.concatenate([values(header, frame, frame.ids) for frame in frames])
    return float(np.quantile(of_all, 1.0 - _BEYOND)) if len(of_all) else 0.0


def _speeds(header: Header, frame: Frame, members: np.ndarray) -> np.ndarray:
    return np.linalg.norm(frame.velocity[frame.rows(members)], axis=1)


def _speed_scale(scene: Scene, header: Header, frames: Sequence[Frame]) -> tuple[float, float]:
    """From rest to what few ever go beyond [m/s]."""
    return _rounded(0.0, _reached(_speeds, header, frames) or 1.0)


def _heights(header: Header, frame: Frame, members: np.ndarray) -> np.ndarray:
    return frame.position[frame.rows(members), 2]


def _height_scale(scene: Scene, header: Header, frames: Sequence[Frame]) -> tuple[float, float]:
    """From the bottom of the world to its top, or as far as all but a few ever are if it has neither [m]."""
    heights = np.concatenate([frame.position[:, 2] for frame in frames])
    if scene.world.boundary[2] != "open" or not len(heights):
        return -0.5 * scene.world.size[2], 0.5 * scene.world.size[2]
    low, high = np.quantile(heights, (0.5 * _BEYOND, 1.0 - 0.5 * _BEYOND))
    return _rounded(float(low), float(high))


def _sizes(header: Header, frame: Frame, members: np.ndarray) -> np.ndarray:
    return header.size[members]


def _size_scale(scene: Scene, header: Header, frames: Sequence[Frame]) -> tuple[float, float]:
    return _rounded(float(header.size.min()), float(header.size.max())) if len(header.size) else (0.0, 1.0)


def _impacts(header: Header, frame: Frame, members: np.ndarray) -> np.ndarray:
    return frame.impacts[frame.rows(members)]


def _impact_scale(scene: Scene, header: Header, frames: Sequence[Frame]) -> tuple[float, float]:
    """From none to what few have had by then."""
    return _rounded(0.0, max(1.0, _reached(_impacts, header, frames[-1:])))


# Fields whose scales are settled by frames.
_CHANGING = "speed", "height", "impacts"

# Unit, values and scale of each. Sizes are factors on shapes of 1 m, hence metres.
_FIELDS = {
    "speed": ("m/s", _speeds, _speed_scale),
    "height": ("m", _heights, _height_scale),
    "size": ("m", _sizes, _size_scale),
    "impacts": ("", _impacts, _impact_scale),
}
