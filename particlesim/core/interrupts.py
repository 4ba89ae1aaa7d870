"""Interruptions: signals that ask a program to end, raised as exceptions, so that what is half done is undone."""

from __future__ import annotations

import math
import signal
import sys
import time
from types import FrameType
from typing import Any, NoReturn

# What ends a program from outside and leaves it time to clean up: Ctrl-C, kill, a terminal that closes.
_SIGNALS = signal.SIGINT, signal.SIGTERM, signal.SIGHUP

# What is said of them.
_SAID = {signal.SIGINT: "interrupted", signal.SIGTERM: "terminated", signal.SIGHUP: "hung up"}

# Signals that follow one within this time are the same wish, often from the same source; they do not disturb the
# cleaning up [s].
_GRACE = 2.0


class Interrupted(KeyboardInterrupt):
    """A signal that asks to end; ``number`` says which."""

    def __init__(self, number: int) -> None:
        super().__init__(signal.Signals(number).name)
        self.number = number


class _Raising:
    """What is called with a signal: raises Interrupted."""

    def __init__(self) -> None:
        self.first: Interrupted | None = None  # what has been raised
        self._raised = -math.inf
        self._usual_hook = sys.unraisablehook

    def __call__(self, number: int, frame: FrameType | None) -> None:
        if time.monotonic() - self._raised < _GRACE:
            return
        self._raised = time.monotonic()
        self.first = self.first or Interrupted(number)
        caller = _waiting_for_results(frame)
        if caller is None:
            raise Interrupted(number)
        _raise_in(caller, number)

    def hook(self, lost: Any) -> None:
        """Raise what Python cannot, such as in a __del__: it tells and forgets it, and the program would go on."""
        if isinstance(lost.exc_value, Interrupted):
            _raise_in(sys._getframe(1), lost.exc_value.number)
        elif self.first is None:  # what is left half made may fail as it is taken apart, which is nobody's concern
            self._usual_hook(lost)


def raise_signals() -> None:
    """From now on the signals that end a program raise Interrupted, but for those that are ignored (nohup)."""
    handler = _Raising()
    for number in _SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, handler)
    sys.unraisablehook = handler.hook


def interruption(error: BaseException) -> KeyboardInterrupt | None:
    """The interruption that an error is, or is of; None if there was none.

    Pydantic, and Python itself where it makes a class, put an error of their own in place of one that is raised amid
    their work, as a signal may be that comes while modules are read.
    """
    if isinstance(error, KeyboardInterrupt):
        return error
    handlers = (signal.getsignal(number) for number in _SIGNALS)
    return next((handler.first for handler in handlers if isinstance(handler, _Raising)), None)


def end_by_signals() -> None:
    """From now on these signals end the program at once, and raise nothing: all is done, and Python takes leave."""
    for number in _SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, signal.SIG_DFL)


def ended_by(error: KeyboardInterrupt) -> tuple[str, int]:
    """What is said of an interruption, in a line with the notes on it of what was kept, and the exit code."""
    number = getattr(error, "number", signal.SIGINT)
    kept = "; ".join(getattr(error, "__notes__", ["nothing was written"]))
    return f"{_SAID[number]}; {kept}", 128 + number


def _waiting_for_results(frame: FrameType | None) -> FrameType | None:
    """The frame that called what was written in C and calls Python from there, without looking for exceptions; or None.

    Numba makes Python objects of what a kernel returns: named tuples, and types that it has not met. One raised there
    ends in a SystemError or in a crash of the interpreter. LLVM hands over what it has compiled; one raised there is
    lost, and the machine code with it.
    """
    caller = None
    while frame is not None:
        module = str(frame.f_globals.get("__name__"))
        if (
            module.startswith("namedtuple_")
            or module == "numba.core.serialize"
            or frame.f_code.co_name.startswith("_raw_object_cache_")
        ):
            caller = frame.f_back
        frame = frame.f_back
    return caller


def _raise_in(frame: FrameType, number: int) -> None:
    """Raise Interrupted in a frame that waits for a call, as soon as it goes on: what debuggers do to stop there."""

    def trace(*_: Any) -> NoReturn:
        frame.f_trace = None
        sys.settrace(None)
        raise Interrupted(number)

    sys.settrace(lambda *_: None)
    frame.f_trace, frame.f_trace_opcodes = trace, True
