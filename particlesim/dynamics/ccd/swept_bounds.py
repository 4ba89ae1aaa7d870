"""The first look at all pairs: spheres are told by the closed form, most others by their bounding spheres.

Every particle has a ball that it cannot leave within the stretch of time, whatever it meets: about where it starts, as
much larger than its bounding sphere as it goes. The balls lie in the order of the places, so that those of neighbours
are in the cache, and nine of ten pairs need no more than them.
"""

from __future__ import annotations

import math

import numpy as np

from particlesim.core.constants import SETTLES, SPHERE, WALL
from particlesim.core.jit import kernel, without_refcounts
from particlesim.core.math3d import dot, load_vec3, norm, sub
from particlesim.dynamics.ccd.time_of_impact import sphere_meets_wall, spheres_meet
from particlesim.dynamics.neighbour_list import around_of, far_apart
from particlesim.geometry.narrow_phase.pair import nearest_image
from particlesim.model.touching import wall_as_partner


@kernel
def free_way(velocity, acceleration, time):
    """How far a particle goes within ``time`` [s] at the most."""
    return (norm(velocity) + 0.5 * norm(acceleration) * time) * time


@kernel
def balls(radius, position, velocity, acceleration, place, duration, ball, first, last):
    """Rows (n, 8) of ``ball``, by place, of particles ``first .. last`` that go straight on for ``duration`` [s].

    Position, radius of the ball, velocity, radius of the particle. Returns whether all accelerate as particle 0 does.
    """
    radius, position, velocity, acceleration = without_refcounts((radius, position, velocity, acceleration))
    place, ball = without_refcounts((place, ball))
    pull = load_vec3(acceleration, 0)
    alike = True
    for i in range(first, last):
        p = place[i]
        own = load_vec3(acceleration, i)
        alike = alike and own[0] == pull[0] and own[1] == pull[1] and own[2] == pull[2]
        for axis in range(3):
            ball[p, axis] = position[i, axis]
            ball[p, 4 + axis] = velocity[i, axis]
        ball[p, 3] = radius[i] + free_way(load_vec3(velocity, i), own, duration)
        ball[p, 7] = radius[i]
    return alike


@kernel(inline=True)
def _list(found, slots, times, count, i, j, slot, time):
    found[count, 0] = i
    found[count, 1] = j
    slots[count] = slot
    times[count] = time
    return count + 1


@kernel
def _pair_time(spheres, ball, p, q, period, duration):
    """When the particles at two places meet that accelerate alike; -1 where that must be looked into."""
    offset = nearest_image(sub(load_vec3(ball, q), load_vec3(ball, p)), period)
    velocity = ball[q, 4] - ball[p, 4], ball[q, 5] - ball[p, 5], ball[q, 6] - ball[p, 6]
    reach = ball[p, 7] + ball[q, 7]
    time = spheres_meet(offset, velocity, reach, duration)
    if time == 0.0 or (not spheres and (time < math.inf or dot(offset, offset) <= reach * reach)):
        time = -1.0
    return time


@kernel
def sieve(
    kind, shape, acceleration, alike, ball, standing, particle, later_start, later, period, duration, first, last
):  # fmt: skip
    """Pairs (m, 2), i < j, of places ``first .. last`` with later neighbours that meet, or may, in ``duration`` [s].

    And where they stand in ``later`` (m,), and times (m,): when they meet, or -1 where the bounding spheres come
    together and more must be known. Where not all are known to accelerate ``alike``, it is looked at for each pair.
    What settles together (see cluster.py) is not looked at.
    """
    kind, shape, acceleration, ball, particle = without_refcounts((kind, shape, acceleration, ball, particle))
    standing, later_start, later, period = without_refcounts((standing, later_start, later, period))
    around = around_of(period)
    most = later_start[last] - later_start[first]
    found, slots = np.empty((most, 2), dtype=np.int64), np.empty(most, dtype=np.int64)
    times = np.empty(most)
    count = 0
    for p in range(first, last):
        for near in range(later_start[p], later_start[p + 1]):
            q = later[near]
            if far_apart(ball, p, q, around):
                continue
            one, two = (p, q) if particle[p] < particle[q] else (q, p)
            i, j = particle[one], particle[two]
            if standing[i] == SETTLES and standing[j] == SETTLES:
                continue
            pull = sub(load_vec3(acceleration, j), load_vec3(acceleration, i)) if not alike else (0.0, 0.0, 0.0)
            time = -1.0
            if pull[0] == 0.0 and pull[1] == 0.0 and pull[2] == 0.0:
                spheres = kind[shape[i]] == SPHERE and kind[shape[j]] == SPHERE
                time = _pair_time(spheres, ball, one, two, period, duration)
            if time < math.inf:
                count = _list(found, slots, times, count, i, j, near, time)
    return found[:count], slots[:count], times[:count]


@kernel
def sieve_walls(
    kind, shape, radius, position, velocity, acceleration, standing, lower, upper, boundary, duration, first, last
):  # fmt: skip
    """As ``sieve``, of particles ``first .. last`` with walls, which are partners below 0 and stand nowhere: -1."""
    kind, shape, radius, position, velocity, acceleration = without_refcounts(
        (kind, shape, radius, position, velocity, acceleration)
    )
    standing = without_refcounts(standing)
    most = 6 * (last - first)
    found, slots = np.empty((most, 2), dtype=np.int64), np.empty(most, dtype=np.int64)
    times = np.empty(most)
    count = 0
    for i in range(first, last):
        if standing[i] == SETTLES:
            continue
        x, v, a = load_vec3(position, i), load_vec3(velocity, i), load_vec3(acceleration, i)
        way = free_way(v, a, duration)
        for wall in range(6):
            axis = wall // 2
            if boundary[axis] == WALL:
                room = (upper[axis] - x[axis] if wall % 2 else x[axis] - lower[axis]) - radius[i]
                if room > way:
                    continue
                sign = 2.0 * (wall % 2) - 1.0
                time = sphere_meets_wall(room, sign * v[axis], sign * a[axis], duration)
                if time == 0.0 or (kind[shape[i]] != SPHERE and (time < math.inf or room < 0.0)):
                    time = -1.0
                if time < math.inf:
                    count = _list(found, slots, times, count, i, wall_as_partner(wall), -1, time)
    return found[:count], slots[:count], times[:count]
