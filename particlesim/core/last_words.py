"""What is said of a program that ends without a word of its own: killed, out of memory, or crashed in a driver.

A process that does nothing else holds the other end of a pipe, hears when the program is no more, and says in one line
what the program told it last. It is in a session of its own: what ends the program does not end it.
"""

from __future__ import annotations

import faulthandler
import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import NoReturn

# The end of the pipe that words go into, while somebody listens.
_pipe: int | None = None

# Before what is told; after it comes what Python writes of a crash, which begins with these words.
_MARK, _CRASH = b"\0", b"Fatal Python error: "

# In the files of functions that call an OpenGL driver.
_DRAWING = b"/OpenGL/", b"/pyrender/", b"/rendering/gl/"


@contextmanager
def watched() -> Iterator[None]:
    """Have it said, on standard error, if the process ends within the block, and not by leaving it."""
    global _pipe  # noqa: PLW0603  (a process has one end)
    _pipe = _pipe_to_listener()
    if _pipe is not None and not faulthandler.is_enabled():  # what is enabled, somebody wants to read
        faulthandler.enable(_pipe, all_threads=False)
    try:
        yield
    finally:
        last_words("")


def last_words(words: str) -> None:
    """What is to be said from now on if the process ends; if that is nothing, nothing but a crash is said."""
    if _pipe is not None:
        with suppress(OSError):  # nobody listens any more
            os.write(_pipe, _MARK + words.encode())


def _pipe_to_listener() -> int | None:
    """The end of a pipe to a new process that listens to it; None if there is no room for one more process."""
    heard, told = os.pipe()
    os.set_blocking(told, False)  # who stops the listener does not stop the work
    # What asks the program to end, and the group that it is in, is not for the listener.
    before = signal.pthread_sigmask(signal.SIG_BLOCK, signal.valid_signals())
    try:
        listener = os.fork()
    except OSError:
        os.close(told)
        told = -1
    else:
        if listener == 0:
            os.close(told)
            _listen(heard)
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
    os.close(heard)
    return told if told >= 0 else None


def _listen(pipe: int) -> NoReturn:
    """Wait for the end of the other process, say what there is to say, and end."""
    try:
        os.setsid()
        for stream in (0, 1):  # others may wait for their end
            os.close(stream)
        text = b""
        while piece := os.read(pipe, 4096):
            text += piece
            text = text[max(text.rfind(_MARK), 0) :]
        if text != _MARK:
            # A bar of progress hides the cursor, and leaves it amid a line.
            cleared = "\x1b[?25h\r\x1b[K" if sys.stderr.isatty() else ""
            print(f"{cleared}{_said_of(text.removeprefix(_MARK))}", file=sys.stderr, flush=True)
    finally:
        os._exit(0)


def _said_of(text: bytes) -> str:
    """The line of what was told last, and of what Python wrote of a crash after it."""
    words, _, crash = text.partition(_CRASH)
    return "; ".join(part for part in (_how(crash), words.decode()) if part)


def _how(crash: bytes) -> str:
    """How a process ended of which Python wrote this."""
    if not crash:
        return "killed, or out of memory"
    what = crash.partition(b"\n")[0].decode()
    return f"{'OpenGL' if any(file in crash for file in _DRAWING) else 'the program'} crashed ({what})"
