"""Conjugate ways: sweeps over contact points that go on along the way of those before.

What a sweep changes is the way down in a problem that is quadratic but for the cones: going on along ways that are
conjugate, as long as they get shorter, takes far fewer of them (M. Silcowitz-Hansen, S. Niebuhr, K. Erleben, The Visual
Computer 26 (2010) 893-901).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from particlesim.core.jit import kernel
from particlesim.dynamics.settings import PAIRS_BETWEEN


class Ways(NamedTuple):
    """Impulses and velocities at the start of a sweep, and the ways that they have taken; which points are listed.

    Where points are solved together instead: when the next time is.
    """

    impulse: np.ndarray  # (m, 7): push, drag and roll
    of_impulse: np.ndarray  # (m, 7)
    motion: np.ndarray  # (n, 6): velocity and angular velocity
    of_motion: np.ndarray  # (n, 6)
    listed: np.ndarray  # (m,) bool, whether a contact point has pushed
    point: np.ndarray  # (m,) int64, those that have
    pause: np.ndarray  # (1,) int64, pairs of sweeps until points are solved together


@kernel
def new_ways(points, members):
    """Room for so many contact points and members."""
    return Ways(
        np.zeros((points, 7)),
        np.zeros((points, 7)),
        np.zeros((members, 6)),
        np.zeros((members, 6)),
        np.zeros(points, dtype=np.bool_),
        np.zeros(points, dtype=np.int64),
        np.full(1, PAIRS_BETWEEN, dtype=np.int64),
    )


@kernel
def list_point(ways, span, k, count):
    """Add contact point ``k``, which has not pushed yet, to the list of those that have; returns how many there are."""
    row = k - span[0]
    ways.listed[row] = True
    ways.point[count] = k
    ways.impulse[row] = 0.0
    ways.of_impulse[row] = 0.0
    return count + 1


@kernel
def set_out(points, terms, mover, span, members, ways, listed):
    """Keep what a sweep starts from; ``listed``: how many points are, and whether anything has rolling friction."""
    count, rolls = listed
    for n in range(count):
        k = ways.point[n]
        p, row = points[k], ways.impulse[k - span[0]]
        row[0] = p.push
        for axis in range(3):
            row[1 + axis] = p.drag[axis]
        if rolls:
            for axis in range(3):
                row[4 + axis] = terms[k].roll[axis]
    for i in members:
        m = mover[i]
        for axis in range(3):
            ways.motion[m.row, axis], ways.motion[m.row, 3 + axis] = m.velocity[axis], m.spin[axis]


@kernel
def length2_of(points, terms, span, ways, listed):
    """The square of what a sweep has changed, as twice a kinetic energy [J]; ``listed`` is as in ``set_out``."""
    length2, (count, rolls) = 0.0, listed
    for n in range(count):
        k = ways.point[n]
        p, row = points[k], ways.impulse[k - span[0]]
        length2 += (p.push - row[0]) ** 2 / p.normal_mass
        if p.static_friction > 0.0:
            for axis in range(3):
                length2 += (p.drag[axis] - row[1 + axis]) ** 2 / p.tangential_mass
        if rolls and terms[k].rolling_friction > 0.0:
            for axis in range(3):
                length2 += (terms[k].roll[axis] - row[4 + axis]) ** 2 / terms[k].rolling_mass
    return length2


@kernel
def go_on(points, terms, mover, span, members, ways, walk):
    """Go a share of the last way once more; the way of these sweeps becomes all that was gone.

    A ``walk`` is (the share, how many points are listed, whether anything has rolling friction).
    """
    share, count, rolls = walk
    for n in range(count):
        k = ways.point[n]
        p, row, way = points[k], ways.impulse[k - span[0]], ways.of_impulse[k - span[0]]
        on = share * way[0]
        way[0] = p.push - row[0] + on
        p.push += on
        for axis in range(3):
            on = share * way[1 + axis]
            way[1 + axis] = p.drag[axis] - row[1 + axis] + on
            p.drag[axis] += on
        if rolls:
            t = terms[k]
            for axis in range(3):
                on = share * way[4 + axis]
                way[4 + axis] = t.roll[axis] - row[4 + axis] + on
                t.roll[axis] += on
    for i in members:
        m = mover[i]
        for axis in range(3):
            on = share * ways.of_motion[m.row, axis]
            ways.of_motion[m.row, axis] = m.velocity[axis] - ways.motion[m.row, axis] + on
            m.velocity[axis] += on
            on = share * ways.of_motion[m.row, 3 + axis]
            ways.of_motion[m.row, 3 + axis] = m.spin[axis] - ways.motion[m.row, 3 + axis] + on
            m.spin[axis] += on
