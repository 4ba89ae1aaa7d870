"""Groups of particles: shape, size, where they start and how they move."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import (
    AfterValidator,
    BeforeValidator,
    Field,
    model_validator,
)

from particlesim.core.constants import UNITS
from particlesim.core.polyhedra import POLYHEDRA
from particlesim.scene.base import (
    MAX_COUNT,
    File,
    Model,
    NotNegative,
    Number,
    Positive,
    PositiveVector,
    Text,
    Vector,
    colour_or,
    mesh_file,
    shorthand,
    whole,
)
from particlesim.scene.messages import listed, must_be, one_of
from particlesim.scene.placements import AnyOrientation, ListPlacement, Placement, RandomPlacement
from particlesim.scene.surface import Surface

# The scene file names polyhedra without parameters as core.polyhedra does.
_PolyhedronName: Any = Literal.__getitem__(tuple(POLYHEDRA))


class SphereShape(Model):
    """A sphere of diameter 1, times the size."""

    kind: Literal["sphere"]


class CapsuleShape(Model):
    """All points within 0.5 of a segment along z, times the size; ``length`` is that of the segment.

    So the capsule is a cylinder of diameter 1 between two half spheres whose centres are ``length`` apart.
    """

    kind: Literal["capsule"]
    length: Positive


# A rounded polyhedron is all points within this distance of it, times the size: a cube with rounding 0.1 is 1.2 wide.
Rounding = NotNegative


class PolyhedronShape(Model):
    """A polyhedron of edge 1, times the size."""

    kind: _PolyhedronName
    rounding: Rounding = 0.0


class CylinderShape(Model):
    """A cylinder of diameter 1 and the given length, along z, times the size; a prism of 64 sides."""

    kind: Literal["cylinder"]
    length: Positive = 1.0
    rounding: Rounding = 0.0


class ConeShape(Model):
    """A cone on a base of diameter 1 and with the given height, along z, times the size; of 64 sides."""

    kind: Literal["cone"]
    height: Positive = 1.0
    rounding: Rounding = 0.0


class BoxShape(Model):
    """A box with the given edges, times the size."""

    kind: Literal["box"]
    edges: PositiveVector
    rounding: Rounding = 0.0


class PyramidShape(Model):
    """A pyramid on a square base of edge 1 and with the given height, times the size."""

    kind: Literal["pyramid"]
    height: Positive = 1.0
    rounding: Rounding = 0.0


# What the numbers of a mesh file are in, which the file does not say.
_AnyUnit: Any = Literal.__getitem__(tuple(UNITS))
Unit = Annotated[_AnyUnit, one_of(*UNITS)]


class MeshShape(Model):
    """The convex hull of an STL, OBJ or PLY file, times the size. Paths start at the scene file's folder."""

    kind: Literal["mesh"]
    file: Annotated[File, AfterValidator(mesh_file)]
    unit: Unit = "m"
    rounding: Rounding = 0.0


Solids = SphereShape | CapsuleShape | CylinderShape | ConeShape | PolyhedronShape | BoxShape | PyramidShape
Shapes = Solids | MeshShape
_Shapes = Annotated[Shapes, Field(discriminator="kind")]
AnyShape = Annotated[
    _Shapes,
    shorthand(
        'a shape such as "sphere", or a table such as { kind = "box", edges = [1, 2, 3] }',
        _Shapes | Literal["sphere", "cylinder", "cone", "pyramid"] | _PolyhedronName,
    ),
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
            raise ValueError(f"low must not be above high, but {self.low:g} is above {self.high:g}")
        return self


_Sizes = Annotated[FixedSize | RangeSize, Field(discriminator="kind")]
Size = Annotated[
    _Sizes,
    shorthand(
        'a number above 0, or a table such as { kind = "uniform", low = 0.1, high = 0.2 }',
        _Sizes | Positive,
        bare=(int, float, np.number),
        table=("fixed", "value"),
        text=False,
    ),
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


_VECTOR_OR_TABLE = 'a list of 3 numbers, [x, y, z], or a table such as { kind = "maxwell", temperature = 1 }'
_Velocities = Annotated[Rest | Maxwell | UniformSpeed | FixedVelocity | RadialVelocity, Field(discriminator="kind")]
_Spins = Annotated[Rest | SpinMaxwell | SpinUniform | FixedVelocity, Field(discriminator="kind")]


def _or_vector(kinds: Any) -> BeforeValidator:
    """Read a list of three numbers as the fixed one of these kinds."""
    bare = (list, tuple, np.ndarray)
    return shorthand(_VECTOR_OR_TABLE, kinds | Vector | Literal["rest"], bare=bare, table=("fixed", "vector"))


Velocity = Annotated[_Velocities, _or_vector(_Velocities)]
Spin = Annotated[_Spins, _or_vector(_Spins)]


# Colours that stand for a quantity.
FIELDS = "by_speed", "by_height", "by_size", "by_impacts"


def _rising(value: tuple[float, float]) -> tuple[float, float]:
    if value[0] >= value[1]:
        raise ValueError("does not rise")
    return value


Range = Annotated[tuple[Number, Number], AfterValidator(_rising), must_be("[low, high], two numbers, low below high")]


class Group(Surface):
    """Particles of one shape, one law of sizes, one surface and one start.

    The world says how the surface is where the group does not; a pair takes the smaller of its two values.
    """

    name: Text | None = None
    shape: AnyShape
    count: (
        Annotated[int, Field(ge=0, le=MAX_COUNT), whole, must_be(f"a whole number from 0 to {MAX_COUNT:,}")] | None
    ) = None
    size: Size = Field(default_factory=lambda: FixedSize(kind="fixed", value=1.0))
    density: Positive | None = None  # [kg/m^3]; 1000 if neither it nor the mass is given
    mass: Positive | None = None  # [kg]
    placement: Placement = Field(default_factory=lambda: RandomPlacement(kind="random"))
    orientation: AnyOrientation = "random"
    velocity: Velocity = Field(default_factory=lambda: Rest(kind="rest"))
    spin: Spin = Field(default_factory=lambda: Rest(kind="rest"))
    colour: Annotated[Text, colour_or("by_shape", "by_group", *FIELDS)] = "by_shape"
    colour_range: Range | None = None  # of the field's scale; settled by the run if not given

    @model_validator(mode="after")
    def _consistent(self) -> Group:
        if self.density is not None and self.mass is not None:
            raise ValueError("give density or mass, not both")
        if self.colour_range is not None and self.colour not in FIELDS:
            raise ValueError(f"colour_range goes with the colours {listed(FIELDS)}")
        if isinstance(self.placement, ListPlacement):
            there = len(self.placement.poses)
            if self.count is not None and self.count != there:
                raise ValueError(f"count is {self.count}, but there are {there} in poses")
        elif self.count is None:
            raise ValueError("the key 'count' is missing")
        return self

    @property
    def number(self) -> int:
        """How many particles the group has."""
        return len(self.placement.poses) if isinstance(self.placement, ListPlacement) else int(self.count or 0)
