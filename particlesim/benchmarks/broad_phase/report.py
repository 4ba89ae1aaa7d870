"""What a comparison leaves behind: a JSON file, and the figure beside it as SVG and PNG."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from particlesim.benchmarks.broad_phase.figure import draw_scene, draw_sweep
from particlesim.benchmarks.broad_phase.runs import Frames, SceneComparison
from particlesim.benchmarks.broad_phase.stream import Stream, write_stream
from particlesim.benchmarks.broad_phase.sweep import Sweep
from particlesim.core.atomic_write import atomic_write


def write_scene(comparison: SceneComparison, path: Path) -> list[Path]:
    """Write the comparison on a scene to ``path`` (JSON), and its figure; all files written."""
    return [_write_json(comparison.table(), path), *draw_scene(comparison, path)]


def write_sweep(sweep: Sweep, path: Path) -> list[Path]:
    """Write a sweep to ``path`` (JSON), and its figure; all files written."""
    return [_write_json(sweep.table(), path), *draw_sweep(sweep, path)]


def write_frames(frames: Frames, world_size: tuple[float, float, float], name: str, path: Path) -> None:
    """Write the boxes of the frames as an AABB stream, in a world of this size [m] about the origin."""
    half = 0.5 * np.array(world_size)
    lower, upper = (np.stack([frame[corner] for frame in frames]) for corner in (0, 1))
    write_stream(path, Stream(name, "particles", np.stack([-half, half]), lower, upper))


def _write_json(table: dict[str, Any], path: Path) -> Path:
    with atomic_write(path) as hidden:
        hidden.write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")
    return path
