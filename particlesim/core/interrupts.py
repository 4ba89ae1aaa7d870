"""Interruptions: signals that ask a program to end, raised as exceptions, so that what is half done is undone."""

from __future__ import annotations

import signal
import sys
import time
from types import FrameType
from typing import Any, NoReturn

# What ends a program from outside and leaves it time to clean up: Ctrl-C, kill, a terminal that closes.
_SIGNALS = signal.SIGINT, signal.SIGTERM, signal.SIGHUP

# Signals that follow one within this time are the same wish, often from the same source; they do not disturb the
# cleaning up [s].
_GRACE = 2.0


class Interrupted(KeyboardInterrupt):
    """A signal that asks to end; ``number`` says which."""

    def __init__(self, number: int) -> None:
        super().__init__(signal.Signals(number).name)
        self.number = number


def raise_signals() -> None:
    """From now on the signals that end a program raise Interrupted, but for those that are ignored (nohup)."""
    raised: float | None = None
    usual_hook = sys.unraisablehook

    def handle(number: int, frame: FrameType | None) -> None:
        nonlocal raised
        if raised is not None and time.monotonic() - raised < _GRACE:
            return
        raised = time.monotonic()
        caller = _waiting_for_results(frame)
        if caller is None:
            raise Interrupted(number)
        _raise_in(caller, number)

    def hook(lost: Any) -> None:
        # What Python cannot raise, such as in a __del__, it tells and forgets: the program would go on. What is left
        # half made by an interruption may fail as it is taken apart, which is nobody's concern any more.
        if isinstance(lost.exc_value, Interrupted):
            _raise_in(sys._getframe(1), lost.exc_value.number)
        elif raised is None:
            usual_hook(lost)

    for number in _SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, handle)
    sys.unraisablehook = hook


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
