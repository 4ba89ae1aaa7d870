"""Arguments of public functions: what is wrong is refused in one line, before any work, by the name of the argument.

Values that are of the right type and still wrong are the function's own matter.
"""

from __future__ import annotations

import collections.abc
import functools
import inspect
import numbers
import types
from collections.abc import Callable
from pathlib import Path
from typing import Any, ParamSpec, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import ArrayLike

from particlesim.core.text import shortened

_Given = ParamSpec("_Given")
_Result = TypeVar("_Result")

# What is said of types that are not said by their own names.
_WORDS: dict[Any, str] = {
    type(None): "None",
    bool: "True or False",
    int: "a whole number",
    float: "a number",
    str: "text",
    collections.abc.Callable: "a function",
    tuple: "a tuple",
    collections.abc.Sequence: "a list",
}

# Lengths [m] up to which volumes and moments of inertia, their fifth powers, are numbers that float64 has.
FARTHEST = 1e30

_LARGEST = int(np.finfo(np.float64).max)


def checked_arguments(function: Callable[_Given, _Result]) -> Callable[_Given, _Result]:
    """Let a public function refuse arguments that are not what its annotations say.

    TypeError, or ValueError for a whole number beyond float64 and for a path that there cannot be; it names the
    function and the argument.
    """
    signature = inspect.signature(function)
    owner, _, last = function.__qualname__.rpartition(".")
    called = owner if last == "__init__" else last

    @functools.cache
    def kinds() -> dict[str, Any]:
        # When it is first called: what is annotated may be there for type checkers only, as results are.
        of_parameters = {name: hint for name, hint in function.__annotations__.items() if name != "return"}
        return get_type_hints(types.SimpleNamespace(__annotations__=of_parameters), function.__globals__)

    @functools.wraps(function)
    def checked(*args: _Given.args, **kwargs: _Given.kwargs) -> _Result:
        try:
            given = signature.bind(*args, **kwargs).arguments
        except TypeError as error:
            raise TypeError(f"{called}: {error}") from None
        known = kinds()
        for name, value in given.items():
            if name in known:
                _check(f"{called}: {name}", value, known[name])
        return function(*args, **kwargs)

    return checked


def _check(what: str, value: Any, kind: Any) -> None:
    if not _is_a(value, kind):
        raise TypeError(f"{what} must be {_in_words(kind)}, not {shown(value)}")
    if isinstance(value, numbers.Integral) and float in _alternatives(kind) and abs(int(value)) > _LARGEST:
        raise ValueError(f"{what} must be a number that float64 has, not {shown(value)}")
    if Path in _alternatives(kind) and "\0" in str(value):
        raise ValueError(f"{what}: no path has a NUL in it, as {shown(value)} has")


def _alternatives(kind: Any) -> tuple[Any, ...]:
    return get_args(kind) if get_origin(kind) in (Union, types.UnionType) else (kind,)


def _is_a(value: Any, kind: Any) -> bool:
    """Whether a value is of an annotated type; numbers of numpy are numbers, and True is none."""
    if len(_alternatives(kind)) > 1:
        return any(_is_a(value, each) for each in _alternatives(kind))
    plain, inner = get_origin(kind) or kind, get_args(kind)
    if plain is Any:
        return True
    if plain in (int, float):
        number = numbers.Integral if plain is int else numbers.Real
        return isinstance(value, number) and not isinstance(value, bool | np.bool)
    if plain is collections.abc.Callable:
        return callable(value)
    if plain is bool:
        return isinstance(value, bool | np.bool)
    if plain is tuple:
        return isinstance(value, tuple) and len(value) == len(inner) and all(map(_is_a, value, inner))
    if plain is collections.abc.Sequence:
        return (
            isinstance(value, plain) and not isinstance(value, str | bytes) and all(_is_a(v, inner[0]) for v in value)
        )
    return isinstance(value, plain)


def _in_words(kind: Any) -> str:
    """Types as one says them: "text, a Path or None"."""
    words = [_words_of(each) for each in _alternatives(kind)]
    return " or ".join(part for part in (", ".join(words[:-1]), words[-1]) if part)


def _words_of(kind: Any) -> str:
    plain, inner = get_origin(kind) or kind, get_args(kind)
    words = _WORDS.get(plain, f"a {getattr(plain, '__name__', plain)}")
    if plain is tuple and inner:
        return f"{words} of {len(inner)}: {', '.join(map(_in_words, inner))}"
    return words


def shown(value: Any) -> str:
    """A value in one line that is not long."""
    try:
        text = " ".join(repr(value).split())
    except ValueError:  # Python writes no whole number of more than some thousand digits
        text = type(value).__name__
    return shortened(text)


def real_numbers(what: str, values: ArrayLike) -> np.ndarray:
    """``values`` as float64. ValueError if they are no real numbers."""
    try:
        array = np.asarray(values)
        if array.dtype.kind not in "biuf":
            raise TypeError(array.dtype)
        return array.astype(np.float64, copy=False)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{what} must be real numbers, got {' '.join(str(error).split())}") from None
