"""Fields of force that act on particles wherever they are, or in a region."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from particlesim.scene.base import Finite, Model, NotNegative, Positive, Vector
from particlesim.scene.placements import Region, not_zero


class _InRegion(Model):
    """A field in a region, everywhere if none is given."""

    region: Region | None = Field(default=None, description="where it acts; everywhere if not given")


class UniformField(_InRegion):
    """The same acceleration everywhere [m/s^2]."""

    kind: Literal["uniform"]
    acceleration: Vector = Field(description="of every particle [m/s^2]")


class CentralField(_InRegion):
    """An acceleration towards a centre, ``strength`` [m/s^2] at 1 m, that goes with a power of the distance r [m].

    With a softening s [m], r is (r^2 + s^2)^(1/2), and the acceleration is less by the ratio of both.
    """

    kind: Literal["central"]
    centre: Vector = Field(default=(0.0, 0.0, 0.0), description="where it pulls to [m]")
    strength: Finite = Field(description="acceleration at 1 m; negative pushes away [m/s^2]")
    exponent: Finite = Field(default=-2.0, description="of the distance")
    softening: NotNegative = Field(default=0.0, description="length that keeps it finite at the centre [m]")


class VortexField(_InRegion):
    """An acceleration round an axis through the centre, ``strength`` [1/s^2] times the distance from it."""

    kind: Literal["vortex"]
    centre: Vector = Field(default=(0.0, 0.0, 0.0), description="a point of the axis [m]")
    axis: Annotated[Vector, AfterValidator(not_zero)] = Field(
        default=(0.0, 0.0, 1.0), description="direction of the axis"
    )
    strength: Finite = Field(description="acceleration for each metre from the axis [1/s^2]")


class DragField(_InRegion):
    """A force against the velocity through a medium, ``coefficient`` [kg/s] times it."""

    kind: Literal["drag"]
    coefficient: Positive = Field(description="force for each m/s [kg/s]")
    velocity: Vector = Field(default=(0.0, 0.0, 0.0), description="of the medium [m/s]")


ForceField = Annotated[UniformField | CentralField | VortexField | DragField, Field(discriminator="kind")]
