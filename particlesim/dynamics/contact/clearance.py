"""How fast surfaces may move in a step, and how far they have come: what is far enough apart need not be looked at."""

from __future__ import annotations

import numpy as np

from particlesim.core.jit import entry_kernel, without_refcounts
from particlesim.core.math3d import (
    conjugate,
    load_vec3,
    norm,
    quat_multiply,
    set_quat,
    set_vec3,
    sub,
    to_quat,
    to_vec3,
)
from particlesim.dynamics.ccd.swept_bounds import largest_acceleration
from particlesim.dynamics.settings import SPEED_HANDED_ON
from particlesim.model.bodies import KINEMATIC
from particlesim.model.domain import nearest_image


@entry_kernel
def surface_speeds(system, spin, duration):
    """How fast the surface of each body moves at most, of obstacles within ``duration`` [s], (n,) [m/s].

    Of half-spaces without what turning does, which depends on where.
    """
    system, spin = without_refcounts((system, spin))
    speed = np.zeros(len(system.body))
    for i in range(len(speed)):
        b = system.body[i]
        speed[i] = norm(to_vec3(b.velocity))
        if i < system.bounded:
            speed[i] += norm(load_vec3(spin, i)) * b.radius
        if b.kind == KINEMATIC:
            speed[i] += largest_acceleration(system, b) * duration
    return speed


@entry_kernel
def expected_speeds(speed, neighbours, gain):
    """How fast surfaces that move at ``speed`` (n,) may become [m/s]: faster by ``gain``, or as neighbours push."""
    speed, neighbours = without_refcounts((speed, neighbours))
    expected = speed.copy()
    for p in range(len(neighbours.body)):
        i = neighbours.body[p]
        for near in range(neighbours.start[p], neighbours.start[p + 1]):
            expected[i] = max(expected[i], SPEED_HANDED_ON * speed[neighbours.body[neighbours.other[near]]])
        expected[i] += gain
    return expected


@entry_kernel
def add_displacements(system, seen, displacement):
    """Add to ``displacement`` (n,) how far surfaces are from where they were ``seen`` [m], which becomes the present.

    ``seen`` (n,) SEEN are poses.
    """
    system, seen, displacement = without_refcounts((system, seen, displacement))
    period = system.domain[0].period
    for i in range(len(displacement)):
        b, s = system.body[i], seen[i]
        x, q = to_vec3(b.position), to_quat(b.orientation)
        half = quat_multiply(q, conjugate(to_quat(s.orientation)))
        turned = 2.0 * b.radius * norm((half[1], half[2], half[3]))
        displacement[i] += norm(nearest_image(sub(x, to_vec3(s.position)), period)) + turned
        set_vec3(s.position, x)
        set_quat(s.orientation, q)
