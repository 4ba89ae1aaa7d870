"""How work in progress is shown: a bar on a terminal, a line now and then elsewhere, or nothing."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

# Seconds between lines where there is no terminal.
_INTERVAL = 5.0


class _Lines:
    """Plain lines to standard error: what is going on, frame k of n, time left."""

    def __init__(self) -> None:
        self._phase = ""
        self._start = self._last = time.monotonic()

    def __call__(self, phase: str, done: int, total: int) -> None:
        now = time.monotonic()
        if phase != self._phase:
            self._phase, self._start = phase, now
        elif now - self._last < _INTERVAL and done < total:
            return
        self._last = now
        left = (now - self._start) / done * (total - done) if done > 1 else None
        ending = f", {left:.0f} s left" if left is not None and done < total else ""
        counted = f": frame {done} of {total}" if done else f" {total} frames"
        print(f"{phase}{counted}{ending}", file=sys.stderr, flush=True)


class _Bar:
    """A bar with the same on a terminal."""

    def __init__(self, bar: Progress) -> None:
        self._bar = bar
        self._task = bar.add_task("")
        self._phase = ""

    def __call__(self, phase: str, done: int, total: int) -> None:
        if phase != self._phase:
            self._phase = phase
            self._bar.reset(self._task, total=total)
        counted = f"frame {done} of {total}" if done else f"{total} frames"
        self._bar.update(self._task, completed=done, description=f"{phase}  {counted}")


@contextmanager
def shown_progress(quiet: bool) -> Iterator[_Lines | _Bar | None]:
    """A progress callback for ``simulate`` and ``render``, fit for where standard error goes; None if ``quiet``."""
    console = Console(stderr=True)
    if quiet:
        yield None
    elif console.is_terminal:
        left = TextColumn("left")
        columns = TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn(), left
        with Progress(*columns, console=console, transient=True) as bar:
            yield _Bar(bar)
    else:
        yield _Lines()
