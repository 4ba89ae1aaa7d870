"""Groups of particles: shape, size, where they start and how they move."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, model_validator

from particlesim.scene.base import (
    Colour,
    Finite,
    Fraction,
    Model,
    NotNegative,
    Positive,
    PositiveVector,
    Quaternion,
    Vector,
    shorthand,
)


class PlainShape(Model):
    """A shape with nothing to choose: a sphere of diameter 1, a cube or a tetrahedron of edge 1, times the size."""

    kind: Literal["sphere", "cube", "tetrahedron"]


class BoxShape(Model):
    """A box with the given edges, times the size."""

    kind: Literal["box"]
    edges: PositiveVector


class PyramidShape(Model):
    """A pyramid on a square base of edge 1 and with the given height, times the size."""

    kind: Literal["pyramid"]
    height: Positive = 1.0


class MeshShape(Model):
    """The convex hull of an STL, OBJ or PLY file, times the size. Paths start at the scene file's folder."""

    kind: Literal["mesh"]
    file: Path


AnyShape = Annotated[
    PlainShape | BoxShape | PyramidShape | MeshShape,
    Field(discriminator="kind"),
    shorthand("", None, str),
]


class FixedSize(Model):
    """Every particle has this size."""

    kind: Literal["fixed"]
    value: Positive


class RangeSize(Model):
    """Sizes between low and high, evenly spread (``uniform``) or evenly spread in their logarithm."""

    kind: Literal["uniform", "log-uniform"]
    low: Positive
    high: Positive

    @model_validator(mode="after")
    def _ordered(self) -> RangeSize:
        if self.high < self.low:
            raise ValueError(f"low must not be above high, here {self.low:g} and {self.high:g}")
        return self


Size = Annotated[FixedSize | RangeSize, Field(discriminator="kind"), shorthand("fixed", "value", int, float)]


class Region(Model):
    """A part of the world, from one corner to the opposite one [m]."""

    lower: Vector
    upper: Vector

    @model_validator(mode="after")
    def _ordered(self) -> Region:
        if any(a >= b for a, b in zip(self.lower, self.upper, strict=True)):
            raise ValueError("every coordinate of lower must be below that of upper")
        return self


class RandomPlacement(Model):
    """Anywhere in the region (the whole world if not given) without overlap."""

    kind: Literal["random"]
    region: Region | None = None


class LatticePlacement(Model):
    """On a simple cubic lattice centred in the region; jitter moves particles by that fraction of the free gap."""

    kind: Literal["lattice"]
    spacing: Positive | None = None  # [m]; the widest that holds the count if not given
    jitter: Fraction = 0.0
    region: Region | None = None


class ClusterPlacement(Model):
    """In Gaussian blobs of standard deviation ``spread`` [m] about given or random centres, without overlap."""

    kind: Literal["cluster"]
    clusters: Annotated[int, Field(ge=1)] = 1
    spread: Positive
    centres: list[Vector] | None = None
    region: Region | None = None

    @model_validator(mode="after")
    def _counted(self) -> ClusterPlacement:
        if self.centres is not None:
            if "clusters" in self.model_fields_set and self.clusters != len(self.centres):
                raise ValueError(f"clusters is {self.clusters} but there are {len(self.centres)} centres")
            if not self.centres:
                raise ValueError("centres must name at least one point")
        return self


class Turn(Model):
    """A rotation by ``angle`` [degrees] about ``axis``."""

    axis: Vector
    angle: Finite

    @model_validator(mode="after")
    def _axis(self) -> Turn:
        if not any(self.axis):
            raise ValueError("axis must not be zero")
        return self


def _not_zero(value: Quaternion) -> Quaternion:
    if not any(value):
        raise ValueError("four numbers (w, x, y, z), not all zero")
    return value


Orientation = Annotated[Quaternion, AfterValidator(_not_zero)] | Turn


class Pose(Model):
    """One particle of a ``list``: velocity [m/s] and spin [rad/s] override those of its group."""

    position: Vector
    orientation: Orientation = (1.0, 0.0, 0.0, 0.0)
    velocity: Vector | None = None
    spin: Vector | None = None


class ListPlacement(Model):
    """Exactly here."""

    kind: Literal["list"]
    poses: Annotated[list[Pose], Field(min_length=1)]


Placement = Annotated[
    RandomPlacement | LatticePlacement | ClusterPlacement | ListPlacement,
    Field(discriminator="kind"),
    shorthand("", None, str),
]


class Rest(Model):
    """No motion."""

    kind: Literal["rest"]


class Maxwell(Model):
    """The Maxwell-Boltzmann distribution at ``temperature`` [J, so that Boltzmann's constant is 1], plus drift."""

    kind: Literal["maxwell"]
    temperature: NotNegative
    drift: Vector = (0.0, 0.0, 0.0)


class UniformSpeed(Model):
    """The same speed [m/s] in directions drawn evenly, plus drift."""

    kind: Literal["uniform"]
    speed: NotNegative
    drift: Vector = (0.0, 0.0, 0.0)


class FixedVelocity(Model):
    """The same velocity [m/s] for all."""

    kind: Literal["fixed"]
    vector: Vector


class RadialVelocity(Model):
    """Away from the centre or towards it at ``speed`` [m/s]."""

    kind: Literal["outward", "inward"]
    speed: NotNegative
    centre: Vector = (0.0, 0.0, 0.0)


class SpinMaxwell(Model):
    """Angular momenta of thermal equilibrium at ``temperature`` [J]."""

    kind: Literal["maxwell"]
    temperature: NotNegative


class SpinUniform(Model):
    """The same angular speed [rad/s] about axes drawn evenly."""

    kind: Literal["uniform"]
    speed: NotNegative


Velocity = Annotated[
    Rest | Maxwell | UniformSpeed | FixedVelocity | RadialVelocity,
    Field(discriminator="kind"),
    shorthand("fixed", "vector", list, tuple),
]
Spin = Annotated[
    Rest | SpinMaxwell | SpinUniform | FixedVelocity,
    Field(discriminator="kind"),
    shorthand("fixed", "vector", list, tuple),
]


class Group(Model):
    """Particles of one shape, one law of sizes and one start."""

    name: str | None = None
    shape: AnyShape
    count: Annotated[int, Field(ge=0)] | None = None
    size: Size = Field(default_factory=lambda: FixedSize(kind="fixed", value=1.0))
    density: Positive | None = None  # [kg/m^3]; 1000 if neither it nor the mass is given
    mass: Positive | None = None  # [kg]
    restitution: Fraction | None = None  # the world's if not given; a pair takes the smaller of its two
    placement: Placement = Field(default_factory=lambda: RandomPlacement(kind="random"))
    orientation: Literal["random", "aligned"] | Orientation = "random"
    velocity: Velocity = Field(default_factory=lambda: Rest(kind="rest"))
    spin: Spin = Field(default_factory=lambda: Rest(kind="rest"))
    colour: Literal["by_shape", "by_group", "by_speed"] | Colour = "by_shape"

    @model_validator(mode="after")
    def _consistent(self) -> Group:
        if self.density is not None and self.mass is not None:
            raise ValueError("give density or mass, not both")
        if isinstance(self.placement, ListPlacement):
            listed = len(self.placement.poses)
            if self.count is not None and self.count != listed:
                raise ValueError(f"count is {self.count} but the list has {listed} poses")
        elif self.count is None:
            raise ValueError("count is missing")
        return self

    @property
    def number(self) -> int:
        """How many particles the group has."""
        return len(self.placement.poses) if isinstance(self.placement, ListPlacement) else int(self.count or 0)
