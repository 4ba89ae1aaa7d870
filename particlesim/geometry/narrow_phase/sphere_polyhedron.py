"""Sphere against polyhedron, rounded or not: the nearest point of the core's surface to the centre."""

import math

from particlesim.core.jit import kernel
from particlesim.core.math3d import (
    axpy,
    cross,
    dot,
    load_vec3,
    mat_transposed_vec,
    mat_vec,
    norm,
    quat_to_matrix,
    scale,
    store_vec3,
    sub,
    to_vec3,
)
from particlesim.geometry.support import bounding_radius, rounding_of
from particlesim.geometry.tolerances import ON_SURFACE


@kernel
def _nearest_on_outline(table, f, size, centre):
    """Whether a centre lies over face ``f``, and if not, the nearest point of the face's outline and its distance."""
    vertex, loop, face = table.vertex, table.loop, table.face[f]
    normal = to_vec3(face.normal)
    over = True
    best, nearest = math.inf, centre
    p = scale(load_vec3(vertex, loop[face.last - 1]), size)
    for k in range(face.first, face.last):
        q = scale(load_vec3(vertex, loop[k]), size)
        edge, to_centre = sub(q, p), sub(centre, p)
        if dot(cross(edge, normal), to_centre) > 0.0:
            over = False
            t = min(max(dot(to_centre, edge) / dot(edge, edge), 0.0), 1.0)
            candidate = axpy(p, edge, t)
            distance = norm(sub(centre, candidate))
            if distance < best:
                best, nearest = distance, candidate
        p = q
    return over, nearest, best


@kernel
def _nearest_on_core(table, body, centre):
    """Signed distance, nearest point of a core's surface and outward normal there, of a centre in body axes."""
    shape, size = body[0], body[1]
    faces, record = table.face, table.shape[shape]
    highest, normal = -math.inf, (0.0, 0.0, 0.0)
    distance, nearest, over_face = math.inf, centre, False
    for f in range(record.first_face, record.last_face):
        n = to_vec3(faces[f].normal)
        height = dot(n, centre) - faces[f].offset * size
        if height > highest:
            highest, normal = height, n
        # Only a face that the centre is in front of can hold the nearest point of the core.
        if height > 0.0 and height < distance:
            over, candidate, apart = _nearest_on_outline(table, f, size, centre)
            if over:
                distance, nearest, normal, over_face = height, axpy(centre, n, -height), n, True
                break
            if apart < distance:
                distance, nearest = apart, candidate
    if highest <= 0.0:
        distance, nearest = highest, axpy(centre, normal, -highest)
    elif not over_face and distance > ON_SURFACE * bounding_radius(table, body):
        normal = scale(sub(centre, nearest), 1.0 / distance)
    return distance, nearest, normal


@kernel
def polyhedron_sphere(table, placed, radius, offset, points):
    """Separation, normal from polyhedron to sphere and one contact point, for a sphere at ``offset`` from it."""
    matrix = quat_to_matrix(placed[2])
    rounding = rounding_of(table, placed)
    distance, nearest, normal = _nearest_on_core(table, placed, mat_transposed_vec(matrix, offset))
    separation = distance - (rounding + radius)
    store_vec3(points, 0, mat_vec(matrix, axpy(nearest, normal, rounding + 0.5 * separation)))
    return separation, mat_vec(matrix, normal), 1
