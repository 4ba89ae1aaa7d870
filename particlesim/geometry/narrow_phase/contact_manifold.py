"""Where two hulls touch: the patch, segment or point that their facing features share."""

import math

import numpy as np

from particlesim.core.constants import MAX_MANIFOLD, PARALLEL_TOLERANCE
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
from particlesim.geometry.shapes import MAX_MESH_VERTICES

# A polygon clipped by a polygon has at most the corners of both.
MAX_CORNERS = 2 * MAX_MESH_VERTICES

# Corners this far outside a face, as a fraction of its size, still lie on it: rounding, and edges that coincide.
_ON_EDGE = 1e-9


@kernel
def _flattest_edge(edge, first, last, vertices, corner, direction, tilt):
    """The other end of the edge at ``corner`` that runs across ``direction``, within ``tilt``; -1 if none."""
    other, least = -1, tilt
    for e in range(first, last):
        if edge[e, 0] == corner or edge[e, 1] == corner:
            end = edge[e, 0] + edge[e, 1] - corner
            span = sub(load_vec3(vertices, end), load_vec3(vertices, corner))
            slope = abs(dot(span, direction)) / norm(span)
            if slope < least:
                other, least = end, slope
    return other


@kernel
def facing_feature(table, shape, size, matrix, offset, direction, tilt, feature):
    """Write the face, edge or vertex of a hull that faces ``direction``.

    Faces and edges may be inclined by ``tilt`` [sine of the angle]. ``feature`` is (MAX_CORNERS, 3); ``offset`` is
    the hull's centroid. Returns how many corners there are, and how much a face is inclined; inf if it is none.
    """
    local = mat_transposed_vec(matrix, direction)
    # Taken out of their struct once: each access counts references, which costs more than the arithmetic.
    face_normal, loop, loop_start = table.face_normal, table.loop, table.loop_start
    vertices = table.vertex[table.vertex_start[shape] : table.vertex_start[shape + 1]]
    face, least = -1, tilt
    for f in range(table.face_start[shape], table.face_start[shape + 1]):
        n = load_vec3(face_normal, f)
        if dot(n, local) > 0.0:
            slope = norm(cross(n, local))
            if slope < least:
                face, least = f, slope
    if face >= 0:
        first, last = loop_start[face], loop_start[face + 1]
        for k in range(first, last):
            store_vec3(feature, k - first, add(offset, mat_vec(matrix, scale(load_vec3(vertices, loop[k]), size))))
        return last - first, least
    best, reach = 0, -math.inf
    for v in range(len(vertices)):
        r = dot(load_vec3(vertices, v), local)
        if r > reach:
            best, reach = v, r
    store_vec3(feature, 0, add(offset, mat_vec(matrix, scale(load_vec3(vertices, best), size))))
    other = _flattest_edge(
        table.edge, table.edge_start[shape], table.edge_start[shape + 1], vertices, best, local, tilt
    )
    if other < 0:
        return 1, math.inf
    store_vec3(feature, 1, add(offset, mat_vec(matrix, scale(load_vec3(vertices, other), size))))
    return 2, math.inf


@kernel
def _clip(polygon, count, side, bound, clipped):
    """The part of a polygon (or segment) where side . x <= bound (Sutherland and Hodgman, CACM 17 (1974) 32-42)."""
    kept = 0
    for k in range(count):
        p, q = load_vec3(polygon, k), load_vec3(polygon, (k + 1) % count)
        over_p, over_q = dot(side, p) - bound, dot(side, q) - bound
        if over_p <= 0.0:
            store_vec3(clipped, kept, p)
            kept += 1
        # A segment is not a closed loop: its way back would repeat the crossing.
        if over_p * over_q < 0.0 and (count > 2 or k == 0):
            store_vec3(clipped, kept, axpy(p, sub(q, p), over_p / (over_p - over_q)))
            kept += 1
    return kept


@kernel
def _clip_to_face(face, corners, normal, margin, incident, count, spare):
    """Clip ``incident`` in place to the prism over a face, wider by ``margin``, whose outward normal is given.

    Returns how many corners it has then.
    """
    for k in range(corners):
        p = load_vec3(face, k)
        edge = sub(load_vec3(face, (k + 1) % corners), p)
        side = cross(edge, normal)
        count = _clip(incident, count, side, dot(side, p) + _ON_EDGE * dot(edge, edge) + margin * norm(side), spare)
        for m in range(count):
            store_vec3(incident, m, load_vec3(spare, m))
    return count


@kernel
def _shared_by_edges(edge_a, edge_b, normal, separation, margin, points, gaps):
    """Points of edge a that two edges facing each other share, and the gaps there; returns how many.

    Those are a segment's two ends if they are parallel, else their crossing, or the ends of what runs within
    ``margin`` of it [m].
    """
    a, b = load_vec3(edge_a, 0), load_vec3(edge_b, 0)
    u, v = sub(load_vec3(edge_a, 1), a), sub(load_vec3(edge_b, 1), b)
    length_u, length_v = norm(u), norm(v)
    t0, t1 = dot(sub(b, a), u) / length_u**2, dot(sub(load_vec3(edge_b, 1), a), u) / length_u**2
    start, end = max(min(t0, t1), 0.0), min(max(t0, t1), 1.0)
    gaps[0] = gaps[1] = separation
    n = cross(u, v)
    if norm(n) > PARALLEL_TOLERANCE * length_u * length_v:
        t = dot(cross(sub(b, a), v), n) / dot(n, n)
        store_vec3(points, 0, axpy(a, u, min(max(t, 0.0), 1.0)))
        near = margin * length_v / norm(n)
        start, end = max(start, t - near), min(end, t + near)
        if margin == 0.0 or end <= start:
            return 1
        for k in range(2):
            t = start if k == 0 else end
            of_a, of_b = axpy(a, u, t), axpy(b, v, (t - t0) / (t1 - t0))
            store_vec3(points, k, of_a)
            gaps[k] = dot(normal, sub(of_b, of_a))
        return 2
    store_vec3(points, 0, axpy(a, u, start))
    if end <= start:
        return 1
    store_vec3(points, 1, axpy(a, u, end))
    return 2


@kernel
def _way_to_face(face, corners, direction, point):
    """How far it is from a point along ``direction`` to the plane of a face, which must not be parallel to it."""
    start = load_vec3(face, 0)
    n = cross(sub(load_vec3(face, corners // 3), start), sub(load_vec3(face, 2 * corners // 3), start))
    return dot(n, sub(start, point)) / dot(n, direction)


@kernel
def hull_patch(
    table, shape_a, size_a, matrix_a, shape_b, size_b, matrix_b, offset, normal, separation, middle, tilt, margin,
    points, gaps,
):  # fmt: skip
    """Write the contact points of two hulls, half way between them, relative to a's centroid; returns how many.

    ``normal`` points from a to b. Faces and edges inclined by less than ``tilt`` [sine of the angle] touch along a
    patch, which may stand out by ``margin`` [m] over their borders; ``middle`` stands in where such features share no
    point. ``points`` is (MAX_MANIFOLD, 3), ``gaps`` how far apart the hulls are at each of them.
    """
    of_a, of_b = np.empty((MAX_CORNERS, 3)), np.empty((MAX_CORNERS, 3))
    spare = np.empty((MAX_CORNERS, 3))
    back = scale(normal, -1.0)
    count_a, slope_a = facing_feature(table, shape_a, size_a, matrix_a, (0.0, 0.0, 0.0), normal, tilt, of_a)
    count_b, slope_b = facing_feature(table, shape_b, size_b, matrix_b, offset, back, tilt, of_b)
    # Of two faces that are inclined the corners of one are looked at over the one that the normal belongs to.
    face_b = slope_b < slope_a - PARALLEL_TOLERANCE
    face_a = slope_a < math.inf and not face_b
    patch, shift = of_a, 0.5 * separation
    if count_a == 1:
        count = 1
    elif count_b == 1:
        patch, shift, count = of_b, -0.5 * separation, 1
    elif face_a:
        patch, shift = of_b, -0.5 * separation
        count = _clip_to_face(of_a, count_a, normal, margin, of_b, count_b, spare)
    elif face_b:
        count = _clip_to_face(of_b, count_b, back, margin, of_a, count_a, spare)
    else:
        patch = spare
        count = _shared_by_edges(of_a, of_b, normal, separation, margin, spare, gaps)
    if count == 0:
        store_vec3(points, 0, middle)
        gaps[0] = separation
        return 1
    kept = min(count, MAX_MANIFOLD)
    for k in range(kept):
        corner = load_vec3(patch, k * count // kept)
        store_vec3(points, k, axpy(corner, normal, shift))
        if count_a == 1 or count_b == 1:
            gaps[k] = separation
        elif face_a:
            gaps[k] = -_way_to_face(of_a, count_a, normal, corner)
        elif face_b:
            gaps[k] = _way_to_face(of_b, count_b, normal, corner)
    return kept
