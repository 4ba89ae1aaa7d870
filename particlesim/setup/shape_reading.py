"""The shapes that a scene names, read and made; what is wrong with one is said of its key."""

from __future__ import annotations

from typing import Any

from particlesim.geometry.shapes import CATALOGUE, Shape
from particlesim.scene.file import SceneError
from particlesim.scene.groups import MeshShape

# A body whose inscribed sphere is this much smaller than its bounding one is a sheet.
_FLATTEST = 1e-6


def shape_of(table: Any, key: str) -> Shape:
    """The shape that a scene's table of shapes describes, which stands under ``key``. SceneError if there is none."""
    try:
        shape = CATALOGUE[table.kind](**table.model_dump(exclude={"kind"}))
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else None
        words = f"cannot be read: {reason}" if reason else str(error)
        raise _shape_error(key, table, " ".join(words.split())) from None
    if shape.inradius <= _FLATTEST * shape.radius:
        raise _shape_error(key, table, "is too flat to be a body")
    return shape


def _shape_error(key: str, table: Any, message: str) -> SceneError:
    if isinstance(table, MeshShape):
        file = str(table.file)
        return SceneError(message.removeprefix(f"{file}: "), f"{key}.file", file)
    return SceneError(message, key)
