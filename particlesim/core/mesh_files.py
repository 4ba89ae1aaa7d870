"""Which files are read as meshes."""

from __future__ import annotations

from pathlib import Path

from particlesim.core.constants import LARGEST_MESH, MESH_ENDINGS


def check_mesh_file(path: Path) -> None:
    """ValueError for a file that is not read as a mesh: of another ending, or so large that it would take minutes."""
    if path.suffix.lower() not in MESH_ENDINGS:
        raise ValueError("must be an STL, OBJ or PLY file")
    size = path.stat().st_size
    if size > LARGEST_MESH:
        raise ValueError(f"has {size / 1e6:,.0f} MB: a mesh file has {LARGEST_MESH // 1_000_000} MB at most")
