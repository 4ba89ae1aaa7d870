"""Reading a scene file."""

from __future__ import annotations

import difflib
import tomllib
from pathlib import Path
from typing import Any

from particlesim.core.arguments import checked_arguments
from particlesim.scene import Scene
from particlesim.scene.base import paths_from
from particlesim.scene.errors import SceneError

# Where groups of particles stand.
_GROUPS = "particles", "emitters"

# Bytes of a scene file at most, as of a hundred thousand poses: to read 100 MB takes more than a minute.
_LARGEST = 20_000_000


@checked_arguments
def load_scene(path: str | Path) -> Scene:
    """Read and check a scene file (TOML). SceneError, in one line, if it cannot be read or is wrong."""
    return parse_scene(load_table(path), path)


def load_table(path: str | Path) -> dict[str, Any]:
    """What a TOML file says, as plain values. SceneError, in one line, if it cannot be read or is no TOML."""
    path = Path(path)
    text = _text(path)
    if not text.strip():
        raise SceneError("the file is empty", file=path)
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise SceneError(f"not valid TOML: {error}", file=path) from None
    except RecursionError:
        raise SceneError("not valid TOML: brackets within brackets without end", file=path) from None
    except ValueError:  # Python reads no whole number of more than some thousand digits
        raise SceneError("not valid TOML: a number of thousands of digits", file=path) from None


def parse_scene(table: dict[str, Any], path: str | Path | None = None) -> Scene:
    """The scene that a table of plain values describes; paths in it start at the folder of ``path``, if given."""
    try:
        with paths_from(Path(path).parent if path else Path(), of_file=path is not None):
            return Scene(**table)
    except SceneError as error:
        raise error if path is None else error.within(path) from None


def stored_scene(table: dict[str, Any]) -> Scene:
    """The scene of a run that was stored: the files that it names were read then and need not be there."""
    with paths_from(None):
        return Scene(**{key: list(map(_of_now, value)) if key in _GROUPS else value for key, value in table.items()})


def _of_now(group: dict[str, Any]) -> dict[str, Any]:
    """A group as this version has it: version 0.1 kept the ends of a scale of colours beside the colour."""
    kept = {key: value for key, value in group.items() if key != "colour_range"}
    if group.get("colour_range") is not None:
        kept["colour"] = {"field": group["colour"].removeprefix("by_"), "range": group["colour_range"]}
    return kept


def _text(path: Path) -> str:
    """What the file says. SceneError if it is no text, or too much."""
    try:
        if path.stat().st_size > _LARGEST:
            size = path.stat().st_size / 1e6
            raise SceneError(f"has {size:,.0f} MB: a scene file has {_LARGEST // 1_000_000} MB at most", file=path)
        # Some editors put a mark of the encoding before the text.
        return path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise SceneError(f"no such file{_neighbour(path)}", file=path) from None
    except IsADirectoryError:
        raise SceneError("is a folder, not a scene file", file=path) from None
    except UnicodeDecodeError:
        raise SceneError("is not a text file (in UTF-8), so not a scene", file=path) from None
    except OSError as error:
        raise SceneError(f"cannot be read: {error.strerror}", file=path) from None


def _neighbour(path: Path) -> str:
    """A file of a similar name, as a question, or nothing."""
    try:
        names = [other.name for other in path.parent.iterdir()]
    except OSError:
        return ""
    close = difflib.get_close_matches(path.name, names, n=1, cutoff=0.8)
    return f"; did you mean '{path.with_name(close[0])}'?" if close else ""
