"""Records: rows of arrays whose fields have names, laid out so that what is read together lies together."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np


def record(fields: Sequence[tuple[Any, ...]]) -> np.dtype:
    """The aligned dtype of a record with these fields, which are its attributes in kernels as in plain Python.

    Parameters
    ----------
    fields : sequence of (name, format) or (name, format, shape)
        As ``numpy.dtype`` takes them.
    """
    return np.dtype((np.record, np.dtype(list(fields), align=True)))


# Bytes of a cache line.
_LINE = 64


def cache_aligned(array: np.ndarray) -> np.ndarray:
    """A copy of an array (n,) that begins with a cache line: a record of whole lines touches no more of them."""
    room = np.empty(array.nbytes + _LINE, dtype=np.uint8)
    first = -room.ctypes.data % _LINE
    aligned = room[first : first + array.nbytes].view(array.dtype)
    aligned[:] = array
    return aligned
