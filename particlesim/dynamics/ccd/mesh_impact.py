"""The next impact of a particle and a mesh: the first of those with its triangles.

A triangle that is touched where the mesh has no such normal is not met there: a body that has sunk in by as little as
it may comes up against the edges of the next triangles of a flat floor. It is looked at again when it is deeper.
"""

import math

import numpy as np

from particlesim.core.jit import kernel
from particlesim.core.math3d import axpy, inverse_rotate, norm, scale, sub, to_vec3
from particlesim.dynamics.ccd.time_of_impact import first_touch, relative_acceleration
from particlesim.dynamics.ccd.touch import may_come_near, touch_of
from particlesim.dynamics.settings import MESH_TOUCH
from particlesim.geometry.narrow_phase.gjk import NO_SIMPLEX
from particlesim.geometry.narrow_phase.mesh import box_about, has_normal, next_triangle
from particlesim.geometry.support import bounding_radius
from particlesim.model.bodies import BODY, placed
from particlesim.model.domain import nearest_image
from particlesim.model.free_motion import advance_path


@kernel
def _swept_box(system, a, b, paths, duration):
    """The box in the axes of mesh ``b`` that particle ``a`` keeps within for ``duration`` [s] on these paths.

    A rigid mesh is looked at from itself, so that the tree over it stays as it is however it moves.
    """
    path_a, path_b = paths
    start = scale(nearest_image(sub(path_b[0], path_a[0]), system.domain[0].period), -1.0)
    end = axpy(start, sub(path_a[2], path_b[2]), duration)
    bent = 0.5 * relative_acceleration(paths) * duration * duration
    # A mesh that turns sees what is at a distance from it go round by as much.
    turned = norm(path_b[3]) * duration * (max(norm(start), norm(end)) + bent)
    reach = a.radius + MESH_TOUCH * a.scale + bent + turned
    return box_about((b.shape_row, b.scale, path_b[1]), start, end, reach)


@kernel
def put_triangle(system, triangle, row):
    """Let a record of a mesh stand for its triangle in a ``row`` of the shape table."""
    triangle.shape_row = row
    triangle.radius = bounding_radius(system.shapes, placed(triangle))


@kernel
def _triangle_impact(system, meshes, a, triangle, paths, duration, points):
    """When particle ``a`` meets a ``triangle``, a body of its own, within ``duration`` on paths given at time 0."""
    path_a, path_b = paths
    if not may_come_near(system, a, triangle, paths, duration):
        return math.inf
    time = first_touch(system, a, triangle, paths, (0.0, duration), 0.0, NO_SIMPLEX, points)
    if time == math.inf:
        return time
    then = (
        advance_path(path_a, to_vec3(a.principal_inertia), time),
        advance_path(path_b, to_vec3(triangle.principal_inertia), time),
    )
    touching, approaching, depth, normal = touch_of(system, a, triangle, then, points)
    if touching:
        outwards = inverse_rotate(then[1][1], scale(normal, -1.0))
        if not (approaching and has_normal(system.shapes, meshes, triangle.shape_row, outwards)):
            time = first_touch(system, a, triangle, paths, (time, duration), depth, NO_SIMPLEX, points)
    return time


@kernel
def mesh_impact(system, meshes, a, b, paths, duration, points):
    """When particle ``a`` and mesh ``b`` collide within ``duration`` on paths given at time 0; inf if they do not."""
    if meshes is None:
        return math.inf
    box = _swept_box(system, a, b, paths, duration)
    copy, first = np.empty(1, dtype=BODY), math.inf
    copy[0] = b
    triangle = copy[0]
    place, row = next_triangle(system.shapes, meshes, b.shape_row, (0, 0), box)
    while row >= 0:
        put_triangle(system, triangle, row)
        time = _triangle_impact(system, meshes, a, triangle, paths, min(first, duration), points)
        first = min(first, time)
        place, row = next_triangle(system.shapes, meshes, b.shape_row, place, box)
    return first
