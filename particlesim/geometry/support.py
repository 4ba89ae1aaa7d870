"""How far a shape reaches in a direction: the one loop over the vertices of a core, and the only tests of kind.

A shape that is placed somewhere is a tuple (row of the shape table, size, orientation). A shape that the narrow phase
has turned already is a tuple (row, size, rotation matrix).
"""

import math

from particlesim.core.constants import HALF_SPACE, SPHERE
from particlesim.core.jit import kernel
from particlesim.core.math3d import dot, load_vec3, mat_transposed_vec, mat_vec, quat_to_matrix, rotate, scale, to_vec3


@kernel
def farthest_row(vertices, first, last, direction):
    """The first of the rows ``first`` to ``last`` of an (n, 3) array that is farthest along ``direction``."""
    best, farthest = first, -math.inf
    for v in range(first, last):
        reach = dot(load_vec3(vertices, v), direction)
        if reach > farthest:
            best, farthest = v, reach
    return best


@kernel
def support_vertex(table, shape, direction):
    """Number of the vertex of a shape's core that is farthest along ``direction``, which is in body axes."""
    record = table.shape[shape]
    return farthest_row(table.vertex, record.first_vertex, record.last_vertex, direction)


@kernel
def support_distance(table, placed, direction):
    """How far a bounded shape reaches from its centroid along ``direction``, a unit vector in world axes [m]."""
    shape, size, orientation = placed
    if is_sphere(table, shape):
        return size * table.shape[shape].rounding
    local = mat_transposed_vec(quat_to_matrix(orientation), direction)
    farthest = load_vec3(table.vertex, support_vertex(table, shape, local))
    return size * (dot(farthest, local) + table.shape[shape].rounding)


@kernel
def turned(placed):
    """A placed shape with its orientation as a rotation matrix."""
    return placed[0], placed[1], quat_to_matrix(placed[2])


@kernel
def vertex_position(table, body, v):
    """Vertex ``v`` of a turned shape from its centroid, in world axes [m]."""
    return mat_vec(body[2], scale(load_vec3(table.vertex, v), body[1]))


@kernel
def rounding_of(table, placed):
    """Rounding radius of a placed or turned shape [m]."""
    return table.shape[placed[0]].rounding * placed[1]


@kernel
def bounding_radius(table, placed):
    """Radius of the bounding sphere of a placed or turned shape [m]."""
    return table.shape[placed[0]].radius * placed[1]


@kernel
def is_sphere(table, shape):
    """Whether orientation means nothing to a shape, and its contacts are closed forms."""
    return table.shape[shape].kind == SPHERE


@kernel
def is_point(table, shape):
    """Whether the core of a shape is a point."""
    return table.shape[shape].last_vertex - table.shape[shape].first_vertex == 1


@kernel
def has_faces(table, shape):
    """Whether the core of a shape is a polyhedron."""
    return table.shape[shape].last_face > table.shape[shape].first_face


@kernel
def is_half_space(table, shape):
    """Whether a shape is all that lies behind a plane."""
    return table.shape[shape].kind == HALF_SPACE


@kernel
def half_space_plane(table, placed):
    """Outward unit normal of a half-space in world axes, and how far its plane is from its position along it [m]."""
    face = table.face[table.shape[placed[0]].first_face]
    return rotate(placed[2], to_vec3(face.normal)), face.offset * placed[1]
