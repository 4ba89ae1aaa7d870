"""Motion blur: the moments while the shutter is open, whose pictures a picture is the mean of.

The shutter closes at the time of a frame, so that a picture needs no frame but its own: particles were before it where
their velocities say. Only what struck them in that time makes a difference.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from particlesim.core.rotations import quaternions_of, rotations_of
from particlesim.scene import Scene
from particlesim.trajectory.frames import Frame, Header


def moments_of(scene: Scene, header: Header, frame: Frame, inradius: np.ndarray) -> Iterator[Frame]:
    """A frame as it was while the shutter was open, itself the last; without blur it alone.

    Nothing was before a run, whose first picture is sharp. ``inradius`` (n,): of all particles of the header [m].
    """
    opened = min(scene.movie.exposure, frame.time)
    if opened <= 0.0:
        yield frame
        return
    inradius, spin = inradius[frame.ids], _angular_velocities(header.of(frame), frame)
    for seconds in np.linspace(opened, 0.0, scene.movie.sub_frames).tolist():
        position = _in_world(scene, frame.position - seconds * frame.velocity, frame.position, inradius)
        orientation = _turned(frame.orientation, -seconds * spin)
        yield replace(frame, time=frame.time - seconds, position=position, orientation=orientation)


def _in_world(scene: Scene, position: np.ndarray, now: np.ndarray, inradius: np.ndarray) -> np.ndarray:
    """Positions (n, 3) of particles that are ``now`` in a world: none was behind a wall that struck it since.

    Along axes with a period they come back on the other side.
    """
    size, boundary = np.asarray(scene.world.size), np.array(scene.world.boundary)
    room = np.maximum(0.5 * size - inradius[:, None], np.abs(now))
    inside = np.where(boundary == "wall", np.clip(position, -room, room), position)
    return inside - np.where(boundary == "periodic", size * np.rint(inside / size), 0.0)


def _angular_velocities(header: Header, frame: Frame) -> np.ndarray:
    """Of particles (n, 3) [rad/s]; 0 of spheres, which look the same however they turn."""
    spin = np.zeros(frame.position.shape)
    turning = np.flatnonzero(~np.array([shape.is_sphere for shape in header.shapes])[header.shape])
    if len(turning):
        rotation = rotations_of(frame.orientation[turning])
        spin[turning] = rotation.apply(rotation.inv().apply(frame.angular_momentum[turning]) / header.inertia[turning])
    return spin


def _turned(orientation: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """Quaternions (n, 4) after rotations (n, 3) [rad] about axes of the world; what does not turn stays to the bit."""
    turning, turned = np.flatnonzero(angles.any(axis=1)), orientation.copy()
    if len(turning):
        turned[turning] = quaternions_of(Rotation.from_rotvec(angles[turning]) * rotations_of(orientation[turning]))
    return turned
