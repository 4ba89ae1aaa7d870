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

    size: PositiveVector
    boundary: Annotated[
        tuple[Boundary, Boundary, Boundary],
        BeforeValidator(_for_each_axis, json_schema_input_type=Boundary | tuple[Boundary, Boundary, Boundary]),
    ] = ("wall", "wall", "wall")
    gravity: Vector = (0.0, 0.0, 0.0)  # [m/s^2]
    restitution: Fraction = 1.0
    friction: NotNegative = 0.0  # Coulomb's coefficient while surfaces slide
    static_friction: NotNegative | None = None  # and until they do; the friction if not given
    rolling_friction: NotNegative = 0.0  # [m]; the torque is at most this times the normal force
    tangential_restitution: TangentialRestitution = 0.0  # of impacts that stick, Walton's beta_0

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
    cells: Annotated[int, Field(ge=1, le=1024), whole, must_be("a whole number from 1 to 1024")] | None = None


class Octree(Model):
    """Nodes split while they hold more than ``max_count`` particles, down to ``max_depth``."""

    kind: Literal["octree"]
    max_count: Annotated[int, Field(ge=1, le=1_000_000), whole, must_be("a whole number from 1 to 1,000,000")] = 32
    max_depth: Annotated[int, Field(ge=1, le=20), whole, must_be("a whole number from 1 to 20")] = 16


_BroadPhases = Annotated[Naive | Grid | Octree, Field(discriminator="kind")]


class Solver(Model):
    """How the motion is computed. None of it changes which pairs collide."""

    broad_phase: Annotated[
        _BroadPhases,
        shorthand(
            '"octree", "grid", "naive", or a table such as { kind = "grid", cells = 32 }',
            _BroadPhases | Literal["octree", "grid", "naive"],
        ),
    ] = Field(default_factory=lambda: Octree(kind="octree"))
    time_step: Annotated[Literal["auto"] | PositiveNumber, must_be("'auto' or a number of seconds above 0")] = (
        "auto"  # [s]
    )
