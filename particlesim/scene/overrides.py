"""Scenes made of others: drawn in another way, or with fewer and larger particles."""

from __future__ import annotations

import math
from typing import Any

from particlesim.scene import Scene
from particlesim.scene.base import MAX_COUNT
from particlesim.scene.file import SceneError, parse_scene

# What decides how a scene is drawn, beside the colours of its groups.
_LOOK = "camera", "movie", "show"


def replaced(scene: Scene, **values: Any) -> Scene:
    """The scene with other values under these keys, checked as those of a file. SceneError if they are wrong."""
    return parse_scene({**scene.model_dump(mode="json"), **values})


def with_movie(scene: Scene, **values: Any) -> Scene:
    """The scene with other values in its table ``movie``. SceneError if they are wrong."""
    return replaced(scene, movie={**scene.movie.model_dump(mode="json"), **values})


def with_colour(scene: Scene, colour: str) -> Scene:
    """The scene with all particles coloured like this. SceneError if it is no colour."""
    groups = [group.model_dump(mode="json") for group in scene.particles]
    for group in groups:
        # A range is one of the field that it was given for.
        group.update(colour=colour, colour_range=group["colour_range"] if group["colour"] == colour else None)
    return replaced(scene, particles=groups)


def with_look(scene: Scene, other: Scene) -> Scene:
    """The scene with the camera, the movie, what is shown, and the colours of another one.

    SceneError if the other one has another number of groups.
    """
    if len(other.particles) != len(scene.particles):
        there, here = len(other.particles), len(scene.particles)
        raise SceneError(f"has {there} groups of particles, but {here} are to be drawn", "particles")
    groups = [
        own.model_copy(update={"colour": look.colour, "colour_range": look.colour_range})
        for own, look in zip(scene.particles, other.particles, strict=True)
    ]
    return scene.model_copy(update={"particles": groups, **{key: getattr(other, key) for key in _LOOK}})


def scaled(scene: Scene, factor: float) -> Scene:
    """A twin of the scene with ``factor`` times as many particles that fill the same part of the world.

    Sizes and the spacing of lattices are multiplied by factor^(-1/3); a given mass and temperatures by 1 / factor, so
    that density, speeds, energy and pressure stay. Particles of a list stay as they are. SceneError if there are no
    others, or too many.
    """
    groups = [group.model_dump(mode="json") for group in scene.particles]
    counted = [group for group in groups if group["placement"]["kind"] != "list"]
    if not counted:
        raise SceneError("all of them are placed by lists, which cannot be scaled", "particles")
    for group in counted:
        _scale(group, factor)
    number = sum(group["count"] for group in counted)
    if number > MAX_COUNT:
        raise SceneError(f"would be {number:,}; there may be up to {MAX_COUNT:,}", "particles")
    return replaced(scene, particles=groups)


def _scale(group: dict[str, Any], factor: float) -> None:
    """Change the table of a group in place."""
    length = factor ** (-1.0 / 3.0)
    # At least one of a group that is there at all.
    group["count"] = max(math.floor(group["count"] * factor + 0.5), min(group["count"], 1))
    for table, key, by in (
        ("size", "value", length),
        ("size", "low", length),
        ("size", "high", length),
        ("placement", "spacing", length),
        ("velocity", "temperature", 1.0 / factor),
        ("spin", "temperature", 1.0 / factor),
    ):
        if group[table].get(key) is not None:
            group[table][key] *= by
    if group["mass"] is not None:
        group["mass"] /= factor
