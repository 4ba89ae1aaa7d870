"""The first look at all pairs: spheres are told by the closed form, most others by their bounding spheres.

Nearly all the time of a step with few impacts is spent here, so it works on plain arrays and reads no more of a
particle than it needs.
"""

from __future__ import annotations

import math

import numpy as np

from particlesim.constants import SETTLES, SPHERE, WALL
from particlesim.impacts.time_of_impact import sphere_meets_wall, spheres_meet
from particlesim.jit import borrowed, kernel
from particlesim.narrow_phase.contacts import wall_as_partner
from particlesim.narrow_phase.pair import nearest_image
from particlesim.vec import dot, norm, row, sub


@kernel
def grown(array):
    """The array with as much room again."""
    longer = np.empty((2 * array.shape[0], array.shape[1]), dtype=array.dtype)
    for k in range(array.shape[0]):
        for column in range(array.shape[1]):
            longer[k, column] = array[k, column]
    return longer


@kernel(inline=True)
def _list(found, times, count, i, j, time):
    found[count, 0] = i
    found[count, 1] = j
    times[count, 0] = time
    return count + 1


@kernel
def sieve(
    kind,
    shape,
    radius,
    position,
    velocity,
    acceleration,
    lower,
    upper,
    boundary,
    period,
    start,
    other,
    standing,
    duration,
    first,
    last,
):
    """Pairs of particles ``first .. last`` with later neighbours and with walls that meet, or may, in ``duration`` [s].

    Returns (m, 2) and times (m, 1): when they meet, or -1 where the bounding spheres come together and more must be
    known. What settles together (see cluster.py) is not looked at.
    """
    kind, shape, radius, position, velocity, acceleration = borrowed(
        (kind, shape, radius, position, velocity, acceleration)
    )
    lower, upper, boundary, period, start, other = borrowed((lower, upper, boundary, period, start, other))
    standing = borrowed(standing)
    found, times = np.empty((256, 2), dtype=np.int64), np.empty((256, 1))
    count = 0
    walls = boundary[0] == WALL or boundary[1] == WALL or boundary[2] == WALL
    for i in range(first, last):
        while count + 6 + start[i + 1] - start[i] > len(found):
            found, times = grown(found), grown(times)
        x, v, a, r = row(position, i), row(velocity, i), row(acceleration, i), radius[i]
        round_i = kind[shape[i]] == SPHERE
        settles = standing[i] == SETTLES
        for near in range(start[i], start[i + 1]):
            j = other[near]
            if j < i or (settles and standing[j] == SETTLES):
                continue
            offset = nearest_image(sub(row(position, j), x), period)
            apart = sub(row(velocity, j), v)
            pull = sub(row(acceleration, j), a)
            reach = r + radius[j]
            alike = pull[0] == 0.0 and pull[1] == 0.0 and pull[2] == 0.0
            way = norm(apart) * duration
            if not alike:
                way += 0.5 * norm(pull) * duration * duration
            if dot(offset, offset) > (reach + way) * (reach + way):
                continue
            time = -1.0
            if alike:
                time = spheres_meet(offset, apart, reach, duration)
                inside = dot(offset, offset) <= reach * reach
                spheres = round_i and kind[shape[j]] == SPHERE
                if time == 0.0 or (not spheres and (inside or time < math.inf)):
                    time = -1.0
            if time < math.inf:
                count = _list(found, times, count, i, j, time)
        if walls and not settles:
            for wall in range(6):
                axis = wall // 2
                if boundary[axis] == WALL:
                    sign = 2.0 * (wall % 2) - 1.0
                    room = (upper[axis] - x[axis] if wall % 2 else x[axis] - lower[axis]) - r
                    time = sphere_meets_wall(room, sign * v[axis], sign * a[axis], duration)
                    if time == 0.0 or (not round_i and (time < math.inf or room < 0.0)):
                        time = -1.0
                    if time < math.inf:
                        count = _list(found, times, count, i, wall_as_partner(wall), time)
    return found[:count], times[:count, 0]
