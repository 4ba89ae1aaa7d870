"""The obstacles of a scene: their shapes, surfaces and motions."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from particlesim.core.rotations import rotations_of
from particlesim.geometry.shapes import Shape, drawn_hull, half_space
from particlesim.model.materials import Material
from particlesim.scene import Scene
from particlesim.scene.file import SceneError
from particlesim.scene.obstacles import (
    HeightfieldShape,
    KeysMotion,
    Motion,
    PlaneShape,
    SpinMotion,
    SurfaceShape,
    VibrateMotion,
)
from particlesim.scene.surface import HasSurface
from particlesim.setup.obstacles import Obstacle, Piece, poses_at
from particlesim.setup.orientations import of_body_axes, quaternion_of
from particlesim.setup.shape_reading import shape_of, surface_of

# A plane is drawn as a slab of this part of the world's longest edge.
_SLAB = 0.01

# Corners of a box about the origin, of edge 2.
_CORNERS = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))


def obstacles_of(scene: Scene, shapes: Sequence[Shape] | None = None) -> list[Obstacle]:
    """The obstacles of a scene, in its order, with these ``shapes`` if they are known.

    SceneError if a shape cannot be made.
    """
    known: Sequence[Shape | None] = shapes or [None] * len(scene.obstacles)
    return [_obstacle(scene, k, shape) for k, shape in enumerate(known)]


def material_of(scene: Scene, said: HasSurface) -> Material:
    """The material of what has a surface in a scene: as the world says where it says nothing itself."""
    return Material(**{**scene.world.surface, **said.surface})


def drawn_shapes(scene: Scene, obstacles: list[Obstacle]) -> tuple[Shape, ...]:
    """What is drawn of each obstacle: its shape, or of a plane a slab as large as the world is there.

    A plane that does not pass through the world has a slab far too small to be seen.
    """
    return tuple(o.shape if o.shape.is_bounded else _slab(scene, o) for o in obstacles)


def _obstacle(scene: Scene, k: int, known: Shape | None) -> Obstacle:
    said = scene.obstacles[k]
    if isinstance(said.shape, PlaneShape):
        shape = half_space(_unit(said.shape.normal))
    elif isinstance(said.shape, SurfaceShape | HeightfieldShape):
        shape = known or surface_of(said.shape, f"obstacles[{k}].shape")
    else:
        shape = known or shape_of(said.shape, f"obstacles[{k}].shape")
    orientation = of_body_axes(quaternion_of(said.orientation), shape)
    _check_period(scene, k, shape, orientation)
    obstacle = Obstacle(
        shape,
        said.position,
        _tuple(orientation),
        said.size,
        material_of(scene, said),
        surface_velocity=said.surface_velocity or (0.0, 0.0, 0.0),
    )
    return obstacle if said.motion is None else obstacle._replace(pieces=_pieces(obstacle, said.motion))


def _check_period(scene: Scene, k: int, shape: Shape, orientation: np.ndarray) -> None:
    """A particle must not meet an obstacle round a periodic domain as well: SceneError."""
    said, key = scene.obstacles[k], f"obstacles[{k}]"
    period = np.array(scene.world.period)
    if isinstance(said.shape, PlaneShape):
        if (np.abs(rotations_of(orientation).apply(shape.face_normals[0]))[period > 0.0] > 1e-12).any():
            raise SceneError("must be at right angles to the periodic axes", f"{key}.shape.normal", said.shape.normal)
    elif (widest := 2.0 * shape.radius * said.size) >= 0.5 * min(period[period > 0.0], default=math.inf):
        span = f"it spans {widest:.4g} m; in a periodic world it must span less than half of it"
        raise SceneError(f"too large: {span}", f"{key}.size", said.size)


def _unit(vector: Any) -> np.ndarray:
    return np.asarray(vector, dtype=np.float64) / np.linalg.norm(vector)


def _tuple(values: Any) -> tuple[Any, ...]:
    return tuple(np.asarray(values, dtype=np.float64).tolist())


def _slab(scene: Scene, plane: Obstacle) -> Shape:
    """The part of a half-space just behind its plane, as far as the world goes, about the plane's position."""
    half, position = 0.5 * np.asarray(scene.world.size), np.asarray(plane.position)
    turn = rotations_of(np.asarray(plane.orientation))
    normal, thick = turn.apply(plane.shape.face_normals[0]), _SLAB * 2.0 * float(half.max())
    across = _section(half, normal, float(normal @ position))
    if len(across) < 3:
        return drawn_hull("plane", 1e-9 * thick * _CORNERS)
    corners = np.concatenate([across, across - thick * normal])
    return drawn_hull("plane", turn.apply(corners - position, inverse=True))


def _section(half: np.ndarray, normal: np.ndarray, level: float) -> np.ndarray:
    """Corners (k, 3) of where the plane normal . x = level cuts a box about the origin, as wide as 2 ``half``."""
    corners = half * _CORNERS
    # Edges join corners that differ along one axis.
    ends = [(a, b) for a, b in itertools.combinations(range(8), 2) if np.count_nonzero(_CORNERS[a] != _CORNERS[b]) == 1]
    start, end = (corners[[pair[k] for pair in ends]] for k in range(2))
    below, above = start @ normal - level, end @ normal - level
    crossed = (np.minimum(below, above) <= 0.0) & (np.maximum(below, above) >= 0.0) & (below != above)
    part = (below / np.where(crossed, below - above, 1.0))[:, None]
    return (start + part * (end - start))[crossed]


# ---- motions ---------------------------------------------------------------------------------------------------------


def _pieces(o: Obstacle, motion: Motion) -> tuple[Piece, ...]:
    """The pieces of an obstacle's motion, which stands at its position until it begins."""
    if isinstance(motion, KeysMotion):
        return _through_keys(o, motion)
    begin, still = motion.begin, Piece(0.0, o.position, o.orientation)
    moving = _steady(o, motion)._replace(start=begin)
    pieces = (moving,) if begin == 0.0 else (still, moving)
    return pieces if motion.until is None else (*pieces, _stop(o, pieces, motion.until))


def _stop(o: Obstacle, pieces: tuple[Piece, ...], time: float) -> Piece:
    """The piece in which an obstacle stays where its pieces bring it at a time [s]."""
    (there,) = poses_at([o._replace(pieces=pieces)], time)
    return Piece(time, _tuple(there["position"]), _tuple(there["orientation"]))


def _steady(o: Obstacle, motion: Any) -> Piece:
    """The piece of what goes on evenly from where an obstacle stands."""
    piece = Piece(0.0, o.position, o.orientation)
    if isinstance(motion, SpinMotion):
        axis, rate = _unit(motion.axis), motion.rate
        centre = np.asarray(o.position if motion.centre is None else motion.centre)
        arm = np.asarray(o.position) - centre
        along = float(arm @ axis) * axis
        arm -= along
        piece = piece._replace(angular_velocity=_tuple(rate * axis))
        if not arm.any():
            return piece
        ahead = np.cross(axis, arm)
        return piece._replace(
            origin=_tuple(centre + along), amplitude=_tuple(ahead), across=_tuple(arm), angular_frequency=rate
        )
    if isinstance(motion, VibrateMotion):
        swing, phase = motion.amplitude * _unit(motion.direction), math.radians(motion.phase)
        origin = np.asarray(o.position) - math.sin(phase) * swing
        frequency = 2.0 * math.pi * motion.frequency
        return piece._replace(origin=_tuple(origin), amplitude=_tuple(swing), angular_frequency=frequency, phase=phase)
    return piece._replace(velocity=motion.velocity)


def _through_keys(o: Obstacle, motion: KeysMotion) -> tuple[Piece, ...]:
    """Pieces from key to key, in which the way is that of a cycloid: no speed and no acceleration at its ends."""
    position, orientation = o.position, o.orientation
    stops = []
    for key in motion.keys:
        position = key.position or position
        if key.orientation is not None:
            orientation = _tuple(of_body_axes(quaternion_of(key.orientation), o.shape))
        stops.append(Piece(key.time, position, orientation))
    pieces = [stops[0]._replace(start=0.0)] if stops[0].start > 0.0 else []
    pieces += [_between(*both) for both in itertools.pairwise(stops)]
    return (*pieces, stops[-1])


def _between(here: Piece, there: Piece) -> Piece:
    """The piece that leads from one stop to another."""
    time = there.start - here.start
    way = np.subtract(there.origin, here.origin)
    turn = rotations_of(np.asarray(there.orientation)) * rotations_of(np.asarray(here.orientation)).inv()
    return here._replace(
        velocity=_tuple(way / time),
        amplitude=_tuple(-way / (2.0 * math.pi)),
        angular_frequency=2.0 * math.pi / time,
        angular_velocity=_tuple(turn.as_rotvec() / time),
    )
