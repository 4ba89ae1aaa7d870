"""What is wrong with a scene, from pydantic's errors: the key path as the file writes it, and what is allowed."""

from __future__ import annotations

import re
from typing import Any, NamedTuple, get_args

from pydantic import BaseModel, ValidationError

from particlesim.scene.messages import hint, listed

# What a value must be, by pydantic's name of the error.
_MUST_BE = {
    "model_type": "must be a table",
    "model_attributes_type": "must be a table",
    "list_type": "must be a list",
    "too_short": "must not be empty",
}


class _Spot(NamedTuple):
    """A place in a scene file: the keys that lead there, the value, and the models that a table there may follow."""

    keys: tuple[str | int, ...]
    value: Any
    models: tuple[type[BaseModel], ...]


def explain(error: ValidationError, table: dict[str, Any], model: type[BaseModel]) -> tuple[str, str, Any]:
    """The first error of a table that follows ``model``: message, key path, and the value there, None for a table."""
    # A misspelt key is also a missing one: the misspelling comes first.
    errors = sorted(error.errors(), key=lambda e: (e["type"] == "missing", e["type"] != "extra_forbidden"))
    first = errors[0]
    kind, location = first["type"], first["loc"]
    if kind in ("missing", "extra_forbidden"):
        *above, name = location
        spot = _find(tuple(above), table, model)
        allowed = list(spot.models[0].model_fields) if spot.models else []
        if kind == "missing":
            return f"the key '{name}' is missing", _path(spot.keys), _shown(spot.value)
        keys = (*spot.keys, str(name))
        meant = hint(str(name), allowed) or f"; allowed: {', '.join(allowed)}"
        return f"unknown key{meant}", _path(keys), _shown(spot.value.get(name))
    spot = _find(location, table, model)
    if kind == "union_tag_invalid" and isinstance(spot.value, dict):
        spot = spot._replace(keys=(*spot.keys, "kind"), value=spot.value["kind"])
    return _message(first, spot), _path(spot.keys), _shown(spot.value)


def _message(error: Any, spot: _Spot) -> str:
    """What is wrong with a value, in our words."""
    kind, context = error["type"], error.get("ctx", {})
    if kind == "union_tag_invalid":
        return f"unknown kind{_kinds(spot, str(context['tag']))}"
    if kind == "union_tag_not_found":
        return f"the key 'kind' is missing{_kinds(spot, '')}"
    if kind == "value_error":
        return str(context["error"])
    message = _MUST_BE.get(kind, "is not allowed here")
    name = spot.keys[-1] if spot.keys else ""
    if kind == "list_type" and isinstance(spot.value, dict):
        return f"{message} of tables: write [[{name}]], in two pairs of brackets"
    if kind.startswith("model") and isinstance(spot.value, list):
        return f"{message}: write [{name}], in one pair of brackets"
    return message


def _kinds(spot: _Spot, word: str) -> str:
    """The kinds that a table may have: the one that looks like ``word``, or all."""
    kinds = [kind for model in spot.models for kind in get_args(model.model_fields["kind"].annotation)]
    return hint(word, kinds) or f"; allowed: {listed(kinds)}"


def _find(location: tuple[str | int, ...], table: dict[str, Any], model: type[BaseModel]) -> _Spot:
    """The place of a pydantic location in a file.

    Pydantic puts the kinds of tables between the keys, and keys that a shorthand leaves out; neither is in the file.
    """
    spot = _Spot((), table, (model,))
    for step in location:
        chosen = tuple(model for model in spot.models if step in _kinds_of(model))
        # A kind may be called as one of its keys: it is chosen once.
        if chosen and chosen != spot.models:
            spot = spot._replace(models=chosen)
        elif isinstance(step, int):
            inside = isinstance(spot.value, list | tuple) and step < len(spot.value)
            spot = _Spot((*spot.keys, step), spot.value[step], spot.models) if inside else spot
        elif isinstance(spot.value, dict) and step in spot.value:
            # In a table whose keys are the file's own, the models are those of its values.
            field = spot.models[0].model_fields.get(step)
            models = spot.models if field is None else _models_in(field.annotation)
            spot = _Spot((*spot.keys, step), spot.value[step], models)
    return spot


def _models_in(annotation: Any) -> tuple[type[BaseModel], ...]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return (annotation,)
    return tuple(model for part in get_args(annotation) for model in _models_in(part))


def _kinds_of(model: type[BaseModel]) -> tuple[Any, ...]:
    return get_args(model.model_fields["kind"].annotation) if "kind" in model.model_fields else ()


def _path(keys: tuple[str | int, ...]) -> str:
    parts = (f"[{key}]" if isinstance(key, int) else f".{_key(key)}" for key in keys)
    return "".join(parts).removeprefix(".")


def _key(key: str) -> str:
    """A key as TOML writes it: bare, or in quotes where it is no plain word."""
    return key if re.fullmatch(r"[\w-]+", key, re.ASCII) else ascii(key)


def _shown(value: Any) -> Any:
    """A value worth showing: not a table, nor a list of tables, which say nothing in a line."""
    tables = isinstance(value, dict) or (isinstance(value, list) and any(isinstance(item, dict) for item in value))
    return None if tables else value
