"""The memory that particles take, compared with what there is. It is light to import: asked before all else."""

from __future__ import annotations

import os
from pathlib import Path

from particlesim.scene.errors import SceneError

# Bytes a particle takes: constants, state, boxes, the broad phase and the candidate pairs at their largest, and a frame
# that is being written. Measured of ten million spheres.
BYTES_PER_PARTICLE = 1400


def check_memory(particles: int) -> None:
    """SceneError if this machine has no memory for so many particles."""
    needed, there = BYTES_PER_PARTICLE * particles, _memory()
    if needed > there:
        message = (
            f"{particles:,} particles need about {needed / 1e9:,.0f} GB of memory; there are {there / 1e9:,.0f} GB"
        )
        raise SceneError(message, "particles")


def _memory() -> float:
    """Bytes of memory that this process may have: the machine's, or what its container is allowed."""
    machine = float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    try:
        return min(machine, float(Path("/sys/fs/cgroup/memory.max").read_text()))
    except (OSError, ValueError):  # no container, or one that says "max"
        return machine
