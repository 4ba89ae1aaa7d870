"""Processes that compile into one cache beside each other: what one is at, another waits for, and loads."""

from __future__ import annotations

import fcntl
import functools
import os
import time
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

# How long a function is waited for before it is compiled here as well [s]: that process may have been stopped. The
# longest takes a few seconds, and what it calls is waited for one by one.
_PATIENCE = 30.0

# How often it is looked whether the other process is done [s].
_INTERVAL = 0.01


@contextmanager
def compiled_here(file: Path, function: Callable[..., Any]) -> Iterator[None]:
    """Wait until no other process compiles ``function``, and let none do so meanwhile, by a lock in ``file``.

    A lock is a byte of the file. It belongs to the process: to ask for it once more is no harm, and it ends with it.
    """
    place = zlib.crc32(f"{function.__module__}.{function.__qualname__}".encode())
    locks = _opened(file)
    if locks is None or not _lock(locks, place):
        yield
        return
    try:
        yield
    finally:
        fcntl.lockf(locks, fcntl.LOCK_UN, 1, place)


@functools.cache
def _opened(file: Path) -> int | None:
    """The file of locks, open until the end: locks end when any opening of their file does. None if it cannot be."""
    try:
        return os.open(file, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
    except OSError:
        return None


def _lock(locks: int, place: int) -> bool:
    """Whether the lock is taken; False if there are no locks here, or patience ends."""
    until = time.monotonic() + _PATIENCE
    while time.monotonic() < until:
        try:
            fcntl.lockf(locks, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, place)
            return True
        except BlockingIOError:
            time.sleep(_INTERVAL)
        except OSError:
            return False
    return False
