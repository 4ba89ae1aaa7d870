"""The next impact of two bodies along the paths they are on."""

import math

from particlesim.core.jit import kernel
from particlesim.core.math3d import dot, norm, scale, sub
from particlesim.dynamics.ccd.half_space_impact import advanced_impact, half_space_impact
from particlesim.dynamics.ccd.parts_impact import parts_impact
from particlesim.dynamics.ccd.time_of_impact import relative_acceleration, sphere_sphere_impact, spheres_near
from particlesim.dynamics.ccd.touch import point_velocity
from particlesim.dynamics.settings import APPROACH_TOLERANCE
from particlesim.geometry.support import has_parts, is_half_space, is_sphere
from particlesim.model.domain import nearest_image


@kernel
def _sphere_sphere(system, a, b, paths, offset, duration):
    """When two spheres under the same acceleration collide, at once only if they approach by more than rounding."""
    path_a, path_b = paths
    velocity = sub(path_b[2], path_a[2])
    reach = a.radius + b.radius
    time = sphere_sphere_impact(offset, velocity, reach, duration)
    if time == 0.0:
        of_a = point_velocity(a, path_a, scale(offset, a.radius / reach))
        of_b = point_velocity(b, path_b, scale(offset, -b.radius / reach))
        tolerance = APPROACH_TOLERANCE * (norm(of_a) + norm(of_b)) + system.domain[0].rest_speed
        if dot(offset, velocity) >= -tolerance * norm(offset):
            time = math.inf
    return time


@kernel
def next_impact(system, a, b, paths, duration, simplex, points):
    """When particle ``a`` and body ``b`` collide within ``duration`` on paths given at time 0; inf if they do not.

    ``simplex`` is the one by which polyhedra looked at before were nearest, or NO_SIMPLEX (see gjk.py).
    """
    if has_parts(system.shapes, a.shape_row) or has_parts(system.shapes, b.shape_row):
        return parts_impact(system, system.meshes, a, b, paths, duration, points)
    if is_half_space(system.shapes, b.shape_row):
        return half_space_impact(system, a, b, paths, duration, points)
    path_a, path_b = paths
    offset = nearest_image(sub(path_b[0], path_a[0]), system.domain[0].period)
    acceleration = relative_acceleration(paths)
    if is_sphere(system.shapes, a.shape_row) and is_sphere(system.shapes, b.shape_row) and acceleration == 0.0:
        return _sphere_sphere(system, a, b, paths, offset, duration)
    # Bounding spheres first: larger by what the acceleration could do.
    reach = a.radius + b.radius + 0.5 * acceleration * duration * duration
    time, end = spheres_near(offset, sub(path_b[2], path_a[2]), reach, duration)
    if time < math.inf:
        time = advanced_impact(system, a, b, paths, (time, end), simplex, points)
    return time
