"""Compiled kernels on the disk: what is damaged there is compiled anew, and what finds no room is told once."""

from __future__ import annotations

import functools
import warnings
from typing import Any

from numba.core.caching import FunctionCache


class KernelCache(FunctionCache):
    """Numba's cache of a function, which never ends a program: without it there is only more to compile."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """What is kept for a signature; None if nothing is, or if it cannot be read."""
        try:
            return super().load_overload(sig, target_context)
        except Exception:  # whatever comes of bytes that are not what was written, such as after power failed
            self._keep(self.flush)
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep what was compiled for a signature, if there is room."""
        self._keep(super().save_overload, sig, data)

    def _keep(self, save: Any, *args: Any) -> None:
        try:
            save(*args)
        except OSError as error:
            _tell(str(error.strerror or error))


@functools.cache
def _tell(reason: str) -> None:
    """Say once in a process why kernels are not kept."""
    warnings.warn(f"compiled kernels cannot be kept ({reason}): the next run compiles them again", stacklevel=2)
