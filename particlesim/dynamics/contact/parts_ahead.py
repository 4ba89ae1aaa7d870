"""Bodies that have parts where a step leads them: how deep they are in each other there, and what was gone through.

A mesh is a sheet without thickness: what is beyond it at the end of a step touches nothing of it there. So it is asked
from which side it came, too.
"""

from __future__ import annotations

import math

import numpy as np

from particlesim.core.constants import MAX_MANIFOLD, TRIANGLE
from particlesim.core.jit import kernel
from particlesim.core.math3d import (
    add,
    axpy,
    cross,
    dot,
    inverse_rotate,
    load_vec3,
    rotate,
    scale,
    sub,
    to_quat,
)
from particlesim.core.math3d import to_vec3 as vec
from particlesim.dynamics.contact.part_patches import gather_patches, new_patches, patch_corners
from particlesim.dynamics.settings import SAME_PATCH_SINE
from particlesim.geometry.narrow_phase.gjk import NO_SIMPLEX
from particlesim.geometry.narrow_phase.mesh import box_about, face_towards
from particlesim.geometry.narrow_phase.pair import pair_separation
from particlesim.geometry.narrow_phase.parts import middle_of_part, next_part, parts_of, which_hides
from particlesim.geometry.support import support_distance
from particlesim.geometry.tolerances import PARALLEL_TOLERANCE
from particlesim.model.bodies import placed
from particlesim.model.domain import nearest_image

_STILL = (0.0, 0.0, 0.0)


@kernel
def _middle_from(system, meshes, a, own, b):
    """Where the middle of the part in row ``own`` of a body is from another one, in world axes [m]."""
    offset = nearest_image(sub(vec(a.position), vec(b.position)), system.domain[0].period)
    return add(offset, middle_of_part(meshes, (own, a.scale, to_quat(a.orientation))))


@kernel
def _in_axes(b, point):
    """A point from the position of a body, in the body's axes at size 1."""
    return scale(inverse_rotate(to_quat(b.orientation), point), 1.0 / b.scale)


@kernel
def _crosses(table, row, start, end):
    """Whether a segment crosses the triangle in a ``row`` of the shape table, all in the axes of its mesh."""
    v = table.shape[row].first_vertex
    p, normal = load_vec3(table.vertex, v), vec(table.face[table.shape[row].first_face].normal)
    before, after = dot(normal, sub(start, p)), dot(normal, sub(end, p))
    if before * after > 0.0 or before == after:
        return False
    there, inside = axpy(start, sub(end, start), before / (before - after)), True
    for k in range(3):
        corner, following = load_vec3(table.vertex, v + k), load_vec3(table.vertex, v + (k + 1) % 3)
        inside = inside and dot(cross(sub(following, corner), sub(there, corner)), normal) >= 0.0
    return inside


@kernel
def _gone_through(system, meshes, bodies, part, way):
    """How deep a placed ``part`` is behind a triangle that its middle goes through, as a separation, and the normal.

    ``bodies`` are the whole of it and what it may go through; its ``way`` (start, end) is seen from that. The
    separation is infinite if it goes through none.
    """
    shapes, (a, b), (start, end) = system.shapes, bodies, way
    deepest, through = math.inf, _STILL
    box = (
        (min(start[0], end[0]), min(start[1], end[1]), min(start[2], end[2])),
        (max(start[0], end[0]), max(start[1], end[1]), max(start[2], end[2])),
    )
    place, row = next_part(shapes, meshes, b.shape_row, (0, 0), box)
    while row >= 0:
        if shapes.shape[row].kind == TRIANGLE and _crosses(shapes, row, start, end):
            corner = load_vec3(shapes.vertex, shapes.shape[row].first_vertex)
            outwards = face_towards(shapes, row, sub(start, corner))
            normal = scale(rotate(to_quat(b.orientation), outwards), -1.0)
            depth = dot(outwards, sub(_in_axes(b, _position_from(system, a, b)), corner))
            separation = b.scale * depth - support_distance(shapes, part, normal)
            if separation < deepest:
                deepest, through = separation, normal
        place, row = next_part(shapes, meshes, b.shape_row, place, box)
    return deepest, through


@kernel
def _position_from(system, a, b):
    """Where a body is from another one, in world axes [m]."""
    return nearest_image(sub(vec(a.position), vec(b.position)), system.domain[0].period)


@kernel
def parts_contact_ahead(system, meshes, ahead, pair, room):
    """Separation, normal, offset and middle of the deepest patch of two bodies where they are ``ahead``.

    ``pair`` are the two; ``room`` (MAX_MANIFOLD, 3) is scratch. Where nothing overlaps the separation is infinite.
    """
    bodies, before_a, before_b = (ahead[pair[0]], ahead[pair[1]]), system.body[pair[0]], system.body[pair[1]]
    a, b = bodies
    patches = new_patches()
    limits = 0.0, PARALLEL_TOLERANCE, 0.0
    offset, count, _ = gather_patches(system, meshes, a, b, limits, SAME_PATCH_SINE, patches)
    deepest, normal, middle, best = math.inf, _STILL, _STILL, -1
    first, last = parts_of(system.shapes, a.shape_row)
    for own in range(first, last):
        part = own, a.scale, to_quat(a.orientation)
        start = _in_axes(before_b, _middle_from(system, meshes, before_a, own, before_b))
        end = _in_axes(b, _middle_from(system, meshes, a, own, b))
        separation, through = _gone_through(system, meshes, bodies, part, (start, end))
        if separation < deepest:
            deepest, normal = separation, through
    for k in range(count):
        if patches.nearest[k, 3] < deepest:
            deepest, normal, best = patches.nearest[k, 3], load_vec3(patches.normal, k), k
    if best >= 0:
        points = patch_corners(patches, best, room)
        for k in range(points):
            middle = axpy(middle, load_vec3(room, k), 1.0 / points)
    return deepest, normal, offset, middle


@kernel
def _comes_upon(system, meshes, part, pair, paths, reach):
    """As ``comes_upon_part``, of the part in row ``part`` of the first body; ``paths`` are (start, end) in axes of b.

    ``pair`` are both bodies where they are ahead, and where they were before.
    """
    (a, b), (before_a, before_b) = pair
    shapes, points = system.shapes, np.empty((MAX_MANIFOLD, 3))
    offset = scale(_position_from(system, a, b), -1.0)
    before = scale(_position_from(system, before_a, before_b), -1.0)
    start, end = paths
    q = to_quat(b.orientation)
    own = part, a.scale, to_quat(a.orientation)
    own_before = part, a.scale, to_quat(before_a.orientation)
    radius = meshes.extent[part].radius * a.scale
    box = box_about(placed(b), rotate(q, scale(start, b.scale)), rotate(q, scale(end, b.scale)), radius)
    place, row = next_part(shapes, meshes, b.shape_row, (0, 0), box)
    while row >= 0:
        other = row, b.scale, q
        now, normal, _ = pair_separation(shapes, own, other, offset, NO_SIMPLEX, points)
        meets = now < 0.0
        if meets:
            contact = now, normal, load_vec3(points, 0)
            meets = which_hides(shapes, meshes, (placed(a), placed(b)), (own, other), offset, contact) < 0
        if meets or (shapes.shape[row].kind == TRIANGLE and _crosses(shapes, row, start, end)):
            other_before = row, b.scale, to_quat(before_b.orientation)
            then, _, _ = pair_separation(shapes, own_before, other_before, before, NO_SIMPLEX, points)
            if then > reach:
                return True
        place, row = next_part(shapes, meshes, b.shape_row, place, box)
    return False


@kernel
def comes_upon_part(system, meshes, ahead, pair, reach):
    """Whether parts of two bodies meet ahead, or one is through a triangle, that were apart by more than ``reach``."""
    a, b, before_a, before_b = ahead[pair[0]], ahead[pair[1]], system.body[pair[0]], system.body[pair[1]]
    first, last = parts_of(system.shapes, a.shape_row)
    for own in range(first, last):
        start = _in_axes(before_b, _middle_from(system, meshes, before_a, own, before_b))
        end = _in_axes(b, _middle_from(system, meshes, a, own, b))
        if _comes_upon(system, meshes, own, ((a, b), (before_a, before_b)), (start, end), reach):
            return True
    return False
