"""Tasks shared among workers: this process alone, processes of this machine, or those of a Dask scheduler.

A task is a function of one value and of nothing else, so it does not matter who carries it out, or how often. One whose
worker dies is handed to another; only so many are handed out at a time, so that neither tasks nor results pile up.
"""

from __future__ import annotations

import contextlib
import hashlib
import importlib.metadata
import importlib.util
import logging
import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from itertools import islice
from pathlib import Path
from typing import Any, Protocol, TypeVar

from particlesim.core.extras import require
from particlesim.core.parallel import available_threads, limit_threads
from particlesim.core.text import shortened

_Item = TypeVar("_Item")
_Result = TypeVar("_Result")

# Tasks that are handed out, for each that can be in work: none waits for the next.
_AHEAD = 2

# Seconds to wait for a scheduler to answer, and for it to have a worker.
_PATIENCE = 20.0

# A cluster of this machine gives up for good what starts a worker again that has died, if none is there within 15 s,
# which a process takes to start where all cores are busy. With all of them given up, tasks would wait for ever.
_PATIENT = {"distributed.deploy.lost-worker-timeout": "1 day"}

# Bytes at each end of a file that tell it from others.
_END = 2**20


class WorkersError(RuntimeError):
    """Workers that cannot be had, or that all died of a task; the message is one line."""


class Workers(Protocol):
    """Those that tasks are shared among."""

    def each(self, task: Callable[[_Item], _Result], items: Iterable[_Item]) -> Iterator[tuple[int, _Result]]:
        """What a task makes of each item, as it is done: the number of the item, and the result."""

    def see(self, path: Path) -> bool:
        """Whether all of them find the same file under this path, which is then made absolute, as this process does."""


@contextmanager
def shared_among(count: int | None, scheduler: str | None, threads: int | None) -> Iterator[Workers]:
    """The workers to share tasks among, for as long as the block lasts.

    Parameters
    ----------
    count
        How many processes of this machine; 1 for this process alone. None for one a processor if Dask is installed.
    scheduler
        The address of a Dask scheduler whose workers are to be used instead, such as ``tcp://host:8786``.
    threads
        How many threads a task may have; None for this machine's share of a worker, and 1 of a scheduler's.

    Raises
    ------
    MissingExtraError
        If Dask is asked for and not installed.
    WorkersError
        If the scheduler does not answer, has no workers, or has such with another version of particlesim; when results
        are asked for, if workers die of a task again and again.
    """
    processors = available_threads()
    if count is None and scheduler is None:
        count = processors if importlib.util.find_spec("distributed") else 1
    if scheduler is None and count == 1:
        yield _Alone(threads)
        return
    distributed = require("distributed", "dask")
    with contextlib.ExitStack() as stack:
        if scheduler is None:
            stack.enter_context(require("dask", "dask").config.set(_PATIENT))
            # One task at a time each: numbers of threads are ours to share out. Their log would repeat what is said.
            cluster = distributed.LocalCluster(
                n_workers=count, threads_per_worker=1, dashboard_address=":0", silence_logs=logging.CRITICAL
            )
            stack.enter_context(cluster)
            threads = threads or max(1, processors // (count or 1))
        client = stack.enter_context(_client(distributed, cluster if scheduler is None else scheduler))
        _check_versions(client, scheduler)
        yield _Dask(distributed, client, threads or 1)


class _Alone:
    """This process does one task after the other."""

    def __init__(self, threads: int | None) -> None:
        self._threads = threads

    def each(self, task: Callable[[_Item], _Result], items: Iterable[_Item]) -> Iterator[tuple[int, _Result]]:
        for number, item in enumerate(items):
            yield number, _with_threads(task, self._threads, item)

    def see(self, path: Path) -> bool:
        return True


class _Dask:
    """The workers of a Dask scheduler."""

    def __init__(self, distributed: Any, client: Any, threads: int) -> None:
        self._distributed, self._client, self._threads = distributed, client, threads

    def each(self, task: Callable[[_Item], _Result], items: Iterable[_Item]) -> Iterator[tuple[int, _Result]]:
        waiting = enumerate(items)
        numbers: dict[str, int] = {}
        with self._client.as_current():
            done = self._distributed.as_completed(with_results=True)

        def hand_out() -> None:
            """As many as may be handed out now: workers come and go."""
            room = _AHEAD * sum(self._client.nthreads().values()) - len(numbers)
            for number, item in islice(waiting, max(room, 0 if numbers else 1)):
                future = self._client.submit(_with_threads, task, self._threads, item, pure=False)
                numbers[future.key] = number
                done.add(future)

        hand_out()
        try:
            for future, result in done:
                number = numbers.pop(future.key)
                future.release()
                hand_out()
                yield number, result
        except self._distributed.KilledWorker as error:
            number = numbers.get(getattr(error, "task", ""), 0)
            raise WorkersError(f"task {number + 1}: one worker after the other died of it, out of memory?") from None

    def see(self, path: Path) -> bool:
        own = _told_apart(path)
        found = self._client.run(_told_apart, path.absolute(), on_error="return")
        return all(told == own for told in found.values())


def _told_apart(path: Path) -> tuple[int, str]:
    """What tells a file from others: its size and a hash of its two ends. OSError if there is none."""
    with path.open("rb") as file:
        size = file.seek(0, os.SEEK_END)
        file.seek(max(0, size - _END))
        end = file.read()
        file.seek(0)
        return size, hashlib.sha256(file.read(_END) + end).hexdigest()


def _with_threads(task: Callable[[_Item], _Result], threads: int | None, item: _Item) -> _Result:
    with limit_threads(threads):
        return task(item)


def _version() -> str:
    return importlib.metadata.version("particlesim")


def _client(distributed: Any, address: Any) -> Any:
    """A client of a scheduler. WorkersError if it does not answer."""
    try:
        return distributed.Client(address, timeout=_PATIENCE, set_as_default=False)
    except (OSError, ValueError) as error:
        words = " ".join(str(error).split())
        raise WorkersError(f"{address}: no scheduler answers there ({shortened(words, 100)})") from None


def _check_versions(client: Any, scheduler: str | None) -> None:
    """WorkersError if there are no workers, or if one would do something else than this process."""
    try:
        client.wait_for_workers(1, timeout=_PATIENCE)
    except TimeoutError:
        raise WorkersError(f"{scheduler}: has no workers") from None
    own = _version()
    # A function of the standard library: one of ours cannot be sent to where particlesim is not installed.
    found = client.run(importlib.metadata.version, "particlesim", on_error="return")
    for worker, version in found.items():
        if isinstance(version, Exception):
            raise WorkersError(f"{worker}: a worker without particlesim")
        if version != own:
            raise WorkersError(f"{worker}: a worker with particlesim {version}, while this is {own}")
