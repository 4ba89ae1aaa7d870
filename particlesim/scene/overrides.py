"""Scenes made of others: drawn in another way, or with fewer and larger particles."""

from __future__ import annotations

import math
from typing import Any

from particlesim.scene import Scene
from particlesim.scene.base import MAX_COUNT, Model
from particlesim.scene.colours import FIELD_WORDS, FieldColour
from particlesim.scene.file import SceneError, parse_scene
from particlesim.scene.flow import Emitter
from particlesim.scene.groups import Group
from particlesim.scene.obstacles import Obstacle
from particlesim.scene.placements import ListPlacement, RowPlacement
from particlesim.scene.surface import Contact
from particlesim.scene.world import World

# What decides how a scene is drawn, beside the colours of its groups.
_LOOK = "camera", "movie", "show"

# Placements that say where each particle is: there is no twin of them with other numbers.
_AS_SAID = ListPlacement, RowPlacement


def replaced(scene: Scene, **values: Any) -> Scene:
    """The scene with other values under these keys, checked as those of a file. SceneError if they are wrong.

    Tables that stay are models already: they are taken over as they are and not checked again.
    """
    return parse_scene({**dict(scene), **values})


def with_movie(scene: Scene, **values: Any) -> Scene:
    """The scene with other values in its table ``movie``. SceneError if they are wrong."""
    return replaced(scene, movie={**dict(scene.movie), **values})


def with_colour(scene: Scene, colour: Any) -> Scene:
    """The scene with all particles coloured like this, a word or a table. SceneError if it is no colour."""
    if isinstance(colour, str) and colour in FIELD_WORDS:
        # A scale that the scene has for this quantity is kept.
        own = (group.colour for group in scene.groups if isinstance(group.colour, FieldColour))
        colour = next((scale for scale in own if scale.field == FIELD_WORDS[colour]), colour)
    return replaced(scene, **grouped(scene, [{**dict(group), "colour": colour} for group in scene.groups]))


def with_look(scene: Scene, other: Scene) -> Scene:
    """The scene with camera, movie and what is shown of another one; with its colours too if it has as many groups."""
    groups = list(scene.groups)
    if len(other.groups) == len(groups):
        groups = [
            own.model_copy(update={"colour": look.colour}) for own, look in zip(groups, other.groups, strict=True)
        ]
    return scene.model_copy(update={**grouped(scene, groups), **{key: getattr(other, key) for key in _LOOK}})


def scaled(scene: Scene, factor: float) -> Scene:
    """A twin of the scene with ``factor`` times as many particles that fill the same part of the world.

    Emitters go ``factor`` times as fast. Sizes, the spacing of lattices and rolling friction are multiplied by
    factor^(-1/3); a given mass, temperatures and drag by 1 / factor, so that density, speeds, energy and pressure stay.
    Particles of a list or a row stay as they are. SceneError if there are no others, or too many.
    """
    counted = [group for group in scene.groups if not isinstance(group.placement, _AS_SAID)]
    if not counted:
        raise SceneError("all of them are placed by lists or rows, which cannot be scaled", "particles")
    number = sum(_scaled_count(group, factor) for group in counted)
    if number > MAX_COUNT:
        raise SceneError(f"would be {number:,}; there may be up to {MAX_COUNT:,}", "particles")
    return replaced(
        scene,
        world=_rolling(scene.world, factor),
        **grouped(
            scene,
            [group if isinstance(group.placement, _AS_SAID) else _scaled(group, factor) for group in scene.groups],
        ),
        contact=[_rolling(contact, factor) for contact in scene.contact],
        obstacles=[_rolling(obstacle, factor) for obstacle in scene.obstacles],
        fields=[_times(field, 1.0 / factor, "coefficient") for field in scene.fields],
    )


def grouped(scene: Scene, groups: list[Any]) -> dict[str, list[Any]]:
    """Groups in the order of ``scene.groups`` under the keys that they stand in."""
    first = len(scene.particles)
    return {"particles": groups[:first], "emitters": groups[first:]}


def _length(factor: float) -> float:
    """By how much larger ``factor`` times as many particles are."""
    return factor ** (-1.0 / 3.0)


def _rolling(table: World | Contact | Obstacle, factor: float) -> Any:
    """A table whose rolling friction, if there is any, is that of a twin."""
    return _times(table, _length(factor), "rolling_friction") if table.rolling_friction else table


def _scaled_count(group: Group, factor: float) -> int:
    """At least one of a group that is there at all."""
    return max(math.floor(group.number * factor + 0.5), min(group.number, 1))


def _scaled(group: Group, factor: float) -> dict[str, Any]:
    """The table of a group with ``factor`` times as many particles."""
    length, energy = _length(factor), 1.0 / factor
    return {
        **_times(group, length, "rolling_friction"),
        "count": _scaled_count(group, factor),
        "size": _times(group.size, length, "value", "low", "high"),
        "placement": _times(group.placement, length, "spacing"),
        "velocity": _times(group.velocity, energy, "temperature"),
        "spin": _times(group.spin, energy, "temperature"),
        "mass": None if group.mass is None else group.mass / factor,
        **({"rate": group.rate * factor} if isinstance(group, Emitter) else {}),
    }


def _times(table: Model, factor: float, *keys: str) -> dict[str, Any]:
    """A table whose numbers under these keys, where it has them, are multiplied by ``factor``."""
    values = dict(table)
    return {**values, **{key: values[key] * factor for key in keys if values.get(key) is not None}}
