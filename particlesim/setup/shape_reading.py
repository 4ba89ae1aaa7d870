"""The shapes that a scene names, read and made; what is wrong with one is said of its key."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from particlesim.core.extras import MissingExtraError
from particlesim.geometry.compounds import Part, compound
from particlesim.geometry.decomposition import decomposed
from particlesim.geometry.shapes import CATALOGUE, Shape
from particlesim.geometry.surface_files import heightfield, surface
from particlesim.scene import groups as scene_groups
from particlesim.scene.file import SceneError
from particlesim.scene.groups import CompoundShape, MeshShape
from particlesim.scene.obstacles import HeightfieldShape, Surfaces, SurfaceShape
from particlesim.setup.orientations import quaternion_of

# A body whose inscribed sphere is this much smaller than its bounding one is a sheet.
_FLATTEST = 1e-6


# What makes the shapes that only obstacles have.
_SURFACES: dict[str, Callable[..., Shape]] = {"mesh": surface, "heightfield": heightfield}


def surface_of(table: Surfaces, key: str) -> Shape:
    """The mesh that an obstacle's table describes, which stands under ``key``. SceneError if there is none."""
    return _made(_SURFACES[table.kind], table, key)


def shape_of(table: Any, key: str) -> Shape:
    """The shape that a scene's table of shapes describes, which stands under ``key``. SceneError if there is none."""
    if isinstance(table, CompoundShape):
        return _compound_of(table, key)
    if isinstance(table, MeshShape) and table.decompose:
        return _decomposed(table, key)
    shape = _made(CATALOGUE[table.kind], table, key, without=("decompose",))
    if shape.inradius <= _FLATTEST * shape.radius:
        raise _shape_error(key, table, "is too flat to be a body")
    return shape


def _decomposed(table: MeshShape, key: str) -> Shape:
    """The compound that a mesh is split into."""
    try:
        return _made(decomposed, table, key, without=("decompose", "rounding"))
    except MissingExtraError as error:
        raise SceneError(str(error), f"{key}.decompose", True) from None


def _compound_of(table: CompoundShape, key: str) -> Shape:
    """The compound that a scene's table describes, which stands under ``key``."""
    parts = [_part_of(part, f"{key}.parts[{k}]") for k, part in enumerate(table.parts)]
    try:
        return compound(parts)
    except ValueError as error:
        raise _shape_error(key, table, str(error)) from None


def _part_of(said: scene_groups.Part, key: str) -> Part:
    """The part of a compound that a scene's table describes, which stands under ``key``."""
    shape = shape_of(said.shape, f"{key}.shape")
    return Part(shape, np.array(said.position), quaternion_of(said.orientation), said.size)


def _made(make: Callable[..., Shape], table: Any, key: str, without: tuple[str, ...] = ()) -> Shape:
    """The shape that is made of a table, but for some of its keys."""
    try:
        return make(**table.model_dump(exclude={"kind", *without}))
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else None
        words = f"cannot be read: {reason}" if reason else str(error)
        raise _shape_error(key, table, " ".join(words.split())) from None


def _shape_error(key: str, table: Any, message: str) -> SceneError:
    if isinstance(table, MeshShape | SurfaceShape | HeightfieldShape):
        file = str(table.file)
        return SceneError(message.removeprefix(f"{file}: "), f"{key}.file", file)
    return SceneError(message, key)
