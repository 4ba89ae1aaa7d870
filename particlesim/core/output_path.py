"""The one gate for output paths: what cannot become a file there is said before any work, in one line."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path


class OutputError(ValueError):
    """A path that no output can be written to as it is; the message is one line."""


def check_output(path: str | Path, *suffixes: str, beside: Sequence[str] = ()) -> None:
    """Refuse a path at which no file can appear.

    Parameters
    ----------
    path
        The file to write.
    *suffixes
        Its ending, such as ".mp4"; one of them if there are several.
    beside
        The endings of files of the same name that come with it.

    Raises
    ------
    OutputError
        For another ending, a folder or device in the way, or a folder that is not there.
    OSError
        For a folder that cannot be written to.
    """
    path = Path(path)
    check_place(path)
    if path.suffix.lower() not in suffixes:
        raise OutputError(f"{path}: the output must end in {_either(suffixes)}")
    for suffix in beside:
        check_place(path.with_suffix(suffix))
    if not path.parent.is_dir():
        raise OutputError(f"{path}: there is no folder {path.parent}")
    try:
        with tempfile.TemporaryFile(dir=path.parent):
            pass
    except OSError as error:
        raise OSError(f"{path}: the folder {path.parent} cannot be written to") from error


def partial_folder(path: Path) -> Path:
    """Where what is finished of an output lies until it is whole."""
    return path.with_name(f".{path.name}.partial")


def check_place(path: Path) -> None:
    """OutputError if something stands at ``path`` that a file cannot take the place of, or that is none."""
    if path.is_dir():
        raise OutputError(f"{path}: is a folder, not a file to write to")
    if str(path) == "-" or path.parent in (Path("/dev"), Path("/dev/fd")) or (path.exists() and not path.is_file()):
        raise OutputError(f"{path}: is not a file to write to; movies and trajectories need one")


def _either(suffixes: Sequence[str]) -> str:
    """Endings in words: ".svg", ".svg or .png", ".mp4, .webm or .gif"."""
    return " or ".join(part for part in (", ".join(suffixes[:-1]), suffixes[-1]) if part)
