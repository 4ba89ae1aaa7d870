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
    in_time,
    mesh_file,
    shorthand,
)
from particlesim.scene.groups import CompoundShape, Solids, Unit
from particlesim.scene.placements import Orientation, not_zero
from particlesim.scene.surface import Surface

Direction = Annotated[Vector, AfterValidator(not_zero)]


class PlaneShape(Model):
    """All that is behind a plane through the position, without end; the normal points out of it."""

    kind: Literal["plane"]
    normal: Direction = Field(default=(0.0, 0.0, 1.0), description="points out of it")


class SurfaceShape(Model):
    """The triangles of an STL, OBJ or PLY file as they are, open or closed, times ``scale``; they have two sides.

    Its position is where the origin of the file is.
    """

    kind: Literal["mesh"]
    file: Annotated[File, AfterValidator(mesh_file)] = Field(description="path within the scene's folder")
    unit: Unit = Field(default="m", description="of the numbers in the file")
    scale: Positive = Field(default=1.0, description="factor on the numbers in the file")


class HeightfieldShape(Model):
    """Heights on a grid, from a numpy array (.npy) or a picture (.png, black is 0 and white is 1), about its middle."""

    kind: Literal["heightfield"]
    file: Annotated[File, AfterValidator(existing_file)] = Field(description="path within the scene's folder")
    size: PositiveVector = Field(
        description="how far it goes along x (columns) and y (rows, the first at the far end), and the height of 1 [m]"
    )


Surfaces = SurfaceShape | HeightfieldShape

_ObstacleShapes = Annotated[PlaneShape | Solids | CompoundShape | Surfaces, Field(discriminator="kind")]
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
    axis: Direction = Field(default=(0.0, 0.0, 1.0), description="that it turns about")
    rate: Finite = Field(description="angular speed [rad/s]")
    centre: Vector | None = Field(
        default=None, description="a point of the axis; the obstacle's position if not given [m]"
    )


class VibrateMotion(Timed):
    """Swings by ``amplitude`` [m] to both sides along ``direction``, ``frequency`` times a second."""

    kind: Literal["vibrate"]
    direction: Direction = Field(default=(0.0, 0.0, 1.0), description="that it swings along")
    amplitude: NotNegative = Field(description="to both sides [m]")
    frequency: Positive = Field(description="swings a second [Hz]")
    phase: Finite = Field(default=0.0, description="that it begins with: at 0 in the middle, going ahead [degrees]")


class TranslateMotion(Timed):
    """Goes on at ``velocity`` [m/s]."""

    kind: Literal["translate"]
    velocity: Vector = Field(description="that it goes on at [m/s]")


class MotionKey(Model):
    """Where an obstacle is at one time."""

    time: NotNegative = Field(description="when it is there [s]")
    position: Vector | None = Field(
        default=None, description="where; as at the key before if not given, and at first as the obstacle says [m]"
    )
    orientation: Orientation | None = Field(default=None, description="how it is turned; likewise")


class KeysMotion(Model):
    """From key to key: it sets off gently and arrives gently, and turns evenly. At rest before the first and the last.

    Between two keys it is as far as t - sin(2 pi t) / (2 pi) of the way, t being the part of the time.
    """

    kind: Literal["keys"]
    keys: Annotated[list[MotionKey], Field(min_length=1), AfterValidator(in_time)] = Field(
        description="where it is, in the order of time"
    )


Motion = Annotated[SpinMotion | VibrateMotion | TranslateMotion | KeysMotion, Field(discriminator="kind")]


class Obstacle(Surface):
    """A body that nothing can push.

    Like a group's, its surface is as the world says where it does not.
    """

    name: Text | None = Field(default=None, description="for contacts and messages")
    shape: ObstacleShape = Field(description="at size 1")
    size: Positive = Field(default=1.0, description="factor on the shape")
    position: Vector = Field(
        default=(0.0, 0.0, 0.0), description="of its centroid, a point of the plane, or the origin of a mesh [m]"
    )
    orientation: Orientation = Field(default=(1.0, 0.0, 0.0, 0.0), description="how it is turned at first")
    colour: Colour = Field(default="#8899aa", description="a colour name or '#rrggbb'")
    opacity: Fraction = Field(default=1.0, description="0 is not drawn")
    motion: Motion | None = Field(default=None, description="stands still if not given")
    surface_velocity: Vector | None = Field(
        default=None, description="of a conveyor, along world axes, felt through friction [m/s]"
    )
