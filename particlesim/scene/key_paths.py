"""Values in a scene's table by their key paths, such as ``particles[0].size``: as errors name them, and sweeps."""

from __future__ import annotations

import re
from typing import Any

from particlesim.scene.errors import SceneError

# A key, or the number of a table in a list.
_STEP = re.compile(r"(?:^|\.)(\w[\w-]*)|\[(\d{1,9})\]", re.ASCII)


def put(table: dict[str, Any], path: str, value: Any) -> None:
    """Put a value into a table of plain values, tables that are not there yet with it.

    SceneError for a path that leads nowhere: through what is no table, or past the end of a list.
    """
    steps = _steps(path)
    place: Any = table
    for k, step in enumerate(steps):
        _check(place, steps, k)
        if k == len(steps) - 1:
            place[step] = value
        elif isinstance(step, str):
            place = place.setdefault(step, {})
        else:
            place = place[step]


def _steps(path: str) -> list[str | int]:
    """The keys and numbers of a path. SceneError if it is none."""
    found = list(_STEP.finditer(path))
    if not found or "".join(match.group() for match in found) != path:
        raise SceneError("must be the path of a key, such as world.gravity[2] or particles[0].size", key=path)
    return [match[1] if match[1] is not None else int(match[2]) for match in found]


def _check(place: Any, steps: list[str | int], k: int) -> None:
    """SceneError if ``place``, which the first ``k`` steps lead to, has no room for the next."""
    step, way = steps[k], _text(steps[:k])
    if isinstance(step, str) and not isinstance(place, dict):
        raise SceneError(f"{way} is no table that could have the key {step}", key=_text(steps))
    if isinstance(step, int) and not isinstance(place, list):
        raise SceneError(f"{way} is no list", key=_text(steps))
    if isinstance(step, int) and step >= len(place):
        raise SceneError(f"{way} has {len(place)} entries, 0 the first", key=_text(steps))


def _text(steps: list[str | int]) -> str:
    return "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in steps).removeprefix(".")
