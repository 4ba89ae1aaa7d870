"""A quick look before the exact test: AABBs in float32 as a structure of arrays, thirty-two against one at a time.

``soa`` (6, n + LANES) float32 holds the rows ``lower x y z, upper x y z`` of n AABBs, all rounded in the same way.
Rounding never turns an order around: from a <= b follows float32(scale (a - origin)) <= float32(scale (b - origin)).
So AABBs that overlap also do in float32, with no margin; a few more seem to, and the test on float64 decides.
"""

from __future__ import annotations

import numpy as np

from particlesim.core.jit import kernel

# AABBs looked at at once, the bits of a number.  ``soa`` has so many unused entries at the end of its rows.
LANES = 32

# The place of a lone bit among 32, by the top five bits of its product with a de Bruijn sequence: C. E. Leiserson,
# H. Prokop, K. H. Randall, "Using de Bruijn Sequences to Index a 1 in a Computer Word", MIT, 1998.
_DE_BRUIJN = 0x077CB531
_PLACES = np.zeros(32, dtype=np.uint64)
for _place in range(32):
    _PLACES[((_DE_BRUIJN << _place) & 0xFFFFFFFF) >> 27] = _place


@kernel
def load_soa(soa, index):
    """AABB number ``index`` as a tuple, which stays in registers."""
    return soa[0, index], soa[1, index], soa[2, index], soa[3, index], soa[4, index], soa[5, index]


@kernel
def may_overlap(a, b):
    """Whether two AABBs overlap as far as float32 can tell."""
    return (a[0] <= b[3]) & (b[0] <= a[3]) & (a[1] <= b[4]) & (b[1] <= a[4]) & (a[2] <= b[5]) & (b[2] <= a[5])


@kernel
def overlap_bits(soa, base, aabb):
    """Bit k is set if AABB number ``base + k`` (uint64) may overlap ``aabb``.

    The loop has no branch, a fixed length and 32-bit numbers only: the compiler tests a vector of AABBs at once.
    """
    bits = np.int32(0)
    for lane in range(LANES):
        hit = may_overlap(aabb, load_soa(soa, base + np.uint64(lane)))
        bits = np.int32(bits | np.int32(np.int32(hit) << np.int32(lane)))
    return np.int64(bits) & 0xFFFFFFFF


@kernel
def child_bits(soa, base, aabb):
    """The same for the eight from ``base`` on."""
    bits = np.int32(0)
    for lane in range(8):
        hit = may_overlap(aabb, load_soa(soa, base + np.uint64(lane)))
        bits = np.int32(bits | np.int32(np.int32(hit) << np.int32(lane)))
    return np.int64(bits)


@kernel
def lowest(bits):
    """Place of the lowest bit that is set, as uint64."""
    return _PLACES[np.uint64(((bits & -bits) * _DE_BRUIJN & 0xFFFFFFFF) >> 27)]
