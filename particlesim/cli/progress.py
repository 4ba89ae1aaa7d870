"""How work in progress is shown: a bar on a terminal, a line now and then elsewhere, or nothing."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress

from rich.console import Console
from rich.progress import BarColumn, Progress, ProgressColumn, Task, TextColumn
from rich.text import Text

from particlesim.core.constants import COMPILING
from particlesim.core.durations import in_words

# Seconds between lines where there is no terminal.
_INTERVAL = 5.0

# The first work loads kernels and says nothing about the rest; the time left is told from this many seconds after it.
_TIMED = 1.0


class _Rate:
    """How long the rest of a phase takes, from how long its frames took."""

    def __init__(self) -> None:
        self._start: tuple[float, float] | None = None

    def left(self, done: float, total: int) -> float | None:
        """Seconds left after ``done`` of ``total`` frames, None if that cannot be said yet."""
        now = time.monotonic()
        if done <= 1 or self._start is None:
            self._start = now, max(done, 1.0)
            return None
        begun, first = self._start
        if done <= first or now - begun < _TIMED:
            return None
        return (now - begun) / (done - first) * (total - done)


def _words(seconds: float) -> str:
    """A time left as people say it."""
    return f"{in_words(seconds)} left"


def _unit_of(phase: str, usual: str) -> str:
    """What is counted in a phase."""
    return "kernel" if phase == COMPILING else usual


class _Lines:
    """Plain lines to standard error: what is going on, ``unit`` k of n, time left."""

    def __init__(self, unit: str) -> None:
        self._unit = unit
        self._phase = ""
        self._last = time.monotonic()
        self._rate = _Rate()

    def __call__(self, phase: str, done: float, total: int) -> None:
        now = time.monotonic()
        left = self._rate.left(done, total)
        if phase == self._phase and now - self._last < _INTERVAL and done < total:
            return
        self._phase, self._last = phase, now
        unit = _unit_of(phase, self._unit)
        counted = f": {unit} {done} of {total}" if done else f" {total} {unit}s"
        ending = f", {_words(left)}" if left is not None and done < total else ""
        with suppress(OSError):  # nobody reads it any more, which is no reason to end
            print(f"{phase}{counted}{ending}", file=sys.stderr, flush=True)


class _TimeLeft(ProgressColumn):
    """The time left, where the task knows it."""

    def render(self, task: Task) -> Text:
        """The words beside the bar."""
        left = task.fields.get("left")
        return Text("" if left is None else _words(left))


class _Bar:
    """A bar with the same on a terminal."""

    def __init__(self, bar: Progress, unit: str) -> None:
        self._bar = bar
        self._unit = unit
        self._task = bar.add_task("starting", total=None)
        self._rate = _Rate()

    def __call__(self, phase: str, done: int, total: int) -> None:
        unit = _unit_of(phase, self._unit)
        counted = f"{unit} {done} of {total}" if done else f"{total} {unit}s"
        self._bar.update(
            self._task,
            completed=done,
            total=total if done else None,
            description=f"{phase}  {counted}",
            left=self._rate.left(done, total),
        )


@contextmanager
def shown_progress(quiet: bool, unit: str = "frame") -> Iterator[_Lines | _Bar | None]:
    """A progress callback, fit for where standard error goes, that counts in ``unit``; None if ``quiet``."""
    console = Console(stderr=True)
    if quiet:
        yield None
    elif console.is_terminal:
        columns = TextColumn("{task.description}"), BarColumn(), _TimeLeft()
        with Progress(*columns, console=console, transient=True) as bar:
            yield _Bar(bar, unit)
    else:
        yield _Lines(unit)
