"""The AABB stream of the Broadmark benchmark: boxes frame by frame, so that others can time the same frames.

Layout, little-endian, from Broadmark's public source (Y. R. Serpa, M. A. F. Rodrigues, "Broadmark: A Testing Framework
for Broad-Phase Collision Detection Algorithms", Computer Graphics Forum 39, 2020; Algorithms/Core/Scene.h):

    offset  bytes
         0    128  name of the scene, text, ended by a zero byte
       128    128  name of the kind of objects, likewise
       256     16  four int32: number of objects n, number of frames, 0, 0
       272     32  box of the world
       304   32 n  the boxes of the first frame, and so on for each frame

A box is eight float32: lower x y z, 0, upper x y z, 0.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from particlesim.core.atomic_write import atomic_write

_HEADER = np.dtype(
    [
        ("scene", "S128"),
        ("objects", "S128"),
        ("count", "<i4"),
        ("frames", "<i4"),
        ("zeros", "<i4", 2),
        ("world", "<f4", 8),
    ]
)
_BOX_BYTES = 32


class StreamError(ValueError):
    """A file that is no AABB stream, or a broken one, in one line."""


class Stream(NamedTuple):
    """Boxes of n objects in k frames."""

    scene: str
    objects: str
    world: np.ndarray  # (2, 3) float64, lower and upper corner [m]
    lower: np.ndarray  # (k, n, 3) float64 [m]
    upper: np.ndarray  # (k, n, 3) float64 [m]

    def frames(self) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Lower and upper corners (n, 3) of the boxes of each frame."""
        return zip(self.lower, self.upper, strict=True)


def write_stream(path: str | Path, stream: Stream) -> None:
    """Write a stream; the file appears whole or not at all.

    Coordinates are rounded to float32.  Rounding keeps the order of numbers, so boxes that overlap still do.
    StreamError if there is no frame or no box, names are too long or coordinates beyond float32; OSError if the file
    cannot be written.
    """
    frames, count, _ = stream.lower.shape
    names = [name.encode() for name in (stream.scene, stream.objects)]
    if not frames or not count:
        raise StreamError(f"{path}: a stream needs a frame and a box in it")
    if max(map(len, names)) > 127:
        raise StreamError(f"{path}: the names in a stream have at most 127 bytes")
    header = np.zeros(1, dtype=_HEADER)
    header["scene"], header["objects"], header["count"], header["frames"] = *names, count, frames
    header["world"] = _padded(stream.world[:1], stream.world[1:], path)
    with atomic_write(path) as hidden, hidden.open("wb") as file:
        file.write(header.tobytes())
        for lower, upper in stream.frames():
            file.write(_padded(lower, upper, path).tobytes())


def _padded(lower: np.ndarray, upper: np.ndarray, path: str | Path) -> np.ndarray:
    """Boxes as rows of eight float32. StreamError if a coordinate is beyond them."""
    rows = np.zeros((len(lower), 8), dtype="<f4")
    with np.errstate(over="ignore"):
        rows[:, 0:3], rows[:, 4:7] = lower, upper
    if not np.isfinite(rows).all():
        raise StreamError(f"{path}: a coordinate is beyond float32")
    return rows


def read_stream(path: str | Path) -> Stream:
    """Read a stream. StreamError, in one line, if the file is no such stream; OSError if it cannot be read."""
    path = Path(path)
    if not path.is_file():
        raise StreamError(f"{path}: no such file")
    with path.open("rb") as file:
        head = file.read(_HEADER.itemsize)
        if len(head) < _HEADER.itemsize:
            raise StreamError(f"{path}: not an AABB stream: shorter than its header of {_HEADER.itemsize} bytes")
        header = np.frombuffer(head, dtype=_HEADER)[0]
        count, frames = int(header["count"]), int(header["frames"])
        if count < 1 or frames < 1 or header["zeros"].any():
            raise StreamError(
                f"{path}: not an AABB stream: {count} objects in {frames} frames, then {header['zeros'].tolist()}"
            )
        there, expected = os.fstat(file.fileno()).st_size - len(head), _BOX_BYTES * count * frames
        if there != expected:
            raise StreamError(
                f"{path}: {there} bytes of boxes, expected {expected} for {count} objects in {frames} frames"
            )
        rows = np.fromfile(file, dtype="<f4").reshape(frames, count, 2, 4)[..., :3].astype(np.float64)
    lower, upper = np.ascontiguousarray(rows[:, :, 0]), np.ascontiguousarray(rows[:, :, 1])
    world = header["world"].reshape(2, 4)[:, :3].astype(np.float64)
    _check_boxes(lower, upper, path)
    return Stream(_text(header["scene"], path), _text(header["objects"], path), world, lower, upper)


def _check_boxes(lower: np.ndarray, upper: np.ndarray, path: Path) -> None:
    """StreamError that names the first box that is none."""
    wrong = np.argwhere(~((lower <= upper) & np.isfinite(lower) & np.isfinite(upper)).all(axis=2))
    if len(wrong):
        frame, number = wrong[0]
        raise StreamError(f"{path}: box {number} of frame {frame} is not finite or upside down")


def _text(raw: bytes, path: Path) -> str:
    try:
        return bytes(raw).split(b"\0")[0].decode()
    except UnicodeDecodeError:
        raise StreamError(f"{path}: not an AABB stream: a name in it is no text") from None
