"""A scene, or the frames of a stream, through every broad phase: what each costs, and that all give the same."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from particlesim.benchmarks.broad_phase.measure import (
    digest,
    duration,
    machine,
    measure_interleaved,
    naive_seconds,
    ours,
    peak_memory,
)
from particlesim.broad_phase import METHODS
from particlesim.core.parallel import use_threads
from particlesim.scene import Scene
from particlesim.simulation.simulation import Simulation
from particlesim.trajectory.frame_aabb import frame_boxes

Progress = Callable[[str, int, int], None]
Frames = Sequence[tuple[np.ndarray, np.ndarray]]  # lower and upper corners (n, 3) [m] of each

# Steps of a scene where their number is not given: as many as take about SECONDS, but no more than MOST_STEPS.
SECONDS = 3.0
MOST_STEPS = 200
_TIMED_STEPS = 3

# Frames of a run whose boxes are searched by every method.
_FRAMES = 5


@dataclass
class Result:
    """What one broad phase did; seconds are medians."""

    method: str
    step_seconds: float | None = None
    search_seconds: float | None = None  # of one search of one frame's boxes
    tested: int | None = None  # box tests, of all frames
    pairs: int | None = None  # found, of all frames
    memory: int | None = None  # bytes allocated by one search, at most at one time
    step_tested: int | None = None  # box tests of all steps, by the ledger
    step_pairs: int | None = None  # candidate pairs of all steps, by the ledger
    state_hash: str | None = None
    digests: list[str] = field(default_factory=list)  # of the pairs of each frame
    left_out: str = ""  # why it did not run


@dataclass
class SceneComparison:
    """All broad phases on one scene or stream."""

    name: str
    boxes: int
    frames: int
    steps: int
    machine: dict[str, Any]
    results: list[Result]

    @property
    def ran(self) -> list[Result]:
        """Those that were not left out."""
        return [result for result in self.results if not result.left_out]

    @property
    def same_pairs(self) -> bool:
        """Whether all found the same pairs in every frame."""
        return len({tuple(result.digests) for result in self.ran}) <= 1

    @property
    def same_trajectory(self) -> bool:
        """Whether all led to the same state, to the last bit."""
        return len({result.state_hash for result in self.ran}) <= 1

    def table(self) -> dict[str, Any]:
        """All of it, as written to JSON."""
        return {
            "name": self.name,
            "boxes": self.boxes,
            "frames": self.frames,
            "steps": self.steps,
            "machine": self.machine,
            "same_pairs": self.same_pairs,
            "same_trajectory": self.same_trajectory,
            "results": [vars(result) for result in self.results],
        }


def compare_scene(
    scene: Scene,
    name: str = "",
    *,
    steps: int | None = None,
    limit: float = 10.0,
    threads: int | None = None,
    progress: Progress | None = None,
) -> tuple[SceneComparison, Frames]:
    """Run ``scene`` through every broad phase, the first step apart; also the boxes of the frames compared on.

    ``steps``: time steps of each run, or as many as take a few seconds.  Naive is left out if it would search for
    more than ``limit`` seconds in all.  SceneError if the scene cannot be built.
    """
    use_threads(threads)
    steps = steps or _affordable_steps(scene, threads)
    frames = _record(scene, steps, threads, progress)
    comparison = compare_frames(
        frames,
        name,
        period=np.array(scene.world.period),
        repeats=steps,
        limit=limit,
        parameters=_parameters(scene),
        threads=threads,
        progress=progress,
    )
    comparison.steps = steps
    for result in comparison.ran:
        if progress:
            progress(f"simulating with {result.method}", 0, steps)
        _simulate(scene, result, steps, threads, progress)
    return comparison, frames


def compare_frames(
    frames: Frames,
    name: str = "",
    *,
    period: np.ndarray | None = None,
    repeats: int = 1,
    limit: float = 10.0,
    parameters: dict[str, dict[str, Any]] | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> SceneComparison:
    """Search the boxes of every frame with every broad phase.

    Naive is left out if ``repeats`` searches, and one of each frame, would take more than ``limit`` seconds.
    """
    use_threads(threads)
    lengths = np.zeros(3) if period is None else period
    expected = naive_seconds(*frames[0], lengths) * (repeats + len(frames))
    results = {method: Result(method) for method in METHODS}
    if expected > limit:
        results["naive"].left_out = f"would take about {duration(expected)}"
    going = [method for method, result in results.items() if not result.left_out]
    seconds: dict[str, list[float]] = {method: [] for method in going}
    for number, (lower, upper) in enumerate(frames):
        searches = {
            method: ours(method, lower, upper, lengths, **(parameters or {}).get(method, {})) for method in going
        }
        for search in searches.values():
            search()  # compiles
        for method, measured in measure_interleaved(searches).items():
            result = results[method]
            result.tested = (result.tested or 0) + (measured.found.tested or 0)
            result.pairs = (result.pairs or 0) + measured.found.size
            result.digests.append(digest(measured.found))
            seconds[method].append(measured.median)
            result.memory = max(result.memory or 0, peak_memory(searches[method]))
        if progress:
            progress("searching", number + 1, len(frames))
    for method in going:
        results[method].search_seconds = statistics.median(seconds[method])
    return SceneComparison(name, len(frames[0][0]), len(frames), 0, machine(), list(results.values()))


def _affordable_steps(scene: Scene, threads: int | None) -> int:
    """How many steps take about ``SECONDS``, by the first few; the very first compiles."""
    simulation = Simulation(scene, threads=threads)
    simulation.step()
    start = time.perf_counter()
    simulation.run(steps=_TIMED_STEPS)
    a_step = (time.perf_counter() - start) / _TIMED_STEPS
    return max(1, min(MOST_STEPS, round(SECONDS / max(a_step, 1e-9))))


def _record(scene: Scene, steps: int, threads: int | None, progress: Progress | None) -> Frames:
    """Boxes of the particles at the start, the end and a few times in between."""
    simulation = Simulation(scene, threads=threads)
    header = simulation.header
    frames = [frame_boxes(header, simulation.frame())]
    wanted = {round(steps * part / (_FRAMES - 1)) for part in range(1, _FRAMES)} - {0}
    for step in range(1, steps + 1):
        simulation.step()
        if step in wanted:
            frames.append(frame_boxes(header, simulation.frame()))
        if progress:
            progress("recording", step, steps)
    return frames


def _simulate(scene: Scene, result: Result, steps: int, threads: int | None, progress: Progress | None) -> None:
    """Run the scene with the result's broad phase."""
    simulation = Simulation(scene, broad_phase=result.method, threads=threads)
    seconds = []
    for step in range(1, steps + 1):
        start = time.perf_counter()
        simulation.step()
        seconds.append(time.perf_counter() - start)
        if progress:
            progress(f"simulating with {result.method}", step, steps)
    # The first step compiles, where nothing else has been timed.
    result.step_seconds = statistics.median(seconds[1:] or seconds)
    ledger = simulation.ledger
    result.step_tested, result.step_pairs = ledger.pairs_tested, ledger.candidate_pairs
    result.state_hash = simulation.state_hash()


def _parameters(scene: Scene) -> dict[str, dict[str, Any]]:
    """Parameters of the scene's own broad phase; the others have their usual ones."""
    chosen = scene.solver.broad_phase
    return {chosen.kind: chosen.model_dump(exclude={"kind"})}
