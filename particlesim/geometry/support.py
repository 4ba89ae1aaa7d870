"""How far a shape reaches in a direction: the one search among the vertices of a core, and the only tests of kind.

Cores of few vertices are gone through; those of many are climbed along their edges, from a vertex near the top that is
looked up by the direction.

A shape that is placed somewhere is a tuple (row of the shape table, size, orientation). A shape that the narrow phase
has turned already is a tuple (row, size, rotation matrix).
"""

import math

from particlesim.core.constants import COMPOUND, HALF_SPACE, MESH, SPHERE
from particlesim.core.jit import kernel
from particlesim.core.math3d import (
    dot,
    load_vec3,
    mat_transposed_vec,
    mat_vec,
    quat_to_matrix,
    rotate,
    scale,
    sub,
    to_vec3,
)
from particlesim.geometry.shape_links import cell_of, ring_of
from particlesim.geometry.tolerances import CLIMBED_VERTICES


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
def _climb(hull, core, direction):
    """As ``farthest_vertex``, from vertex to vertex along edges: on a convex body no way up ends below the top."""
    vertices, link = hull
    best = link[core[2] + cell_of(direction)]
    # Rounding could lead round in a circle.
    for _ in range(core[1] - core[0]):
        here, top, gain = load_vec3(vertices, best), best, 0.0
        first, last = ring_of(link, core, best)
        for k in range(first, last):
            higher = dot(sub(load_vec3(vertices, link[k]), here), direction)
            if higher > gain:
                top, gain = link[k], higher
        if top == best:
            break
        best = top
    return best


@kernel
def is_climbed(core):
    """Whether a core (see ``farthest_vertex``) has so many vertices that it is climbed, not gone through."""
    return core[1] - core[0] >= CLIMBED_VERTICES


@kernel
def farthest_vertex(hull, core, direction):
    """Number of the vertex of a core that is farthest along ``direction``, in body axes.

    ``hull`` are the arrays (vertex, link) of the shape table, ``core`` the (first vertex, last vertex, link) of a row.
    """
    if is_climbed(core):
        return _climb(hull, core, direction)
    return farthest_row(hull[0], core[0], core[1], direction)


@kernel
def core_of(shape):
    """The core of a SHAPE row as ``farthest_vertex`` takes it."""
    return shape.first_vertex, shape.last_vertex, shape.link


@kernel
def support_vertex(table, shape, direction):
    """Number of the vertex of a shape's core that is farthest along ``direction``, which is in body axes."""
    return farthest_vertex((table.vertex, table.link), core_of(table.shape[shape]), direction)


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
def has_many_vertices(table, shape):
    """Whether a core is better asked for its farthest vertices than gone through, vertex by vertex or face by face."""
    return is_climbed(core_of(table.shape[shape]))


@kernel
def is_half_space(table, shape):
    """Whether a shape is all that lies behind a plane."""
    return table.shape[shape].kind == HALF_SPACE


@kernel
def has_parts(table, shape):
    """Whether a shape is a mesh or a compound, whose triangles or parts are shapes by themselves."""
    return table.shape[shape].kind == MESH or table.shape[shape].kind == COMPOUND


@kernel
def half_space_plane(table, placed):
    """Outward unit normal of a half-space in world axes, and how far its plane is from its position along it [m]."""
    face = table.face[table.shape[placed[0]].first_face]
    return rotate(placed[2], to_vec3(face.normal)), face.offset * placed[1]
