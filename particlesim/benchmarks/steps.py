"""How fast the simulation is here: whole time steps of gases, so that the figures can be repeated anywhere.

Each gas is measured in a process of its own: memory that another one has left behind does not blur the figures.
"""

from __future__ import annotations

import json
import math
import multiprocessing
import resource
import signal
import statistics
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from multiprocessing.connection import Connection
from pathlib import Path

import numba

from particlesim.core.atomic_write import atomic_write
from particlesim.core.parallel import available_threads, use_threads
from particlesim.scene import Scene
from particlesim.setup.memory import check_memory
from particlesim.simulation.simulation import Simulation

COUNTS = 1_000, 10_000, 100_000
LARGE = 1_000_000

# Measurements a gas: their median is told, and how far they lie apart.
MEASUREMENTS = 5

# Each measurement takes at least so long [s] and so many steps: the neighbours are found anew every fifth step or so.
LEAST_SECONDS, _LEAST_STEPS = 1.0, 10

# Steps before the first measurement: skins and buffers get their sizes, and neighbours have been found anew.
_STEPS_BEFORE = 6

# A gas of so many is run first, for its kernels to be compiled and loaded.
_FEW = 100

# In one time step a particle of size 1 moves this fraction of its radius on average.
_DISPLACEMENT = 0.05

# Fewer particles than this take less memory than what comes and goes in the process.
_FEWEST_WEIGHED = 10_000


class BenchError(RuntimeError):
    """A measurement that came to nothing."""


@dataclass(frozen=True)
class Gas:
    """Particles of size 1, as many of each shape, that fill a fraction of a periodic cube."""

    name: str
    fill: float
    volumes: dict[str, float]  # of each shape at size 1 [m^3]

    def scene(self, count: int) -> Scene:
        """``count`` particles of mass 1 kg at a temperature of 1 J."""
        numbers = [(count + k) // len(self.volumes) for k in range(len(self.volumes))]
        volume = sum(number * each for number, each in zip(numbers, self.volumes.values(), strict=True)) / self.fill
        thermal = {"kind": "maxwell", "temperature": 1.0}
        groups = [
            {"shape": shape, "count": number, "mass": 1.0, "velocity": thermal, "spin": thermal}
            for shape, number in zip(self.volumes, numbers, strict=True)
        ]
        table = {
            "world": {"size": [volume ** (1.0 / 3.0)] * 3, "boundary": "periodic"},
            "solver": {"time_step": time_step()},
            "particles": groups,
        }
        return Scene(**table)


GASES = (
    Gas("spheres", 0.2, {"sphere": math.pi / 6.0}),
    Gas("mixed", 0.1, {"sphere": math.pi / 6.0, "cube": 1.0, "pyramid": 1.0 / 3.0}),
)


# A gas, how many particles, on how many threads, and how long a measurement takes at least [s].
Task = tuple[Gas, int, int | None, float]


@dataclass(frozen=True)
class Speed:
    """What was measured of a gas."""

    gas: str
    particles: int
    steps: int  # in all measurements together
    rates: list[float]  # of each measurement, millions of particle-steps a second
    milliseconds: dict[str, float]  # a step spends on each phase
    impacts: float  # a particle and step
    bytes: float | None  # a particle takes at the most, None where there are too few to tell

    @property
    def rate(self) -> float:
        """The median of the rates."""
        return statistics.median(self.rates)

    @property
    def spread(self) -> float:
        """From the least of the rates to the most, as a fraction of their median."""
        return (max(self.rates) - min(self.rates)) / self.rate


def time_step() -> float:
    """The time step of all gases [s]: the mean speed at temperature T is sqrt(8 T / (pi m))."""
    return _DISPLACEMENT * 0.5 / math.sqrt(8.0 / math.pi)


def run(
    counts: Sequence[int],
    threads: int | None = None,
    progress: Callable[[str, int, int], None] | None = None,
    least_seconds: float = LEAST_SECONDS,
) -> Iterator[Speed]:
    """Measure every gas with each number of particles, each measurement for ``least_seconds`` or more.

    ``progress`` is called with the gas, how many measurements are done, and how many there will be. SceneError if
    there is no memory for so many particles, BenchError if a measurement comes to nothing.
    """
    use_threads(threads)
    check_memory(max(counts))
    total = MEASUREMENTS * len(counts) * len(GASES)
    for g, gas in enumerate(GASES):
        for c, count in enumerate(counts):
            done = MEASUREMENTS * (g * len(counts) + c)

            def tell(k: int, done: int = done, what: str = f"{gas.name}, {count:,} particles") -> None:
                if progress is not None:
                    progress(what, done + k, total)

            tell(0)
            yield _measured_apart((gas, count, threads, least_seconds), tell)


def _measured_apart(what: Task, tell: Callable[[int], None]) -> Speed:
    """Measure a gas in a process of its own."""
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe(duplex=False)
    worker = context.Process(target=_work, args=(theirs, what), daemon=True)
    worker.start()
    theirs.close()
    try:
        while not isinstance(message := ours.recv(), Speed):
            tell(message)
        return message
    except EOFError:
        raise BenchError(f"the measurement of {what[0].name}, {what[1]:,} particles, has failed") from None
    finally:
        worker.terminate()
        worker.join()


def _work(pipe: Connection, what: Task) -> None:
    """What the other process does: it sends how many measurements are done, then the result."""
    # Ctrl-C reaches it as well, but the process that started it ends it.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    gas, _, threads, _ = what
    Simulation(gas.scene(_FEW), threads=threads).run(steps=_STEPS_BEFORE)
    pipe.send(measured(what, pipe.send))


def measured(what: Task, tell: Callable[[int], None]) -> Speed:
    """Measure a gas in this process; ``tell`` is called with how many measurements are done."""
    gas, count, threads, least_seconds = what
    before = _resident()
    _forget_peak()
    simulation = Simulation(gas.scene(count), threads=threads)
    begun = time.perf_counter()
    simulation.run(steps=_STEPS_BEFORE)
    a_step = (time.perf_counter() - begun) / _STEPS_BEFORE
    steps = max(_LEAST_STEPS, math.ceil(least_seconds / a_step))
    impacts, spent, rates = simulation.ledger.impacts, simulation.seconds, []
    for k in range(MEASUREMENTS):
        begun = time.perf_counter()
        simulation.run(steps=steps)
        rates.append(1e-6 * count * steps / (time.perf_counter() - begun))
        tell(k + 1)
    made = steps * MEASUREMENTS
    return Speed(
        gas=gas.name,
        particles=count,
        steps=made,
        rates=rates,
        milliseconds={phase: 1e3 * (now - spent[phase]) / made for phase, now in simulation.seconds.items()},
        impacts=(simulation.ledger.impacts - impacts) / (count * made),
        bytes=max(_peak() - before, 0) / count if count >= _FEWEST_WEIGHED else None,
    )


def write(path: Path, speeds: Sequence[Speed]) -> None:
    """The figures as JSON, in a file that appears whole or not at all. OSError if it cannot be written."""
    what = {
        "threads": available_threads(),
        "python": ".".join(map(str, sys.version_info[:3])),
        "numba": numba.__version__,
        "time_step": time_step(),
        "gases": [asdict(speed) | {"rate": speed.rate, "spread": speed.spread} for speed in speeds],
    }
    with atomic_write(path) as hidden:
        hidden.write_text(json.dumps(what, indent=2) + "\n", encoding="utf-8")


# ---- memory ------------------------------------------------------------------------------------------------------


def _status(key: str) -> int | None:
    """A figure [bytes] that Linux keeps of this process; None on other systems."""
    try:
        lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    except OSError:
        return None
    return next((1024 * int(line.split()[1]) for line in lines if line.startswith(f"{key}:")), None)


def _peak() -> int:
    """The most memory this process has had since ``_forget_peak``, or since it began where that is not kept [bytes]."""
    peak = _status("VmHWM")
    # Kilobytes, but bytes on macOS.
    unit = 1 if sys.platform == "darwin" else 1024
    return unit * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss if peak is None else peak


def _resident() -> int:
    """The memory this process has now [bytes]."""
    now = _status("VmRSS")
    return _peak() if now is None else now


def _forget_peak() -> None:
    """Let the peak be what there is now (see clear_refs in proc(5))."""
    try:
        Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
    except OSError:  # not Linux, or not allowed: the peak is then that of the largest so far
        return
