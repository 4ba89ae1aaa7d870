"""How long a search takes, how much memory, and on what machine."""

from __future__ import annotations

import hashlib
import os
import platform
import re
import statistics
import time
import tracemalloc
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from particlesim.broad_phase import METHODS
from particlesim.core.parallel import available_threads


class Found(NamedTuple):
    """What a search comes back with."""

    size: int  # number of pairs
    tested: int | None = None  # box tests; None where a library does not say
    pairs: np.ndarray | None = None  # (m, 2) int64, of our methods


Search = Callable[[], Found]

# Repetitions of a search, and seconds after which no further one is begun.
MOST_REPEATS = 7
ENOUGH_SECONDS = 2.0

# Boxes on which the seconds of a naive test are measured, before all pairs are tried.
_SAMPLE = 4096


@dataclass
class Measured:
    """Repetitions of one search on the same boxes."""

    seconds: list[float] = field(default_factory=list)
    found: Found = field(default_factory=lambda: Found(0))

    @property
    def median(self) -> float:
        """Median of the seconds."""
        return statistics.median(self.seconds)

    def row(self) -> dict[str, Any]:
        """As written to JSON; times in seconds."""
        return {
            "seconds": self.median,
            "fastest": min(self.seconds),
            "slowest": max(self.seconds),
            "repeats": len(self.seconds),
            "pairs": self.found.size,
            "tested": self.found.tested,
        }


def measure_interleaved(searches: Mapping[str, Search]) -> dict[str, Measured]:
    """Run every search once, then all again, and so on: what else the machine does falls on all of them alike."""
    results = {name: Measured() for name in searches}
    for _ in range(MOST_REPEATS):
        for name, search in searches.items():
            result = results[name]
            if not result.seconds or sum(result.seconds) < ENOUGH_SECONDS:
                start = time.perf_counter()
                result.found = search()
                result.seconds.append(time.perf_counter() - start)
    return results


def ours(method: str, lower: np.ndarray, upper: np.ndarray, period: np.ndarray, **parameters: Any) -> Search:
    """A broad phase of this program as a search."""

    def search() -> Found:
        pairs, tested = METHODS[method](lower, upper, period, **parameters)
        return Found(len(pairs), int(tested), pairs)

    return search


def naive_seconds(lower: np.ndarray, upper: np.ndarray, period: np.ndarray) -> float:
    """How long naive would take on these boxes, from how long it takes on some of them."""
    some = slice(0, _SAMPLE)
    sample = np.ascontiguousarray(lower[some]), np.ascontiguousarray(upper[some])
    METHODS["naive"](sample[0][:2], sample[1][:2], period)  # compiles
    start = time.perf_counter()
    METHODS["naive"](*sample, period)
    return (time.perf_counter() - start) * max(1.0, len(lower) / _SAMPLE) ** 2


def peak_memory(search: Search) -> int:
    """Bytes that a search allocates beyond what was there, at most at one time."""
    tracemalloc.start()
    try:
        search()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def digest(found: Found) -> str:
    """SHA-256 of the pairs: two lists that agree in it are the same, in the same order."""
    return hashlib.sha256(np.ascontiguousarray(found.pairs).tobytes()).hexdigest()


def duration(seconds: float) -> str:
    """A time in a unit that suits it."""
    for unit, length in (("d", 86400.0), ("h", 3600.0), ("min", 60.0)):
        if seconds >= length:
            return f"{seconds / length:.1f} {unit}"
    return f"{seconds:.0f} s"


def machine() -> dict[str, Any]:
    """What the figures depend on, without the name of the machine."""
    return {
        "cores": os.cpu_count(),
        "clock_ghz": _clock(),
        "threads": available_threads(),
        "system": platform.system(),
        "architecture": platform.machine(),
        "python": platform.python_version(),
        "numpy": np.__version__,
    }


def machine_words(found: dict[str, Any]) -> str:
    """The machine in a few words."""
    clock = f" at {found['clock_ghz']:.1f} GHz" if found["clock_ghz"] else ""
    return f"{found['threads']} of {found['cores']} cores{clock}"


def _clock() -> float | None:
    """Clock of the processor [GHz], where the system says."""
    try:
        clocks = re.findall(r"^cpu MHz\s*:\s*([\d.]+)", Path("/proc/cpuinfo").read_text(encoding="utf-8"), re.MULTILINE)
    except OSError:
        return None
    return round(max(map(float, clocks)) / 1000.0, 2) if clocks else None
