"""How fast a heap comes to rest here, beside Rapier where it is installed: mixed bodies dropped into a box.

Both engines start from the same bodies at the same places, and use the same number of threads.
"""

from __future__ import annotations

import importlib.util
import json
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from particlesim.core.atomic_write import atomic_write
from particlesim.core.parallel import available_threads, use_threads
from particlesim.scene import Scene
from particlesim.simulation.simulation import Simulation

COUNTS = (999,)
LARGE = 9_999

SHAPES = "sphere", "cube", "tetrahedron"
SIZE, RESTITUTION, FRICTION = 0.08, 0.3, 0.5

# Simulated [s]: from drop to rest, and how often is looked at what it took [s].
DURATION, PIECE = 3.0, 0.5

# A heap of so many is run first, for kernels to be compiled and loaded.
_FEW = 30


@dataclass(frozen=True)
class Settled:
    """What was measured of a heap."""

    engine: str
    bodies: int
    seconds: list[float]  # of computing for each simulated second, piece by piece
    overlaps: list[float]  # the deepest after each piece, as a fraction of the size; none where it is not known
    phases: dict[str, float]  # seconds in all

    @property
    def mean(self) -> float:
        """Seconds of computing for a simulated second."""
        return sum(self.seconds) / len(self.seconds)


def heap(count: int) -> Scene:
    """``count`` mixed bodies above the floor of a box that is 1 m wide for 999 of them."""
    width = float(np.cbrt(count / 999.0))
    groups = [
        {"shape": shape, "count": (count + k) // len(SHAPES), "size": SIZE, "placement": "random"}
        for k, shape in enumerate(SHAPES)
    ]
    world = {
        "size": [width, width, 2.0 * width],
        "gravity": [0.0, 0.0, -9.81],
        "restitution": RESTITUTION,
        "friction": FRICTION,
    }
    return Scene.model_validate({"world": world, "particles": groups, "seed": 1})


def engines() -> list[str]:
    """Who can be measured here."""
    return ["particlesim", *(["Rapier"] if importlib.util.find_spec("rapier3d") else [])]


def run(
    counts: Sequence[int], threads: int | None = None, progress: Callable[[str, int, int], None] | None = None
) -> Iterator[Settled]:
    """Measure every engine with each number of bodies; ``progress`` is called with what is done, and how far."""
    use_threads(threads)
    total = len(counts) * len(engines())
    for c, count in enumerate(counts):
        for e, engine in enumerate(engines()):
            if progress is not None:
                progress(f"{engine}, {count:,} bodies", c * len(engines()) + e, total)
            yield _ours(count) if engine == "particlesim" else _rapier(count)


def _ours(count: int) -> Settled:
    Simulation(heap(_FEW)).run(duration=DURATION)
    simulation = Simulation(heap(count))
    seconds, overlaps = _timed(lambda: simulation.run(duration=PIECE), lambda: simulation.largest_overlap() / SIZE)
    return Settled("particlesim", count, seconds, overlaps, simulation.seconds)


def _timed(advance: Callable[[], None], overlap: Callable[[], float]) -> tuple[list[float], list[float]]:
    """Seconds of computing for each simulated second, and the overlap, piece by piece."""
    seconds, overlaps = [], []
    for _ in range(round(DURATION / PIECE)):
        begun = time.perf_counter()
        advance()
        seconds.append((time.perf_counter() - begun) / PIECE)
        overlaps.append(overlap())
    return seconds, overlaps


def _rapier(count: int) -> Settled:
    from particlesim.benchmarks.rapier_heap import rapier_world  # noqa: PLC0415  (need not be installed)

    world = rapier_world(Simulation(heap(count)).model, FRICTION, RESTITUTION, available_threads())
    steps = round(PIECE / world.integration_parameters.dt)

    def advance() -> None:
        for _ in range(steps):
            world.step()

    seconds, _ = _timed(advance, lambda: 0.0)
    return Settled("Rapier", count, seconds, [], {})


def write(path: Path, heaps: Sequence[Settled]) -> None:
    """The figures as JSON, in a file that appears whole or not at all. OSError if it cannot be written."""
    what = {"threads": available_threads(), "heaps": [asdict(settled) | {"mean": settled.mean} for settled in heaps]}
    with atomic_write(path) as hidden:
        hidden.write_text(json.dumps(what, indent=2) + "\n", encoding="utf-8")
