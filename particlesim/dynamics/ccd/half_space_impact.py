"""The next impact of two convex bodies that is found step by step, and that of a particle and a half-space."""

import math

from particlesim.core.jit import kernel
from particlesim.core.math3d import dot, norm, scale, sub, to_vec3
from particlesim.dynamics.ccd.time_of_impact import first_touch, sphere_half_space_impact
from particlesim.dynamics.ccd.touch import may_come_near, point_velocity, speed_at_depth, touch_of
from particlesim.dynamics.settings import APPROACH_TOLERANCE, IMPACT_TOLERANCE
from particlesim.geometry.narrow_phase.gjk import NO_SIMPLEX
from particlesim.geometry.support import half_space_plane, is_sphere
from particlesim.model.bodies import STATIC, placed
from particlesim.model.free_motion import advance_path


@kernel
def advanced_impact(system, a, b, paths, interval, simplex, points):
    """When two bodies of which one at least is more than a sphere collide in an interval, on paths given at time 0."""
    start, end = interval
    path_a, path_b = paths
    if simplex[0] == 0 and not may_come_near(system, a, b, paths, end):
        return math.inf
    time = first_touch(system, a, b, paths, interval, 0.0, simplex, points)
    if time == start:
        then = (
            advance_path(path_a, to_vec3(a.principal_inertia), start),
            advance_path(path_b, to_vec3(b.principal_inertia), start),
        )
        touching, approaching, depth, _ = touch_of(system, a, b, then, points)
        if touching and not approaching:
            time = first_touch(system, a, b, paths, interval, depth, simplex, points)
    return time


@kernel
def _sphere_half_space(system, a, path, normal, room, motion, duration):
    """When a sphere meets a static half-space; if it touches it and hardly moves, when it has sunk in a little.

    ``motion`` are its speed and acceleration towards the half-space, whose normal points into the solid.
    """
    speed, acceleration = motion
    if room <= IMPACT_TOLERANCE * a.scale:
        surface = point_velocity(a, path, scale(normal, a.radius))
        none = APPROACH_TOLERANCE * norm(surface) + system.domain[0].rest_speed
        slop = system.domain[0].penetration_slop * a.scale
        if -none - speed_at_depth(slop, max(acceleration, 0.0)) <= speed <= none:
            room = max(0.25 * slop, slop + room)
    return sphere_half_space_impact(room, speed, acceleration, duration)


@kernel
def half_space_impact(system, a, b, paths, duration, points):
    """When particle ``a`` meets half-space ``b`` within ``duration``."""
    path_a, path_b = paths
    if b.kind != STATIC:
        return advanced_impact(system, a, b, paths, (0.0, duration), NO_SIMPLEX, points)
    normal = scale(half_space_plane(system.shapes, placed(b))[0], -1.0)
    room = dot(normal, sub(path_b[0], path_a[0])) - a.radius
    motion = dot(path_a[2], normal), dot(path_a[4], normal)
    if is_sphere(system.shapes, a.shape_row):
        return _sphere_half_space(system, a, path_a, normal, room, motion, duration)
    time = sphere_half_space_impact(room, motion[0], motion[1], duration)
    if time < math.inf or room <= 0.0:
        start = time if room > 0.0 else 0.0
        time = advanced_impact(system, a, b, paths, (start, duration), NO_SIMPLEX, points)
    return time
