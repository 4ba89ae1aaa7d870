"""The one gate for output paths: what cannot become a file there is said before any work, in one line."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Sequence
from pathlib import Path

# Where the number of a picture stands in the name of a sequence, as ffmpeg has it.
_NUMBER = re.compile(r"%(?:0([1-9]))?d")


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


def is_sequence(path: Path) -> bool:
    """Whether a movie at this path is one of numbered pictures."""
    return path.suffix.lower() == ".png"


def picture_path(path: Path, number: int) -> Path:
    """The path of a picture of a sequence, whose name says where its number stands: ``x_%05d.png``."""
    return path.with_name(_NUMBER.sub(lambda found: f"{number:0{found[1] or 1}}", path.name))


def check_sequence(path: Path, pictures: int | None = None) -> None:
    """Refuse a sequence whose name has no place for a number, or, if it is known how many, that older pictures go on.

    Anything that is no sequence passes. OutputError.
    """
    if not is_sequence(path):
        return
    if len(_NUMBER.findall(path.name)) != 1:
        named = path.with_name(f"{path.stem}_%05d.png")
        raise OutputError(f"{path}: pictures of a movie need a place for their number, such as {named}")
    check_place(picture_path(path, 0))
    if pictures is not None and (after := picture_path(path, pictures)).exists():
        raise OutputError(f"{after}: of a longer sequence: it would seem to go on with these {pictures:,}; remove it")


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
