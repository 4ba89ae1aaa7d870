"""A mesh that is not convex, as a compound of convex parts (X. Wei et al., ACM Trans. Graphics 41 (2022) 42)."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from particlesim.core.constants import MAX_PARTS
from particlesim.core.extras import require
from particlesim.geometry.compounds import Part, compound
from particlesim.geometry.convex_hull import hull_polygons
from particlesim.geometry.mass_properties import mass_properties
from particlesim.geometry.mesh_file import mesh_triangles
from particlesim.geometry.shapes import Shape, hull

_UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])


def decomposed(file: str | Path, unit: str = "m") -> Shape:
    """The compound of convex parts that an STL, OBJ or PLY file is split into, whose numbers are in ``unit``.

    The same file, and version of coacd, gives the same parts. ``remarks`` say how many there are, and by how much their
    volume differs from that within the triangles.

    Raises
    ------
    OSError, ValueError
        If the file cannot be read, is no mesh, encloses no volume or has too many parts.
    MissingExtraError
        If coacd is not installed.
    """
    coacd, path = require("coacd", "decompose"), Path(file)
    points, triangles = mesh_triangles(path, unit)
    # Corners that triangles share are one: of an STL file each triangle has its own, and the parts come out worse.
    points, number = np.unique(points, axis=0, return_inverse=True)
    triangles = number.reshape(-1)[triangles]
    volume = mass_properties(points, triangles.tolist()).volume
    coacd.set_log_level("off")
    found = coacd.run_coacd(coacd.Mesh(points, triangles), seed=0)
    parts = [part for part in (_part(path.stem, corners) for corners, _ in found) if part is not None]
    if not parts:
        raise ValueError(f"'{path.stem}' has no convex parts that enclose a volume")
    if len(parts) > MAX_PARTS:
        raise ValueError(f"'{path.stem}' has {len(parts):,} convex parts; there may be up to {MAX_PARTS}")
    shape = compound(parts)
    off = f"{shape.volume / volume - 1.0:+.2%} of the volume of its file" if volume > 0.0 else "its file is not closed"
    return replace(shape, name=path.stem, remarks=(f"{len(parts)} convex parts, {off}",))


def _part(name: str, corners: np.ndarray) -> Part | None:
    """The hull of corners as a part where it is; None of a sliver."""
    try:
        centroid = mass_properties(*hull_polygons(name, corners)).centroid
        return Part(hull(name, corners), centroid, _UPRIGHT, 1.0)
    except ValueError:
        return None
