"""What a scene's author reads when a value is wrong: what it must be, and the word that was probably meant."""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError, WrapValidator

from particlesim.core.text import shortened

# Name of the error of a number that is too large or too close to 0 to compute with.
OUT_OF_REACH = "out_of_reach"


def must_be(what: str) -> WrapValidator:
    """Let a type refuse values with the words ``must be <what>`` in place of pydantic's."""

    def check(value: Any, accept: Callable[[Any], Any]) -> Any:
        try:
            return accept(value)
        except ValidationError as error:
            beyond = any(each["type"] == OUT_OF_REACH for each in error.errors())
            size = ", between 1e-30 and 1e30 in size" if beyond else ""
            raise ValueError(f"must be {what}{size}") from None

    return WrapValidator(check)


def one_of(*words: str) -> WrapValidator:
    """Let a ``Literal`` of these words refuse others with a list of them, and the one that was probably meant."""

    def check(value: Any, accept: Callable[[Any], Any]) -> Any:
        try:
            return accept(value)
        except ValidationError:
            meant = hint(value, words) if isinstance(value, str) else ""
            raise ValueError(f"must be {listed(words)}{meant}") from None

    return WrapValidator(check)


def hint(word: str, allowed: Iterable[str]) -> str:
    """The allowed word that looks like ``word`` as a question, or nothing."""
    close = difflib.get_close_matches(word.lower(), list(allowed), n=1)
    return f"; did you mean '{close[0]}'?" if close else ""


def check_words(value: Any, allowed: Sequence[str], what: str, each: str) -> None:
    """ValueError, which says ``what`` there must be, if a value is no list of allowed words, ``each`` of them once."""
    if not isinstance(value, list | tuple):
        raise ValueError(what)
    for word in value:
        if word not in allowed:
            raise ValueError(what + (hint(word, allowed) if isinstance(word, str) else ""))
        if value.count(word) > 1:
            raise ValueError(f"must have each {each} once, but has '{word}' {value.count(word)} times")


def listed(words: Iterable[str]) -> str:
    """Words in quotes, the last after an 'or'."""
    quoted = [f"'{word}'" for word in words]
    return " or ".join([", ".join(quoted[:-1]), quoted[-1]] if len(quoted) > 1 else quoted)


def shown(value: Any) -> str:
    """A value as TOML would write it, on one line, cut short where it is long."""
    return shortened(_toml(value))


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float) and not math.isfinite(value):
        return "nan" if math.isnan(value) else "inf" if value > 0.0 else "-inf"
    if isinstance(value, str | Path):
        return '"' + "".join(c if c.isprintable() else f"\\u{ord(c):04x}" for c in str(value)) + '"'
    if isinstance(value, list | tuple):
        return f"[{', '.join(_toml(item) for item in value)}]"
    if isinstance(value, dict):
        return f"{{{', '.join(f'{key} = {_toml(item)}' for key, item in value.items())}}}"
    return " ".join(str(value).split())
