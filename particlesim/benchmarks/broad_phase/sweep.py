"""The sweep: one kind of boxes, from a hundred to a million of them."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from particlesim.benchmarks.broad_phase.boxes import KINDS, make_boxes
from particlesim.benchmarks.broad_phase.measure import (
    Measured,
    Search,
    digest,
    duration,
    machine,
    measure_interleaved,
    ours,
)
from particlesim.benchmarks.broad_phase.peers import peer_search, peers
from particlesim.broad_phase import METHODS
from particlesim.core.parallel import use_threads

__all__ = ["KINDS", "Sweep", "sweep"]

# Exponents are fitted from this number of boxes on: below, what a call costs in itself is most of it.
FITTED_FROM = 10_000

_NO_PERIOD = np.zeros(3)


class SweepError(ValueError):
    """A kind of boxes that there is not, in one line."""


@dataclass
class Sweep:
    """What a sweep measured."""

    kind: str
    machine: dict[str, Any]
    limit: float  # seconds a search may take
    rows: list[dict[str, Any]] = field(default_factory=list)  # a method on a number of boxes each
    stopped: dict[str, str] = field(default_factory=dict)  # methods that do not go to the end, and why
    disagree: list[str] = field(default_factory=list)  # of our methods; empty if all found the same pairs

    def of(self, method: str, value: str) -> tuple[np.ndarray, np.ndarray]:
        """Numbers of boxes and a column of ``rows``, where it is known."""
        rows = [row for row in self.rows if row["method"] == method and row[value] is not None]
        return np.array([row["boxes"] for row in rows], dtype=float), np.array(
            [row[value] for row in rows], dtype=float
        )

    @property
    def methods(self) -> list[str]:
        """All that were measured, in order."""
        return list(dict.fromkeys(row["method"] for row in self.rows))

    def exponent(self, method: str, value: str) -> float | None:
        """p in value ~ n**p, fitted to at least three numbers of boxes from ``FITTED_FROM`` on."""
        count, measured = self.of(method, value)
        fitted = count >= FITTED_FROM
        if fitted.sum() < 3:
            return None
        return float(np.polyfit(np.log(count[fitted]), np.log(measured[fitted]), 1)[0])

    def table(self) -> dict[str, Any]:
        """All of it, as written to JSON."""
        exponents = {m: {v: self.exponent(m, v) for v in ("seconds", "tested")} for m in self.methods}
        return {
            "sweep": self.kind,
            "machine": self.machine,
            "limit_seconds": self.limit,
            "exponents_from_boxes": FITTED_FROM,
            "exponents": exponents,
            "stopped": self.stopped,
            "same_pairs": not self.disagree,
            "rows": self.rows,
        }


def sizes_up_to(largest: int) -> list[int]:
    """1, 3.16, 10 ... times a hundred, up to ``largest``."""
    sizes = (round(100.0 * 10.0 ** (0.5 * step)) for step in itertools.count())
    return list(itertools.takewhile(lambda size: size <= largest, sizes))


def sweep(
    kind: str,
    *,
    largest: int = 1_000_000,
    limit: float = 10.0,
    threads: int | None = None,
    progress: Callable[[str, int, int], None] | None = None,
) -> Sweep:
    """Every broad phase, and other libraries, on boxes of a kind (see ``make_boxes``), 100 to ``largest`` of them.

    A method stops before the number at which one search would take more than ``limit`` seconds, as it has grown so
    far.  ``progress`` is told how many boxes have been searched.  SweepError for a ``kind`` that there is not.
    """
    if kind not in KINDS:
        raise SweepError(f"--sweep: unknown kind of boxes {kind!r}; there are {', '.join(KINDS)}")
    use_threads(threads)
    result = Sweep(kind, machine(), limit)
    sizes = sizes_up_to(largest)
    for count in sizes:
        if progress:
            progress(kind, sum(size for size in sizes if size < count), sum(sizes))
        going = [name for name in (*METHODS, *peers(kind)) if name not in result.stopped]
        for name in going:
            expected = _expected(result, name, count)
            if expected > limit:
                result.stopped[name] = f"stops before {count:,} boxes, which would take about {duration(expected)}"
        searches = _searches(kind, count, [name for name in going if name not in result.stopped])
        measured = measure_interleaved(searches)
        for name, search in measured.items():
            result.rows.append({"method": name, "boxes": count, **search.row()})
        result.disagree += _disagreement(measured, count)
    if progress:
        progress(kind, sum(sizes), sum(sizes))
    return result


def _searches(kind: str, count: int, names: list[str]) -> dict[str, Search]:
    """The named searches on the same boxes; ours have been compiled."""
    boxes = make_boxes(kind, count)
    few = make_boxes(kind, 50)
    searches: dict[str, Search] = {}
    for name in names:
        if name in METHODS:
            ours(name, few.lower, few.upper, _NO_PERIOD)()
            searches[name] = ours(name, boxes.lower, boxes.upper, _NO_PERIOD)
        else:
            searches[name] = peer_search(name, boxes)
    return searches


def _expected(result: Sweep, name: str, count: int) -> float:
    """Seconds that a search of ``count`` boxes will take, if it grows as it did in the last step and at least as n."""
    counts, seconds = result.of(name, "fastest")
    if len(counts) < 2:
        return 0.0
    growth = math.log(seconds[-1] / seconds[-2]) / math.log(counts[-1] / counts[-2])
    return float(seconds[-1] * (count / counts[-1]) ** min(max(growth, 1.0), 2.0))


def _disagreement(measured: dict[str, Measured], count: int) -> list[str]:
    """Which of our methods did not find the same pairs as the first of them."""
    digests = {name: digest(measured[name].found) for name in METHODS if name in measured}
    first = next(iter(digests.values()), "")
    return [f"{name} on {count:,} boxes" for name, found in digests.items() if found != first]
