"""The leaves of the octree as fine lines, coloured by their depth."""

from __future__ import annotations

import numpy as np

from particlesim.broad_phase import octree_leaves
from particlesim.rendering.gl import geometry
from particlesim.rendering.shading.colour_maps import map_colours
from particlesim.scene import Scene
from particlesim.scene.world import Octree
from particlesim.trajectory.frames import Frame

# Leaves at this depth or deeper have the last colour of this map.
_DEEPEST, _MAP = 8, "viridis"


def cell_lines(
    lower: np.ndarray, upper: np.ndarray, depth: np.ndarray, width: float, background: np.ndarray
) -> np.ndarray:
    """Lines (see gl.geometry) for boxes ``lower`` .. ``upper`` (k, 3) [m] of ``depth`` (k,); ``width`` [pixels].

    ``background``: sRGB 0 .. 1 (3,), that they stand off from.
    """
    colour = np.empty((len(depth), 4))
    colour[:, :3] = map_colours(np.asarray(depth) / _DEEPEST, _MAP, background)
    colour[:, 3] = 0.35
    return geometry.box_lines(np.asarray(lower), np.asarray(upper), np.repeat(colour, 12, axis=0), width)


def octree_cells(scene: Scene, frame: Frame) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Lower and upper corners (k, 3) [m] and depths (k,) of the octree's leaves over the particles of a frame."""
    chosen = scene.solver.broad_phase
    octree = chosen if isinstance(chosen, Octree) else Octree(kind="octree")
    upper = 0.5 * np.asarray(scene.world.size)
    return octree_leaves(frame.position, frame.position, octree.max_count, octree.max_depth, -upper, upper)
