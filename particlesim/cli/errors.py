"""How a command fails: one line on standard error and an exit code."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NoReturn

import typer

from particlesim.core.atomic_write import FULL


class OptionError(ValueError):
    """The value of an option that is not allowed: the option, the value and what is allowed, in one line."""


@contextmanager
def one_line_errors(source: Path) -> Iterator[None]:
    """Expected failures as one line on standard error and an exit code; anything else is a bug and shows where."""
    from particlesim.scene.file import SceneError  # noqa: PLC0415

    try:
        yield
    except SceneError as error:
        _fail_as(error, str(error if error.file else error.within(source)), 2)
    except OSError as error:
        if is_of_output(error):
            raise
        _fail_as(error, _described(error), 1)
    except MemoryError as error:
        _fail_as(error, ": ".join(filter(None, ["out of memory", str(error)])), 1)
    except (ValueError, RuntimeError) as error:
        # Errors of other modules of ours, which need not be imported to catch them.
        if not type(error).__module__.startswith("particlesim."):
            raise
        _fail_as(error, str(error), 2 if isinstance(error, ValueError) else 1)


def _fail_as(error: Exception, message: str, code: int) -> NoReturn:
    """End the program with the line of an error, and with the notes on it of what was kept."""
    fail("; ".join([message, *getattr(error, "__notes__", [])]), code)


def is_of_output(error: OSError) -> bool:
    """Whether it says that what is printed finds no reader, or no room: our files are named where they do not fit."""
    return isinstance(error, BrokenPipeError) or (error.errno in FULL and error.filename is None)


def _described(error: OSError) -> str:
    """An error of ours as it is, one of the system with the file it is about."""
    if error.strerror:
        return ": ".join([str(name) for name in (error.filename,) if name] + [error.strerror])
    return str(error)


def fail(message: str, code: int) -> NoReturn:
    """End the program with a line and this exit code."""
    with suppress(OSError):  # a terminal that has been closed
        print(message, file=sys.stderr)
    raise typer.Exit(code)
