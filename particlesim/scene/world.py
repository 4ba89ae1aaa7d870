"""The space the particles move in and the method by which their motion is computed."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from particlesim.scene.base import Fraction, Model, Positive, PositiveVector, Vector, shorthand

Boundary = Literal["wall", "periodic", "open"]


class World(Model):
    """A box of ``size`` [m] about the origin."""

    size: PositiveVector
    boundary: Annotated[
        tuple[Boundary, Boundary, Boundary],
        BeforeValidator(lambda value: (value,) * 3 if isinstance(value, str) else value),
    ] = ("wall", "wall", "wall")
    gravity: Vector = (0.0, 0.0, 0.0)  # [m/s^2]
    restitution: Fraction = 1.0


class Naive(Model):
    """Every pair: the reference."""

    kind: Literal["naive"]


class Grid(Model):
    """A uniform grid of ``cells`` x ``cells`` x ``cells`` boxes; from number and sizes of particles if not given."""

    kind: Literal["grid"]
    cells: Annotated[int, Field(ge=1, le=1024)] | None = None


class Octree(Model):
    """Nodes split while they hold more than ``max_count`` particles, down to ``max_depth``."""

    kind: Literal["octree"]
    max_count: Annotated[int, Field(ge=1)] = 16
    max_depth: Annotated[int, Field(ge=1, le=20)] = 16


class Solver(Model):
    """How the motion is computed. None of it changes which pairs meet."""

    broad_phase: Annotated[Naive | Grid | Octree, Field(discriminator="kind"), shorthand("", None, str)] = Field(
        default_factory=lambda: Octree(kind="octree")
    )
    time_step: Literal["auto"] | Positive = "auto"  # [s]
