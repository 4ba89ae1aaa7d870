"""Where two shapes touch: the patch, segment or point that the facing features of their cores share."""

import math

import numpy as np

from particlesim.core.constants import MAX_MANIFOLD
from particlesim.core.jit import kernel
from particlesim.core.math3d import (
    add,
    axpy,
    cross,
    dot,
    load_vec3,
    mat_transposed_vec,
    norm,
    scale,
    store_vec3,
    sub,
    to_vec3,
)
from particlesim.geometry.shape_links import ring_of
from particlesim.geometry.support import core_of, rounding_of, support_vertex, turned, vertex_position
from particlesim.geometry.tolerances import MAX_FACE_CORNERS, ON_EDGE, PARALLEL_TOLERANCE

# A polygon clipped by a polygon has at most the corners of both.
MAX_CORNERS = 2 * MAX_FACE_CORNERS


@kernel
def _flattest_edge(table, shape, vertex, direction, tilt):
    """The other end of the edge at ``vertex`` that runs across ``direction``, within ``tilt``; -1 if none."""
    start, other, least = load_vec3(table.vertex, vertex), -1, tilt
    first, last = ring_of(table.link, core_of(table.shape[shape]), vertex)
    for k in range(first, last):
        span = sub(load_vec3(table.vertex, table.link[k]), start)
        slope = abs(dot(span, direction)) / norm(span)
        if slope < least:
            other, least = table.link[k], slope
    return other


@kernel
def _facing_face(table, shape, direction, tilt):
    """The face whose normal is nearest to ``direction`` in body axes, within ``tilt``, and its slope; -1 if none."""
    faces, record = table.face, table.shape[shape]
    face, least = -1, tilt
    for f in range(record.first_face, record.last_face):
        n = to_vec3(faces[f].normal)
        if dot(n, direction) > 0.0:
            slope = norm(cross(n, direction))
            if slope < least:
                face, least = f, slope
    return face, least


@kernel
def support_feature(table, body, offset, direction, tilt, feature):
    """Write the face, edge or vertex of a turned core at ``offset`` that faces ``direction``.

    Faces and edges may be inclined by ``tilt`` [sine of the angle]. ``feature`` is (MAX_CORNERS, 3); of a face of more
    than MAX_FACE_CORNERS it has so many, evenly spread. Returns how many corners there are, and how much a face is
    inclined; inf if it is none.
    """
    shape = body[0]
    local = mat_transposed_vec(body[2], direction)
    face, slope = _facing_face(table, shape, local, tilt)
    # The sides of a flat prism have no area: they are edges.
    if face >= 0 and table.face[face].last - table.face[face].first > 2:
        first, corners = table.face[face].first, table.face[face].last - table.face[face].first
        count = min(corners, MAX_FACE_CORNERS)
        for k in range(count):
            corner = table.loop[first + k * corners // count]
            store_vec3(feature, k, add(offset, vertex_position(table, body, corner)))
        return count, slope
    vertex = support_vertex(table, shape, local)
    store_vec3(feature, 0, add(offset, vertex_position(table, body, vertex)))
    other = _flattest_edge(table, shape, vertex, local, tilt)
    if other < 0:
        return 1, math.inf
    store_vec3(feature, 1, add(offset, vertex_position(table, body, other)))
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
        count = _clip(incident, count, side, dot(side, p) + ON_EDGE * dot(edge, edge) + margin * norm(side), spare)
        for m in range(count):
            store_vec3(incident, m, load_vec3(spare, m))
    return count


@kernel
def _across(v, normal):
    """The part of a vector across a unit normal."""
    return axpy(v, normal, -dot(v, normal))


@kernel
def _shared_by_edges(edge_a, edge_b, normal, rounding, margin, points, gaps):
    """Points of edge a that two edges facing each other share, seen along the normal, and the gaps there.

    Those are the ends of what they share if they are parallel, else their crossing, or the ends of what runs within
    ``margin`` of it [m]. ``rounding`` is how much nearer the surfaces are than the edges [m]. Returns how many.
    """
    a, b = load_vec3(edge_a, 0), load_vec3(edge_b, 0)
    u, v, apart = sub(load_vec3(edge_a, 1), a), sub(load_vec3(edge_b, 1), b), sub(b, a)
    # What lies along the normal must not count: times the inverse of a small angle between the edges it is anything.
    flat_u, flat_v = _across(u, normal), _across(v, normal)
    t0, t1 = dot(apart, flat_u) / dot(flat_u, flat_u), dot(add(apart, v), flat_u) / dot(flat_u, flat_u)
    start, end = max(min(t0, t1, 1.0), 0.0), min(max(t0, t1, 0.0), 1.0)
    sine = dot(cross(flat_u, flat_v), normal)
    if abs(sine) > PARALLEL_TOLERANCE * norm(flat_u) * norm(flat_v):
        crossing = min(max(dot(cross(apart, flat_v), normal) / sine, start), end)
        near = margin * norm(flat_v) / abs(sine)
        start, end = max(start, crossing - near), min(end, crossing + near)
    count = 2 if end > start else 1
    for k in range(count):
        of_a = axpy(a, u, start if k == 0 else end)
        along_b = dot(sub(of_a, b), flat_v) / dot(flat_v, flat_v)
        store_vec3(points, k, of_a)
        gaps[k] = dot(normal, sub(axpy(b, v, min(max(along_b, 0.0), 1.0)), of_a)) - rounding
    return count


@kernel
def _distance_to_face(face, corners, direction, point):
    """How far a point is along ``direction`` from the plane of a face, not parallel to it, and the cosine between."""
    start = load_vec3(face, 0)
    n = cross(sub(load_vec3(face, corners // 3), start), sub(load_vec3(face, 2 * corners // 3), start))
    return dot(n, sub(start, point)) / dot(n, direction), abs(dot(n, direction)) / norm(n)


@kernel
def contact_manifold(table, a, b, contact, limits, points, gaps):
    """Write the contact points of two placed shapes, half way between them, from a's centroid; returns how many.

    Parameters
    ----------
    table : ShapeTable
    a, b : (row of the shape table, size, orientation)
    contact : (offset of b from a [m], normal from a to b, separation [m], half way between the nearest points [m])
    limits : (tilt, margin)
        Faces and edges inclined by less than ``tilt`` [sine of the angle] touch along a patch, which may stand out by
        ``margin`` [m] over their borders.
    points : (MAX_MANIFOLD, 3) float64, written [m]
    gaps : (MAX_MANIFOLD,) float64, written: how far apart the shapes are at each of the points [m]
    """
    offset, normal, separation, middle = contact
    tilt, margin = limits
    rounding_a, rounding_b = rounding_of(table, a), rounding_of(table, b)
    of_a, of_b = np.empty((MAX_CORNERS, 3)), np.empty((MAX_CORNERS, 3))
    spare = np.empty((MAX_CORNERS, 3))
    back = scale(normal, -1.0)
    count_a, slope_a = support_feature(table, turned(a), (0.0, 0.0, 0.0), normal, tilt, of_a)
    count_b, slope_b = support_feature(table, turned(b), offset, back, tilt, of_b)
    # Of two faces that are inclined the corners of one are looked at over the one that the normal belongs to.
    face_b = slope_b < slope_a - PARALLEL_TOLERANCE
    face_a = slope_a < math.inf and not face_b
    patch, shift, side = of_a, rounding_a, 1.0
    if count_a == 1:
        count = 1
    elif count_b == 1:
        patch, shift, side, count = of_b, -rounding_b, -1.0, 1
    elif face_a:
        patch, shift, side = of_b, -rounding_b, -1.0
        count = _clip_to_face(of_a, count_a, normal, margin, of_b, count_b, spare)
    elif face_b:
        count = _clip_to_face(of_b, count_b, back, margin, of_a, count_a, spare)
    else:
        patch = spare
        count = _shared_by_edges(of_a, of_b, normal, rounding_a + rounding_b, margin, spare, gaps)
    if count == 0:
        store_vec3(points, 0, middle)
        gaps[0] = separation
        return 1
    kept = min(count, MAX_MANIFOLD)
    for k in range(kept):
        corner = load_vec3(patch, k * count // kept)
        if count_a == 1 or count_b == 1:
            gaps[k] = separation
        elif face_a or face_b:
            face, corners = (of_a, count_a) if face_a else (of_b, count_b)
            way, cosine = _distance_to_face(face, corners, normal, corner)
            gaps[k] = side * way - (rounding_a + rounding_b) / cosine
        store_vec3(points, k, axpy(corner, normal, shift + side * 0.5 * gaps[k]))
    return kept
