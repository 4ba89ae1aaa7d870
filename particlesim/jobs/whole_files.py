"""Whether a movie or a picture is whole: one that was cut off still says at its beginning where it comes from."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import BinaryIO

from PIL import Image

# What ends the last block of a picture, and the file (GIF89a specification, 15 and 27).
_END_OF_GIF = b"\x00;"

# The last part of a PNG: it is empty, and its checksum always the same (RFC 2083, 4.1.4).
_END_OF_PNG = b"IEND\xaeB`\x82"

# A box of this type has the pictures of an MP4 (ISO/IEC 14496-12, 8.1.1), the element of this name those of a WebM
# (RFC 8794, 11.1; RFC 9559, 5.1).
_MEDIA, _SEGMENT = b"mdat", b"\x18\x53\x80\x67"


class DamagedFileError(ValueError):
    """A movie or a picture that is not whole; the message is one line."""


def check_whole(path: Path) -> None:
    """DamagedFileError if a movie or a picture is not whole, as far as its format tells without decoding.

    A trajectory tells when it is opened. OSError if the file cannot be read.
    """
    ending = path.suffix.lower()
    with path.open("rb"):  # or the system says why not
        pass
    if ending in _CHECKS and not _CHECKS[ending](path):
        raise DamagedFileError(f"{path}: not a whole {ending} file: damaged, cut off, or of another kind")


def _is_whole_png(path: Path) -> bool:
    try:
        with Image.open(path) as image:
            image.verify()  # each part with the checksum of its own, but for that of the last
    except (OSError, SyntaxError):  # as Pillow says that one is cut off, or wrong
        return False
    return path.read_bytes().endswith(_END_OF_PNG)


def _is_whole_gif(path: Path) -> bool:
    return path.read_bytes().endswith(_END_OF_GIF)


def _is_whole_mp4(path: Path) -> bool:
    return _is_filled(path, _boxes, _MEDIA)


def _is_whole_webm(path: Path) -> bool:
    return _is_filled(path, _elements, _SEGMENT)


def _is_filled(path: Path, parts: Callable[[BinaryIO, int], Iterator[tuple[bytes, int]]], needed: bytes) -> bool:
    """Whether a file ends where the last of its parts does, and one has the name that is needed."""
    size = path.stat().st_size
    with path.open("rb") as file:
        ends = dict(parts(file, size))
    return needed in ends and max(ends.values()) == size


def _boxes(file: BinaryIO, size: int) -> Iterator[tuple[bytes, int]]:
    """The outermost boxes of an MP4: types, and where they end (ISO/IEC 14496-12, 4.2)."""
    start = 0
    while start < size:
        file.seek(start)
        length, name = int.from_bytes(file.read(4)), file.read(4)
        if length == 1:
            length = int.from_bytes(file.read(8))
        start = start + max(length, 8) if length else size  # 0 stands for all that is left
        yield name, start


def _elements(file: BinaryIO, size: int) -> Iterator[tuple[bytes, int]]:
    """The outermost elements of a WebM: names, and where they end (RFC 8794, 4 to 6)."""
    start = 0
    while start < size:
        file.seek(start)
        name, length = _variable(file), _variable(file)
        start = max(start + 2, file.tell() + int.from_bytes(length) - (1 << 7 * len(length)))
        yield name, start


def _variable(file: BinaryIO) -> bytes:
    """A number that says by the zeros it begins with how many bytes it has, and a bit for that number."""
    first = file.read(1)
    return first + file.read(8 - int.from_bytes(first).bit_length())


_CHECKS: dict[str, Callable[[Path], bool]] = {
    ".mp4": _is_whole_mp4,
    ".webm": _is_whole_webm,
    ".gif": _is_whole_gif,
    ".png": _is_whole_png,
}
