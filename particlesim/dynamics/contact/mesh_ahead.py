"""Particles and meshes where a step leads them: how deep they are in each other there, and what was gone through.

A mesh is a sheet without thickness: what is beyond it at the end of a step touches nothing of it there. So it is asked
from which side it came, too.
"""

from __future__ import annotations

import math

import numpy as np

from particlesim.core.constants import MAX_MANIFOLD
from particlesim.core.jit import kernel
from particlesim.core.math3d import axpy, cross, dot, inverse_rotate, load_vec3, rotate, scale, sub, to_quat
from particlesim.core.math3d import to_vec3 as vec
from particlesim.dynamics.contact.mesh_patches import gather_patches, new_patches, patch_corners
from particlesim.dynamics.settings import SAME_PATCH_SINE
from particlesim.geometry.narrow_phase.gjk import NO_SIMPLEX
from particlesim.geometry.narrow_phase.mesh import box_about, face_towards, has_normal, next_triangle
from particlesim.geometry.narrow_phase.pair import pair_separation
from particlesim.geometry.support import support_distance
from particlesim.geometry.tolerances import PARALLEL_TOLERANCE
from particlesim.model.bodies import placed
from particlesim.model.domain import nearest_image

_STILL = (0.0, 0.0, 0.0)


@kernel
def _from_mesh(system, a, b):
    """Where a particle is in the axes of a mesh, at size 1."""
    apart = nearest_image(sub(vec(a.position), vec(b.position)), system.domain[0].period)
    return scale(inverse_rotate(to_quat(b.orientation), apart), 1.0 / b.scale)


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
def _gone_through(system, meshes, ahead, pair, start, end):
    """How deep a particle is behind a triangle that its middle goes through, as a separation, and the normal.

    ``start`` and ``end`` of its way are seen from the mesh. The separation is infinite if it goes through none.
    """
    shapes, a, b = system.shapes, ahead[pair[0]], ahead[pair[1]]
    deepest, way = math.inf, _STILL
    lower = min(start[0], end[0]), min(start[1], end[1]), min(start[2], end[2])
    upper = max(start[0], end[0]), max(start[1], end[1]), max(start[2], end[2])
    place, row = next_triangle(shapes, meshes, b.shape_row, (0, 0), (lower, upper))
    while row >= 0:
        if _crosses(shapes, row, start, end):
            corner = load_vec3(shapes.vertex, shapes.shape[row].first_vertex)
            outwards = face_towards(shapes, row, sub(start, corner))
            normal = scale(rotate(to_quat(b.orientation), outwards), -1.0)
            separation = b.scale * dot(outwards, sub(end, corner)) - support_distance(shapes, placed(a), normal)
            if separation < deepest:
                deepest, way = separation, normal
        place, row = next_triangle(shapes, meshes, b.shape_row, place, (lower, upper))
    return deepest, way


@kernel
def mesh_contact_ahead(system, meshes, ahead, pair, room):
    """Separation, normal, offset and middle of the deepest patch of a particle on a mesh where they are ``ahead``.

    ``pair`` are the two; ``room`` (MAX_MANIFOLD, 3) is scratch. Where nothing overlaps the separation is infinite.
    """
    a, b = ahead[pair[0]], ahead[pair[1]]
    patches = new_patches()
    limits = 0.0, PARALLEL_TOLERANCE, 0.0
    offset, count, _ = gather_patches(system, meshes, a, b, limits, SAME_PATCH_SINE, patches)
    start = _from_mesh(system, system.body[pair[0]], system.body[pair[1]])
    deepest, normal = _gone_through(system, meshes, ahead, pair, start, _from_mesh(system, a, b))
    middle, best = _STILL, -1
    for k in range(count):
        if patches.nearest[k, 3] < deepest:
            deepest, normal, best = patches.nearest[k, 3], load_vec3(patches.normal, k), k
    if best >= 0:
        points = patch_corners(patches, best, room)
        for k in range(points):
            middle = axpy(middle, load_vec3(room, k), 1.0 / points)
    return deepest, normal, offset, middle


@kernel
def comes_upon_triangle(system, meshes, ahead, pair, reach):
    """Whether a particle meets a triangle of a mesh ahead, or its middle is through it, that was beyond ``reach``."""
    a, b, points = ahead[pair[0]], ahead[pair[1]], np.empty((MAX_MANIFOLD, 3))
    before_a, before_b = system.body[pair[0]], system.body[pair[1]]
    start, end = _from_mesh(system, before_a, before_b), _from_mesh(system, a, b)
    offset = nearest_image(sub(vec(b.position), vec(a.position)), system.domain[0].period)
    before = nearest_image(sub(vec(before_b.position), vec(before_a.position)), system.domain[0].period)
    q, q_before = to_quat(b.orientation), to_quat(before_b.orientation)
    box = box_about(placed(b), rotate(q, scale(start, b.scale)), scale(offset, -1.0), a.radius)
    place, row = next_triangle(system.shapes, meshes, b.shape_row, (0, 0), box)
    while row >= 0:
        now, normal, _ = pair_separation(system.shapes, placed(a), (row, b.scale, q), offset, NO_SIMPLEX, points)
        meets = now < 0.0 and has_normal(system.shapes, meshes, row, inverse_rotate(q, scale(normal, -1.0)))
        if meets or _crosses(system.shapes, row, start, end):
            triangle = row, b.scale, q_before
            then, _, _ = pair_separation(system.shapes, placed(before_a), triangle, before, NO_SIMPLEX, points)
            if then > reach:
                return True
        place, row = next_triangle(system.shapes, meshes, b.shape_row, place, box)
    return False
