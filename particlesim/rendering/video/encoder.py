"""Images to a file: H.264 and others through ffmpeg, single images through Pillow."""

from __future__ import annotations

import contextlib
import queue
import signal
import subprocess
import tempfile
import threading
import time
from collections.abc import Callable, Mapping
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

# Encoders divide their work by the number of threads, and the bytes depend on it: fixed, not the machine's.
_THREADS = 4

# Video players take untagged colours for those of old television; the tags say what they are.
_YUV = ["-vf", "scale=out_color_matrix=bt709:out_range=tv:flags=bicubic+accurate_rnd+bitexact,format=yuv420p"]
_TAGS = ["-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "bt709", "-color_range", "tv"]

NO_PICTURES = "there are no frames to make a movie of"

# x264 would write its settings into the file (unit type 6).
_WITHOUT_SETTINGS = ["-bsf:v", "filter_units=remove_types=6"]


def write_image(path: str | Path, image: np.ndarray, text: Mapping[str, str] | None = None) -> None:
    """Write an image (height, width, 3 or 4) uint8 sRGB in the format of the path's ending, such as .png, with texts.

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

    It encodes images (height, width, 3) uint8 sRGB of ``size`` (width, height, both even) to ``path``, an MP4 file: as
    movies with this ``ending`` have them, or for a .gif so that nothing is lost. The same images give the same bytes. A
    .webm may have four ``channels``, and is then encoded to a file of its own kind.
    ``close`` ends it, whatever it is at; ``seconds`` were spent encoding.
    """

    def __init__(
        self, path: Path, fps: float, size: tuple[int, int], crf: int, ending: str = ".mp4", channels: int = 3
    ) -> None:
        self._shape = size[1], size[0], channels
        codec, kind = (_CODECS[ending](crf), "mp4") if channels == 3 else (_vp9_with_alpha(crf), "webm")
        command = _command(path, fps, self._shape, codec, kind)
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
        if image.shape != self._shape or image.dtype != np.uint8:
            raise ValueError(f"an image of shape {image.shape} {image.dtype}, not {self._shape} uint8")
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


def _command(path: Path, fps: float, shape: tuple[int, int, int], codec: list[str], kind: str) -> list[str]:
    rate = str(Fraction(fps).limit_denominator(1001))
    height, width, channels = shape
    pixels = ["-pix_fmt", "rgb24" if channels == 3 else "rgba", "-s", f"{width}x{height}"]
    source = ["-f", "rawvideo", *pixels, "-r", rate, "-i", "-"]
    # No versions or dates in the file: the same images, the same bytes.
    bare = ["-threads", str(_THREADS), "-fflags", "+bitexact", "-flags:v", "+bitexact"]
    # A path as it is: "12:30.mp4" would be a protocol.
    target = ["-f", kind, f"file:{path}"]
    return [ffmpeg(), "-y", "-v", "error", *source, "-an", *codec, *bare, *target]


def _h264(crf: int) -> list[str]:
    return [*_YUV, *_TAGS, "-c:v", "libx264", "-preset", "veryfast", "-crf", str(crf), *_WITHOUT_SETTINGS]


def _vp9(crf: int) -> list[str]:
    # Its rate factors go up to 63 where x264's end at 51; an average bit rate of 0 lets them alone decide. The speed is
    # such that two cores encode about as fast as they draw.
    constant = ["-crf", str(round(crf * 63 / 51)), "-b:v", "0"]
    return [*_YUV, *_TAGS, "-c:v", "libvpx-vp9", *constant, "-deadline", "good", "-cpu-used", "5", "-row-mt", "1"]


def _vp9_with_alpha(crf: int) -> list[str]:
    # Alpha goes as a second stream of grey; frames that are not shown would have none.
    pictures = [_YUV[0], _YUV[1].replace("yuv420p", "yuva420p")]
    return [*pictures, *_vp9(crf)[len(_YUV) :], "-auto-alt-ref", "0"]


def _lossless(crf: int) -> list[str]:
    return ["-c:v", "libx264rgb", "-preset", "ultrafast", "-qp", "0", *_WITHOUT_SETTINGS]


# How segments of a movie are encoded at a rate factor of x264, by the ending of the whole.
_CODECS: dict[str, Callable[[int], list[str]]] = {".mp4": _h264, ".webm": _vp9, ".gif": _lossless}
