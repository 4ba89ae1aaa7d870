"""Shapes that consist of others, part by part: the triangles of a mesh, the convex parts of a compound.

All parts of a body have its position and its orientation: their vertices are where they are in it. Any other shape is
its own only part.

Where parts of a compound meet, edges of one may be within another, or flush with it: a ball that rolls from one cube to
the next, having sunk in by as little as it may, comes up against an edge that the body of both has not (see mesh.py
for triangles). Such normals are hidden.
"""

import math

import numpy as np

from particlesim.core.constants import COMPOUND, MAX_MANIFOLD, MESH, TRIANGLE
from particlesim.core.jit import kernel
from particlesim.core.math3d import axpy, cross, dot, inverse_rotate, load_vec3, norm, rotate, scale, sub, to_vec3
from particlesim.geometry.narrow_phase.gjk import NO_SIMPLEX
from particlesim.geometry.narrow_phase.mesh import box_about, face_towards, has_normal, next_triangle
from particlesim.geometry.narrow_phase.pair import pair_nearer, pair_separation
from particlesim.geometry.support import bounding_radius, is_half_space, support_distance
from particlesim.geometry.tolerances import HIDDEN_ABOVE, NORMAL_SINE


@kernel
def parts_of(table, shape):
    """Rows of the shape table of the convex parts that a bounded shape has: the first, past the last."""
    if table.shape[shape].kind == COMPOUND:
        return table.shape[shape].first_part, table.shape[shape].last_part
    return shape, shape + 1


@kernel
def middle_of_part(meshes, part):
    """The middle of a placed convex part from the position of its body, in world axes [m]."""
    return rotate(part[2], scale(to_vec3(meshes.extent[part[0]].middle), part[1]))


@kernel
def box_about_part(meshes, part, b, offset, reach):
    """The box, in the axes of placed b at ``offset``, about what is within ``reach`` [m] of a placed convex part."""
    centre = sub(middle_of_part(meshes, part), offset)
    return box_about(b, centre, centre, meshes.extent[part[0]].radius * part[1] + reach)


@kernel
def next_part(table, meshes, shape, place, box):
    """The next part of any shape that meets a ``box`` (see ``next_triangle``): its place in the search, and its row."""
    kind = table.shape[shape].kind
    if kind == MESH:
        return next_triangle(table, meshes, shape, place, box)
    (first, last), (lower, upper) = parts_of(table, shape), box
    for row in range(first + place[1], last):
        e = meshes.extent[row] if kind == COMPOUND else meshes.extent[0]
        if kind != COMPOUND or (
            e.lower[0] <= upper[0]
            and lower[0] <= e.upper[0]
            and e.lower[1] <= upper[1]
            and lower[1] <= e.upper[1]
            and e.lower[2] <= upper[2]
            and lower[2] <= e.upper[2]
        ):
            return (0, row + 1 - first), row
    return (0, 0), -1


# ---- hidden normals --------------------------------------------------------------------------------------------------


@kernel
def _facing_face(table, row, own):
    """The face of a polyhedron in a ``row`` that faces a direction in body axes most; -1 of what has no faces."""
    best, most = -1, -math.inf
    for f in range(table.shape[row].first_face, table.shape[row].last_face):
        if dot(to_vec3(table.face[f].normal), own) > most:
            best, most = f, dot(to_vec3(table.face[f].normal), own)
    return best


@kernel
def facing_normal(table, part, outwards):
    """The normal of the face of a placed polyhedron that faces a direction most; of a triangle, on that side of it."""
    row, _, orientation = part
    own = inverse_rotate(orientation, outwards)
    if table.shape[row].kind == TRIANGLE:
        return rotate(orientation, face_towards(table, row, own))
    return rotate(orientation, to_vec3(table.face[_facing_face(table, row, own)].normal))


@kernel
def _is_inside(table, meshes, whole, row, point, outwards):
    """Whether a point right above a place on a part, in its ``row``, is inside of another part of a compound."""
    radius, scratch = bounding_radius(table, whole), np.empty((MAX_MANIFOLD, 3))
    above, dot_of_point = axpy(point, outwards, HIDDEN_ABOVE * radius), (len(meshes.extent) - 1, 0.0, whole[2])
    first, last = parts_of(table, whole[0])
    for other in range(first, last):
        placed = other, whole[1], whole[2]
        if other == row or norm(sub(above, middle_of_part(meshes, placed))) > meshes.extent[other].radius * whole[1]:
            continue
        apart, _, _ = pair_separation(table, placed, dot_of_point, above, NO_SIMPLEX, scratch)
        if apart < -NORMAL_SINE * radius:
            return True
    return False


@kernel
def _is_face_hidden(table, meshes, whole, part, face, place):
    """Whether other parts are above a face all about a ``place`` (point, outwards) on it.

    What is looked at lies a little way off towards each of its corners: at its border it is known neither from the
    point itself, nor from what lies on the border, whether other parts are flush with it or stand beside it.
    """
    (row, size, orientation), (point, outwards) = part, place
    first, last, middle = table.face[face].first, table.face[face].last, (0.0, 0.0, 0.0)
    for k in range(first, last):
        middle = axpy(middle, load_vec3(table.vertex, table.loop[k]), 1.0 / (last - first))
    for k in range(first, last):
        corner = load_vec3(table.vertex, table.loop[k])
        towards = sub(rotate(orientation, scale(axpy(corner, sub(middle, corner), 0.25), size)), point)
        way = min(HIDDEN_ABOVE * bounding_radius(table, whole) / norm(towards), 1.0)
        if not _is_inside(table, meshes, whole, row, axpy(point, towards, way), outwards):
            return False
    return True


@kernel
def _is_edge_hidden(table, meshes, whole, row, point, outwards):
    """Whether another part is where an edge or a vertex of a part has a normal, and reaches farther along it."""
    radius, scratch = bounding_radius(table, whole), np.empty((MAX_MANIFOLD, 3))
    near, dot_of_point = NORMAL_SINE * radius, (len(meshes.extent) - 1, 0.0, whole[2])
    first, last = parts_of(table, whole[0])
    for other in range(first, last):
        placed = other, whole[1], whole[2]
        away = norm(sub(point, middle_of_part(meshes, placed))) - meshes.extent[other].radius * whole[1]
        if other == row or away > near:
            continue
        apart, _, _ = pair_separation(table, placed, dot_of_point, point, NO_SIMPLEX, scratch)
        if apart <= near and support_distance(table, placed, outwards) > dot(point, outwards) + near:
            return True
    return False


@kernel
def is_hidden(table, meshes, whole, part, point, outwards):
    """Whether a placed compound has no such normal where a part of it does.

    Parameters
    ----------
    whole, part : (row of the shape table, size, orientation)
    point : on the surface of the part, from the position of the body [m]
    outwards : unit normal, in world axes
    """
    row, _, orientation = part
    if table.shape[row].rounding > 0.0:
        return _is_inside(table, meshes, whole, row, point, outwards)
    own = inverse_rotate(orientation, outwards)
    face = _facing_face(table, row, own)
    if norm(cross(to_vec3(table.face[face].normal), own)) <= NORMAL_SINE:
        return _is_face_hidden(table, meshes, whole, part, face, (point, outwards))
    return _is_edge_hidden(table, meshes, whole, row, point, outwards)


@kernel
def shows(table, meshes, whole, part, point, outwards):
    """Whether a placed shape has a normal where a placed part of it is touched (see ``is_hidden``)."""
    kind = table.shape[part[0]].kind
    if kind == TRIANGLE:
        return has_normal(table, meshes, part[0], inverse_rotate(part[2], outwards))
    return table.shape[whole[0]].kind != COMPOUND or not is_hidden(table, meshes, whole, part, point, outwards)


@kernel
def which_hides(table, meshes, wholes, parts, offset, contact):
    """Which of two placed shapes has no such normal where parts of them touch: 0 or 1, -1 if both have.

    ``contact`` is (separation [m], normal from the first, point half way between them, from the first one's position).
    What touches a half-space touches it with what is outermost.
    """
    separation, normal, middle = contact
    if is_half_space(table, parts[1][0]):
        return -1
    of_b = sub(axpy(middle, normal, 0.5 * separation), offset)
    if not shows(table, meshes, wholes[1], parts[1], of_b, scale(normal, -1.0)):
        return 1
    of_a = axpy(middle, normal, -0.5 * separation)
    return -1 if shows(table, meshes, wholes[0], parts[0], of_a, normal) else 0


# ---- all parts -------------------------------------------------------------------------------------------------------


@kernel
def parts_separation(table, meshes, a, b, offset, points):
    """How deep placed a is in placed b at ``offset`` from it, part by part, as a separation below 0; the normal.

    Apart, it is some number above 0: only parts near each other are looked at. ``points`` is scratch.
    """
    least, deepest = math.inf, (0.0, 0.0, 0.0)
    first, last = parts_of(table, a[0])
    for own in range(first, last):
        part = own, a[1], a[2]
        box = box_about_part(meshes, part, b, offset, 0.0)
        place, row = next_part(table, meshes, b[0], (0, 0), box)
        while row >= 0:
            found, normal, _ = pair_separation(table, part, (row, b[1], b[2]), offset, NO_SIMPLEX, points)
            if found < least:
                least, deepest = found, normal
            place, row = next_part(table, meshes, b[0], place, box)
    return least, deepest


@kernel
def parts_nearer(table, meshes, a, b, offset, distance):
    """Whether any parts of two placed bounded shapes are nearer than ``distance`` [m]."""
    first, last = parts_of(table, a[0])
    for own in range(first, last):
        part = own, a[1], a[2]
        box = box_about_part(meshes, part, b, offset, distance)
        place, row = next_part(table, meshes, b[0], (0, 0), box)
        while row >= 0:
            if pair_nearer(table, part, (row, b[1], b[2]), offset, distance):
                return True
            place, row = next_part(table, meshes, b[0], place, box)
    return False
