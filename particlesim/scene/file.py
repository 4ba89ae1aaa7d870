"""Reading a scene file."""

from __future__ import annotations

import difflib
import tomllib
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from particlesim.scene import Scene
from particlesim.scene.messages import shown
from particlesim.scene.validation_errors import explain


class SceneError(ValueError):
    """One line: the file, the key path, the value, and what is allowed."""

    def __init__(self, message: str, key: str = "", value: Any = None, file: str | Path | None = None) -> None:
        self.key, self.value, self.message, self.file = key, value, message, file
        where = f"{key} = {shown(value)}" if key and value is not None else key
        super().__init__(": ".join(str(part) for part in (file, where, message) if part))

    def within(self, file: str | Path) -> SceneError:
        """The same error, said of a scene read from ``file``."""
        return SceneError(self.message, self.key, self.value, file)


def load_scene(path: str | Path) -> Scene:
    """Read and check a scene file (TOML). SceneError, in one line, if it cannot be read or is wrong."""
    path = Path(path)
    text = _text(path)
    if not text.strip():
        raise SceneError("the file is empty", file=path)
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise SceneError(f"not valid TOML: {error}", file=path) from None
    except RecursionError:
        raise SceneError("not valid TOML: brackets within brackets without end", file=path) from None
    return parse_scene(table, path)


def parse_scene(table: dict[str, Any], path: str | Path | None = None) -> Scene:
    """The scene that a table of plain values describes; paths in it start at the folder of ``path``, if given."""
    try:
        return Scene.model_validate(table, context={"folder": Path(path).parent} if path else None)
    except ValidationError as error:
        raise SceneError(*explain(error, table), path) from None


def _text(path: Path) -> str:
    """What the file says. SceneError if it is no text."""
    try:
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
