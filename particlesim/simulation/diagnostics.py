"""The ledger: what must be kept, and what was done."""

from __future__ import annotations

import numpy as np

from particlesim.core.jit import kernel
from particlesim.core.math3d import add, axpy, cross, dot, load_vec3, scale, store_vec3, to_vec3
from particlesim.model.free_motion import particle_spin


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
