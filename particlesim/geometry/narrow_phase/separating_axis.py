"""How deep two overlapping cores are in each other: the separating axis test over all faces and edge pairs.

The depth is the distance from the origin to the nearest face of the difference body B - A. Its faces are those of A,
those of B, and one for each pair of edges whose arcs cross on the sphere of normals
(D. Gregorius, The Separating Axis Test between Convex Polyhedra, Game Developers Conference 2013).
A point has neither faces nor edges; a segment has one edge, whose arc of normals is a whole great circle.
"""

import math

import numpy as np

from particlesim.core.jit import kernel
from particlesim.core.math3d import (
    add,
    axpy,
    cross,
    dot,
    load_vec3,
    mat_transposed_vec,
    mat_vec,
    norm,
    scale,
    store_vec3,
    sub,
    to_vec3,
)
from particlesim.geometry.narrow_phase.expanding_polytope import expanded_depth
from particlesim.geometry.support import bounding_radius, farthest_row, has_faces, vertex_position
from particlesim.geometry.tolerances import FACE_FIRST, JOINED, MANY_EDGE_PAIRS, PARALLEL_EDGES

_NOWHERE = (0.0, 0.0, 0.0)
_IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


@kernel
def _relative_rotation(matrix_a, matrix_b):
    """The rotation from b's body axes to a's, nine numbers by rows."""
    x = mat_transposed_vec(matrix_a, (matrix_b[0], matrix_b[3], matrix_b[6]))
    y = mat_transposed_vec(matrix_a, (matrix_b[1], matrix_b[4], matrix_b[7]))
    z = mat_transposed_vec(matrix_a, (matrix_b[2], matrix_b[5], matrix_b[8]))
    return x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2]


@kernel
def _vertices_at(table, body, offset):
    """Vertices of a turned core whose centroid is at ``offset``, (v, 3)."""
    record = table.shape[body[0]]
    moved = np.empty((record.last_vertex - record.first_vertex, 3))
    for k in range(len(moved)):
        store_vec3(moved, k, add(offset, vertex_position(table, body, record.first_vertex + k)))
    return moved


@kernel
def _normals_at(table, body):
    """Face normals of a turned core, (f, 3)."""
    record = table.shape[body[0]]
    turned = np.empty((record.last_face - record.first_face, 3))
    for k in range(len(turned)):
        store_vec3(turned, k, mat_vec(body[2], to_vec3(table.face[record.first_face + k].normal)))
    return turned


@kernel
def _best_face(table, shape, vertices, normals, others, touching):
    """The face of a core from whose plane ``others`` stick out farthest, by their nearest point: (separation, normal).

    ``vertices`` and ``normals`` are those of the core in the same frame as ``others``. Of no faces: minus infinity.
    The normal is the sum of those of all faces whose planes ``others`` reach within ``touching``, if any: where edges
    or corners touch, each is as good as another.
    """
    record = table.shape[shape]
    best, best_normal = -math.inf, _NOWHERE
    for f in range(len(normals)):
        n = load_vec3(normals, f)
        corner = table.loop[table.face[record.first_face + f].first] - record.first_vertex
        nearest = farthest_row(others, 0, len(others), scale(n, -1.0))
        separation = dot(n, load_vec3(others, nearest)) - dot(n, load_vec3(vertices, corner))
        if max(abs(separation), abs(best)) <= touching:
            best, best_normal = max(separation, best), add(best_normal, n)
        elif separation > best:
            best, best_normal = separation, n
    return best, best_normal


@kernel
def _joint_normal(u, v):
    """The unit vector along u - v, or along ``u`` if ``v`` is parallel to it: faces lie on each other.

    A unit vector stays what it is to the last bit.
    """
    if norm(cross(u, v)) > PARALLEL_EDGES * norm(u) * norm(v):
        u = sub(u, v)
    length = norm(u)
    return u if abs(length - 1.0) < 1e-15 else scale(u, 1.0 / length)


@kernel
def _edge_axis(a, along_a, outwards, b, along_b):
    """Separation of two edges along the direction across both, and that direction, on the side of ``outwards``.

    ``a`` and ``b`` are points of the edges. Minus infinity if the edges are parallel.
    """
    n = cross(along_a, along_b)
    length = norm(n)
    if length <= PARALLEL_EDGES * norm(along_a) * norm(along_b):
        return -math.inf, n
    n = scale(n, math.copysign(1.0 / length, dot(n, outwards)))
    # Nearly parallel edges leave n uncertain across them, not along: only the part of b - a across may count.
    apart = sub(b, a)
    return dot(n, axpy(apart, along_a, -dot(apart, along_a) / dot(along_a, along_a))), n


@kernel
def _edge(edges, e, vertices, first_vertex):
    """An end of edge ``e`` and the vector to its other end."""
    start = load_vec3(vertices, edges[e, 0] - first_vertex)
    return start, sub(load_vec3(vertices, edges[e, 1] - first_vertex), start)


@kernel
def _best_edge_pair(table, shape_a, shape_b, vertices_a, normals_a, vertices_b, normals_b):
    """The deepest-lying crossing of edges of polyhedra: (separation, normal from a to b)."""
    a, b, edges = table.shape[shape_a], table.shape[shape_b], table.edge
    best, best_normal = -math.inf, _NOWHERE
    along_face_b = np.empty(len(normals_b))
    for i in range(a.first_edge, a.last_edge):
        start_a, along_a = _edge(edges, i, vertices_a, a.first_vertex)
        left_a = load_vec3(normals_a, edges[i, 2] - a.first_face)
        right_a = load_vec3(normals_a, edges[i, 3] - a.first_face)
        for f in range(len(normals_b)):
            along_face_b[f] = dot(load_vec3(normals_b, f), along_a)
        for j in range(b.first_edge, b.last_edge):
            left_b, right_b = along_face_b[edges[j, 2] - b.first_face], along_face_b[edges[j, 3] - b.first_face]
            if left_b * right_b >= 0.0:
                continue
            start_b, along_b = _edge(edges, j, vertices_b, b.first_vertex)
            on_left, on_right = dot(left_a, along_b), dot(right_a, along_b)
            # The arc of a's normals crosses the mirrored arc of b's, on the same side of the sphere.
            if on_left * on_right >= 0.0 or left_b * on_right >= 0.0:
                continue
            # Outwards from a: the sum of the edge's two face normals leans that way.
            separation, n = _edge_axis(start_a, along_a, add(left_a, right_a), start_b, along_b)
            if separation > best:
                best, best_normal = separation, n
    return best, best_normal


@kernel
def _best_edge_of_segment(table, shape, vertices, normals, segment):
    """The deepest-lying crossing of a polyhedron's edges and a segment (2, 3): (separation, normal to the segment)."""
    record, edges = table.shape[shape], table.edge
    start = load_vec3(segment, 0)
    along = sub(load_vec3(segment, 1), start)
    best, best_normal = -math.inf, _NOWHERE
    for e in range(record.first_edge, record.last_edge):
        left = load_vec3(normals, edges[e, 2] - record.first_face)
        right = load_vec3(normals, edges[e, 3] - record.first_face)
        # The arc of the edge's normals crosses the great circle of directions across the segment.
        if dot(left, along) * dot(right, along) >= 0.0:
            continue
        start_a, along_a = _edge(edges, e, vertices, record.first_vertex)
        separation, n = _edge_axis(start_a, along_a, add(left, right), start, along)
        if separation > best:
            best, best_normal = separation, n
    return best, best_normal


@kernel
def _polyhedron_depth(table, a, b, offset):
    """As core_depth, for a polyhedron a and any core b."""
    # All in the body axes of a, from the centroid of a.
    turned_a = a[0], a[1], _IDENTITY
    turned_b = b[0], b[1], _relative_rotation(a[2], b[2])
    vertices_a, normals_a = _vertices_at(table, turned_a, _NOWHERE), _normals_at(table, turned_a)
    vertices_b, normals_b = (
        _vertices_at(table, turned_b, mat_transposed_vec(a[2], offset)),
        _normals_at(table, turned_b),
    )
    sizes = bounding_radius(table, a) + bounding_radius(table, b)
    separation, normal = _best_face(table, a[0], vertices_a, normals_a, vertices_b, JOINED * sizes)
    of_b, normal_b = _best_face(table, b[0], vertices_b, normals_b, vertices_a, JOINED * sizes)
    better, other = (normal, normal_b) if separation >= of_b else (scale(normal_b, -1.0), scale(normal, -1.0))
    if max(abs(separation), abs(of_b)) > JOINED * sizes:
        other = _NOWHERE
    separation, normal = max(separation, of_b), _joint_normal(better, other)
    of_edges, edge_normal = -math.inf, normal
    if len(vertices_b) == 2:
        of_edges, edge_normal = _best_edge_of_segment(table, a[0], vertices_a, normals_a, vertices_b)
    else:
        of_edges, edge_normal = _best_edge_pair(table, a[0], b[0], vertices_a, normals_a, vertices_b, normals_b)
    if of_edges > separation + FACE_FIRST * sizes:
        separation, normal = of_edges, edge_normal
    return separation, mat_vec(a[2], normal)


@kernel
def _direction_of(table, body):
    """The vector along a turned segment; of a point, nothing."""
    record = table.shape[body[0]]
    start, end = record.first_vertex, record.last_vertex - 1
    return sub(vertex_position(table, body, end), vertex_position(table, body, start))


@kernel
def _across(v):
    """A vector across ``v``, +x if that is nothing: the axis that v is least along, and v, span a plane; across it."""
    x, y, z = abs(v[0]), abs(v[1]), abs(v[2])
    if x + y + z == 0.0:
        return 1.0, 0.0, 0.0
    if x <= y and x <= z:
        return 0.0, v[2], -v[1]
    return (-v[2], 0.0, v[0]) if y <= z else (v[1], -v[0], 0.0)


@kernel
def _thin_depth(table, a, b, offset):
    """As core_depth, for points and segments that touch: along any direction across both they are as good as apart."""
    u, v = _direction_of(table, a), _direction_of(table, b)
    longer = u if dot(u, u) >= dot(v, v) else v
    n = cross(u, v)
    if norm(n) <= PARALLEL_EDGES * norm(u) * norm(v):
        n = _across(longer)
    else:
        # Of nearly parallel segments n is uncertain: across the longer it is across both.
        n = axpy(n, longer, -dot(n, longer) / dot(longer, longer))
    n = scale(n, 1.0 / norm(n))
    separation = dot(n, offset)
    return abs(separation), scale(n, -1.0 if separation < 0.0 else 1.0)


@kernel
def core_depth(table, a, b, offset):
    """Separation of two cores along the best axis, and that axis, from a to b in world axes.

    ``a`` and ``b`` are turned shapes (see geometry/support.py), b at ``offset`` from a.
    Negative: the exact penetration depth, the shortest shift that parts the cores. Positive: a lower bound of the
    distance.
    """
    shape_a, shape_b = table.shape[a[0]], table.shape[b[0]]
    # About: with a point each edge is a pair as well.
    edge_pairs = (shape_a.last_edge - shape_a.first_edge + 1) * (shape_b.last_edge - shape_b.first_edge + 1)
    if edge_pairs >= MANY_EDGE_PAIRS:
        separation, normal, proven = expanded_depth(table, a, b, offset)
        if proven:
            return separation, normal
    if has_faces(table, a[0]):
        return _polyhedron_depth(table, a, b, offset)
    if has_faces(table, b[0]):
        separation, normal = _polyhedron_depth(table, b, a, scale(offset, -1.0))
        return separation, scale(normal, -1.0)
    return _thin_depth(table, a, b, offset)
