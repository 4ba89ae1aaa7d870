"""The space the particles move in and the method by which their motion is computed."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from particlesim.scene.base import (
    Fraction,
    Model,
    NotNegative,
    PositiveNumber,
    PositiveVector,
    Vector,
    shorthand,
    whole,
)
from particlesim.scene.messages import hint, listed, must_be
from particlesim.scene.surface import HasSurface, TangentialRestitution

Boundary = Literal["wall", "periodic", "open"]
_BOUNDARIES = "wall", "periodic", "open"


def _for_each_axis(value: Any) -> Any:
    """One word for all axes, or a list of three. ValueError that names the word that is none."""
    words = (value,) * 3 if isinstance(value, str) else value
    if not isinstance(words, list | tuple) or len(words) != 3:
        raise ValueError(f"must be {listed(_BOUNDARIES)}, or a list of 3 of them, for x, y and z")
    for word in words:
        if word not in _BOUNDARIES:
            meant = hint(word, _BOUNDARIES) if isinstance(word, str) else ""
            raise ValueError(f"must be {listed(_BOUNDARIES)}, or a list of 3 of them{meant}")
    return words


class World(HasSurface):
    """A box of ``size`` [m] about the origin."""

    size: PositiveVector = Field(description="edges of the box, about the origin [m]")
    boundary: Annotated[
        tuple[Boundary, Boundary, Boundary],
        BeforeValidator(_for_each_axis, json_schema_input_type=Boundary | tuple[Boundary, Boundary, Boundary]),
    ] = Field(default=("wall", "wall", "wall"), description="what ends it along x, y and z, or one word for all")
    gravity: Vector = Field(default=(0.0, 0.0, 0.0), description="acceleration of all particles [m/s^2]")
    restitution: Fraction = Field(default=1.0, description="part of the speed that an impact gives back")
    friction: NotNegative = Field(default=0.0, description="Coulomb's coefficient while surfaces slide")
    static_friction: NotNegative | None = Field(
        default=None, description="and until they do; the friction if not given"
    )
    rolling_friction: NotNegative = Field(
        default=0.0, description="the torque is at most this times the normal force [m]"
    )
    tangential_restitution: TangentialRestitution = Field(
        default=0.0, description="part of the sliding that impacts which stick give back, Walton's beta_0"
    )

    @property
    def period(self) -> tuple[float, float, float]:
        """Edges of the periodic axes [m], 0 of the others."""
        x, y, z = (edge if kind == "periodic" else 0.0 for edge, kind in zip(self.size, self.boundary, strict=True))
        return x, y, z


class Naive(Model):
    """Every pair: the reference."""

    kind: Literal["naive"]


class Grid(Model):
    """A uniform grid of ``cells`` x ``cells`` x ``cells`` boxes; from number and sizes of particles if not given."""

    kind: Literal["grid"]
    cells: Annotated[int, Field(ge=1, le=1024), whole, must_be("a whole number from 1 to 1024")] | None = Field(
        default=None, description="along each axis; from number and sizes of particles if not given"
    )


class Octree(Model):
    """Nodes split while they hold more than ``max_count`` particles, down to ``max_depth``."""

    kind: Literal["octree"]
    max_count: Annotated[int, Field(ge=1, le=1_000_000), whole, must_be("a whole number from 1 to 1,000,000")] = Field(
        default=32, description="particles that a node holds undivided"
    )
    max_depth: Annotated[int, Field(ge=1, le=20), whole, must_be("a whole number from 1 to 20")] = Field(
        default=16, description="levels of nodes"
    )


_BroadPhases = Annotated[Naive | Grid | Octree, Field(discriminator="kind")]


class Solver(Model):
    """How the motion is computed. None of it changes which pairs collide."""

    broad_phase: Annotated[
        _BroadPhases,
        shorthand(
            '"octree", "grid", "naive", or a table such as { kind = "grid", cells = 32 }',
            _BroadPhases | Literal["octree", "grid", "naive"],
        ),
    ] = Field(default_factory=lambda: Octree(kind="octree"), description="how pairs that may collide are found")
    time_step: Annotated[Literal["auto"] | PositiveNumber, must_be("'auto' or a number of seconds above 0")] = Field(
        default="auto",
        description="how much is computed at once; no impact is missed, and no overlap larger, whatever it is [s]",
    )
