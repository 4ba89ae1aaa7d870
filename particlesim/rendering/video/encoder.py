"""Images to a file: H.264 through ffmpeg, single images through Pillow."""

from __future__ import annotations

import contextlib
import queue
import signal
import subprocess
import tempfile
import threading
import time
from collections.abc import Mapping
from fractions import Fraction
from pathlib import Path
from typing import NoReturn

import numpy as np
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from particlesim.core.atomic_write import atomic_write
from particlesim.rendering.errors import RenderError
from particlesim.rendering.gl.platform import ffmpeg

# Images that wait for the encoder: enough to even out the two, few enough to cost little memory.
_WAITING = 4

# x264 divides its work by the number of threads, and the bytes depend on it: fixed, not the machine's.
_THREADS = 4


def write_image(path: str | Path, image: np.ndarray, text: Mapping[str, str] | None = None) -> None:
    """Write an image (height, width, 3) uint8 sRGB in the format of the path's ending, such as .png, and texts with it.

    RenderError for an ending that stands for no format; OSError for a path that cannot be written.
    """
    written = PngInfo()
    for name, words in (text or {}).items():
        written.add_text(name, words)
    with atomic_write(path) as hidden:
        try:
            Image.fromarray(image).save(hidden, pnginfo=written)
        except ValueError as error:
            raise RenderError(f"{path}: {error}") from error


class Encoder:
    """ffmpeg in a process of its own, fed by a thread, so that the next image is drawn while one is encoded.

    It encodes images (height, width, 3) uint8 sRGB of ``size`` (width, height, both even) to ``path``, H.264, yuv420p.
    The same images give the same bytes. ``close`` ends it, whatever it is at; ``seconds`` were spent encoding.
    """

    def __init__(self, path: Path, fps: float, size: tuple[int, int], crf: int) -> None:
        self._size = size
        command = _command(path, fps, size, crf)
        self._log = tempfile.TemporaryFile()  # noqa: SIM115  (closed in close)
        # A session of its own: Ctrl-C is for us to handle, and ends ffmpeg from here.
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=self._log, stderr=self._log, start_new_session=True
        )
        self._images: queue.Queue[np.ndarray | None] = queue.Queue(maxsize=_WAITING)
        self._broken = threading.Event()
        self._feeder = threading.Thread(target=self._feed, name="ffmpeg feeder", daemon=True)
        self._feeder.start()
        self.seconds = 0.0

    def close(self) -> None:
        """End ffmpeg if it has not ended, and free what it took."""
        if self._process.poll() is None:
            self._process.kill()
        self._images.put(None)
        self._feeder.join()
        self._process.wait()
        self._log.close()

    def send(self, image: np.ndarray) -> None:
        """Hand over an image, waiting while ffmpeg is behind. ValueError for another size, RenderError if it fails."""
        width, height = self._size
        if image.shape != (height, width, 3) or image.dtype != np.uint8:
            raise ValueError(f"an image of shape {image.shape} {image.dtype}, not {(height, width, 3)} uint8")
        if self._broken.is_set():
            self._fail()
        self._images.put(np.ascontiguousarray(image))

    def finish(self) -> None:
        """Wait until all is encoded. RenderError if it fails."""
        self._images.put(None)
        self._feeder.join()
        start = time.perf_counter()
        if self._process.wait() or self._broken.is_set():
            self._fail()
        self.seconds += time.perf_counter() - start

    def _feed(self) -> None:
        pipe = self._process.stdin
        assert pipe is not None
        while (image := self._images.get()) is not None:
            # A broken encoder still empties the queue: nothing may wait for it.
            if not self._broken.is_set():
                start = time.perf_counter()
                try:
                    pipe.write(image.data)
                except OSError:
                    self._broken.set()
                self.seconds += time.perf_counter() - start
        with contextlib.suppress(OSError):
            pipe.close()

    def _fail(self) -> NoReturn:
        status = self._process.wait()
        self._log.seek(0)
        raise failure(status, self._log.read())


def failure(status: int, log: bytes) -> RenderError:
    """The error that says how ffmpeg ended, with the last line that it wrote."""
    lines = log.decode(errors="replace").split("\n")
    last = next((line.strip() for line in reversed(lines) if line.strip()), "no message")
    how = f"was ended by {signal.Signals(-status).name}" if status < 0 else f"failed with exit status {status}"
    return RenderError(f"ffmpeg {how}: {last}")


def _command(path: Path, fps: float, size: tuple[int, int], crf: int) -> list[str]:
    rate = str(Fraction(fps).limit_denominator(1001))
    source = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{size[0]}x{size[1]}", "-r", rate, "-i", "-"]
    # Video players take untagged colours for those of old television; these say what they are.
    scale = "scale=out_color_matrix=bt709:out_range=tv:flags=bicubic+accurate_rnd+bitexact,format=yuv420p"
    tags = ["-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "bt709", "-color_range", "tv"]
    codec = ["-c:v", "libx264", "-preset", "veryfast", "-crf", str(crf), "-threads", str(_THREADS)]
    # No versions, dates or settings in the file (unit type 6): the same images, the same bytes.
    bare = ["-fflags", "+bitexact", "-flags:v", "+bitexact", "-bsf:v", "filter_units=remove_types=6"]
    # A path as it is: "12:30.mp4" would be a protocol.
    target = ["-f", "mp4", f"file:{path}"]
    return [ffmpeg(), "-y", "-v", "error", *source, "-an", "-vf", scale, *codec, *tags, *bare, *target]
