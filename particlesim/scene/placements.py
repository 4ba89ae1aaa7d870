"""Where particles of a group start, and how they are turned."""

from __future__ import annotations

import itertools
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Discriminator, Field, Tag, WithJsonSchema, model_validator

from particlesim.scene.base import (
    MAX_COUNT,
    Finite,
    Fraction,
    Model,
    Number,
    Positive,
    Vector,
    shorthand,
    whole,
)
from particlesim.scene.messages import hint, must_be, one_of


class Region(Model):
    """A part of the world, from one corner to the opposite one [m]: that box, or the ellipsoid that just fits in."""

    lower: Vector = Field(description="corner with the smallest coordinates [m]")
    upper: Vector = Field(description="corner with the largest [m]")
    form: Annotated[Literal["box", "ellipsoid"], one_of("box", "ellipsoid")] = Field(
        default="box", description="the box, or the ellipsoid that just fits in"
    )

    @model_validator(mode="after")
    def _ordered(self) -> Region:
        if any(a >= b for a, b in zip(self.lower, self.upper, strict=True)):
            raise ValueError("every coordinate of lower must be below that of upper")
        return self


class RandomPlacement(Model):
    """Anywhere in the region (the whole world if not given) without overlap."""

    kind: Literal["random"]
    region: Region | None = Field(default=None, description="the whole world if not given")


class LatticePlacement(Model):
    """On a simple cubic lattice centred in the region; jitter moves particles by that fraction of the free gap."""

    kind: Literal["lattice"]
    spacing: Positive | None = Field(default=None, description="the widest that holds the count if not given [m]")
    jitter: Fraction = Field(default=0.0, description="how far each is moved, as a fraction of the free gap")
    region: Region | None = Field(default=None, description="the whole world if not given")


def _leads_on(points: list[Any]) -> list[Any]:
    if len(points) < 2:
        raise ValueError("must be 2 points or more")
    for k, (a, b) in enumerate(itertools.pairwise(points), 1):
        if a == b:
            raise ValueError(f"point {k} is the same as the one before")
    return points


class RowPlacement(Model):
    """At equal distances along a smooth curve through points [m], from the first to the last, each turned with it.

    The curve's direction seen from above becomes the x axis of what is ``"aligned"``, or turned otherwise.
    """

    kind: Literal["row"]
    through: Annotated[list[Vector], AfterValidator(_leads_on)] = Field(description="points of the curve [m]")


class ClusterPlacement(Model):
    """In Gaussian blobs of standard deviation ``spread`` [m] about given or random centres, without overlap."""

    kind: Literal["cluster"]
    clusters: Annotated[int, Field(ge=1, le=MAX_COUNT), whole, must_be("a whole number of 1 or more")] | None = Field(
        default=None, description="how many blobs; as many as there are centres if not given"
    )
    spread: Positive = Field(description="standard deviation [m]")
    centres: Annotated[list[Vector], Field(min_length=1)] | None = Field(
        default=None, description="of the blobs; random if not given [m]"
    )
    region: Region | None = Field(default=None, description="the whole world if not given")

    @model_validator(mode="after")
    def _counted(self) -> ClusterPlacement:
        if None not in (self.centres, self.clusters) and self.clusters != len(self.centres or ()):
            raise ValueError(f"clusters is {self.clusters}, but there are {len(self.centres or ())} in centres")
        return self


def not_zero(value: tuple[float, ...]) -> tuple[float, ...]:
    if not any(value):
        raise ValueError("must not be zero")
    return value


class Turn(Model):
    """A rotation by ``angle`` [degrees] about ``axis``."""

    axis: Annotated[Vector, AfterValidator(not_zero)] = Field(description="that it is turned about")
    angle: Finite = Field(description="by how much [degrees]")


_HOW_TURNED = "[w, x, y, z] (a quaternion), or { axis = [x, y, z], angle = degrees }"
Quaternion = Annotated[tuple[Number, Number, Number, Number], must_be(_HOW_TURNED), AfterValidator(not_zero)]


def _known_word(value: str) -> str:
    words = "random", "aligned"
    if value not in words:
        raise ValueError(f"must be 'random', 'aligned', {_HOW_TURNED}{hint(value, words)}")
    return value


def _form(value: Any) -> str:
    """How an orientation is written. The brackets tell these names from keys."""
    return "(turn)" if isinstance(value, dict | Turn) else "(quaternion)"


def _form_or_word(value: Any) -> str:
    return "(word)" if isinstance(value, str) else _form(value)


_Given = Annotated[Quaternion, Tag("(quaternion)")] | Annotated[Turn, Tag("(turn)")]
_Word = Annotated[str, AfterValidator(_known_word), WithJsonSchema({"enum": ["random", "aligned"]})]
Orientation = Annotated[_Given, Discriminator(_form)]
AnyOrientation = Annotated[_Given | Annotated[_Word, Tag("(word)")], Discriminator(_form_or_word)]


class Pose(Model):
    """One particle of a ``list``: velocity [m/s] and spin [rad/s] override those of its group."""

    position: Vector = Field(description="of the centroid [m]")
    orientation: Orientation = Field(default=(1.0, 0.0, 0.0, 0.0), description="how it is turned")
    velocity: Vector | None = Field(default=None, description="in place of the group's [m/s]")
    spin: Vector | None = Field(default=None, description="in place of the group's [rad/s]")


class ListPlacement(Model):
    """Exactly here."""

    kind: Literal["list"]
    poses: Annotated[list[Pose], Field(min_length=1)] = Field(description="one for each particle")


_Placements = Annotated[
    RandomPlacement | LatticePlacement | RowPlacement | ClusterPlacement | ListPlacement, Field(discriminator="kind")
]
Placement = Annotated[
    _Placements,
    shorthand(
        '"random", "lattice", or a table such as { kind = "cluster", spread = 0.5 }',
        _Placements | Literal["random", "lattice"],
    ),
]
