"""Vertices of mesh files, and their simplification."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from particlesim.geometry.convex_hull import convex_hull, corner_points
from particlesim.geometry.tolerances import MAX_MESH_VERTICES


def mesh_vertices(path: Path) -> np.ndarray:
    """Vertices of the convex hull of an STL, OBJ or PLY file, at most MAX_MESH_VERTICES of them, (v, 3).

    OSError or ValueError if the file cannot be read or encloses no volume.
    """
    import trimesh  # noqa: PLC0415  (slow to import, needed for meshes only)

    if not path.is_file():
        raise FileNotFoundError(f"no such file: {path}")
    try:
        loaded: Any = trimesh.load(path, force="mesh", process=False)
        points = np.asarray(loaded.vertices, dtype=np.float64)
    except Exception as error:
        raise ValueError(f"{path} cannot be read as a mesh: {error}") from error
    # Points inside faces and edges are no corners: what is left is thinned, so that a cube of many points stays one.
    return _spread(corner_points(path.stem, points[convex_hull(path.stem, points).vertices]))


def _spread(points: np.ndarray) -> np.ndarray:
    """At most MAX_MESH_VERTICES of the points, each the farthest from those chosen before it."""
    if len(points) <= MAX_MESH_VERTICES:
        return points
    chosen = [int(np.argmax(np.linalg.norm(points - points.mean(axis=0), axis=1)))]
    distance = np.linalg.norm(points - points[chosen[0]], axis=1)
    while len(chosen) < MAX_MESH_VERTICES:
        chosen.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return points[chosen]
