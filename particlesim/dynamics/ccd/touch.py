"""How two bodies touch at one moment of their paths, and whether they come near each other at all."""

import math

from particlesim.core.jit import kernel
from particlesim.core.math3d import add, cross, dot, load_vec3, norm, sub, to_vec3
from particlesim.dynamics.ccd.time_of_impact import largest_displacement, relative_acceleration
from particlesim.dynamics.settings import APPROACH_TOLERANCE, IMPACT_TOLERANCE
from particlesim.geometry.narrow_phase.pair import pair_contact, pair_nearer
from particlesim.geometry.support import is_half_space, is_sphere
from particlesim.model.bodies import angular_velocity_of
from particlesim.model.domain import nearest_image


@kernel
def point_velocity(b, path, lever_arm):
    """Velocity of the point of a body at ``lever_arm`` from its position, on a path."""
    return add(path[2], cross(angular_velocity_of(path[1], path[3], to_vec3(b.principal_inertia)), lever_arm))


@kernel
def speed_at_depth(depth, acceleration):
    """Half the speed that an acceleration gives to bodies until they have sunk into each other by ``depth`` [m/s].

    What parts more slowly would meet again within a moment, over and over.
    """
    return 0.5 * math.sqrt(2.0 * acceleration * depth)


@kernel
def touch_of(system, a, b, paths, points):
    """Whether two bodies touch; whether any point of their contact approaches; how deep they may go if none does [m].

    Returns the normal as well. If they part everywhere, they may go as deep as they are. If not, or if they part so
    slowly that they would be back at once, it is the penetration slop of their sizes, or a little deeper than they are
    up to twice that.
    """
    domain = system.domain[0]
    path_a, path_b = paths
    offset = nearest_image(sub(path_b[0], path_a[0]), domain.period)
    separation, normal, count = pair_contact(
        system.shapes, (a.shape_row, a.scale, path_a[1]), (b.shape_row, b.scale, path_b[1]), offset, points
    )
    sizes = a.scale if b.inradius == math.inf else a.scale + b.scale
    tolerance = IMPACT_TOLERANCE * sizes
    touching = separation <= tolerance
    slop = domain.penetration_slop * sizes
    at_once = speed_at_depth(slop, relative_acceleration(paths))
    approaching, leaving = False, True
    for k in range(count if touching else 0):
        of_a = point_velocity(a, path_a, load_vec3(points, k))
        of_b = point_velocity(b, path_b, sub(load_vec3(points, k), offset))
        normal_velocity = -dot(of_a, normal) + dot(of_b, normal)
        none = APPROACH_TOLERANCE * (norm(of_a) + norm(of_b)) + domain.rest_speed
        approaching = approaching or normal_velocity < -none
        leaving = leaving and normal_velocity > none + at_once
    depth = max(0.0, -separation) + 4.0 * tolerance
    if not leaving:
        depth = max(slop, depth, min(depth + 0.25 * slop, 2.0 * slop))
    return touching, approaching, depth, normal


@kernel
def may_come_near(system, a, b, paths, duration):
    """Whether two bodies come near each other within ``duration`` [s]: where that has no closed form, a quick look.

    Most are too far apart, which the first direction or two of the distance algorithm tell.
    """
    shapes = system.shapes
    if is_sphere(shapes, a.shape_row) or is_sphere(shapes, b.shape_row) or is_half_space(shapes, b.shape_row):
        return True
    path_a, path_b = paths
    offset = nearest_image(sub(path_b[0], path_a[0]), system.domain[0].period)
    distance = largest_displacement(system, a, b, paths, duration)
    placed_a, placed_b = (a.shape_row, a.scale, path_a[1]), (b.shape_row, b.scale, path_b[1])
    return pair_nearer(shapes, placed_a, placed_b, offset, distance)
