"""Obstacles: what particles move among, standing or on a path that nothing changes."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from particlesim.scene.base import (
    Colour,
    File,
    Finite,
    Fraction,
    Model,
    NotNegative,
    Positive,
    PositiveVector,
    Text,
    Timed,
    Vector,
    existing_file,
    file_within,
    in_time,
    mesh_file,
    shorthand,
)
from particlesim.scene.groups import Solids, Unit
from particlesim.scene.placements import Orientation, not_zero
from particlesim.scene.surface import Surface

Direction = Annotated[Vector, AfterValidator(not_zero)]


class PlaneShape(Model):
    """All that is behind a plane through the position, without end; the normal points out of it."""

    kind: Literal["plane"]
    normal: Direction = (0.0, 0.0, 1.0)


class SurfaceShape(Model):
    """The triangles of an STL, OBJ or PLY file as they are, open or closed, times ``scale``; they have two sides.

    Its position is where the origin of the file is.
    """

    kind: Literal["mesh"]
    file: Annotated[File, AfterValidator(mesh_file), AfterValidator(file_within)]
    unit: Unit = "m"
    scale: Positive = 1.0


class HeightfieldShape(Model):
    """Heights on a grid, from a numpy array (.npy) or a picture (.png, black is 0 and white is 1), about its middle.

    ``size`` is how far it goes along x (columns) and y (rows, the first at the far end), and the height of 1 [m].
    """

    kind: Literal["heightfield"]
    file: Annotated[File, AfterValidator(existing_file), AfterValidator(file_within)]
    size: PositiveVector


Surfaces = SurfaceShape | HeightfieldShape

_ObstacleShapes = Annotated[PlaneShape | Solids | Surfaces, Field(discriminator="kind")]
ObstacleShape = Annotated[
    _ObstacleShapes,
    shorthand(
        'a shape such as "sphere", or a table such as { kind = "plane", normal = [0, 0, 1] }',
        _ObstacleShapes | Literal["plane", "sphere", "cylinder", "cone", "cube", "tetrahedron", "pyramid"],
    ),
]


class SpinMotion(Timed):
    """Turns about an axis through ``centre`` (the obstacle's position if not given) at ``rate`` [rad/s]."""

    kind: Literal["spin"]
    axis: Direction = (0.0, 0.0, 1.0)
    rate: Finite
    centre: Vector | None = None  # [m]


class VibrateMotion(Timed):
    """Swings by ``amplitude`` [m] to both sides along ``direction``, ``frequency`` times a second."""

    kind: Literal["vibrate"]
    direction: Direction = (0.0, 0.0, 1.0)
    amplitude: NotNegative
    frequency: Positive  # [Hz]
    phase: Finite = 0.0  # when it begins [degrees]: at 0 in the middle, going ahead


class TranslateMotion(Timed):
    """Goes on at ``velocity`` [m/s]."""

    kind: Literal["translate"]
    velocity: Vector


class MotionKey(Model):
    """Where an obstacle is at one time."""

    time: NotNegative  # [s]
    position: Vector | None = None  # [m]; as at the key before if not given, and at first that of the obstacle
    orientation: Orientation | None = None  # likewise


class KeysMotion(Model):
    """From key to key: it sets off gently and arrives gently, and turns evenly. At rest before the first and the last.

    Between two keys it is as far as t - sin(2 pi t) / (2 pi) of the way, t being the part of the time.
    """

    kind: Literal["keys"]
    keys: Annotated[list[MotionKey], Field(min_length=1), AfterValidator(in_time)]


Motion = Annotated[SpinMotion | VibrateMotion | TranslateMotion | KeysMotion, Field(discriminator="kind")]


class Obstacle(Surface):
    """A body that nothing can push.

    Like a group's, its surface is as the world says where it does not.
    """

    name: Text | None = None
    shape: ObstacleShape
    size: Positive = 1.0  # factor on the shape
    position: Vector = (0.0, 0.0, 0.0)  # of its centroid, a point of the plane, or the origin of a mesh [m]
    orientation: Orientation = (1.0, 0.0, 0.0, 0.0)
    colour: Colour = "#8899aa"
    opacity: Fraction = 1.0  # 0 is not drawn
    motion: Motion | None = None
    surface_velocity: Vector | None = None  # of a conveyor, world axes, felt by friction [m/s]
