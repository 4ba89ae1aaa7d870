"""Pictures drawn beside each other, on all cores, while the next frames are simulated.

A picture depends on its frame and the look alone (see ``Renderer.draw``), and what takes time in it lets other threads
run. So threads do: processes would draw no faster, but would have everything to import again, and frames to be sent.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from types import TracebackType

import numpy as np

from particlesim.core.parallel import available_threads, limit_threads
from particlesim.rendering import Renderer
from particlesim.rendering.hud.history import History
from particlesim.rendering.look import Look
from particlesim.trajectory.frames import Frame

# Drawers at most: more are faster than pictures are encoded. What is left of the cores they share within pictures.
_MOST = 4

# Pictures in work or waiting, for each drawer: enough that none waits for the next frame; fewer, but one, where more
# of their frames would take too much memory [bytes].
_AHEAD = 2
_MEMORY = 2**30


class Drawers:
    """Draw the pictures of one movie. A context manager: it holds OpenGL contexts, one for each of its threads.

    Parameters
    ----------
    look : Look
        How they are drawn.
    pictures : int
        How many there will be.
    """

    def __init__(self, look: Look, pictures: int) -> None:
        threads = available_threads()
        count = max(1, min(threads, pictures, _MOST))
        self._look, self._threads = look, threads // count
        # Of one thread each, since a context belongs to a thread.
        self._pools = [ThreadPoolExecutor(1, thread_name_prefix="drawer") for _ in range(count)]
        self._renderers = [pool.submit(Renderer, look) for pool in self._pools]
        self.waiting: deque[Future[np.ndarray]] = deque()  # pictures in work, or waiting for it
        self.seconds = 0.0  # that nothing but pictures was waited for

    def __enter__(self) -> Drawers:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for picture in self.waiting:
            picture.cancel()
        for pool, renderer in zip(self._pools, self._renderers, strict=True):
            pool.submit(_close, renderer)
            pool.shutdown()

    def draw(self, frames: Iterable[tuple[Frame, History]]) -> Iterator[np.ndarray]:
        """The pictures of frames, each with what has passed before it, in their order. RenderError as for Renderer."""
        for number, (frame, history) in enumerate(frames):
            drawer = number % len(self._pools)
            self.waiting.append(self._pools[drawer].submit(self._draw, drawer, frame, history))
            while len(self.waiting) > min(_AHEAD * len(self._pools), max(1, _MEMORY // max(frame.nbytes, 1))):
                yield self._next()
        while self.waiting:
            yield self._next()

    def _next(self) -> np.ndarray:
        start = time.perf_counter()
        picture = self.waiting.popleft().result()
        self.seconds += time.perf_counter() - start
        return picture

    def _draw(self, drawer: int, frame: Frame, history: History) -> np.ndarray:
        with limit_threads(self._threads):
            return self._renderers[drawer].result().draw(frame, history)


def _close(renderer: Future[Renderer]) -> None:
    """Close a renderer, in its thread, if there is one."""
    if renderer.exception() is None:
        renderer.result().close()
