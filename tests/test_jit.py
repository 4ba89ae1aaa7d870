"""What kernels are compiled with."""

import sys
from typing import NamedTuple

import numpy as np

from particlesim.core.jit import kernel, without_refcounts


class Things(NamedTuple):
    values: np.ndarray
    factor: float


@kernel
def _sum_of_part(things, first, last):
    total = 0.0
    part = things.values[first:last]
    for k in range(len(part)):
        total += part[k, 0] * things.factor
    return total


@kernel
def _sum_and_count(things, counted):
    things, counted = without_refcounts((things, counted))
    total = 0.0
    for k in range(len(counted)):
        counted[k] += 1
        total += _sum_of_part(things, k, len(things.values))
    return total, things.values.copy()


def test_borrowed_arrays_are_read_and_written_in_place():
    values, counted = np.arange(8.0).reshape(4, 2), np.zeros(3, dtype=np.int64)
    held = sys.getrefcount(values), sys.getrefcount(counted)
    total, copied = _sum_and_count(Things(values, 2.0), counted)
    assert total == 2.0 * (12 + 12 + 10)
    assert np.array_equal(copied, values)
    assert not np.shares_memory(copied, values)
    assert counted.tolist() == [1, 1, 1]
    assert (sys.getrefcount(values), sys.getrefcount(counted)) == held
