"""What a result depends on, as plain values: what a run must find unchanged to be gone on with."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from particlesim.scene import Scene
from particlesim.trajectory.gsd_file import Trajectory


def task_of(
    source: Scene | Trajectory,
    look: Scene | None = None,
    frames: range | None = None,
    shard: tuple[int, int] | None = None,
) -> dict[str, Any]:
    """The keys of a scene, and what else its run or the drawing of a trajectory depends on."""
    if isinstance(source, Scene):
        table = _plain(source)
        table["files"] = {file: hashlib.sha256(Path(file).read_bytes()).hexdigest() for file in _files(table)}
    else:
        table = _plain(source.scene)
        table["trajectory"] = {"frames": len(source), "bytes": source.path.stat().st_size}
    if look is not None and look is not source:
        table["look"] = _plain(look)
    if frames is not None:
        table["frames"] = [frames.start, frames.stop, frames.step]
    if shard is not None:
        table["shard"] = list(shard)
    return table


def _plain(scene: Scene) -> dict[str, Any]:
    return json.loads(scene.model_dump_json())


def _files(value: Any) -> Iterator[str]:
    """The files that the tables of a scene name."""
    if isinstance(value, dict):
        if value.get("kind") == "mesh":
            yield value["file"]
        value = list(value.values())
    if isinstance(value, list):
        for inner in value:
            yield from _files(inner)
