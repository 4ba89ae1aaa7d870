"""How deep two overlapping hulls are in each other: the separating axis test over all faces and edge pairs.

The depth is the distance from the origin to the nearest face of the difference body B - A. Its faces are those of A,
those of B, and one for each pair of edges whose arcs cross on the sphere of normals
(D. Gregorius, The Separating Axis Test between Convex Polyhedra, Game Developers Conference 2013).
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
)

# Edges closer to parallel than this [sine of the angle] give no direction worth having; a face normal is as good.
_PARALLEL_EDGES = 1e-10

# An edge pair must beat the best face by this fraction of the sizes: ties go to faces, whose contact is a patch.
_FACE_FIRST = 1e-14


@kernel
def _into_frame(rows, start, end, matrix, factor, offset):
    """Rows ``start`` to ``end`` of a table turned by ``matrix``, stretched and shifted."""
    moved = np.empty((end - start, 3))
    for k in range(start, end):
        store_vec3(moved, k - start, add(offset, mat_vec(matrix, scale(load_vec3(rows, k), factor))))
    return moved


@kernel
def _best_face(normals, corners_of_faces, others):
    """The face from whose plane ``others`` stick out farthest, by their nearest point: (separation, face).

    ``corners_of_faces`` holds one corner of each face.
    """
    best, best_face = -math.inf, 0
    for f in range(len(normals)):
        n = load_vec3(normals, f)
        nearest = math.inf
        for v in range(len(others)):
            nearest = min(nearest, dot(n, load_vec3(others, v)))
        separation = nearest - dot(n, load_vec3(corners_of_faces, f))
        if separation > best:
            best, best_face = separation, f
    return best, best_face


@kernel
def _one_corner_each(table, shape, vertices):
    """One corner of each face of a shape, from its vertices in any frame."""
    first = table.face_start[shape]
    corners = np.empty((table.face_start[shape + 1] - first, 3))
    for f in range(len(corners)):
        store_vec3(corners, f, load_vec3(vertices, table.loop[table.loop_start[first + f]]))
    return corners


@kernel
def _best_edge_pair(edges_a, vertices_a, normals_a, edges_b, vertices_b, normals_b):
    """The deepest-lying crossing of edges: (separation, normal from a to b)."""
    best, best_normal = -math.inf, (0.0, 0.0, 0.0)
    along_face_b = np.empty(len(normals_b))
    for i in range(len(edges_a)):
        a = load_vec3(vertices_a, edges_a[i, 0])
        along_a = sub(load_vec3(vertices_a, edges_a[i, 1]), a)
        left_a, right_a = load_vec3(normals_a, edges_a[i, 2]), load_vec3(normals_a, edges_a[i, 3])
        for f in range(len(normals_b)):
            along_face_b[f] = dot(load_vec3(normals_b, f), along_a)
        for j in range(len(edges_b)):
            left_b, right_b = along_face_b[edges_b[j, 2]], along_face_b[edges_b[j, 3]]
            if left_b * right_b >= 0.0:
                continue
            b = load_vec3(vertices_b, edges_b[j, 0])
            along_b = sub(load_vec3(vertices_b, edges_b[j, 1]), b)
            on_left, on_right = dot(left_a, along_b), dot(right_a, along_b)
            # The arc of a's normals crosses the mirrored arc of b's, on the same side of the sphere.
            if on_left * on_right >= 0.0 or left_b * on_right >= 0.0:
                continue
            n = cross(along_a, along_b)
            length = norm(n)
            if length <= _PARALLEL_EDGES * norm(along_a) * norm(along_b):
                continue
            # Outwards from a: the sum of the edge's two face normals leans that way.
            n = scale(n, math.copysign(1.0 / length, dot(n, add(left_a, right_a))))
            # Nearly parallel edges leave n uncertain across them, not along: only the part of b - a across may count.
            apart = sub(b, a)
            separation = dot(n, axpy(apart, along_a, -dot(apart, along_a) / dot(along_a, along_a)))
            if separation > best:
                best, best_normal = separation, n
    return best, best_normal


@kernel
def hull_depth(table, shape_a, size_a, matrix_a, shape_b, size_b, matrix_b, offset):
    """Separation along the best axis and that axis, from a to b in world axes.

    Negative: the exact penetration depth (the shortest shift that parts them). Positive: a lower bound of the distance.
    """
    # All in the axes of a, about the centroid of a.
    columns = (
        mat_transposed_vec(matrix_a, (matrix_b[0], matrix_b[3], matrix_b[6])),
        mat_transposed_vec(matrix_a, (matrix_b[1], matrix_b[4], matrix_b[7])),
        mat_transposed_vec(matrix_a, (matrix_b[2], matrix_b[5], matrix_b[8])),
    )
    turn = (
        columns[0][0], columns[1][0], columns[2][0],
        columns[0][1], columns[1][1], columns[2][1],
        columns[0][2], columns[1][2], columns[2][2],
    )  # fmt: skip
    identity = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
    nowhere = (0.0, 0.0, 0.0)
    local_offset = mat_transposed_vec(matrix_a, offset)
    vs, fs = table.vertex_start, table.face_start
    vertices_a = _into_frame(table.vertex, vs[shape_a], vs[shape_a + 1], identity, size_a, nowhere)
    vertices_b = _into_frame(table.vertex, vs[shape_b], vs[shape_b + 1], turn, size_b, local_offset)
    normals_a = table.face_normal[fs[shape_a] : fs[shape_a + 1]]
    normals_b = _into_frame(table.face_normal, fs[shape_b], fs[shape_b + 1], turn, 1.0, nowhere)

    separation, face = _best_face(normals_a, _one_corner_each(table, shape_a, vertices_a), vertices_b)
    normal = load_vec3(normals_a, face)
    of_b, face = _best_face(normals_b, _one_corner_each(table, shape_b, vertices_b), vertices_a)
    if of_b > separation:
        separation, normal = of_b, scale(load_vec3(normals_b, face), -1.0)
    edges_a = table.edge[table.edge_start[shape_a] : table.edge_start[shape_a + 1]]
    edges_b = table.edge[table.edge_start[shape_b] : table.edge_start[shape_b + 1]]
    of_edges, edge_normal = _best_edge_pair(edges_a, vertices_a, normals_a, edges_b, vertices_b, normals_b)
    sizes = table.radius[shape_a] * size_a + table.radius[shape_b] * size_b
    if of_edges > separation + _FACE_FIRST * sizes:
        separation, normal = of_edges, edge_normal
    return separation, mat_vec(matrix_a, normal)
