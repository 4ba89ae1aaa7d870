"""What a picture shows: every body, and in a periodic world the images of those that reach through its faces."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from particlesim.rendering.visibility.geometry_tables import GeometryTables, taken
from particlesim.scene import Scene
from particlesim.trajectory.frame_aabb import frame_boxes
from particlesim.trajectory.frames import Frame, Header

# The source of instances that are the bodies themselves, one each.
ALL_BODIES = slice(None)


class Instances(NamedTuple):
    """What may be seen in a picture.

    Parameters
    ----------
    position : (m, 3) float64
        Centroids [m].
    orientation : (m, 4) float64
        Unit quaternions (w, x, y, z).
    tables : GeometryTables
        Shape and size of each instance.
    source : slice or (m,) int64
        The body that each is an image of: ALL_BODIES, or their numbers.
    """

    position: np.ndarray
    orientation: np.ndarray
    tables: GeometryTables
    source: slice | np.ndarray = ALL_BODIES

    def bodies(self, indices: np.ndarray) -> np.ndarray:
        """The bodies (k,) that the instances ``indices`` (k,) are images of."""
        return indices if isinstance(self.source, slice) else self.source[indices]


def instances_of(scene: Scene, header: Header, frame: Frame, tables: GeometryTables) -> Instances:
    """The bodies of a frame, and their images through the faces of a periodic world that they reach through."""
    header, source = header.of(frame), ALL_BODIES if frame.present is None else frame.present
    if frame.present is not None:
        tables = taken(tables, frame.present)
    position, orientation = np.ascontiguousarray(frame.position), np.ascontiguousarray(frame.orientation)
    periodic = np.array(scene.world.boundary) == "periodic"
    if not periodic.any():
        return Instances(position, orientation, tables, source)
    size = np.asarray(scene.world.size)
    near = np.flatnonzero(((np.abs(position) + tables.radius[:, None] > 0.5 * size) & periodic).any(axis=1))
    boxes = frame_boxes(
        replace(header, shape=header.shape[near], size=header.size[near]),
        replace(frame, position=position[near], orientation=orientation[near], present=None),
    )
    which, shift = images_of(*boxes, size, periodic)
    rows = np.concatenate([np.arange(len(position)), near[which]])
    images = position[near[which]] + shift
    return Instances(np.concatenate([position, images]), orientation[rows], taken(tables, rows), frame.ids[rows])


def images_of(
    lower: np.ndarray, upper: np.ndarray, size: np.ndarray, periodic: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Images of AABBs that reach through a face of a world about the origin.

    Parameters
    ----------
    lower, upper : (n, 3) float64
        Corners of the AABBs [m].
    size : (3,) float64
        Edges of the world [m].
    periodic : (3,) bool
        Which axes are periodic.

    Returns
    -------
    which : (k,) int64
        The AABB that each image is of.
    shift : (k, 3) float64
        From the AABB to its image [m].
    """
    count = len(lower)
    which, shift = np.arange(count), np.zeros((count, 3))
    for axis in np.flatnonzero(periodic):
        # An image may reach through a face of the next axis as well: about an edge there are three, a corner seven.
        below = np.flatnonzero(lower[which, axis] < -0.5 * size[axis])
        above = np.flatnonzero(upper[which, axis] > 0.5 * size[axis])
        through = np.concatenate([below, above])
        moved = shift[through]
        moved[:, axis] = np.repeat([size[axis], -size[axis]], [len(below), len(above)])
        which, shift = np.concatenate([which, which[through]]), np.concatenate([shift, moved])
    return which[count:], shift[count:]
