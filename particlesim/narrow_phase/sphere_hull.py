"""Sphere against hull: the nearest point of the hull's surface to the centre."""

import math

from particlesim.jit import kernel
from particlesim.vec import along, apply, apply_transposed, cross, dot, matrix_of, norm, put, row, scaled, sub

# A centre nearer to a face than this fraction of the hull's size takes the face's normal: the direction from the
# nearest point is mostly rounding there.
_ON_SURFACE = 1e-10


@kernel
def _corner(table, shape, size, k):
    """Corner number ``k`` of the table's loops, at the hull's size."""
    return scaled(row(table.vertex, table.vertex_start[shape] + table.loop[k]), size)


@kernel
def _nearest_on_face(table, shape, size, face, normal, height, centre):
    """The point of a face nearest to a centre that lies ``height`` above the plane of the face."""
    first, last = table.loop_start[face], table.loop_start[face + 1]
    inside = True
    best, nearest = math.inf, centre
    for k in range(first, last):
        p = _corner(table, shape, size, k)
        edge = sub(_corner(table, shape, size, k + 1 if k + 1 < last else first), p)
        to_centre = sub(centre, p)
        if dot(cross(edge, normal), to_centre) > 0.0:
            inside = False
            t = min(max(dot(to_centre, edge) / dot(edge, edge), 0.0), 1.0)
            candidate = along(p, edge, t)
            distance = norm(sub(centre, candidate))
            if distance < best:
                best, nearest = distance, candidate
    return along(centre, normal, -height) if inside else nearest


@kernel
def hull_sphere(table, shape, size, turn, diameter, offset, points):
    """Separation, normal from hull to sphere and one contact point, for a sphere at ``offset`` from a hull."""
    matrix = matrix_of(turn)
    centre = apply_transposed(matrix, offset)
    first, last = table.face_start[shape], table.face_start[shape + 1]
    highest, normal = -math.inf, (0.0, 0.0, 0.0)
    distance, nearest = math.inf, centre
    for f in range(first, last):
        n = row(table.face_normal, f)
        height = dot(n, centre) - table.face_offset[f] * size
        if height > highest:
            highest, normal = height, n
        # Only a face that the centre is in front of can hold the nearest point of the hull.
        if height > 0.0 and height < distance:
            candidate = _nearest_on_face(table, shape, size, f, n, height, centre)
            apart = norm(sub(centre, candidate))
            if apart < distance:
                distance, nearest = apart, candidate
    if highest <= 0.0:
        distance, nearest = highest, along(centre, normal, -highest)
    elif distance > _ON_SURFACE * (table.radius[shape] * size):
        normal = scaled(sub(centre, nearest), 1.0 / distance)
    separation = distance - 0.5 * diameter
    put(points, 0, apply(matrix, along(nearest, normal, 0.5 * separation)))
    return separation, apply(matrix, normal), 1
