"""Libraries that come with an extra of the package: what they are for says itself how to get them."""

from __future__ import annotations

import importlib
from typing import Any


class MissingExtraError(RuntimeError):
    """A library that is not installed; the message is one line and says how to install it."""


def require(module: str, extra: str, distribution: str | None = None) -> Any:
    """The module of a library that the extra brings, from a distribution that may have another name.

    MissingExtraError if it is not installed.
    """
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        library = distribution or module.partition(".")[0]
        raise MissingExtraError(f"{library} is not installed; pip install 'particlesim[{extra}]' does it") from error
