"""The shapes that a scene names, read and made; what is wrong with one is said of its key."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from particlesim.geometry.shapes import CATALOGUE, Shape
from particlesim.geometry.surface_files import heightfield, surface
from particlesim.scene.file import SceneError
from particlesim.scene.groups import MeshShape
from particlesim.scene.obstacles import HeightfieldShape, Surfaces, SurfaceShape

# A body whose inscribed sphere is this much smaller than its bounding one is a sheet.
_FLATTEST = 1e-6


# What makes the shapes that only obstacles have.
_SURFACES: dict[str, Callable[..., Shape]] = {"mesh": surface, "heightfield": heightfield}


def surface_of(table: Surfaces, key: str) -> Shape:
    """The mesh that an obstacle's table describes, which stands under ``key``. SceneError if there is none."""
    return _made(_SURFACES[table.kind], table, key)


def shape_of(table: Any, key: str) -> Shape:
    """The shape that a scene's table of shapes describes, which stands under ``key``. SceneError if there is none."""
    shape = _made(CATALOGUE[table.kind], table, key)
    if shape.inradius <= _FLATTEST * shape.radius:
        raise _shape_error(key, table, "is too flat to be a body")
    return shape


def _made(make: Callable[..., Shape], table: Any, key: str) -> Shape:
    """The shape that is made of a table."""
    try:
        return make(**table.model_dump(exclude={"kind"}))
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else None
        words = f"cannot be read: {reason}" if reason else str(error)
        raise _shape_error(key, table, " ".join(words.split())) from None


def _shape_error(key: str, table: Any, message: str) -> SceneError:
    if isinstance(table, MeshShape | SurfaceShape | HeightfieldShape):
        file = str(table.file)
        return SceneError(message.removeprefix(f"{file}: "), f"{key}.file", file)
    return SceneError(message, key)
