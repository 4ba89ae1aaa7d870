"""The active set: what rests, and all that may touch it: the bodies that settle together.

It begins with bodies that touch, slowly, an obstacle that gravity presses them against. All that may reach one of its
bodies within the substep belongs to it, whether it rests there, rocks or arrives.
"""

from __future__ import annotations

import numpy as np

from particlesim.core.constants import MAX_MANIFOLD
from particlesim.core.jit import entry_kernel, kernel, without_refcounts
from particlesim.core.math3d import (
    conjugate,
    dot,
    grow_records,
    load_vec3,
    norm,
    quat_multiply,
    set_quat,
    set_vec3,
    sub,
    to_quat,
    to_vec3,
)
from particlesim.dynamics.contact.contact_points import CONTACT_POINT, Room, add_contact
from particlesim.dynamics.settings import LOSSLESS_REST, RESTITUTION_THRESHOLD_HEIGHT, SPEED_HANDED_ON
from particlesim.dynamics.standing import FREE, LOOSE, SETTLES
from particlesim.model.domain import nearest_image


@kernel
def _rests(point, count, gravity):
    """Whether bodies hardly move against each other at one of these points, and gravity presses them together there."""
    for k in range(count):
        p = point[k]
        near = RESTITUTION_THRESHOLD_HEIGHT * p.inradius * (LOSSLESS_REST if p.restitution == 1.0 else 1.0)
        if p.gap <= near and abs(p.normal_velocity) <= p.threshold and dot(to_vec3(p.normal), gravity) > 0.0:
            return True
    return False


@entry_kernel
def surface_speeds(body, spin, count):
    """How fast the surface of each of ``count`` bodies moves at most, (n,) [m/s], 0 for those beyond."""
    body, spin = without_refcounts((body, spin))
    speed = np.zeros(len(body))
    for i in range(count):
        speed[i] = norm(to_vec3(body[i].velocity)) + norm(load_vec3(spin, i)) * body[i].radius
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


@kernel
def _seed(system, neighbours, motion, standing, room, waiting):
    """Let bodies settle that rest on an obstacle; they are listed in ``waiting``. Returns how many there are."""
    point = np.empty(MAX_MANIFOLD, dtype=CONTACT_POINT)
    gravity = to_vec3(system.domain[0].gravity)
    found = 0
    for i in range(system.particles):
        standing[i] = FREE
        for j in range(system.bounded, len(system.body)):
            if standing[i] == FREE:
                count, _, _ = add_contact(system, motion, (i, j), -np.inf, room, point, 0)
                if _rests(point, count, gravity):
                    standing[i] = SETTLES
        place = neighbours.place[i]
        for near in range(neighbours.start[place], neighbours.start[place + 1]):
            j = neighbours.body[neighbours.other[near]]
            if j >= system.particles and standing[i] == FREE:
                count, _, _ = add_contact(system, motion, (i, j), -np.inf, room, point, 0)
                if _rests(point, count, gravity):
                    standing[i] = SETTLES
        if standing[i] == SETTLES:
            waiting[found] = i
            found += 1
    return found


@entry_kernel
def find_active_set(system, neighbours, motion, memory):
    """Contact points (m,) CONTACT_POINT of all that settles in a substep.

    ``memory`` (ClearanceMemory) says how far surfaces have come, and how far apart neighbours were at least, with the
    displacements they had then, which is kept up to date; its ``standing`` of each body is filled in: FREE, SETTLES or
    LOOSE.
    """
    system, neighbours, motion, memory = without_refcounts((system, neighbours, motion, memory))
    standing, displacement, clearance = memory.standing, memory.displacement, memory.clearance
    room = Room(np.empty((MAX_MANIFOLD, 3)), np.empty(MAX_MANIFOLD))
    point = np.empty(64, dtype=CONTACT_POINT)
    waiting = np.empty(system.particles, dtype=np.int64)
    gathered = np.zeros(len(system.body), dtype=np.bool_)
    found = _seed(system, neighbours, motion, standing, room, waiting)
    size = next_one = 0
    while next_one < found:
        i = waiting[next_one]
        next_one += 1
        gathered[i] = True
        place = neighbours.place[i]
        most = len(system.body) - system.bounded + neighbours.start[place + 1] - neighbours.start[place]
        while size + MAX_MANIFOLD * most > len(point):
            point = grow_records(point)
        for j in range(system.bounded, len(system.body)):
            size, what, _ = add_contact(system, motion, (i, j), -np.inf, room, point, size)
            if what == LOOSE:
                standing[i] = LOOSE
        for near in range(neighbours.start[place], neighbours.start[place + 1]):
            j = neighbours.body[neighbours.other[near]]
            if gathered[j]:
                continue
            before, come = size, displacement[i] + displacement[j]
            pair = min(i, j), max(i, j)
            size, what, clear = add_contact(system, motion, pair, clearance[near] - come, room, point, size)
            clearance[near] = clear + come
            if size > before and j < system.particles and standing[j] == FREE:
                standing[j] = SETTLES
                waiting[found] = j
                found += 1
            if what == LOOSE:
                standing[i] = LOOSE
                standing[j] = LOOSE if standing[j] != FREE else FREE
    return point[:size]
