"""Reading a GSD file in which nothing is taken for granted: sizes are checked before memory is asked for.

The library trusts a file's index, and what the file says of numbers of particles: a changed byte can ask for petabytes.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import gsd.fl
import numpy as np

from particlesim.core.text import shortened

# Layout of GSD files, version 1 and 2 (https://gsd.readthedocs.io, "File layer specification").
_MAGIC = 0x65DF65DF65DF65DF
_HEADER = np.dtype(
    [
        ("magic", "<u8"),
        ("index_location", "<u8"),
        ("index_entries", "<u8"),
        ("namelist_location", "<u8"),
        ("namelist_entries", "<u8"),
        ("versions", "<u4", 2),
        ("names", "S64", 2),
        ("reserved", "V80"),
    ]
)
_ENTRY = np.dtype(
    [
        ("frame", "<u8"),
        ("rows", "<u8"),
        ("location", "<i8"),
        ("columns", "<u4"),
        ("name", "<u2"),
        ("type", "u1"),
        ("flags", "u1"),
    ]
)
_NAME_BYTES = 64

# Bytes of a number by its type, 1 to 11: whole numbers without sign, with sign, of single and double precision, letter.
_TYPE_BYTES = np.array([0, 1, 2, 4, 8, 1, 2, 4, 8, 4, 8, 1])


class TrajectoryError(ValueError):
    """A file that is not a trajectory of ours; the message is one line."""


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Say what goes wrong in reading a file in one line. TrajectoryError, whatever it was."""
    try:
        yield
    except TrajectoryError:
        raise
    except (OSError, RuntimeError, ValueError, LookupError, TypeError, ArithmeticError, MemoryError) as error:
        words = " ".join(str(error).split()) or type(error).__name__
        raise TrajectoryError(f"{path}: damaged, or not a trajectory ({shortened(words, 100)})") from None


class Chunks:
    """The arrays of a GSD file by frame and name. TrajectoryError if it is none, or if its index is damaged."""

    def __init__(self, path: Path) -> None:
        self.path = path
        if not path.is_file():
            raise TrajectoryError(f"{path}: no such file")
        _check_index(path)
        try:
            self._file = gsd.fl.open(str(path), "r")
        except (OSError, RuntimeError):
            raise TrajectoryError(f"{path}: not a GSD file, or cannot be read") from None
        self.frames = int(self._file.nframes)
        self.closed = False

    def close(self) -> None:
        """Close the file. TrajectoryError for what is asked of it afterwards."""
        self._file.close()
        self.closed = True

    def has(self, name: str, frame: int = 0) -> bool:
        """Whether a chunk is in a frame."""
        if self.closed:  # the library would say that it has none
            raise TrajectoryError(f"{self.path}: has been closed")
        return bool(self._file.chunk_exists(frame, name))

    def read(self, name: str, frame: int = 0) -> np.ndarray:
        """A chunk of a frame, or that of frame 0 if it stays the same. KeyError if there is none."""
        return self._file.read_chunk(frame if self.has(name, frame) else 0, name)

    def rows(self, name: str, count: int, default: tuple[float, ...], frame: int = 0) -> np.ndarray:
        """``count`` rows like ``default`` of numbers for the particles, which stands for what is not in the file.

        float64, (count, len(default)). TrajectoryError if there are others, or if they are not finite.
        """
        if not self.has(name, frame) and not self.has(name):
            return np.tile(np.asarray(default, dtype=np.float64), (count, 1))
        values = self.read(name, frame).astype(np.float64)
        if values.size != count * len(default) or not np.isfinite(values).all():
            what = f"{name} of frame {frame} is not {len(default)} finite numbers a particle"
            raise TrajectoryError(f"{self.path}: damaged: {what}")
        return values.reshape(count, len(default))


def cut(path: Path, frames: int) -> None:
    """Let a GSD file hold its first ``frames`` frames only, as if no more had come. TrajectoryError if it is none."""
    header, entries = _index(path)
    # An index ends at the first entry that points nowhere; frames stand in it in their order.
    entries[entries["frame"] >= frames] = 0
    with path.open("r+b") as file:
        file.seek(int(header["index_location"]))
        file.write(entries.tobytes())


def room_in_index(path: Path, needed: int) -> int:
    """How many more chunks the index of a GSD file has room for: at least as many as are ``needed``, made if need be.

    The library makes room as well, but does not notice when it could not: on a full disk it would write what comes
    next over frames. TrajectoryError if it is no GSD file, OSError if there is no room on the disk.
    """
    header, entries = _index(path)
    used = np.count_nonzero(entries["location"])
    if len(entries) - used >= needed:
        return int(len(entries) - used)
    grown = np.zeros(2 * len(entries) + needed, _ENTRY)
    grown[:used] = entries[:used]
    header["index_entries"] = len(grown)
    with path.open("r+b") as file:
        header["index_location"] = file.seek(0, os.SEEK_END)
        file.write(grown.tobytes())
        file.flush()
        os.fsync(file.fileno())  # before the header says that it is there
        file.seek(0)
        file.write(header.tobytes())
    return int(len(grown) - used)


def _check_index(path: Path) -> None:
    """TrajectoryError if a file is not GSD, or if its index points to what is not in it."""
    size = os.path.getsize(path)
    _, entries = _index(path)
    entries = entries[: np.argmax(entries["location"] == 0) if (entries["location"] == 0).any() else None]
    frame = entries["frame"]
    # In float64: whole numbers of damaged files would overflow.
    numbers = entries["rows"].astype(np.float64) * np.maximum(entries["columns"], 1)
    known = (entries["type"] >= 1) & (entries["type"] < len(_TYPE_BYTES))
    bytes_each = _TYPE_BYTES[np.where(known, entries["type"], 0)]
    inside = (entries["location"] > 0) & (entries["location"] + numbers * bytes_each <= size)
    ordered = (frame <= len(entries)) & (np.diff(frame.astype(np.float64), prepend=0.0) >= 0.0)
    if not (known & inside & ordered).all():
        raise TrajectoryError(f"{path}: damaged: its index points to what is not there")


def _index(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """The header of a file and all places of its index. TrajectoryError if it is not GSD, or if they are not there."""
    size = os.path.getsize(path)
    with path.open("rb") as file:
        start = file.read(_HEADER.itemsize)
        header = np.frombuffer(start, _HEADER).copy()[0] if len(start) == _HEADER.itemsize else None
        if header is None or header["magic"] != _MAGIC:
            raise TrajectoryError(f"{path}: not a GSD file, or cannot be read")
        blocks = (("index", _ENTRY.itemsize), ("namelist", _NAME_BYTES))
        for block, each in blocks:
            if int(header[f"{block}_location"]) + each * int(header[f"{block}_entries"]) > size:
                raise TrajectoryError(f"{path}: damaged: its {block} is not all there")
        file.seek(int(header["index_location"]))
        entries = np.frombuffer(file.read(_ENTRY.itemsize * int(header["index_entries"])), _ENTRY)
    return header, entries.copy()
