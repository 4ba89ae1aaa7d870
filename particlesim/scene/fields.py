"""Fields of force that act on particles wherever they are, or in a region."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from particlesim.scene.base import Finite, Model, NotNegative, Positive, Vector
from particlesim.scene.placements import Region, not_zero


class _InRegion(Model):
    """A field in a region, everywhere if none is given."""

    region: Region | None = None


class UniformField(_InRegion):
    """The same acceleration everywhere [m/s^2]."""

    kind: Literal["uniform"]
    acceleration: Vector


class CentralField(_InRegion):
    """An acceleration towards a centre, ``strength`` [m/s^2] at 1 m, that goes with a power of the distance r [m].

    With a softening s [m], r is (r^2 + s^2)^(1/2), and the acceleration is less by the ratio of both.
    """

    kind: Literal["central"]
    centre: Vector = (0.0, 0.0, 0.0)
    strength: Finite
    exponent: Finite = -2.0
    softening: NotNegative = 0.0


class VortexField(_InRegion):
    """An acceleration round an axis through the centre, ``strength`` [1/s^2] times the distance from it."""

    kind: Literal["vortex"]
    centre: Vector = (0.0, 0.0, 0.0)
    axis: Annotated[Vector, AfterValidator(not_zero)] = (0.0, 0.0, 1.0)
    strength: Finite


class DragField(_InRegion):
    """A force against the velocity through a medium, ``coefficient`` [kg/s] times it."""

    kind: Literal["drag"]
    coefficient: Positive
    velocity: Vector = (0.0, 0.0, 0.0)  # of the medium [m/s]


ForceField = Annotated[UniformField | CentralField | VortexField | DragField, Field(discriminator="kind")]
