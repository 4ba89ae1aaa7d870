"""The ledger: what must be kept, and what was done."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from particlesim.core.jit import kernel
from particlesim.core.math3d import add, axpy, cross, dot, load_vec3, scale, store_vec3, to_vec3
from particlesim.model.free_motion import particle_spin


@dataclass(frozen=True)
class Ledger:
    """Sums over all particles at one time, and counts since the start.

    Energies [J], momentum [kg m/s], angular momentum about the origin [kg m^2/s]; both vectors (3,).
    """

    time: float  # [s]
    time_step: float  # the last one [s]
    steps: int
    kinetic_translational: float
    kinetic_rotational: float
    potential: float  # in the field of gravity, zero at the corner of the world that it points to
    momentum: np.ndarray
    angular_momentum: np.ndarray
    impacts: int
    pairs_tested: int  # boxes compared by the broad phase
    candidate_pairs: int  # pairs it handed to the narrow phase
    unresolved: int  # stretches of time in which more happened than was worked through (see MAX_IMPACTS)
    virial: float  # sum of r_ij . impulse over pair impacts [J s]
    wall_impulse: np.ndarray  # (6,) given to the walls -x, +x, -y, +y, -z, +z along their outward normals [N s]
    largest_overlap: float  # of two particles, or of a particle and a wall, at this time [m]

    @property
    def kinetic(self) -> float:
        """Translational and rotational kinetic energy [J]."""
        return self.kinetic_translational + self.kinetic_rotational

    @property
    def energy(self) -> float:
        """Kinetic and potential energy [J]."""
        return self.kinetic + self.potential

    def row(self) -> dict[str, Any]:
        """Everything by name, as a trajectory stores it."""
        return asdict(self)


@kernel
def sums(world, constants, state):
    """Rows (3, 3): energies of translation, of rotation and in the field; momentum; angular momentum."""
    translational = rotational = potential = 0.0
    momentum = angular = (0.0, 0.0, 0.0)
    gravity = to_vec3(world.gravity)
    # Gravity times the corner of the world that it points to.
    lowest = 0.0
    for axis in range(3):
        lowest += max(gravity[axis] * world.lower[axis], gravity[axis] * world.upper[axis])
    for i in range(len(constants.mass)):
        m, v, x = constants.mass[i], load_vec3(state.velocity, i), load_vec3(state.position, i)
        own = load_vec3(state.angular_momentum, i)
        # Where the particle would be had it not been brought back into a periodic world.
        x = (
            x[0] + state.image[i, 0] * world.period[0],
            x[1] + state.image[i, 1] * world.period[1],
            x[2] + state.image[i, 2] * world.period[2],
        )
        translational += 0.5 * m * dot(v, v)
        rotational += 0.5 * dot(own, particle_spin(constants, state, i))
        potential += m * (lowest - dot(gravity, x))
        momentum = axpy(momentum, v, m)
        angular = add(angular, add(own, scale(cross(x, v), m)))
    out = np.empty((3, 3))
    store_vec3(out, 0, (translational, rotational, potential))
    store_vec3(out, 1, momentum)
    store_vec3(out, 2, angular)
    return out
