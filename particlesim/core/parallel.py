"""Work shared between threads by ranges.

Kernels over many items are plain serial kernels over a range ``first .. last`` that release the GIL.  A few items
take one range; many take one range a thread, or more for work that is uneven, from a pool of threads.  The same
kernel serves both, so it is compiled once, without the seconds and the 0.1 ms a call that numba's own ``parallel=True``
costs, and a call with a few hundred items pays for no threads.  A kernel writes only to the items of its range, or
returns a list of its own, so that results do not depend on the number of threads.

How many threads a team has is said, first to last: by its own argument; by ``limit_threads`` around the code that
makes it, which holds for that code alone; by ``use_threads`` for the whole process; else one a processor.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TypeVar

from particlesim.core.arguments import shown
from particlesim.core.constants import MOST_THREADS

Result = TypeVar("Result")

# Fewer items than this are done by the calling thread: to wake threads and wait for them takes about 0.05 ms.
ALONE = 4096

# Threads of a team: None for one a processor that this process may use.
_process_limit: int | None = None
_limit: ContextVar[int | None] = ContextVar("threads", default=None)


def check_threads(count: int | None) -> int | None:
    """``count`` itself. ValueError if it is below 1 or above ``MOST_THREADS``."""
    if count is not None and not 1 <= count <= MOST_THREADS:
        raise ValueError(f"the number of threads must be 1 to {MOST_THREADS:,}, not {shown(count)}")
    return count


def use_threads(count: int | None) -> None:
    """Let all teams of this process have ``count`` threads, or one a processor. ValueError as for check_threads."""
    global _process_limit  # noqa: PLW0603  (a setting of the process, as the number of its processors is)
    _process_limit = check_threads(count)


@contextmanager
def limit_threads(count: int | None) -> Iterator[None]:
    """Let teams that the code inside makes have ``count`` threads; None leaves things as they are.

    It concerns the thread that runs this code and nothing else: two simulations in one process, one after the other or
    at the same time, each keep their own number.

    Parameters
    ----------
    count : int or None
        Threads of a team, 1 to ``MOST_THREADS``.

    Raises
    ------
    ValueError
        For another ``count``.
    """
    token = _limit.set(check_threads(count) or _limit.get())
    try:
        yield
    finally:
        _limit.reset(token)


def available_threads() -> int:
    """How many threads a team for much work has here."""
    affinity = getattr(os, "sched_getaffinity", None)  # not every system can tell
    return _limit.get() or _process_limit or (len(affinity(0)) if affinity else os.cpu_count() or 1)


class _Pools(threading.local):
    """The pools of a thread by their number of threads, kept: to start these takes longer than many a task.

    Each thread has its own: tasks that run at the same time do not wait for each other's.
    """

    def __init__(self) -> None:
        self.of: dict[int, ThreadPoolExecutor] = {}


_pools = _Pools()


def _forget_pools() -> None:
    """Let the process have none: a child has none of its parent's threads."""
    _pools.of.clear()


if hasattr(os, "register_at_fork"):  # not every system forks
    os.register_at_fork(after_in_child=_forget_pools)


def _pool_of(threads: int) -> ThreadPoolExecutor | None:
    """The pool of so many threads; None where the calling thread does the work."""
    if threads == 1:
        return None
    if threads not in _pools.of:
        _pools.of[threads] = ThreadPoolExecutor(threads)
    return _pools.of[threads]


class ThreadTeam:
    """The threads for one task over ``count`` items.

    Parameters
    ----------
    count : int
        Items of the task.  Fewer than ``ALONE`` are done by the calling thread.
    threads : int, optional
        Threads for many items; by default what ``available_threads`` says.

    Raises
    ------
    ValueError
        If there cannot be so many ``threads``.
    """

    def __init__(self, count: int, threads: int | None = None) -> None:
        self._few = count < ALONE
        wanted = check_threads(threads) or available_threads()
        self.threads = 1 if self._few else wanted
        self._pool = _pool_of(self.threads)

    def each(self, work: Callable[[int, int, int], Result], count: int, blocks: int = 0) -> list[Result]:
        """``work(block, first, last)`` for consecutive ranges that cover ``0 .. count``; the results in order.

        One block a thread, or ``blocks`` of them, handed out as threads become free; a few items are one block.
        """
        blocks = 1 if self._few else max(1, min(blocks or self.threads, count))
        edges = [count * block // blocks for block in range(blocks + 1)]
        share = map if self._pool is None else self._pool.map
        return list(share(work, range(blocks), edges[:-1], edges[1:]))
