"""The keys of a scene file as tables of Markdown, read off the scene models, so that pages cannot be out of date.

A line ``{{ keys of obstacles }}`` on a page becomes the table of ``[[obstacles]]`` and of every table within it that no
key before it in ``Scene`` has; ``{{ keys }}`` becomes that of the scene itself.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import PurePosixPath
from typing import Any

from particlesim.scene import Scene
from particlesim.scene.base import Model

_LINE = re.compile(r"^\{\{ keys(?: of (\w+))? \}\}$", re.MULTILINE)
_UNIT = re.compile(r" \[([^\]]+)\]$")
_REF = "#/$defs/"

_SCHEMA = Scene.model_json_schema()
_TABLES: dict[str, dict[str, Any]] = _SCHEMA["$defs"]


def _models(base: type[Model] = Model) -> Iterator[type[Model]]:
    """All tables there are, bases among them."""
    for model in base.__subclasses__():
        yield model
        yield from _models(model)


_CLASSES = {model.__name__: model for model in _models()}


def _within(node: Any, key: str) -> Iterator[tuple[str, str]]:
    """The tables that a part of the schema names and the keys that they are values of, each before those within it."""
    if isinstance(node, list):
        for item in node:
            yield from _within(item, key)
    elif isinstance(node, dict) and "$ref" in node:
        name = node["$ref"].removeprefix(_REF)
        yield name, key
        for inner, value in _TABLES[name]["properties"].items():
            yield from _within(value, inner)
    elif isinstance(node, dict):
        yield from _within([value for part, value in node.items() if part != "discriminator"], key)


def _rooms() -> dict[str, dict[str, str]]:
    """The tables that each key of a scene has on its page, and the keys that they are values of."""
    told: set[str] = set()
    rooms: dict[str, dict[str, str]] = {}
    for key, node in _SCHEMA["properties"].items():
        rooms[key] = {}
        for name, via in _within(node, key):
            if name not in told:
                rooms[key].setdefault(name, via)
        told.update(rooms[key])
    return rooms


_ROOMS = _rooms()
_PAGES = {name: key for key, names in _ROOMS.items() for name in names}


def on_page_markdown(markdown: str, *, page: Any, **_: Any) -> str:
    """Put tables in the place of lines that ask for them."""
    here = PurePosixPath(page.file.src_uri).stem
    return _LINE.sub(lambda line: _keys_of(line[1], here), markdown)


def _keys_of(key: str | None, here: str) -> str:
    """The tables of a key of the scene, or of the scene."""
    if key is None:
        return _table("Scene", _SCHEMA, here)
    first, *others = _ROOMS[key]
    # A key that is one table is what its page is about; of one that has kinds, each gets its heading.
    whole = [] if _has_kinds(first) else [_described(first, here)]
    return "\n\n".join(whole + [_section(name, here) for name in (others if whole else [first, *others])])


def _has_kinds(name: str) -> bool:
    return "kind" in _TABLES[name]["properties"]


def _section(name: str, here: str) -> str:
    """A table within another one under a heading of its own."""
    kind = _words(_TABLES[name]["properties"].get("kind", {}), here)
    key = _ROOMS[_PAGES[name]][name]
    title = f"`{key}` of the kind {kind}" if kind else f"`{key}`"
    return f"### {title} {{ #{name.lower()} }}\n\n{_described(name, here)}"


def _described(name: str, here: str) -> str:
    said = _TABLES[name].get("description", "").replace("``", "`")
    return f"{said}\n\n{_table(name, _TABLES[name], here)}"


def _table(name: str, table: dict[str, Any], here: str) -> str:
    own = _CLASSES[name].__annotations__
    keys = sorted(table["properties"].keys() - {"kind"}, key=[*own, *table["properties"]].index)
    rows = [_row(name, key, table["properties"][key], table.get("required", ()), here) for key in keys]
    head = ["| key | | unit | what it may be | if not given |", "|---|---|---|---|---|"]
    return "\n".join(head + rows) if rows else ""


def _row(name: str, key: str, node: dict[str, Any], required: Any, here: str) -> str:
    said = node["description"]
    unit = _UNIT.search(said)
    default = "**required**" if key in required else _usual(name, key)
    cells = f"`{key}`", _UNIT.sub("", said), unit[1] if unit else "", _words(node, here), default
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _usual(name: str, key: str) -> str:
    """The value of a key that is not given, as TOML writes it."""
    value = _CLASSES[name].model_fields[key].get_default(call_default_factory=True)
    if isinstance(value, Model):
        given = dict(value.__repr_args__())
        value = given["kind"] if len(given) == 1 else given.get("value", "")
    return f"`{json.dumps(value)}`" if value not in (None, "", []) else ""


def _words(node: dict[str, Any], here: str) -> str:
    """What a value may be. A word that stands for a table of that kind is said once, as that table."""
    said = list(_alternatives(node, here))
    links = " ".join(each for each in said if each.startswith("["))
    return ", ".join(each for each in said if each and (each.startswith("[") or each not in links))


def _alternatives(node: dict[str, Any], here: str) -> Iterator[str]:
    if "$ref" in node:
        yield _link(node["$ref"].removeprefix(_REF), here)
    elif "anyOf" in node or "oneOf" in node:
        for each in node.get("anyOf", node.get("oneOf")):
            yield from _alternatives(each, here)
    elif "const" in node or "enum" in node:
        yield from (f"`{json.dumps(word)}`" for word in node.get("enum", [node.get("const")]))
    elif "prefixItems" in node:
        yield f"list of {len(node['prefixItems'])}: {_words(node['prefixItems'][0], here)}"
    elif "items" in node:
        yield f"list of {_words(node['items'], here)}"
    else:
        yield _plain(node)


def _plain(node: dict[str, Any]) -> str:
    text = "path" if node.get("format") == "path" else "text"
    kinds = {"string": text, "boolean": "`true`, `false`", "number": "number", "integer": "whole number"}
    bounds = {"exclusiveMinimum": "above", "minimum": "from", "maximum": "to"}
    words = [f"{word} {node[bound]:,}" for bound, word in bounds.items() if bound in node]
    return " ".join([kinds.get(node.get("type", ""), ""), *words]).strip()


def _link(name: str, here: str) -> str:
    """A table by its kind, or by its name."""
    kind = _words(_TABLES[name]["properties"].get("kind", {}), here)
    page = _PAGES[name]
    if name == next(iter(_ROOMS[page])) and not _has_kinds(name):
        return f"[table]({page}.md)"
    return f"[{kind or 'table'}]({'' if page == here else f'{page}.md'}#{name.lower()})"
