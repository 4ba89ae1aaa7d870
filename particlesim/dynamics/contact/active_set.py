"""What rests, and all that may meet it: the bodies that settle together.

A cluster begins with bodies that touch, slowly, a wall that gravity presses against. All that may reach one of its
bodies within the stretch of time belongs to it, whether it rests there, rocks or arrives.
"""

from __future__ import annotations

import numpy as np

from particlesim.core.constants import FREE, LOOSE, MAX_MANIFOLD, RESTITUTION_THRESHOLD_HEIGHT, SETTLES, STILL, WALL
from particlesim.core.jit import kernel, without_refcounts
from particlesim.core.math3d import (
    conjugate,
    dot,
    grow,
    load_quat,
    load_vec3,
    norm,
    quat_multiply,
    store_quat,
    store_vec3,
    sub,
    to_vec3,
)
from particlesim.dynamics.contact.contact_points import COLUMNS, GAP, INRADIUS, PARTING, RESTITUTION, SLOW, add_contact
from particlesim.geometry.narrow_phase.half_space import wall_normal
from particlesim.geometry.narrow_phase.pair import nearest_image
from particlesim.model.touching import wall_as_partner

# The fraction of a neighbour's speed that a body is expected to take on. With FASTER nearly all are foreseen; the rest
# costs a second look at everything.
_HANDED_ON = 0.3


@kernel
def _rests(point, first, last):
    """Whether partners hardly move against each other at one of these contact points, and touch there."""
    for k in range(first, last):
        near = RESTITUTION_THRESHOLD_HEIGHT * point[k, INRADIUS] * (STILL if point[k, RESTITUTION] == 1.0 else 1.0)
        if point[k, GAP] <= near and abs(point[k, PARTING]) <= point[k, SLOW]:
            return True
    return False


@kernel
def _pressed(world, wall):
    """Whether gravity presses against a wall."""
    return world.boundary[wall // 2] == WALL and dot(wall_normal(wall), to_vec3(world.gravity)) > 0.0


@kernel
def surface_paces(constants, state, spin):
    """How fast the surface of each particle moves at most, (n,) [m/s]."""
    pace = np.empty(len(constants.radius))
    for i in range(len(pace)):
        pace[i] = norm(load_vec3(state.velocity, i)) + norm(load_vec3(spin, i)) * constants.radius[i]
    return pace


@kernel
def expected_paces(pace, lists, least):
    """How fast surfaces that move at ``pace`` may become (n,) [m/s]: ``least`` faster, or as neighbours push them."""
    particle, start, other = lists.particle, lists.start, lists.other
    expected = np.empty(len(pace))
    for p in range(len(pace)):
        i = particle[p]
        expected[i] = pace[i]
        for near in range(start[p], start[p + 1]):
            expected[i] = max(expected[i], _HANDED_ON * pace[particle[other[near]]])
        expected[i] += least
    return expected


@kernel
def walk(constants, state, period, position, orientation, way):
    """Add to ``way`` (n,) how far surfaces are from where they were at ``position`` and ``orientation`` [m].

    These become the present ones.
    """
    constants, state, period = without_refcounts((constants, state, period))
    for i in range(len(way)):
        x, q = load_vec3(state.position, i), load_quat(state.orientation, i)
        half = quat_multiply(q, conjugate(load_quat(orientation, i)))
        turn = 2.0 * constants.radius[i] * norm((half[1], half[2], half[3]))
        way[i] += norm(nearest_image(sub(x, load_vec3(position, i)), period)) + turn
        store_vec3(position, i, x)
        store_quat(orientation, i, q)


@kernel
def find_cluster(table, world, constants, state, spin, lists, duration, pace, way, clearance, standing):
    """Contact points (m, COLUMNS) of all clusters for a stretch of ``duration`` [s], and their partners (m, 2).

    ``pace`` (n,) bounds the speeds of surfaces [m/s], ``way`` (n,) how far they have come [m]. ``clearance`` (m,)
    beside ``lists.other`` is how far apart neighbours were at least, with the ways they had come then, and is kept
    up to date. Fills in the ``standing`` (n,) of each particle: FREE, SETTLES or LOOSE.
    """
    table, world, constants, state = without_refcounts((table, world, constants, state))
    spin, lists, pace, standing = without_refcounts((spin, lists, pace, standing))
    way, clearance = without_refcounts((way, clearance))
    start, other = lists.start, lists.other
    position, radius = state.position, constants.radius
    count = len(radius)
    points, gaps = np.empty((MAX_MANIFOLD, 3)), np.empty(MAX_MANIFOLD)
    partner, point = np.empty((64, 2), dtype=np.int64), np.empty((64, COLUMNS))
    waiting = np.empty(count, dtype=np.int64)
    gathered = np.zeros(count, dtype=np.bool_)
    found = size = 0
    for i in range(count):
        standing[i] = FREE
        for wall in range(6):
            if standing[i] != FREE or not _pressed(world, wall):
                continue
            axis = wall // 2
            room = world.upper[axis] - position[i, axis] if wall % 2 else position[i, axis] - world.lower[axis]
            if room <= radius[i] * (1.0 + RESTITUTION_THRESHOLD_HEIGHT):
                j = wall_as_partner(wall)
                last, _, _ = add_contact(
                    table, world, constants, state, spin, pace, duration, i, j, -np.inf, points, gaps, partner, point, 0
                )
                if _rests(point, 0, last):
                    standing[i] = SETTLES
                    waiting[found] = i
                    found += 1
    next_one = 0
    while next_one < found:
        i = waiting[next_one]
        next_one += 1
        gathered[i] = True
        place = lists.place[i]
        while size + MAX_MANIFOLD * (6 + start[place + 1] - start[place]) > len(partner):
            partner, point = grow(partner), grow(point)
        for wall in range(6):
            if world.boundary[wall // 2] == WALL:
                j = wall_as_partner(wall)
                size, what, _ = add_contact(
                    table, world, constants, state, spin, pace, duration, i, j, -np.inf, points, gaps, partner, point,
                    size,
                )  # fmt: skip
                if what == LOOSE:
                    standing[i] = LOOSE
        for near in range(start[place], start[place + 1]):
            j = lists.particle[other[near]]
            if gathered[j]:
                continue
            a, b = min(i, j), max(i, j)
            before = size
            come = way[i] + way[j]
            size, what, clear = add_contact(
                table, world, constants, state, spin, pace, duration, a, b, clearance[near] - come, points, gaps,
                partner, point, size,
            )  # fmt: skip
            clearance[near] = clear + come
            if size > before and standing[j] == FREE:
                standing[j] = SETTLES
                waiting[found] = j
                found += 1
            if what == LOOSE:
                standing[i] = LOOSE
                standing[j] = LOOSE if standing[j] != FREE else FREE
    return partner[:size], point[:size]
