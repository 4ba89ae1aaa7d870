"""Runs that can be gone on with: what is finished of one lies in a folder beside its output, ``.NAME.partial``."""

from __future__ import annotations

import fcntl
import importlib.metadata
import json
import os
import shutil
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple

from particlesim.core.atomic_write import atomic_write
from particlesim.core.last_words import last_words
from particlesim.core.output_path import partial_folder
from particlesim.core.text import shortened
from particlesim.simulation.simulation import Simulation
from particlesim.simulation.soundness import SimulationError

# Wall time between two checkpoints [s]: at most so much is done again.
INTERVAL = 10.0

# A checkpoint of millions of particles takes seconds: the next comes no sooner than so many times what one took.
_SPARE = 20.0

_INDEX = "index.json"


class PartialRunError(ValueError):
    """A partial run is in the way, or cannot be gone on with; the message is one line."""


class PartialRun:
    """The folder that a run works in, its own while it runs. A context manager.

    Whoever leaves it well has moved the result out of it, and the folder goes. If it is left by an error, it stays if
    anything was kept, and a note on the error says so.

    Parameters
    ----------
    path : Path
        The output; the folder lies beside it.
    task : dict
        Plain values of all that the result depends on.
    resume : bool
        Whether to go on with a run that is there; one that is not there begins.

    Raises
    ------
    PartialRunError
        On entering, if another run is at work on the same output; if one is there and is not to be gone on with; if
        its task is another.
    """

    def __init__(self, path: str | Path, task: dict[str, Any], resume: bool) -> None:
        self._path, self._resume = Path(path), resume
        # As it comes back from the file.
        self._task = json.loads(json.dumps({"version": importlib.metadata.version("particlesim"), **task}))
        self.folder = partial_folder(self._path).absolute()
        self.kept: dict[str, Any] | None = None  # what was kept last, with "done" and "total" frames
        self._next: float | None = None  # when something is to be kept

    def __enter__(self) -> PartialRun:
        lock = _locked(self.folder)
        if lock is None:
            raise PartialRunError(f"{self._path}: another run is at work on it, in {partial_folder(self._path)}")
        self._lock = lock
        try:
            self._look()
        except BaseException:
            os.close(lock)
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        gone = not self.folder.exists()
        try:
            if error is None or self.kept is None:
                with suppress(OSError):
                    remove_run(self.folder)
        finally:
            os.close(self._lock)
        if gone and isinstance(error, Exception):
            raise FileNotFoundError(f"{self._path}: what was done of it is gone, with {self.folder}") from error
        if isinstance(error, OSError) and (error.filename is None or self._is_ours(error.filename)):
            error.filename = str(self._path)
        if error is None:
            last_words("")
        elif self.kept is not None and (self.folder / _INDEX).exists():
            error.add_note(self._in_words(", those before that," if isinstance(error, SimulationError) else ""))

    def _is_ours(self, file: str) -> bool:
        return Path(file).absolute().is_relative_to(self.folder)

    @property
    def state(self) -> Path | None:
        """The checkpoint of the simulation to go on with; None if there is none."""
        return self.folder / self.kept["state"] if self.kept and self.kept["state"] else None

    def due(self) -> bool:
        """Whether it is time to keep what is done: at first an interval after this is asked for the first time.

        What comes before, such as compiling, may take long, but there is nothing to keep.
        """
        now = time.monotonic()
        if self._next is None:
            self._next = now + INTERVAL
        return now >= self._next

    def keep(self, done: int, total: int, simulation: Simulation | None, values: dict[str, Any]) -> None:
        """Keep what is done from now on: frames, the files in the folder, the state of a simulation, plain values.

        Without a state, the simulation begins anew when the run is gone on with.
        """
        start = time.monotonic()
        state = f"{simulation.steps}.ckpt" if simulation is not None else None
        if simulation is not None:
            simulation.save(self.folder / str(state))
        for file in self.folder.iterdir():
            _sync(file)
        kept = {"task": self._task, "done": done, "total": total, "state": state, "values": values}
        with atomic_write(self.folder / _INDEX) as hidden:
            hidden.write_text(json.dumps(kept))
            _sync(hidden)
        _sync(self.folder)
        self._count(kept)
        for old in self.folder.glob("*.ckpt"):
            if old.name != state:
                old.unlink()
        now = time.monotonic()
        self._next = now + max(INTERVAL, _SPARE * (now - start))

    def forget(self) -> None:
        """Let nothing be kept."""
        self._count(None)
        (self.folder / _INDEX).unlink(missing_ok=True)
        for file in self.folder.iterdir():
            file.unlink()

    def _count(self, kept: dict[str, Any] | None) -> None:
        """Let this be what was kept last."""
        self.kept = kept
        last_words("nothing was kept" if kept is None else self._in_words())

    def _in_words(self, which: str = "") -> str:
        """What is kept, and how to go on with it if there is no saying ``which`` frames those are."""
        assert self.kept is not None
        kept = f"{_frames(self.kept)}{which} are kept in {partial_folder(self._path)}"
        return kept if which else f"{kept}; --resume goes on with them"

    def _look(self) -> None:
        """See what is there. PartialRunError if it is not to be gone on with, or cannot be."""
        found = _index(self.folder)
        if found is None:  # ended before anything was kept, or while it was removed
            self.forget()
            return
        self._count(found)
        where = f"{self._path}: there is a partial run of it, {_frames(found)}, in {partial_folder(self._path)}"
        remove = f"'particlesim clean --remove {self._path}' removes it"
        if not self._resume:
            raise PartialRunError(f"{where}; --resume goes on with it, {remove}")
        change = _difference(found["task"], self._task)
        if change is not None:
            raise PartialRunError(f"{where}, and it is another: {change}; change it back, or {remove}")


class Found(NamedTuple):
    """A partial run that was found."""

    folder: Path
    frames: str  # how many are kept, in words
    size: int  # of its files [bytes]
    at_work: bool


def partial_runs(place: Path) -> Iterator[Found]:
    """The partial runs in a folder, or of an output."""
    folders = sorted(place.glob(".*.partial")) if place.is_dir() else [partial_folder(place)]
    for folder in folders:
        if not folder.is_dir():
            continue
        lock = _locked(folder)
        if lock is not None:
            os.close(lock)
        found = _index(folder)
        frames = "nothing kept" if found is None else _frames(found)
        yield Found(folder, frames, sum(file.stat().st_size for file in folder.iterdir()), lock is None)


def remove_run(folder: Path) -> None:
    """Remove a partial run. OSError if that cannot be done."""
    # First what says what counts: of half a run, if this is interrupted, nothing does.
    (folder / _INDEX).unlink(missing_ok=True)
    shutil.rmtree(folder)


def _frames(kept: dict[str, Any]) -> str:
    return f"{kept['done']:,} of {kept['total']:,} frames"


def _locked(folder: Path) -> int | None:
    """The folder, made if need be, open and for this run alone until it is closed; None if it is another's."""
    while True:
        folder.mkdir(exist_ok=True)
        lock = os.open(folder, os.O_RDONLY)
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            # Another run may have removed it between these lines.
            if folder.exists() and os.path.samestat(os.fstat(lock), os.stat(folder)):
                return lock
        except BlockingIOError:
            os.close(lock)
            return None
        os.close(lock)


def _index(folder: Path) -> dict[str, Any] | None:
    """What was kept last in a folder; None if nothing was."""
    try:
        return json.loads((folder / _INDEX).read_text())
    except FileNotFoundError:
        return None


def _sync(path: Path) -> None:
    """Have a file on the disk, or what a folder says of its files, and not only with the system."""
    file = os.open(path, os.O_RDONLY)
    try:
        os.fsync(file)
    finally:
        os.close(file)


def _difference(before: Any, now: Any, key: str = "") -> str | None:
    """The first key by which two tables differ, with its values; None if they are the same."""
    if isinstance(before, dict) and isinstance(now, dict):
        below = ((f"{key}.{k}" if key else k, before.get(k), now.get(k)) for k in [*before, *(now.keys() - before)])
    elif isinstance(before, list) and isinstance(now, list) and len(before) == len(now):
        below = ((f"{key}[{k}]", *pair) for k, pair in enumerate(zip(before, now, strict=True)))
    else:
        was, is_now = (shortened(json.dumps(value)) for value in (before, now))
        return None if before == now else f"{key} was {was} and is {is_now}"
    return next((found for name, a, b in below if (found := _difference(a, b, name)) is not None), None)
