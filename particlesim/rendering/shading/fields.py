"""Quantities that particles can be coloured by: what they are called, their values, and the scale they are shown on."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from particlesim.scene import Scene
from particlesim.trajectory.frames import Frame, Header

# How many figures a scale has beside it.
_FEWEST, _MOST = 3, 5

# Distances between the figures of a scale, times a power of ten.
_STEPS = (5.0, 2.5, 2.0, 1.0)


class Field(NamedTuple):
    """A quantity with its scale; what lies beyond the scale has the colour of its end."""

    name: str
    unit: str
    low: float
    high: float
    values: Callable[[Header, Frame, np.ndarray], np.ndarray]  # of some particles

    def fractions(self, header: Header, frame: Frame, members: np.ndarray) -> np.ndarray:
        """Where on the scale the particles ``members`` (k,) are, (k,), 0 at its low end and 1 at its high one."""
        return (self.values(header, frame, members) - self.low) / (self.high - self.low)


def field_of(kind: str, scene: Scene, header: Header, first: Frame) -> Field:
    """The field of a colour such as by_speed; its scale is the scene's, or settled by the first frame."""
    name, unit, values, scale = _FIELDS[kind]
    ranges = (g.colour_range for g in scene.particles if g.colour == kind and g.colour_range)
    low, high = next(ranges, None) or scale(scene, header, first)
    if low == high:
        # One value for all: in the middle of a scale that shows it.
        low, high = low - (0.5 * abs(low) or 0.5), high + (0.5 * abs(high) or 0.5)
    return Field(name, unit, float(low), float(high), values)


def figures(low: float, high: float) -> list[tuple[float, str]]:
    """Three to five round values on the scale from ``low`` to ``high``, and how they are written."""
    largest = math.floor(math.log10(high - low)) + 1
    steps = [number * 10.0**power for power in (largest, largest - 1, largest - 2) for number in _STEPS]
    step = next(step for step in steps if _FEWEST <= _count(low, high, step) <= _MOST)
    first = math.ceil(low / step - 1e-9)
    values = [step * (first + k) for k in range(_count(low, high, step))]
    if not 1e-3 <= max(abs(low), abs(high)) < 1e6:
        return [(value, f"{value:.3g}") for value in values]
    places = max(0, -math.floor(math.log10(step) + 1e-9))
    if abs(round(step, places) - step) > 1e-9 * step:
        places += 1
    return [(value, f"{value + 0.0:.{places}f}") for value in values]


def _count(low: float, high: float, step: float) -> int:
    """How many multiples of ``step`` there are from ``low`` to ``high``."""
    return math.floor(high / step + 1e-9) - math.ceil(low / step - 1e-9) + 1


def _speeds(header: Header, frame: Frame, members: np.ndarray) -> np.ndarray:
    return np.linalg.norm(frame.velocity[members], axis=1)


def _speed_scale(scene: Scene, header: Header, first: Frame) -> tuple[float, float]:
    """From rest to twice the first r.m.s. speed, and what a fall through the world adds to it [m/s]."""
    mean_square = float(np.mean(np.sum(first.velocity**2, axis=1))) if len(first.velocity) else 0.0
    fall = float(np.abs(scene.world.gravity) @ np.asarray(scene.world.size))
    return 0.0, float(np.sqrt(4.0 * mean_square + 2.0 * fall)) or 1.0


def _heights(header: Header, frame: Frame, members: np.ndarray) -> np.ndarray:
    return frame.position[members, 2]


def _height_scale(scene: Scene, header: Header, first: Frame) -> tuple[float, float]:
    """From the bottom of the world to its top, or from the lowest particle to the highest if it has neither [m]."""
    if scene.world.boundary[2] != "open" or not len(first.position):
        return -0.5 * scene.world.size[2], 0.5 * scene.world.size[2]
    return float(first.position[:, 2].min()), float(first.position[:, 2].max())


def _sizes(header: Header, frame: Frame, members: np.ndarray) -> np.ndarray:
    return header.size[members]


def _size_scale(scene: Scene, header: Header, first: Frame) -> tuple[float, float]:
    return (float(header.size.min()), float(header.size.max())) if len(header.size) else (0.0, 1.0)


def _impacts(header: Header, frame: Frame, members: np.ndarray) -> np.ndarray:
    return frame.impacts[members]


def _impact_scale(scene: Scene, header: Header, first: Frame) -> tuple[float, float]:
    """From none to twice as many as a bounding sphere of a gas at the first speeds has had when the movie ends.

    It collides with others at a rate of sqrt(2) pi d^2 n v, and with walls of area A around a volume V at A v / 4 V
    (J. Jeans, An Introduction to the Kinetic Theory of Gases, 1940, ch. 2 and 5).
    """
    edges = np.asarray(scene.world.size)
    volume = float(edges.prod())
    speed = float(np.linalg.norm(first.velocity, axis=1).mean()) if len(first.velocity) else 0.0
    cross_section = math.pi * float(np.mean(4.0 * header.radius**2)) if len(header.size) else 0.0
    walls = np.array(scene.world.boundary) == "wall"
    rate = math.sqrt(2.0) * cross_section * len(header.size) / volume + 0.5 * float((walls / edges).sum())
    return 0.0, max(1.0, round(2.0 * rate * speed * scene.duration))


# Name, unit, values and scale of each. Sizes are factors on shapes of 1 m, hence metres.
_FIELDS = {
    "by_speed": ("speed", "m/s", _speeds, _speed_scale),
    "by_height": ("height", "m", _heights, _height_scale),
    "by_size": ("size", "m", _sizes, _size_scale),
    "by_impacts": ("impacts", "", _impacts, _impact_scale),
}
