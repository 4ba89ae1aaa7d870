"""Who is in a picture: all particles, and in a periodic world those that come in where others stick out."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from particlesim.rendering.visibility.geometry_tables import Bodies
from particlesim.scene import Scene
from particlesim.trajectory.frame_aabb import frame_boxes
from particlesim.trajectory.frames import Frame, Header

# Each particle as itself.
EVERYONE = slice(None)


class Cast(NamedTuple):
    """``position`` (m, 3) and ``orientation`` (m, 4) float64 of all that may be seen, what they look like, and
    ``whose`` (m,) image each is: EVERYONE, or numbers of particles.
    """

    position: np.ndarray
    orientation: np.ndarray
    bodies: Bodies
    whose: slice | np.ndarray

    def particles(self, members: np.ndarray) -> np.ndarray:
        """Which particles ``members`` (k,) of the cast are images of, (k,)."""
        return members if isinstance(self.whose, slice) else self.whose[members]


def cast_of(scene: Scene, header: Header, frame: Frame, bodies: Bodies) -> Cast:
    """The particles of a frame, and their images through the faces of a periodic world that they reach through."""
    position, orientation = np.ascontiguousarray(frame.position), np.ascontiguousarray(frame.orientation)
    periodic = np.array(scene.world.boundary) == "periodic"
    if not periodic.any():
        return Cast(position, orientation, bodies, EVERYONE)
    size = np.asarray(scene.world.size)
    near = np.flatnonzero(((np.abs(position) + bodies.outer[:, None] > 0.5 * size) & periodic).any(axis=1))
    boxes = frame_boxes(
        replace(header, shape=header.shape[near], size=header.size[near]),
        replace(frame, position=position[near], orientation=orientation[near]),
    )
    which, shift = images_of(*boxes, size, periodic)
    whose = np.concatenate([np.arange(len(position)), near[which]])
    of_each = {name: getattr(bodies, name)[whose] for name in ("inner", "outer", "size", "shape")}
    images = position[near[which]] + shift
    return Cast(np.concatenate([position, images]), orientation[whose], bodies._replace(**of_each), whose)


def images_of(
    lower: np.ndarray, upper: np.ndarray, size: np.ndarray, periodic: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Images of boxes that reach through a face of a world about the origin: ``which`` (k,) box, and its shift (k, 3).

    ``lower`` and ``upper`` (n, 3), edges of the world ``size`` (3,) [m] and which axes are ``periodic`` (3,) bool.
    """
    count = len(lower)
    which, shift = np.arange(count), np.zeros((count, 3))
    for axis in np.flatnonzero(periodic):
        # An image may reach through a face of the next axis as well: about an edge there are three, a corner seven.
        below = np.flatnonzero(lower[which, axis] < -0.5 * size[axis])
        above = np.flatnonzero(upper[which, axis] > 0.5 * size[axis])
        through = np.concatenate([below, above])
        turn = shift[through]
        turn[:, axis] = np.repeat([size[axis], -size[axis]], [len(below), len(above)])
        which, shift = np.concatenate([which, which[through]]), np.concatenate([shift, turn])
    return which[count:], shift[count:]
