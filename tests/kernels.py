"""Kernels that only kernels call, called from tests: through an entry of its own each."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba


def callable_from_python(inner: Any) -> Callable[..., Any]:
    """A function of Python that calls an inner kernel with the same arguments."""

    @numba.njit(error_model="numpy")
    def call(*arguments: Any) -> Any:
        return inner(*arguments)

    return call
