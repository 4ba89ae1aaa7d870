"""Reading a scene file, and saying in one line what is wrong with it."""

from __future__ import annotations

import difflib
import json
import tomllib
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from particlesim.scene import Scene

# What a value must be, by pydantic's name of the error where its own words would not help a scene's author.
_MUST_BE = {
    "missing": "is missing",
    "model_type": "must be a table",
    "model_attributes_type": "must be a table",
    "list_type": "must be a list",
    "tuple_type": "must be a list",
    "string_type": "must be text",
    "bool_type": "must be true or false",
    "bool_parsing": "must be true or false",
    "int_type": "must be a whole number",
    "int_parsing": "must be a whole number",
    "int_from_float": "must be a whole number",
    "float_type": "must be a number",
    "float_parsing": "must be a number",
    "finite_number": "must be a finite number",
    "path_type": "must be a path",
    "too_short": "has too few entries",
    "too_long": "has too many entries",
}


class SceneError(ValueError):
    """One line: the file, the key path, the value, and what is allowed."""

    def __init__(self, message: str, key: str = "", value: Any = None, file: str | Path | None = None) -> None:
        self.key, self.value, self.message = key, value, message
        where = f"{key} = {_shown(value)}" if key and value is not None else key
        super().__init__(": ".join(str(part) for part in (file, where, message) if part))


def load_scene(path: str | Path) -> Scene:
    """Read and check a scene file (TOML). SceneError, in one line, if it cannot be read or is wrong."""
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise SceneError("no such file", file=path) from None
    except (OSError, UnicodeDecodeError) as error:
        raise SceneError(f"cannot be read: {error}", file=path) from None
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise SceneError(f"not valid TOML: {error}", file=path) from None
    return parse_scene(table, path)


def parse_scene(table: dict[str, Any], path: str | Path | None = None) -> Scene:
    """The scene that a table of plain values describes; relative paths in it start at the folder of ``path``."""
    try:
        scene = Scene.model_validate(table)
    except ValidationError as error:
        raise _first_error(error, table, path) from None
    scene.set_folder(Path(path).parent if path else Path())
    return scene


def _first_error(error: ValidationError, table: dict[str, Any], path: str | Path | None) -> SceneError:
    # A misspelt key is also a missing one: the misspelling comes first.
    errors = sorted(error.errors(), key=lambda e: (e["type"] == "missing", e["type"] != "extra_forbidden"))
    first = errors[0]
    keys, value, known = _follow(first["loc"], table)
    same = [e for e in errors if _follow(e["loc"], table)[0] == keys]
    if first["type"] == "extra_forbidden":
        message = "unknown key" + _hint(str(keys[-1]), _allowed_keys(first["loc"]))
    else:
        message = " or ".join(dict.fromkeys(_allowed(e) for e in same))
    return SceneError(message, _path(keys), value if known else None, path)


def _allowed(error: Any) -> str:
    """What a value should have been."""
    kind, context = error["type"], error.get("ctx", {})
    if kind == "union_tag_invalid":
        tags = [tag.strip("' ") for tag in context["expected_tags"].split(",")]
        return f"unknown kind '{context['tag']}'" + _hint(str(context["tag"]), tags)
    if kind == "union_tag_not_found":
        return "the key 'kind' is missing"
    if kind == "literal_error":
        return f"must be {context['expected']}"
    if kind == "value_error":
        return str(context["error"])
    if kind in _MUST_BE:
        return _MUST_BE[kind]
    return str(error["msg"]).replace("Input should be", "must be")


def _follow(location: tuple[Any, ...], table: Any) -> tuple[list[Any], Any, bool]:
    """The part of a pydantic location that is in the file, the value there, and whether there is one.

    Pydantic puts names of union members between the keys; they are not in the file.
    """
    keys: list[Any] = []
    value, known = table, True
    for depth, step in enumerate(location):
        if isinstance(value, dict) and step in value:
            value = value[step]
        elif isinstance(value, list | tuple) and isinstance(step, int) and step < len(value):
            value = value[step]
        elif depth == len(location) - 1 and isinstance(value, dict) and str(step).isidentifier():
            tags = {str(value.get("kind"))}
            if step in tags:
                continue
            known = False
        else:
            continue
        keys.append(step)
    return keys, value, known


def _allowed_keys(location: tuple[Any, ...]) -> list[str]:
    """The keys of the table that holds the one at ``location``."""
    model: type[BaseModel] = Scene
    choices: list[type[BaseModel]] = []
    for step in location[:-1]:
        if isinstance(step, str) and step in model.model_fields and not choices:
            choices = _models_in(model.model_fields[step].annotation)
        elif isinstance(step, str):
            choices = [m for m in choices if _has_kind(m, step) or m.__name__ in step]
        if len(choices) == 1:
            model, choices = choices[0], []
    return list(model.model_fields)


def _models_in(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [model for part in get_args(annotation) for model in _models_in(part)]


def _has_kind(model: type[BaseModel], kind: str) -> bool:
    return "kind" in model.model_fields and kind in get_args(model.model_fields["kind"].annotation)


def _hint(word: str, allowed: list[str]) -> str:
    close = difflib.get_close_matches(word, allowed, n=1)
    return f"; did you mean '{close[0]}'?" if close else f"; allowed: {', '.join(allowed)}"


def _path(keys: list[Any]) -> str:
    return "".join(f"[{k}]" if isinstance(k, int) else f".{k}" for k in keys).lstrip(".")


def _shown(value: Any) -> str:
    text = value if isinstance(value, str) else json.dumps(value, default=str)
    return repr(text) if isinstance(value, str) else text if len(text) <= 60 else f"{text[:57]}..."
