"""The next impact of two bodies of which one at least has parts: the first of those of their parts.

A part that is touched where its body has no such normal is not met there: what has sunk in by as little as it may comes
up against the edges of the next triangles of a flat floor, or of the next part of a compound. It is looked at again
when it is deeper.
"""

import math

import numpy as np

from particlesim.core.jit import kernel
from particlesim.core.math3d import axpy, load_vec3, norm, scale, sub, to_vec3
from particlesim.dynamics.ccd.half_space_impact import half_space_impact
from particlesim.dynamics.ccd.time_of_impact import first_touch, largest_angular_speed, relative_acceleration
from particlesim.dynamics.ccd.touch import may_come_near, touch_of
from particlesim.dynamics.settings import MESH_TOUCH
from particlesim.geometry.narrow_phase.gjk import NO_SIMPLEX
from particlesim.geometry.narrow_phase.mesh import box_about
from particlesim.geometry.narrow_phase.parts import next_part, parts_of, which_hides
from particlesim.geometry.support import bounding_radius, is_half_space
from particlesim.model.bodies import BODY, placed
from particlesim.model.domain import nearest_image
from particlesim.model.free_motion import advance_path


@kernel
def _swept_box(system, part, b, paths, duration):
    """The box in the axes of body ``b`` that a ``part`` keeps within for ``duration`` [s] on these paths.

    A rigid body is looked at from itself, so that the tree over a mesh stays as it is however it moves.
    """
    path_a, path_b = paths
    start = scale(nearest_image(sub(path_b[0], path_a[0]), system.domain[0].period), -1.0)
    end = axpy(start, sub(path_a[2], path_b[2]), duration)
    bent = 0.5 * relative_acceleration(paths) * duration * duration
    # A body that turns sees what is at a distance from it go round by as much.
    turned = largest_angular_speed(b, path_b) * duration * (max(norm(start), norm(end)) + bent)
    reach = part.radius + MESH_TOUCH * part.scale + bent + turned
    return box_about((b.shape_row, b.scale, path_b[1]), start, end, reach)


@kernel
def put_part(system, part, row):
    """Let a record of a body stand for its part in a ``row`` of the shape table."""
    part.shape_row = row
    part.radius = bounding_radius(system.shapes, placed(part))


@kernel
def _part_impact(system, meshes, wholes, parts, paths, duration, points):
    """When two ``parts``, records of bodies, meet within ``duration`` on paths given at time 0.

    ``wholes`` are the rows of the shapes that they are of.
    """
    (a, b), (path_a, path_b) = parts, paths
    if is_half_space(system.shapes, b.shape_row):
        return half_space_impact(system, a, b, paths, duration, points)
    if not may_come_near(system, a, b, paths, duration):
        return math.inf
    time = first_touch(system, a, b, paths, (0.0, duration), 0.0, NO_SIMPLEX, points)
    if time == math.inf:
        return time
    then = (
        advance_path(path_a, to_vec3(a.principal_inertia), time),
        advance_path(path_b, to_vec3(b.principal_inertia), time),
    )
    touching, approaching, depth, normal = touch_of(system, a, b, then, points)
    if touching:
        offset = nearest_image(sub(then[1][0], then[0][0]), system.domain[0].period)
        placed_wholes = (wholes[0], a.scale, then[0][1]), (wholes[1], b.scale, then[1][1])
        placed_parts = (a.shape_row, a.scale, then[0][1]), (b.shape_row, b.scale, then[1][1])
        contact = 0.0, normal, load_vec3(points, 0)
        hidden = which_hides(system.shapes, meshes, placed_wholes, placed_parts, offset, contact) >= 0
        if hidden or not approaching:
            time = first_touch(system, a, b, paths, (time, duration), depth, NO_SIMPLEX, points)
    return time


@kernel
def parts_impact(system, meshes, a, b, paths, duration, points):
    """When two bodies collide within ``duration`` on paths given at time 0; inf if they do not."""
    if meshes is None:
        return math.inf
    copies, wholes, first = np.empty(2, dtype=BODY), (a.shape_row, b.shape_row), math.inf
    copies[0], copies[1] = a, b
    part, other = copies[0], copies[1]
    begin, end = parts_of(system.shapes, a.shape_row)
    for own in range(begin, end):
        put_part(system, part, own)
        box = _swept_box(system, part, b, paths, duration)
        place, row = next_part(system.shapes, meshes, b.shape_row, (0, 0), box)
        while row >= 0:
            put_part(system, other, row)
            time = _part_impact(system, meshes, wholes, (part, other), paths, min(first, duration), points)
            first = min(first, time)
            place, row = next_part(system.shapes, meshes, b.shape_row, place, box)
    return first
