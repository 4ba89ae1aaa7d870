"""A quick look before the box test: boxes in columns of float32, thirty-two of them against one at a time.

Columns (6, n + LANES) float32 hold ``lower x y z, upper x y z`` of n boxes, all rounded in the same way.  Rounding
never turns an order around: from a <= b follows float32(scale (a - origin)) <=
float32(scale (b - origin)).  So boxes that overlap also do in float32, with no margin; a few more seem to, and the
box test on float64 decides.
"""

from __future__ import annotations

import numpy as np

from particlesim.core.jit import kernel

# Boxes looked at at once, the bits of a number.  Columns have so many unused entries at their end.
LANES = 32

# The place of a lone bit among 32, by the top five bits of its product with a de Bruijn sequence: C. E. Leiserson,
# H. Prokop, K. H. Randall, "Using de Bruijn Sequences to Index a 1 in a Computer Word", MIT, 1998.
_DE_BRUIJN = 0x077CB531
_PLACES = np.zeros(32, dtype=np.uint64)
for _place in range(32):
    _PLACES[((_DE_BRUIJN << _place) & 0xFFFFFFFF) >> 27] = _place


@kernel
def column_of(columns, index):
    """Column ``index`` as a tuple, which stays in registers."""
    return (
        columns[0, index], columns[1, index], columns[2, index],
        columns[3, index], columns[4, index], columns[5, index],
    )  # fmt: skip


@kernel
def may_overlap(a, b):
    """Whether two boxes overlap as far as float32 can tell."""
    return (a[0] <= b[3]) & (b[0] <= a[3]) & (a[1] <= b[4]) & (b[1] <= a[4]) & (a[2] <= b[5]) & (b[2] <= a[5])


@kernel
def overlap_bits(columns, base, box):
    """Bit k is set if column ``base + k`` (uint64) may overlap ``box``.

    The loop has no branch, a fixed length and 32-bit numbers only: the compiler tests a vector of boxes at once.
    """
    bits = np.int32(0)
    for lane in range(LANES):
        hit = may_overlap(box, column_of(columns, base + np.uint64(lane)))
        bits = np.int32(bits | np.int32(np.int32(hit) << np.int32(lane)))
    return np.int64(bits) & 0xFFFFFFFF


@kernel
def child_bits(columns, base, box):
    """The same for the eight columns from ``base`` on."""
    bits = np.int32(0)
    for lane in range(8):
        hit = may_overlap(box, column_of(columns, base + np.uint64(lane)))
        bits = np.int32(bits | np.int32(np.int32(hit) << np.int32(lane)))
    return np.int64(bits)


@kernel
def lowest(bits):
    """Place of the lowest bit that is set, as uint64."""
    return _PLACES[np.uint64(((bits & -bits) * _DE_BRUIJN & 0xFFFFFFFF) >> 27)]
