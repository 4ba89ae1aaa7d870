"""What the command does once it knows what it is asked for: compare, write, and say what was found."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

from rich.console import Group

from particlesim.benchmarks.broad_phase.report import write_frames, write_scene, write_sweep
from particlesim.benchmarks.broad_phase.runs import compare_frames, compare_scene
from particlesim.benchmarks.broad_phase.stream import read_stream
from particlesim.benchmarks.broad_phase.sweep import sweep
from particlesim.benchmarks.broad_phase.table import scene_table, sweep_table
from particlesim.scene import Scene


class Report(NamedTuple):
    """The outcome of a comparison."""

    table: Group
    written: list[Path]
    same: bool  # whether all broad phases gave the same


def on_scene(scene: Scene, name: str, path: Path, stream: Path | None, *, steps: int | None, **settings: Any) -> Report:
    """Compare on a scene; ``path`` is that of the JSON, ``stream`` of the frames' boxes if they are wanted."""
    comparison, frames = compare_scene(scene, name, steps=steps, **settings)
    written = write_scene(comparison, path)
    if stream is not None:
        write_frames(frames, scene.world.size, name, stream)
        written.append(stream)
    return Report(scene_table(comparison), written, comparison.same_pairs and comparison.same_trajectory)


def on_stream(source: Path, path: Path, **settings: Any) -> Report:
    """Compare on the frames of a stream. StreamError if it is none."""
    read = read_stream(source)
    comparison = compare_frames(list(read.frames()), read.scene or source.stem, **settings)
    return Report(scene_table(comparison), write_scene(comparison, path), comparison.same_pairs)


def on_sweep(kind: str, path: Path, **settings: Any) -> Report:
    """Compare on a sweep. SweepError for a kind that there is not."""
    result = sweep(kind, **settings)
    return Report(sweep_table(result), write_sweep(result, path), not result.disagree)
