"""Where the result of a command goes."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from particlesim.cli.errors import fail


@contextmanager
def place_for(path: Path | None, source: Path, suffix: str) -> Iterator[Path]:
    """Where the result goes: as told, or to renders/ under the name of the source.

    A wrong place is found out before the work, not after it; renders/ does not stay behind if nothing comes of it.
    """
    if path is not None:
        path = path if path.suffix or path.is_dir() else path.with_suffix(suffix)
        check_output(path, suffix)
        yield path
        return
    folder = Path("renders")
    path = folder / f"{source.stem}{suffix}"
    is_new = not folder.exists()
    folder.mkdir(exist_ok=True)
    check_output(path, suffix)
    try:
        yield path
    except BaseException:
        if is_new and not any(folder.iterdir()):
            folder.rmdir()
        raise


def check_output(path: Path, suffix: str) -> None:
    """Exit with a line if no file can appear at ``path``."""
    if path.is_dir():
        fail(f"{path}: is a folder, not a file to write to", 2)
    if path.suffix.lower() != suffix:
        fail(f"{path}: the output must end in {suffix}", 2)
    if not path.parent.is_dir():
        fail(f"{path}: there is no folder {path.parent}", 2)
    if not os.access(path.parent, os.W_OK):
        fail(f"{path}: the folder {path.parent} cannot be written to", 1)
