"""Work shared between threads by ranges.

Kernels over many items are plain serial kernels over a range ``first .. last`` that release the GIL.  A few items
take one range; many take one range a thread, or more for work that is uneven, from a pool of threads.  The same
kernel serves both, so it is compiled once, without the seconds and the 0.1 ms a call that numba's own ``parallel=True``
costs, and a call with a few hundred items pays for no threads.  A kernel writes only to the items of its range, or
returns a list of its own, so that results do not depend on the number of threads.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

Result = TypeVar("Result")

# Fewer items than this are done by the calling thread: to wake threads and wait for them takes about 0.05 ms.
ALONE = 4096


# How many threads a crew has; None for one a processor that this process may use.
_threads: int | None = None


def use_threads(count: int | None) -> None:
    """Let crews made from now on have ``count`` threads, or one a processor. ValueError if it is below 1."""
    global _threads  # noqa: PLW0603  (a setting of the process, as the number of its processors is)
    if count is not None and count < 1:
        raise ValueError(f"the number of threads must be at least 1, not {count}")
    _threads = count


def available_threads() -> int:
    """How many threads a crew for much work has."""
    affinity = getattr(os, "sched_getaffinity", None)  # not every system can tell
    return _threads or (len(affinity(0)) if affinity else os.cpu_count() or 1)


# The pool of each number of threads, kept: to start threads for each task takes longer than many a task.
_pools: dict[int, ThreadPoolExecutor] = {}

if hasattr(os, "register_at_fork"):  # not every system forks; a child has none of its parent's threads
    os.register_at_fork(after_in_child=_pools.clear)


def _pool_of(threads: int) -> ThreadPoolExecutor | None:
    """The pool of so many threads; None where the calling thread does the work."""
    if threads == 1:
        return None
    if threads not in _pools:
        _pools[threads] = ThreadPoolExecutor(threads)
    return _pools[threads]


class ThreadTeam:
    """The threads (see ``use_threads``) for one task over ``count`` items."""

    def __init__(self, count: int) -> None:
        self._few = count < ALONE
        self.threads = 1 if self._few else available_threads()
        self._pool = _pool_of(self.threads)

    def each(self, work: Callable[[int, int, int], Result], count: int, blocks: int = 0) -> list[Result]:
        """``work(block, first, last)`` for consecutive ranges that cover ``0 .. count``; the results in order.

        One block a thread, or ``blocks`` of them, handed out as threads become free; a few items are one block.
        """
        blocks = 1 if self._few else max(1, min(blocks or self.threads, count))
        edges = [count * block // blocks for block in range(blocks + 1)]
        share = map if self._pool is None else self._pool.map
        return list(share(work, range(blocks), edges[:-1], edges[1:]))
