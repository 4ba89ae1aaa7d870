"""The standard streams of the program, as it finds them and as it leaves them."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress

from particlesim.cli.errors import is_of_output


def open_streams() -> None:
    """Let standard streams that are closed (``2>&-``) lead nowhere.

    A file of ours would get the number of one that is closed, and with it what libraries print there.
    """
    for number, (name, mode) in enumerate((("stdin", "r"), ("stdout", "w"), ("stderr", "w"))):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # it gets the lowest number that is free, which is this one
            setattr(sys, name, os.fdopen(number, mode, closefd=False))


def warn_in_one_line() -> None:
    """Let warnings be a line each, without where in the program they are from."""
    warnings.formatwarning = lambda message, *_, **__: f"{message}\n"


@contextmanager
def one_line_output() -> Iterator[None]:
    """End with one line and exit code 1 if what the block prints cannot be written; without one if nobody reads it."""
    try:
        try:
            yield
        finally:
            sys.stdout.flush()
    except OSError as error:
        if not is_of_output(error):
            raise
        if not isinstance(error, BrokenPipeError):
            with suppress(OSError):
                print(f"standard output: {error.strerror}", file=sys.stderr)
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # for what is left, which Python would try to write again
        sys.exit(1)
