"""What must be kept: energies, momentum and angular momentum, summed over all particles."""

import numpy as np

from particlesim.core.jit import entry_kernel, kernel, without_refcounts
from particlesim.core.math3d import add, axpy, cross, dot, scale, store_vec3, to_vec3
from particlesim.model.bodies import angular_velocity


@kernel
def _lowest(domain):
    """Gravity times the corner of the domain that it points to."""
    lowest = 0.0
    for axis in range(3):
        g = domain.gravity[axis]
        lowest += max(g * domain.lower[axis], g * domain.upper[axis])
    return lowest


@kernel
def _unwrapped(b, period):
    """Where a particle would be had it not been brought back into a periodic domain."""
    x, image = b.position, b.image
    return x[0] + image[0] * period[0], x[1] + image[1] * period[1], x[2] + image[2] * period[2]


@entry_kernel
def conserved(system):
    """Rows (3, 3): energies of translation, of rotation and in the field [J]; momentum; angular momentum."""
    system = without_refcounts(system)
    domain = system.domain[0]
    gravity, lowest = to_vec3(domain.gravity), _lowest(domain)
    translational = rotational = potential = 0.0
    momentum = angular = (0.0, 0.0, 0.0)
    for i in range(system.particles):
        b = system.body[i]
        m, v, x = b.mass, to_vec3(b.velocity), _unwrapped(b, domain.period)
        own = to_vec3(b.angular_momentum)
        translational += 0.5 * m * dot(v, v)
        rotational += 0.5 * dot(own, angular_velocity(b))
        potential += m * (lowest - dot(gravity, x))
        momentum = axpy(momentum, v, m)
        angular = add(angular, add(own, scale(cross(x, v), m)))
    out = np.empty((3, 3))
    store_vec3(out, 0, (translational, rotational, potential))
    store_vec3(out, 1, momentum)
    store_vec3(out, 2, angular)
    return out
