"""The arrays a simulation works on: struct of arrays, float64, C-contiguous, checked once when they are built.

What never changes (``Constants``, ``ShapeTable``, ``World``) is apart from what every step changes (``State``).
Units are SI; axes right-handed, z up; quaternions (w, x, y, z); angular velocity in world axes.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from particlesim.core.constants import PENETRATION_SLOP
from particlesim.geometry.shapes import Shape


class Constants(NamedTuple):
    """What a particle is."""

    shape: np.ndarray  # (n,) int64, row of the shape table
    group: np.ndarray  # (n,) int64, which entry of the scene's particles it came from
    size: np.ndarray  # (n,) factor on the shape of size 1
    mass: np.ndarray  # (n,) [kg]
    inertia: np.ndarray  # (n, 3) principal moments [kg m^2]
    restitution: np.ndarray  # (n,) of the particle; a pair takes the smaller of its two
    radius: np.ndarray  # (n,) bounding sphere [m]
    inradius: np.ndarray  # (n,) inscribed sphere [m]


class State(NamedTuple):
    """Where a particle is and how it moves."""

    position: np.ndarray  # (n, 3) centroid [m]
    orientation: np.ndarray  # (n, 4) unit quaternion, body to world
    velocity: np.ndarray  # (n, 3) [m/s]
    angular_momentum: np.ndarray  # (n, 3) about the centroid, world axes [kg m^2/s]
    image: np.ndarray  # (n, 3) int64, how often it left a periodic world by its upper faces


class Particles(NamedTuple):
    """Constants and state side by side, as a script sees them."""

    shape: np.ndarray
    group: np.ndarray
    size: np.ndarray
    mass: np.ndarray
    inertia: np.ndarray
    restitution: np.ndarray
    radius: np.ndarray
    inradius: np.ndarray
    position: np.ndarray
    orientation: np.ndarray
    velocity: np.ndarray
    angular_momentum: np.ndarray
    image: np.ndarray
    angular_velocity: np.ndarray  # (n, 3) world axes [rad/s], computed from the angular momentum
    impacts: np.ndarray  # (n,) int64, how many each has had since the start


class World(NamedTuple):
    """The space the particles move in."""

    lower: np.ndarray  # (3,) [m]
    upper: np.ndarray  # (3,) [m]
    boundary: np.ndarray  # (3,) int64: WALL, PERIODIC or OPEN
    period: np.ndarray  # (3,) edge of a periodic axis [m], 0 elsewhere
    gravity: np.ndarray  # (3,) [m/s^2]
    restitution: float  # of the walls
    still: float = 0.0  # speed below which nothing counts as approaching [m/s]
    sinking: float = PENETRATION_SLOP  # how deep touches may go before they count again, as a fraction of sizes


def particle_constants(
    shapes: Sequence[Shape],
    shape: np.ndarray,
    group: np.ndarray,
    size: np.ndarray,
    density: np.ndarray,
    restitution: np.ndarray,
) -> Constants:
    """Mass, inertia and radii of particles from their shape, size [-] and density [kg/m^3]; all (n,)."""
    volume = np.array([s.volume for s in shapes])[shape] * size**3
    moments = np.array([s.moments for s in shapes]).reshape(-1, 3)[shape] * (size**5)[:, None]
    return Constants(
        shape=np.ascontiguousarray(shape, dtype=np.int64),
        group=np.ascontiguousarray(group, dtype=np.int64),
        size=np.ascontiguousarray(size, dtype=np.float64),
        mass=density * volume,
        inertia=np.ascontiguousarray(density[:, None] * moments),
        restitution=np.ascontiguousarray(restitution, dtype=np.float64),
        radius=np.array([s.radius for s in shapes])[shape] * size,
        inradius=np.array([s.inradius for s in shapes])[shape] * size,
    )
