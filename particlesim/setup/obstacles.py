"""Obstacles: bodies that nothing can push, static or on a prescribed path."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from particlesim.geometry.shapes import Shape
from particlesim.model.bodies import KINEMATIC, make_obstacles
from particlesim.model.materials import Material
from particlesim.model.prescribed_motion import MOTION, place_kinematic

_NOWHERE = (0.0, 0.0, 0.0)
_UPRIGHT = (1.0, 0.0, 0.0, 0.0)

Triple = tuple[float, float, float]
Quadruple = tuple[float, float, float, float]


class Piece(NamedTuple):
    """How an obstacle moves from a time on: x = origin + v t + A sin(w t + p) + B cos(w t + p), while it turns."""

    start: float  # that t is counted from [s]
    origin: Triple  # [m]
    orientation: Quadruple = _UPRIGHT  # at the start
    velocity: Triple = _NOWHERE  # v [m/s]
    angular_velocity: Triple = _NOWHERE  # world axes [rad/s]
    amplitude: Triple = _NOWHERE  # A [m]
    across: Triple = _NOWHERE  # B [m]
    angular_frequency: float = 0.0  # w [rad/s]
    phase: float = 0.0  # p [rad]


class Obstacle(NamedTuple):
    """A shape that stands where it is, or goes through the pieces of a motion."""

    shape: Shape
    position: Triple  # at time 0 [m]
    orientation: Quadruple = _UPRIGHT  # at time 0, of the shape's body axes
    size: float = 1.0
    material: Material = Material()
    pieces: tuple[Piece, ...] = ()  # in the order of their starts, the first at or before time 0
    surface_velocity: Triple = _NOWHERE  # against the body, across its surface, world axes [m/s]

    @property
    def moves(self) -> bool:
        """Whether any of it does at any time."""
        return bool(self.pieces) or any(self.surface_velocity)


class Obstructed(NamedTuple):
    """Obstacles as the system takes them."""

    bounded: np.ndarray  # (b,) BODY, convex ones of bounded extent
    surroundings: np.ndarray  # (h,) BODY, half-spaces and meshes
    motion: np.ndarray  # (k,) MOTION


def obstruct(obstacles: Sequence[Obstacle], first_shape: int, first_material: int) -> Obstructed:
    """The bodies of obstacles, whose shapes and materials are numbered from these on in their order."""
    bodies = make_obstacles(len(obstacles))
    motions = [np.zeros(0, dtype=MOTION)]
    for k, (b, o) in enumerate(zip(bodies, obstacles, strict=True)):
        b["shape_row"], b["material"], b["scale"] = first_shape + k, first_material + k, o.size
        b["position"], b["orientation"], b["entry"] = o.position, o.orientation, k
        if o.shape.is_bounded:
            b["radius"], b["inradius"] = o.shape.radius * o.size, o.shape.inradius * o.size
        if o.moves:
            b["kind"], b["motion"] = KINEMATIC, sum(map(len, motions))
            motions.append(_motion_of(o))
    bounded = np.array([o.shape.is_bounded and not len(o.shape.triangles) for o in obstacles], dtype=bool)
    return Obstructed(bodies[bounded], bodies[~bounded], np.concatenate(motions))


def poses_at(obstacles: Sequence[Obstacle], time: float) -> np.ndarray:
    """The obstacles as they are at ``time`` [s], (n,) BODY, in their order."""
    found = obstruct(obstacles, 0, 0)
    bodies = np.concatenate([found.bounded, found.surroundings])
    place_kinematic(bodies, found.motion, time)
    return bodies[np.argsort(bodies["entry"])]


def _motion_of(o: Obstacle) -> np.ndarray:
    """The prescribed motion of an obstacle, (pieces,) MOTION."""
    pieces = o.pieces or (Piece(0.0, o.position, o.orientation),)
    motion = np.zeros(len(pieces), dtype=MOTION)
    for name in Piece._fields:
        motion[name] = [getattr(piece, name) for piece in pieces]
    motion["until"] = [*motion["start"][1:], np.inf]
    motion["surface_velocity"] = o.surface_velocity
    return motion
