"""Sphere against hull: the nearest point of the hull's surface to the centre."""

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
)

# A centre nearer to an edge or a corner than this fraction of the hull's size takes the normal of a face there: the
# direction from the nearest point is mostly rounding.
_ON_SURFACE = 1e-10


@kernel
def _nearest_on_outline(vertices, size, loop, first, last, normal, centre):
    """Whether a centre lies over a face, and if not, the nearest point of the face's outline and its distance.

    The face's corners are ``loop[first:last]``, numbers of ``vertices`` (v, 3), which are those of size 1.
    """
    over = True
    best, nearest = math.inf, centre
    p = scale(load_vec3(vertices, loop[last - 1]), size)
    for k in range(first, last):
        q = scale(load_vec3(vertices, loop[k]), size)
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
def hull_sphere(table, shape, size, turn, diameter, offset, points):
    """Separation, normal from hull to sphere and one contact point, for a sphere at ``offset`` from a hull."""
    # Taken out of their struct once: each access counts references, which costs more than the arithmetic.
    face_normal, face_offset, loop, loop_start = table.face_normal, table.face_offset, table.loop, table.loop_start
    vertices = table.vertex[table.vertex_start[shape] : table.vertex_start[shape + 1]]
    matrix = quat_to_matrix(turn)
    centre = mat_transposed_vec(matrix, offset)
    highest, normal = -math.inf, (0.0, 0.0, 0.0)
    distance, nearest, over_face = math.inf, centre, False
    for f in range(table.face_start[shape], table.face_start[shape + 1]):
        n = load_vec3(face_normal, f)
        height = dot(n, centre) - face_offset[f] * size
        if height > highest:
            highest, normal = height, n
        # Only a face that the centre is in front of can hold the nearest point of the hull.
        if height > 0.0 and height < distance:
            over, candidate, apart = _nearest_on_outline(
                vertices, size, loop, loop_start[f], loop_start[f + 1], n, centre
            )
            if over:
                distance, nearest, normal, over_face = height, axpy(centre, n, -height), n, True
                break
            if apart < distance:
                distance, nearest = apart, candidate
    if highest <= 0.0:
        distance, nearest = highest, axpy(centre, normal, -highest)
    elif not over_face and distance > _ON_SURFACE * (table.radius[shape] * size):
        normal = scale(sub(centre, nearest), 1.0 / distance)
    separation = distance - 0.5 * diameter
    store_vec3(points, 0, mat_vec(matrix, axpy(nearest, normal, 0.5 * separation)))
    return separation, mat_vec(matrix, normal), 1
