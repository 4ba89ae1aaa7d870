"""What concerns every particle in every stretch of time, whether it meets anything or not."""

from __future__ import annotations

import math

from particlesim.core.jit import kernel, without_refcounts
from particlesim.core.math3d import dot, load_quat, load_vec3, norm, store_quat, store_vec3, sub, to_vec3
from particlesim.geometry.narrow_phase.pair import nearest_image
from particlesim.model.free_motion import free_path, spin_rate


@kernel
def _turns_round(position, lower, period):
    """How often a coordinate has gone round a periodic axis; 0 on any other."""
    inside = 0.0 <= position - lower < period  # of most, who are spared the division
    return math.floor((position - lower) / period) if period > 0.0 and not inside else 0


@kernel
def fly_on(constants, state, world, clock, acceleration, anchor, leash, duration, first, last):
    """Bring particles ``first .. last`` from their clocks to ``duration`` [s] along their free paths.

    Particles that leave a periodic world come back on the other side. Returns for how long [s] all of them certainly
    stay on their leashes, going straight on; -1 if one is not on its leash now.
    """
    constants, state, world = without_refcounts((constants, state, world))
    clock, acceleration, anchor, leash = without_refcounts((clock, acceleration, anchor, leash))
    position, orientation, velocity = state.position, state.orientation, state.velocity
    momentum, image, inertia = state.angular_momentum, state.image, constants.inertia
    corner, period = world.lower, world.period
    gravity = norm(to_vec3(world.gravity))
    longest = math.inf
    for i in range(first, last):
        pull = load_vec3(acceleration, i)
        x, q, v = free_path(
            load_vec3(position, i),
            load_quat(orientation, i),
            load_vec3(velocity, i),
            load_vec3(momentum, i),
            load_vec3(inertia, i),
            pull,
            duration - clock[i],
        )
        turns = (
            _turns_round(x[0], corner[0], period[0]),
            _turns_round(x[1], corner[1], period[1]),
            _turns_round(x[2], corner[2], period[2]),
        )
        if turns != (0, 0, 0):
            for axis in range(3):
                image[i, axis] += turns[axis]
            x = x[0] - period[0] * turns[0], x[1] - period[1] * turns[1], x[2] - period[2] * turns[2]
        store_vec3(position, i, x)
        store_quat(orientation, i, q)
        store_vec3(velocity, i, v)
        room = leash[i] - norm(nearest_image(sub(x, load_vec3(anchor, i)), period))
        if room < 0.0:
            longest = -1.0
        else:
            # room = speed t + pull t^2 / 2
            speed = norm(v)
            denominator = speed + math.sqrt(speed * speed + 2.0 * max(gravity, norm(pull)) * room)
            if denominator > 0.0:
                longest = min(longest, 2.0 * room / denominator)
    return longest


@kernel
def paces(constants, state, world, out, rows, first, last):
    """Sums over blocks ``first .. last`` of ``rows`` particles: squares of paces of surfaces, and gravity, in radii.

    ``out`` (blocks, 2) [1/s^2], [1/s^2]. Returns the largest speed [m/s].
    """
    velocity, orientation, momentum, inertia, radius = without_refcounts(
        (state.velocity, state.orientation, state.angular_momentum, constants.inertia, constants.radius)
    )
    g = norm(to_vec3(world.gravity))
    fastest = 0.0
    for block in range(first, last):
        pace = pull = 0.0
        for i in range(block * rows, min((block + 1) * rows, len(radius))):
            speed2 = dot(load_vec3(velocity, i), load_vec3(velocity, i))
            own = load_vec3(momentum, i)
            fastest = max(fastest, speed2)
            speed = math.sqrt(speed2)
            if dot(own, own) > 0.0:
                speed += spin_rate(load_quat(orientation, i), own, load_vec3(inertia, i)) * radius[i]
            pace += (speed / radius[i]) ** 2
            pull += g / radius[i]
        out[block, 0], out[block, 1] = pace, pull
    return math.sqrt(fastest)
