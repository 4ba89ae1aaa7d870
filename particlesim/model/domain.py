"""The space that bodies move in: its extent, its periods, its gravity, and the walls that bound it."""

from __future__ import annotations

import numpy as np

from particlesim.core.constants import PERIODIC, WALL
from particlesim.core.jit import kernel
from particlesim.core.records import record
from particlesim.model.bodies import make_obstacles

DOMAIN = record(
    [
        ("lower", "f8", (3,)),  # [m]
        ("upper", "f8", (3,)),  # [m]
        ("period", "f8", (3,)),  # edge of a periodic axis, 0 elsewhere [m]
        ("gravity", "f8", (3,)),  # [m/s^2]
        ("boundary", "i8", (3,)),  # WALL, PERIODIC or OPEN
        ("rest_speed", "f8"),  # below which nothing counts as approaching: rounding, set by the solver [m/s]
        ("penetration_slop", "f8"),  # of sizes, that touches may go before they count again; set by the solver
    ]
)


def make_domain(size: np.ndarray, boundary: np.ndarray, gravity: np.ndarray) -> np.ndarray:
    """A domain about the origin, (1,) DOMAIN, of edges ``size`` (3,) [m]; boundaries as ``core.constants`` has them."""
    domain = np.zeros(1, dtype=DOMAIN)
    half = 0.5 * np.asarray(size, dtype=np.float64)
    domain["lower"], domain["upper"] = -half, half
    domain["boundary"], domain["gravity"] = boundary, gravity
    domain["period"] = np.where(np.asarray(boundary) == PERIODIC, 2.0 * half, 0.0)
    return domain


def wall_normals() -> np.ndarray:
    """Outward normals of the solids behind the six walls, (6, 3), in the order of WALL_NAMES: into the domain."""
    normals = np.zeros((6, 3))
    for wall in range(6):
        normals[wall, wall // 2] = 1.0 - 2.0 * (wall % 2)
    return normals


def make_walls(domain: np.ndarray, first_shape: int) -> np.ndarray:
    """The walls of a domain as static half-spaces, (k,) BODY, for shapes ``first_shape`` on in the order of walls."""
    extent, which = domain[0], np.flatnonzero(np.repeat(domain[0]["boundary"] == WALL, 2))
    walls = make_obstacles(len(which))
    walls["wall"], walls["shape_row"] = which, first_shape + which
    for row, wall in zip(walls, which.tolist(), strict=True):
        row["position"][wall // 2] = extent["upper" if wall % 2 else "lower"][wall // 2]
    return walls


@kernel
def nearest_image(offset, period):
    """An offset between two bodies, by the shortest way round each periodic axis."""
    x, y, z = offset
    # Few pairs lie on two sides of a face: the others are spared the division.
    if abs(x) > 0.5 * period[0] and period[0] > 0.0:
        x -= period[0] * round(x / period[0])
    if abs(y) > 0.5 * period[1] and period[1] > 0.0:
        y -= period[1] * round(y / period[1])
    if abs(z) > 0.5 * period[2] and period[2] > 0.0:
        z -= period[2] * round(z / period[2])
    return x, y, z
