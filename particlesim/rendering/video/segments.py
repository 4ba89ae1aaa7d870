"""A movie as closed segments in a folder, joined without encoding again: what is encoded once is never lost."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Mapping
from pathlib import Path
from typing import BinaryIO

import numpy as np

from particlesim.core.constants import SEGMENT
from particlesim.rendering.errors import RenderError
from particlesim.rendering.video.encoder import NO_PICTURES, Encoder
from particlesim.rendering.video.joining import join_files


def segment_file(folder: Path, number: int) -> Path:
    """Where a closed segment lies."""
    return folder / f"{number:06}.mp4"


class Segments:
    """Encode a movie into a folder, from its start or from where it was left. A context manager.

    The pictures of the segment that is not yet closed lie beside it as they are, so that it can be encoded again.

    Parameters
    ----------
    folder : Path
        Where segments and pictures lie; it must exist.
    fps : float
        Pictures a second.
    size : (int, int)
        Width and height of the pictures, both even.
    crf : int
        x264's constant rate factor, 0 (lossless) to 51 (smallest file).
    sent : int
        How many pictures of the movie were sent, and kept by ``flush``, before it was left.
    first : int
        The picture that a part of a movie begins with, which begins a segment.
    ending : str
        Of the whole movie: .mp4, .webm or .gif.
    channels : int
        Of the pictures: 4 if they have no background, of which .webm alone knows.
    """

    def __init__(
        self,
        folder: Path,
        fps: float,
        size: tuple[int, int],
        crf: int,
        sent: int = 0,
        first: int = 0,
        ending: str = ".mp4",
        channels: int = 3,
    ) -> None:
        self._folder, self._fps, self._size, self._crf, self._ending = folder, fps, size, crf, ending
        self._channels = channels
        self._encoder: Encoder | None = None
        self._pictures: BinaryIO | None = None  # of the segment that is open
        self.sent, self._first = sent, first
        self.seconds = 0.0  # spent encoding
        for part in folder.glob("*.part"):  # of runs that were killed
            part.unlink()
        if sent % SEGMENT and not self._segment(sent // SEGMENT).exists():
            self._open(sent // SEGMENT, sent % SEGMENT)

    def __enter__(self) -> Segments:
        return self

    def __exit__(self, *_: object) -> None:
        if self._encoder is not None:
            self._encoder.close()
        if self._pictures is not None:
            self._pictures.close()

    def send(self, image: np.ndarray) -> None:
        """Add a picture (h, w, channels) uint8 sRGB. ValueError for another size, RenderError if ffmpeg fails."""
        number, place = divmod(self.sent, SEGMENT)
        self.sent += 1
        if self._segment(number).exists():  # closed after what was kept last, with this very picture
            return
        if self._encoder is None:
            self._open(number)
        assert self._encoder is not None and self._pictures is not None
        self._encoder.send(image)
        self._pictures.write(np.ascontiguousarray(image).data)
        if place == SEGMENT - 1:
            self._close(number)

    def flush(self) -> None:
        """Let all that was sent be in the folder."""
        if self._pictures is not None:
            self._pictures.flush()

    def close_open_one(self) -> None:
        """Close the segment that is open, if one is: the last of a movie or part. RenderError if ffmpeg fails."""
        if self._encoder is not None:
            self._close((self.sent - 1) // SEGMENT)

    def join(self, tags: Mapping[str, str]) -> None:
        """Make the whole movie, or part, with these tags. RenderError if it has no pictures or ffmpeg fails."""
        if self.sent == self._first:
            raise RenderError(NO_PICTURES)
        self.close_open_one()
        last = (self.sent - 1) // SEGMENT
        names = [self._segment(number).name for number in range(self._first // SEGMENT, last + 1)]
        start = time.perf_counter()
        join_files(self._folder, names, self._whole, tags)
        self.seconds += time.perf_counter() - start

    def appear(self, path: Path) -> None:
        """Let it be where it is to go."""
        os.replace(self._whole, path)

    @property
    def _whole(self) -> Path:
        return self._folder / f"whole{self._ending}"

    def _segment(self, number: int) -> Path:
        return segment_file(self._folder, number)

    def _part(self, number: int) -> Path:
        # The ffmpeg of a run that was killed may still be writing: each process has names of its own.
        return self._folder / f"{number:06}.{os.getpid()}.part"

    def _raw(self, number: int) -> Path:
        return self._folder / f"{number:06}.rgb"

    def _open(self, number: int, kept: int = 0) -> None:
        """Begin a segment, or begin it again with the pictures of it that were kept."""
        codec = self._crf, self._ending, self._channels
        self._encoder = Encoder(self._part(number), self._fps, self._size, *codec)
        self._pictures = pictures = self._raw(number).open("r+b" if kept else "wb")
        width, height = self._size
        shape = height, width, self._channels
        for _ in range(kept):
            self._encoder.send(np.frombuffer(pictures.read(math.prod(shape)), np.uint8).reshape(shape))
        pictures.truncate()  # of what came after

    def _close(self, number: int) -> None:
        assert self._encoder is not None and self._pictures is not None
        self._encoder.finish()
        self.seconds += self._encoder.seconds
        self._encoder.close()
        self._pictures.close()
        self._encoder = self._pictures = None
        os.replace(self._part(number), self._segment(number))
        self._raw(number).unlink()
