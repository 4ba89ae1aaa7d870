"""What is wrong with a scene, as one line."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from particlesim.scene.messages import shown


class SceneError(ValueError):
    """One line: the file, the key path, the value, and what is allowed."""

    def __init__(self, message: str, key: str = "", value: Any = None, file: str | Path | None = None) -> None:
        self.key, self.value, self.message, self.file = key, value, message, file
        where = f"{key} = {shown(value)}" if key and value is not None else key
        super().__init__(": ".join(str(part) for part in (file, where, message) if part))

    def within(self, file: str | Path) -> SceneError:
        """The same error, said of a scene read from ``file``."""
        return SceneError(self.message, self.key, self.value, file)
