"""Advance: every body along its free path to the end of the substep; and how fast all of them are."""

from __future__ import annotations

import math

import numpy as np

from particlesim.core.jit import entry_kernel, kernel, without_refcounts
from particlesim.core.math3d import axpy, dot, norm, set_quat, set_vec3, sub, to_quat, to_vec3
from particlesim.core.parallel import ThreadTeam
from particlesim.dynamics.ccd.swept_bounds import largest_acceleration
from particlesim.dynamics.settings import SUM_BLOCK
from particlesim.model.domain import nearest_image
from particlesim.model.free_motion import angular_speed, free_rotation, isotropic_rotation
from particlesim.model.system import System


@kernel
def _turns_round(position, lower, period):
    """How often a coordinate has gone round a periodic axis; 0 on any other."""
    inside = 0.0 <= position - lower < period  # of most, which are spared the division
    return math.floor((position - lower) / period) if period > 0.0 and not inside else 0


@kernel
def _wrapped(b, position, lower, period):
    """A position brought back into a periodic domain; counts in the body's image how often it went round."""
    turns = (
        _turns_round(position[0], lower[0], period[0]),
        _turns_round(position[1], lower[1], period[1]),
        _turns_round(position[2], lower[2], period[2]),
    )
    if turns != (0, 0, 0):
        for axis in range(3):
            b.image[axis] += turns[axis]
        position = (
            position[0] - period[0] * turns[0],
            position[1] - period[1] * turns[1],
            position[2] - period[2] * turns[2],
        )
    return position


@kernel
def _turn(b, time):
    """Let a particle turn freely for ``time`` [s]."""
    momentum = to_vec3(b.angular_momentum)
    if dot(momentum, momentum) > 0.0:
        orientation, isotropic = to_quat(b.orientation), b.isotropic_inertia
        if isotropic > 0.0:
            orientation = isotropic_rotation(orientation, momentum, isotropic, time)
        else:
            orientation = free_rotation(orientation, momentum, to_vec3(b.principal_inertia), time)
        set_quat(b.orientation, orientation)


@kernel
def _time_within_skin(position, speed, acceleration, reference, period):
    """For how long [s] a body certainly stays within its skin, going straight on; -1 if it is not within it now."""
    offset = nearest_image(sub(position, (reference[0], reference[1], reference[2])), period)
    room = reference[3] - norm(offset)
    if room < 0.0:
        return -1.0
    # room = speed t + acceleration t^2 / 2
    denominator = speed + math.sqrt(speed * speed + 2.0 * acceleration * room)
    return 2.0 * room / denominator if denominator > 0.0 else math.inf


@entry_kernel
def advance(system, reference, duration, first, last):
    """Bring particles ``first .. last`` from their local clocks to ``duration`` [s] along their free paths.

    Those that leave a periodic domain come back on the other side. Returns for how long [s] all of them certainly stay
    within their skins, going straight on; -1 if one has left it.
    """
    system, reference = without_refcounts((system, reference))
    # Taken out of its record once: what is written to the bodies might be the domain, for all the compiler knows.
    domain = system.domain[0]
    lower, period, fall = to_vec3(domain.lower), to_vec3(domain.period), to_vec3(domain.gravity)
    gravity, longest = norm(fall), math.inf
    for i in range(first, last):
        b = system.body[i]
        time = duration - b.time if b.disturbed != 0 else duration
        acceleration = fall if b.resting == 0 else (0.0, 0.0, 0.0)
        velocity = to_vec3(b.velocity)
        position = axpy(axpy(to_vec3(b.position), velocity, time), acceleration, 0.5 * time * time)
        position, velocity = _wrapped(b, position, lower, period), axpy(velocity, acceleration, time)
        set_vec3(b.position, position)
        set_vec3(b.velocity, velocity)
        _turn(b, time)
        longest = min(longest, _time_within_skin(position, norm(velocity), gravity, reference[i], period))
    return longest


@entry_kernel
def time_within_skins(system, reference, first, last):
    """As ``advance`` returns, of bodies ``first .. last`` as they are now."""
    system, reference = without_refcounts((system, reference))
    longest = math.inf
    for i in range(first, last):
        b = system.body[i]
        speed, acceleration = norm(to_vec3(b.velocity)), largest_acceleration(system, b)
        period = system.domain[0].period
        longest = min(longest, _time_within_skin(to_vec3(b.position), speed, acceleration, reference[i], period))
    return longest


@entry_kernel
def sum_speeds(system, block_size, sums, first, last):
    """Sums over blocks ``first .. last`` of particles: squares of surface speeds, and gravity, in radii.

    ``sums`` (blocks, 2) [1/s^2], [1/s^2]. Returns the largest speed [m/s].
    """
    system, sums = without_refcounts((system, sums))
    gravity = norm(to_vec3(system.domain[0].gravity))
    fastest = 0.0
    for block in range(first, last):
        squares = falls = 0.0
        for i in range(block * block_size, min((block + 1) * block_size, system.particles)):
            b = system.body[i]
            speed2 = dot(to_vec3(b.velocity), to_vec3(b.velocity))
            fastest = max(fastest, speed2)
            speed = math.sqrt(speed2)
            momentum = to_vec3(b.angular_momentum)
            if dot(momentum, momentum) > 0.0:
                speed += angular_speed(b) * b.radius
            squares += (speed / b.radius) ** 2
            falls += gravity / b.radius
        sums[block, 0], sums[block, 1] = squares, falls
    return math.sqrt(fastest)


def typical_speeds(system: System) -> tuple[float, float, float]:
    """Of particles: speed of surfaces (root mean square) and gravity in radii [1/s, 1/s^2]; the largest speed [m/s]."""
    sums = np.empty((-(-system.particles // SUM_BLOCK), 2))
    of_blocks = ThreadTeam(system.particles).each(
        lambda _, first, last: sum_speeds(system, SUM_BLOCK, sums, first, last), len(sums)
    )
    squares, falls = sums.sum(axis=0) / system.particles
    return math.sqrt(squares), falls, max(of_blocks)
