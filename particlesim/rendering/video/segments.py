"""A movie as closed segments in a folder, joined without encoding again: what is encoded once is never lost."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import BinaryIO

import numpy as np

from particlesim.core.constants import SEGMENT
from particlesim.rendering.errors import RenderError
from particlesim.rendering.gl.platform import ffmpeg
from particlesim.rendering.video.encoder import Encoder, failure


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
    """

    def __init__(
        self, folder: Path, fps: float, size: tuple[int, int], crf: int, sent: int = 0, first: int = 0
    ) -> None:
        self._folder, self._fps, self._size, self._crf = folder, fps, size, crf
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
        """Add a picture (height, width, 3) uint8 sRGB. ValueError for another size, RenderError if ffmpeg fails."""
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

    def join(self, path: Path, tags: Mapping[str, str]) -> None:
        """Write the whole movie, or part, to ``path`` with these tags.

        RenderError if it has no pictures or ffmpeg fails.
        """
        if self.sent == self._first:
            raise RenderError(f"{path}: there are no frames to make a movie of")
        last = (self.sent - 1) // SEGMENT
        if self._encoder is not None:
            self._close(last)
        names = [self._segment(number).name for number in range(self._first // SEGMENT, last + 1)]
        join_files(self._folder, names, path, tags)

    def _segment(self, number: int) -> Path:
        return self._folder / f"{number:06}.mp4"

    def _part(self, number: int) -> Path:
        # The ffmpeg of a run that was killed may still be writing: each process has names of its own.
        return self._folder / f"{number:06}.{os.getpid()}.part"

    def _raw(self, number: int) -> Path:
        return self._folder / f"{number:06}.rgb"

    def _open(self, number: int, kept: int = 0) -> None:
        """Begin a segment, or begin it again with the pictures of it that were kept."""
        self._encoder = Encoder(self._part(number), self._fps, self._size, self._crf)
        self._pictures = pictures = self._raw(number).open("r+b" if kept else "wb")
        width, height = self._size
        for _ in range(kept):
            self._encoder.send(np.frombuffer(pictures.read(3 * width * height), np.uint8).reshape(height, width, 3))
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


def join_files(folder: Path, names: Sequence[str], path: Path, tags: Mapping[str, str]) -> None:
    """Write movies in a folder, one after the other, to ``path`` with these tags. RenderError if ffmpeg fails."""
    (folder / "segments.txt").write_text("".join(f"file {name}\n" for name in names))
    command = ["-y", "-f", "concat", "-i", "segments.txt", "-c", "copy"]
    for name, text in tags.items():
        command += ["-metadata", f"{name}={text}"]
    # Without the bit rate, which would tell of the files that it was joined from, and how often.
    command += ["-movflags", "+faststart", "-write_btrt", "0", "-fflags", "+bitexact", "-f", "mp4"]
    command += [f"file:{path.absolute()}"]
    done = _ffmpeg(command, folder)
    if done.returncode:
        raise failure(done.returncode, done.stderr)


def pictures_in(path: Path) -> int:
    """How many pictures of a movie can be read, without decoding them."""
    done = _ffmpeg(["-i", f"file:{path.absolute()}", "-c", "copy", "-f", "framecrc", "-"], path.parent)
    # A line each; lines about all of them begin with a number sign.
    return sum(not line.startswith(b"#") for line in done.stdout.splitlines())


def _ffmpeg(arguments: Sequence[str], folder: Path) -> subprocess.CompletedProcess[bytes]:
    # A session of its own: Ctrl-C is for us to handle.
    command = [ffmpeg(), "-v", "error", *arguments]
    return subprocess.run(command, cwd=folder, capture_output=True, start_new_session=True, check=False)
