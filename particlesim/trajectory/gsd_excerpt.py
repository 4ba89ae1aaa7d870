"""Some frames of a trajectory as a file of their own, chunk by chunk: to send to where the whole file is not."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable
from pathlib import Path

import gsd.fl

from particlesim.trajectory.gsd_chunks import reading


def excerpt(path: Path, numbers: Iterable[int]) -> bytes:
    """A GSD file of the first frame of another one, and then of those with these numbers.

    The first one has what stays the same. TrajectoryError if the file cannot be read.
    """
    with tempfile.TemporaryDirectory() as folder, reading(path):
        made = Path(folder, "excerpt.gsd")
        with gsd.fl.open(str(path), "r") as whole:
            names = whole.find_matching_chunk_names("")
            version = {"schema": whole.schema, "schema_version": whole.schema_version}
            with gsd.fl.open(str(made), "w", application=whole.application, **version) as part:
                for frame in (0, *numbers):
                    for name in names:
                        if whole.chunk_exists(frame, name):
                            part.write_chunk(name, whole.read_chunk(frame, name))
                    part.end_frame()
        return made.read_bytes()
