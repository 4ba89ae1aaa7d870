"""A movie as numbered pictures (PNG), in a folder until all of them are there."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

import numpy as np

from particlesim.core.output_path import picture_path
from particlesim.rendering.errors import RenderError
from particlesim.rendering.video.encoder import NO_PICTURES, write_image

# Pictures that are compressed beside each other, and those that wait for it: enough to keep up with the drawing.
_WRITERS, _WAITING = 2, 8


class PictureFiles:
    """Write the pictures of a movie, from its start or from where it was left. A context manager.

    Parameters
    ----------
    folder : Path
        Where they lie until all are there; it must exist.
    text : callable
        What is written into a picture, by its number.
    sent : int
        How many pictures were sent, and kept by ``flush``, before the movie was left.
    """

    def __init__(self, folder: Path, text: Callable[[int], Mapping[str, str]], sent: int = 0) -> None:
        self._folder, self._text, self.sent = folder, text, sent
        self._pool = ThreadPoolExecutor(_WRITERS, thread_name_prefix="picture writer")
        self._waiting: deque[Future[None]] = deque()
        self.seconds = 0.0  # they are written beside other work

    def __enter__(self) -> PictureFiles:
        return self

    def __exit__(self, *_: object) -> None:
        self._pool.shutdown(cancel_futures=True)

    def send(self, image: np.ndarray) -> None:
        """Add a picture (height, width, 3) uint8 sRGB. OSError if one before it could not be written."""
        path, text = self._hidden(self.sent), self._text(self.sent)
        self._waiting.append(self._pool.submit(write_image, path, image, text))
        self.sent += 1
        while len(self._waiting) > _WAITING:
            self._waiting.popleft().result()

    def flush(self) -> None:
        """Let all that was sent be in the folder. OSError if it could not be written."""
        while self._waiting:
            self._waiting.popleft().result()

    def join(self, tags: Mapping[str, str]) -> None:
        """Wait until all are written, each with its own text. RenderError if there are none, OSError as for send."""
        if not self.sent:
            raise RenderError(NO_PICTURES)
        self.flush()

    def appear(self, path: Path) -> None:
        """Let them be where they are to go; ``path`` has a place for their number: ``x_%05d.png``."""
        for number in range(self.sent):
            hidden, place = self._hidden(number), picture_path(path, number)
            if hidden.exists() or not place.exists():  # or it was left in the midst of this
                os.replace(hidden, place)

    def _hidden(self, number: int) -> Path:
        return self._folder / f"{number:08}.png"
