"""Obstacles: bodies that nothing can push, static or on a prescribed path."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from particlesim.geometry.shapes import Shape
from particlesim.model.bodies import KINEMATIC, make_obstacles
from particlesim.model.materials import Material
from particlesim.model.prescribed_motion import MOTION

_NOWHERE = (0.0, 0.0, 0.0)


class Obstacle(NamedTuple):
    """A shape that stands, or drifts, turns about its position and swings: x(t) = x + v t + A sin(w t + p)."""

    shape: Shape
    position: tuple[float, float, float]  # [m]
    orientation: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)  # at time 0, of the shape's body axes
    size: float = 1.0
    material: Material = Material()
    velocity: tuple[float, float, float] = _NOWHERE  # [m/s]
    angular_velocity: tuple[float, float, float] = _NOWHERE  # world axes [rad/s]
    amplitude: tuple[float, float, float] = _NOWHERE  # [m]
    angular_frequency: float = 0.0  # [rad/s]
    phase: float = 0.0  # at time 0 [rad]

    @property
    def moves(self) -> bool:
        """Whether it is anywhere else at any time."""
        swings = self.angular_frequency != 0.0 and any(self.amplitude)
        return any(self.velocity) or any(self.angular_velocity) or swings


class Obstructed(NamedTuple):
    """Obstacles as the system takes them."""

    bounded: np.ndarray  # (b,) BODY
    half_spaces: np.ndarray  # (h,) BODY
    motion: np.ndarray  # (k,) MOTION


def obstruct(obstacles: Sequence[Obstacle], first_shape: int, first_material: int) -> Obstructed:
    """The bodies of obstacles, whose shapes and materials are numbered from these on in their order."""
    bodies = make_obstacles(len(obstacles))
    motions: list[np.ndarray] = []
    for k, (b, o) in enumerate(zip(bodies, obstacles, strict=True)):
        b["shape_row"], b["material"], b["scale"] = first_shape + k, first_material + k, o.size
        b["position"], b["orientation"] = o.position, o.orientation
        if o.shape.is_bounded:
            b["radius"], b["inradius"] = o.shape.radius * o.size, o.shape.inradius * o.size
        if o.moves:
            b["kind"], b["motion"] = KINEMATIC, len(motions)
            motions.append(_motion_of(o))
    bounded = np.array([o.shape.is_bounded for o in obstacles], dtype=bool)
    return Obstructed(bodies[bounded], bodies[~bounded], np.concatenate([np.zeros(0, dtype=MOTION), *motions]))


def _motion_of(o: Obstacle) -> np.ndarray:
    """The prescribed motion of an obstacle, (1,) MOTION."""
    motion = np.zeros(1, dtype=MOTION)
    motion["origin"], motion["orientation"] = o.position, o.orientation
    for name in ("velocity", "angular_velocity", "amplitude", "angular_frequency", "phase"):
        motion[name] = getattr(o, name)
    return motion
