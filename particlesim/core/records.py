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


def as_records(array: np.ndarray) -> np.ndarray:
    """A view of an array as the records that ``record`` made, where a file kept their fields but not that it did.

    To kernels another dtype is another type, which they would be compiled for again.
    """
    names, fields = array.dtype.names, array.dtype.fields
    if names is None or fields is None:
        return array
    layout: Any = {
        "names": names,
        "formats": [fields[name][0] for name in names],
        "offsets": [fields[name][1] for name in names],
        "itemsize": array.dtype.itemsize,
    }
    return array.view(np.dtype((np.record, np.dtype(layout, align=True))))


# Bytes of a cache line.
_LINE = 64


def cache_aligned(array: np.ndarray) -> np.ndarray:
    """A copy of an array (n,) that begins with a cache line: a record of whole lines touches no more of them."""
    room = np.empty(array.nbytes + _LINE, dtype=np.uint8)
    first = -room.ctypes.data % _LINE
    aligned = room[first : first + array.nbytes].view(array.dtype)
    aligned[:] = array
    return aligned
