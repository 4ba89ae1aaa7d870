"""The canonical order of found pairs: lists of keys in any order become rows (i, j), sorted, each once.

A radix sort from the top: keys are first brought into bands of consecutive i, few enough that writing to all of them
at once stays in the cache; then each band is sorted by i by counting, and each row by j.
"""

from __future__ import annotations

import numpy as np

from particlesim.core.jit import entry_kernel, kernel
from particlesim.core.parallel import ThreadTeam

# Rows in a band, 2**BAND at first: the counters of a band, 32 kB, stay in the fastest cache.  Bands are made wider
# until there are at most MOST_BANDS: so many places can be written to by turns.
_BAND = 13
_MOST_BANDS = 512

# Rows with more pairs than this are sorted by themselves.
_LONG_ROW = 24

_LOW_HALF = 0xFFFFFFFF


@entry_kernel
def _count_bands(keys, shift, counts):
    for slot in range(keys.size):
        counts[np.uint64(keys[slot]) >> np.uint64(shift)] += 1


@entry_kernel
def _fill_bands(keys, shift, cursors, sorted_keys):
    for slot in range(keys.size):
        band = np.uint64(keys[slot]) >> np.uint64(shift)
        place = np.uint64(cursors[band])
        cursors[band] = place + np.uint64(1)
        sorted_keys[place] = keys[slot]


@kernel
def _sort_row(pairs, start, stop):
    """Shell's sort with the gaps of Knuth (The Art of Computer Programming 3, 5.2.1)."""
    gap = 1
    while 3 * gap + 1 < (stop - start) // 3:
        gap = 3 * gap + 1
    while gap > 0:
        for slot in range(start + gap, stop):
            value = pairs[slot, 1]
            hole = slot
            while hole >= start + gap and pairs[hole - gap, 1] > value:
                pairs[hole, 1] = pairs[hole - gap, 1]
                hole -= gap
            pairs[hole, 1] = value
        gap //= 3


@kernel
def _sort_short_rows(pairs):
    """Insertion, over all rows in one go: most rows have one pair or two, and a loop for each would cost more."""
    for slot in range(1, pairs.shape[0]):
        row = pairs[slot, 0]
        value = pairs[slot, 1]
        if (pairs[slot - 1, 1] > value) & (pairs[slot - 1, 0] == row):
            hole = slot
            while hole > 0 and pairs[hole - 1, 0] == row and pairs[hole - 1, 1] > value:
                pairs[hole, 1] = pairs[hole - 1, 1]
                hole -= 1
            pairs[hole, 1] = value


@kernel
def _compact(pairs):
    """Move sorted rows that are there for the first time to the front; how many."""
    size = min(pairs.shape[0], 1)
    for slot in range(1, pairs.shape[0]):
        if pairs[slot, 0] != pairs[slot - 1, 0] or pairs[slot, 1] != pairs[slot - 1, 1]:
            pairs[size, 0] = pairs[slot, 0]
            pairs[size, 1] = pairs[slot, 1]
            size += 1
    return size


@entry_kernel
def _write_band(keys, first_row, rows, unique, pairs):
    """Keys whose i is in ``first_row .. first_row + rows`` to the front of ``pairs``; how many there are.

    With ``unique`` a key that stands there several times is written once.
    """
    ends = np.zeros(rows + 1, dtype=np.int32)  # one to the right: row r starts at ends[r], then ends there
    for slot in range(keys.size):
        ends[np.uint64((keys[slot] >> 32) - first_row + 1)] += 1
    longest = 0
    for row in range(rows):
        longest = max(longest, ends[row + 1])
        ends[row + 1] += ends[row]
    for slot in range(keys.size):
        here = np.uint64((keys[slot] >> 32) - first_row)
        place = np.uint64(ends[here])
        ends[here] = place + np.uint64(1)
        pairs[place, 0] = keys[slot] >> 32
        pairs[place, 1] = keys[slot] & _LOW_HALF
    if longest > _LONG_ROW:
        for row in range(rows):
            start = ends[row - 1] if row > 0 else 0
            if ends[row] - start > _LONG_ROW:
                _sort_row(pairs, start, ends[row])
    _sort_short_rows(pairs)
    return _compact(pairs) if unique else keys.size


def _banded(lists: list[np.ndarray], bands: int, band: int, team: ThreadTeam) -> tuple[np.ndarray, np.ndarray]:
    """All keys in the order of their bands, and where each band starts (bands + 1,) int64."""
    counts = np.zeros((len(lists), bands), dtype=np.int64)
    shift = band + 32

    def count(_: int, first: int, last: int) -> None:
        for number in range(first, last):
            _count_bands(lists[number], shift, counts[number])

    team.each(count, len(lists))
    ends = counts.T.cumsum().reshape(bands, -1).T  # by band, and in a band by list
    cursors = np.ascontiguousarray(ends - counts)
    keys = np.empty(int(counts.sum()), dtype=np.int64)

    def fill(_: int, first: int, last: int) -> None:
        for number in range(first, last):
            _fill_bands(lists[number], shift, cursors[number], keys)

    team.each(fill, len(lists))
    return keys, np.append(0, ends[-1])


def sort_pairs(lists: list[np.ndarray], count: int, team: ThreadTeam, *, unique: bool = False) -> np.ndarray:
    """All keys of ``lists`` as (m, 2) int64 pairs sorted by (i, j), among ``count`` AABBs; uses up the lists.

    ``unique``: the lists may hold a pair more than once; it comes out once.
    """
    band = _BAND
    while (count - 1) >> band >= _MOST_BANDS:
        band += 1
    if len(lists) == 1 and count <= 1 << band:
        pairs = np.empty((lists[0].size, 2), dtype=np.int64)
        return pairs[: int(_write_band(lists[0], 0, count, unique, pairs))]
    bands = ((count - 1) >> band) + 1
    keys, starts = _banded(lists, bands, band, team)
    lists.clear()  # as much memory as the keys take
    pairs = np.empty((len(keys), 2), dtype=np.int64)
    sizes = np.empty(bands, dtype=np.int64)

    def write(_: int, first: int, last: int) -> None:
        for number in range(first, last):
            here = slice(int(starts[number]), int(starts[number + 1]))
            rows = min(1 << band, count - (number << band))
            sizes[number] = _write_band(keys[here], number << band, rows, unique, pairs[here])

    team.each(write, bands, 8 * team.threads)
    if sizes.sum() == len(keys):
        return pairs
    return np.concatenate([pairs[int(s) : int(s + size)] for s, size in zip(starts[:-1], sizes, strict=True)])
