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

from particlesim.core.constants import MAX_PARTS, UNITS
from particlesim.core.polyhedra import POLYHEDRA
from particlesim.scene.base import (
    MAX_COUNT,
    File,
    Flag,
    Model,
    NotNegative,
    Positive,
    PositiveVector,
    Text,
    Vector,
    mesh_file,
    shorthand,
    whole,
)
from particlesim.scene.colours import COLOUR_WORDS, GroupColour
from particlesim.scene.messages import must_be, one_of
from particlesim.scene.placements import AnyOrientation, ListPlacement, Orientation, Placement, RandomPlacement
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
    length: Positive = Field(description="distance of the centres of its half spheres, times the size [m]")


Rounding = NotNegative
_ROUNDING = "all within this distance of it belong to it, times the size: a cube with 0.1 is 1.2 wide [m]"


class PolyhedronShape(Model):
    """A polyhedron of edge 1, times the size."""

    kind: _PolyhedronName
    rounding: Rounding = Field(default=0.0, description=_ROUNDING)


class CylinderShape(Model):
    """A cylinder of diameter 1 and the given length, along z, times the size; a prism of 64 sides."""

    kind: Literal["cylinder"]
    length: Positive = Field(default=1.0, description="along z, times the size [m]")
    rounding: Rounding = Field(default=0.0, description=_ROUNDING)


class ConeShape(Model):
    """A cone on a base of diameter 1 and with the given height, along z, times the size; of 64 sides."""

    kind: Literal["cone"]
    height: Positive = Field(default=1.0, description="along z, times the size [m]")
    rounding: Rounding = Field(default=0.0, description=_ROUNDING)


class BoxShape(Model):
    """A box with the given edges, times the size."""

    kind: Literal["box"]
    edges: PositiveVector = Field(description="along x, y and z, times the size [m]")
    rounding: Rounding = Field(default=0.0, description=_ROUNDING)


class PyramidShape(Model):
    """A pyramid on a square base of edge 1 and with the given height, times the size."""

    kind: Literal["pyramid"]
    height: Positive = Field(default=1.0, description="along z, times the size [m]")
    rounding: Rounding = Field(default=0.0, description=_ROUNDING)


# What the numbers of a mesh file are in, which the file does not say.
_AnyUnit: Any = Literal.__getitem__(tuple(UNITS))
Unit = Annotated[_AnyUnit, one_of(*UNITS)]


class MeshShape(Model):
    """The convex hull of an STL, OBJ or PLY file, or convex parts of it, times the size.

    Paths start at the scene file's folder.
    """

    kind: Literal["mesh"]
    file: Annotated[File, AfterValidator(mesh_file)] = Field(description="path within the scene's folder")
    unit: Unit = Field(default="m", description="of the numbers in the file")
    rounding: Rounding = Field(default=0.0, description=_ROUNDING)
    decompose: Flag = Field(default=False, description="a compound of convex parts, not the hull; needs coacd")

    @model_validator(mode="after")
    def _hull_or_parts(self) -> MeshShape:
        if self.decompose and self.rounding:
            raise ValueError("rounding does not go with decompose")
        return self


Solids = SphereShape | CapsuleShape | CylinderShape | ConeShape | PolyhedronShape | BoxShape | PyramidShape
Convex = Solids | MeshShape
_WORDS = 'a shape such as "sphere", or a table such as { kind = "box", edges = [1, 2, 3] }'


def _or_word(kinds: Any) -> BeforeValidator:
    """Read a word as the kind of a shape that has no other keys."""
    return shorthand(_WORDS, kinds | Literal["sphere", "cylinder", "cone", "pyramid"] | _PolyhedronName)


_Convex = Annotated[Convex, Field(discriminator="kind")]


class Part(Model):
    """One of the shapes that a compound consists of."""

    shape: Annotated[_Convex, _or_word(_Convex)] = Field(description="convex, at size 1")
    size: Positive = Field(default=1.0, description="factor on the shape, times that of the particle")
    position: Vector = Field(default=(0.0, 0.0, 0.0), description="of its centroid, times the size of the particle [m]")
    orientation: Orientation = Field(default=(1.0, 0.0, 0.0, 0.0), description="how it is turned")


def _enough(parts: list[Part]) -> list[Part]:
    if not 1 <= len(parts) <= MAX_PARTS:
        raise ValueError(f"must be 1 to {MAX_PARTS} parts, not {len(parts)}")
    return parts


class CompoundShape(Model):
    """Several convex shapes as one body, which need not be convex, times the size. Its position is its centroid.

    Mass and inertia are sums over the parts: where two overlap, both are there.
    """

    kind: Literal["compound"]
    parts: Annotated[list[Part], AfterValidator(_enough)] = Field(
        description=f"where each of them is, in axes of the compound; 1 to {MAX_PARTS}"
    )


Shapes = Convex | CompoundShape
_Shapes = Annotated[Shapes, Field(discriminator="kind")]
AnyShape = Annotated[_Shapes, _or_word(_Shapes)]


class FixedSize(Model):
    """Every particle has this size."""

    kind: Literal["fixed"]
    value: Positive = Field(description="factor on the shape")


class RangeSize(Model):
    """Sizes between low and high, evenly spread (``uniform``) or evenly spread in their logarithm."""

    kind: Literal["uniform", "log-uniform"]
    low: Positive = Field(description="smallest")
    high: Positive = Field(description="largest")

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
    temperature: NotNegative = Field(description="Boltzmann's constant is 1 [J]")
    drift: Vector = Field(default=(0.0, 0.0, 0.0), description="added to all [m/s]")


class UniformSpeed(Model):
    """The same speed [m/s] in directions drawn evenly, plus drift."""

    kind: Literal["uniform"]
    speed: NotNegative = Field(description="of all [m/s]")
    drift: Vector = Field(default=(0.0, 0.0, 0.0), description="added to all [m/s]")


class FixedVelocity(Model):
    """The same velocity [m/s] for all."""

    kind: Literal["fixed"]
    vector: Vector = Field(description="of all: a velocity [m/s] or a spin [rad/s]")


class RadialVelocity(Model):
    """Away from the centre or towards it at ``speed`` [m/s]."""

    kind: Literal["outward", "inward"]
    speed: NotNegative = Field(description="of all [m/s]")
    centre: Vector = Field(default=(0.0, 0.0, 0.0), description="where from or to [m]")


class SpinMaxwell(Model):
    """Angular momenta of thermal equilibrium at ``temperature`` [J]."""

    kind: Literal["maxwell"]
    temperature: NotNegative = Field(description="Boltzmann's constant is 1 [J]")


class SpinUniform(Model):
    """The same angular speed [rad/s] about axes drawn evenly."""

    kind: Literal["uniform"]
    speed: NotNegative = Field(description="of all [rad/s]")


_VECTOR_OR_TABLE = 'a list of 3 numbers, [x, y, z], or a table such as { kind = "maxwell", temperature = 1 }'
_Velocities = Annotated[Rest | Maxwell | UniformSpeed | FixedVelocity | RadialVelocity, Field(discriminator="kind")]
_Spins = Annotated[Rest | SpinMaxwell | SpinUniform | FixedVelocity, Field(discriminator="kind")]


def _or_vector(kinds: Any) -> BeforeValidator:
    """Read a list of three numbers as the fixed one of these kinds."""
    bare = (list, tuple, np.ndarray)
    return shorthand(_VECTOR_OR_TABLE, kinds | Vector | Literal["rest"], bare=bare, table=("fixed", "vector"))


Velocity = Annotated[_Velocities, _or_vector(_Velocities)]
Spin = Annotated[_Spins, _or_vector(_Spins)]


class Group(Surface):
    """Particles of one shape, one law of sizes, one surface and one start.

    The world says how the surface is where the group does not; a pair takes the smaller of its two values.
    """

    name: Text | None = Field(default=None, description="for contacts, legends and messages")
    shape: AnyShape = Field(description="of all of them, at size 1")
    count: (
        Annotated[int, Field(ge=0, le=MAX_COUNT), whole, must_be(f"a whole number from 0 to {MAX_COUNT:,}")] | None
    ) = Field(default=None, description="how many; of a list of poses as many as it has")
    size: Size = Field(default_factory=lambda: FixedSize(kind="fixed", value=1.0), description="factor on the shape")
    density: Positive | None = Field(default=None, description="1000 if neither it nor the mass is given [kg/m^3]")
    mass: Positive | None = Field(default=None, description="of each, in place of a density [kg]")
    placement: Placement = Field(default_factory=lambda: RandomPlacement(kind="random"), description="where they start")
    orientation: AnyOrientation = Field(default="random", description="how they are turned at first")
    velocity: Velocity = Field(default_factory=lambda: Rest(kind="rest"), description="how they move at first [m/s]")
    spin: Spin = Field(default_factory=lambda: Rest(kind="rest"), description="how they turn at first [rad/s]")
    colour: GroupColour = Field(default="by_shape", description=COLOUR_WORDS)

    @model_validator(mode="after")
    def _consistent(self) -> Group:
        if self.density is not None and self.mass is not None:
            raise ValueError("give density or mass, not both")
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
