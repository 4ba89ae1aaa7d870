"""Swept-sphere culling: the first look at all neighbouring pairs.

Every body has a swept bound that it cannot leave within the substep, whatever strikes it: a sphere about where it
starts, as much larger than its bounding sphere as it goes. The bounds lie in the order of the space-filling curve, so
that those of neighbours are in the cache, and nine of ten pairs need no more than them. Spheres on free paths are told
by the closed form.
"""

from __future__ import annotations

import math

import numpy as np

from particlesim.core.jit import entry_kernel, kernel, without_refcounts
from particlesim.core.math3d import dot, norm, scale, sub, to_vec3
from particlesim.core.records import record
from particlesim.dynamics.ccd.time_of_impact import sphere_half_space_impact, sphere_sphere_impact
from particlesim.dynamics.standing import SETTLES
from particlesim.geometry.support import half_space_plane, is_half_space, is_sphere
from particlesim.model.bodies import KINEMATIC, STATIC, angular_velocity, placed
from particlesim.model.domain import nearest_image
from particlesim.model.free_motion import free_acceleration
from particlesim.model.prescribed_motion import swing_acceleration, swing_of

BOUND = record(
    [
        ("position", "f8", (3,)),  # where the body starts [m]
        ("reach", "f8"),  # radius of the swept bound [m]
        ("velocity", "f8", (3,)),  # [m/s]
        ("radius", "f8"),  # of the bounding sphere [m]
    ]
)

# A pair that may collide: time of impact, or LOOK_CLOSER where more must be known.
CANDIDATE = record([("i", "i8"), ("j", "i8"), ("slot", "i8"), ("time", "f8")])
LOOK_CLOSER = -1.0


@kernel
def free_displacement(velocity, acceleration, time):
    """How far a particle goes within ``time`` [s] at most, from a velocity and the size of an acceleration."""
    return (norm(velocity) + 0.5 * acceleration * time) * time


@kernel
def largest_acceleration(system, b):
    """The largest acceleration of a body's position on its present path [m/s^2]."""
    largest = norm(free_acceleration(system, b))
    if b.kind == KINEMATIC:
        largest += swing_acceleration(swing_of(system.motion[b.motion]))
    return largest


@entry_kernel
def write_bounds(system, place, duration, bound, first, last):
    """Swept bounds, by place, of bodies ``first .. last`` that go on freely for ``duration`` [s].

    Returns whether all of them are spheres that accelerate as body 0 does: nothing more need be known of them.
    """
    system, place, bound = without_refcounts((system, place, bound))
    common = free_acceleration(system, system.body[0])
    alike = True
    for i in range(first, last):
        b, s = system.body[i], bound[place[i]]
        alike = alike and b.kind != KINEMATIC and free_acceleration(system, b) == common
        alike = alike and is_sphere(system.shapes, b.shape_row)
        s.reach = b.radius + free_displacement(to_vec3(b.velocity), largest_acceleration(system, b), duration)
        s.radius = b.radius
        for axis in range(3):
            s.position[axis] = b.position[axis]
            s.velocity[axis] = b.velocity[axis]
    return alike


@kernel
def inverse_period(period):
    """Periods (3,) and their inverses, 0 on axes that do not wrap, as ``bounds_apart`` takes them."""
    return (
        (period[0], period[1], period[2]),
        (
            1.0 / period[0] if period[0] > 0.0 else 0.0,
            1.0 / period[1] if period[1] > 0.0 else 0.0,
            1.0 / period[2] if period[2] > 0.0 else 0.0,
        ),
    )


@kernel
def bounds_apart(a, b, periods):
    """Whether two spheres (BOUND) have no point in common."""
    period, inverse = periods
    x, y, z = b.position[0] - a.position[0], b.position[1] - a.position[1], b.position[2] - a.position[2]
    x -= period[0] * np.rint(x * inverse[0])
    y -= period[1] * np.rint(y * inverse[1])
    z -= period[2] * np.rint(z * inverse[2])
    reach = a.reach + b.reach
    return x * x + y * y + z * z > reach * reach


@kernel
def _settles(standing, i):
    """Whether a body settles with others; ``standing`` is empty where nothing comes to rest."""
    return len(standing) > 0 and standing[i] == SETTLES


@kernel
def _impact_time(spheres, a, b, period, duration):
    """When two bodies that accelerate alike collide, from their bounds; LOOK_CLOSER where that does not tell."""
    offset = nearest_image(sub(to_vec3(b.position), to_vec3(a.position)), period)
    velocity = sub(to_vec3(b.velocity), to_vec3(a.velocity))
    reach = a.radius + b.radius
    time = sphere_sphere_impact(offset, velocity, reach, duration)
    if time == 0.0 or (not spheres and (time < math.inf or dot(offset, offset) <= reach * reach)):
        time = LOOK_CLOSER
    return time


@entry_kernel
def cull_pairs(system, neighbours, bound, standing, alike, duration, first, last):
    """Neighbours of places ``first .. last`` that collide, or may, in ``duration`` [s], (m,) CANDIDATE.

    Where not all bodies are known to be spheres that accelerate ``alike``, it is looked at for each pair. What settles
    together (see lasting_contacts.py) is left out, and so are pairs without a particle.
    """
    system, neighbours, bound, standing, alike = without_refcounts((system, neighbours, bound, standing, alike))
    period = system.domain[0].period
    periods = inverse_period(period)
    found = np.empty(neighbours.later_start[last] - neighbours.later_start[first], dtype=CANDIDATE)
    count = 0
    for p in range(first, last):
        for slot in range(neighbours.later_start[p], neighbours.later_start[p + 1]):
            q = neighbours.later[slot]
            if bounds_apart(bound[p], bound[q], periods):
                continue
            one, two = (p, q) if neighbours.body[p] < neighbours.body[q] else (q, p)
            i, j = neighbours.body[one], neighbours.body[two]
            if _settles(standing, i) and _settles(standing, j):
                continue
            time = LOOK_CLOSER
            if alike:
                time = _impact_time(True, bound[one], bound[two], period, duration)
            elif _accelerate_alike(system, system.body[i], system.body[j]):
                spheres = _are_spheres(system.shapes, system.body[i], system.body[j])
                time = _impact_time(spheres, bound[one], bound[two], period, duration)
            if time < math.inf:
                c = found[count]
                c.i, c.j, c.slot, c.time = i, j, slot, time
                count += 1
    return found[:count]


@kernel
def _accelerate_alike(system, a, b):
    return b.kind != KINEMATIC and free_acceleration(system, a) == free_acceleration(system, b)


@kernel
def _are_spheres(shapes, a, b):
    return is_sphere(shapes, a.shape_row) and is_sphere(shapes, b.shape_row)


@kernel
def _half_space_time(system, a, b, duration):
    """When particle ``a`` meets half-space ``b``; LOOK_CLOSER where that is not told by its bounding sphere."""
    inward = scale(half_space_plane(system.shapes, placed(b))[0], -1.0)
    room = dot(inward, sub(to_vec3(b.position), to_vec3(a.position))) - a.radius
    velocity, acceleration = sub(to_vec3(a.velocity), to_vec3(b.velocity)), free_acceleration(system, a)
    if b.kind != STATIC:
        # Turning or swinging, it is met sooner or later than a plane that only drifts.
        if room <= free_displacement(velocity, norm(acceleration) + largest_acceleration(system, b), duration):
            return LOOK_CLOSER
        turning = angular_velocity(b)
        return LOOK_CLOSER if dot(turning, turning) > 0.0 else math.inf
    if room > free_displacement(velocity, norm(acceleration), duration):
        return math.inf
    time = sphere_half_space_impact(room, dot(inward, velocity), dot(inward, acceleration), duration)
    if time == 0.0 or (not is_sphere(system.shapes, a.shape_row) and (time < math.inf or room < 0.0)):
        time = LOOK_CLOSER
    return time


@entry_kernel
def cull_surroundings(system, standing, duration, first, last):
    """As ``cull_pairs``, of particles ``first .. last`` with half-spaces and meshes, which are in no list: slot -1."""
    system, standing = without_refcounts((system, standing))
    found = np.empty((len(system.body) - system.bounded) * (last - first), dtype=CANDIDATE)
    count = 0
    for i in range(first, last):
        if _settles(standing, i):
            continue
        for j in range(system.bounded, len(system.body)):
            time = LOOK_CLOSER
            if is_half_space(system.shapes, system.body[j].shape_row):
                time = _half_space_time(system, system.body[i], system.body[j], duration)
            if time < math.inf:
                c = found[count]
                c.i, c.j, c.slot, c.time = i, j, -1, time
                count += 1
    return found[:count]
