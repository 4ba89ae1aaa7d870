"""Distance between two convex hulls: the algorithm of Gilbert, Johnson and Keerthi.

E. G. Gilbert, D. W. Johnson, S. S. Keerthi, IEEE Journal of Robotics and Automation 4 (1988) 193-203. The nearest
point of the simplex is the best over all of its corners, edges, triangles and its inside. That is Johnson's
fallback rather than his recursion: a few more flops, and no answer that lies outside the simplex, however thin it is.
"""

import math

import numpy as np

from particlesim.jit import kernel
from particlesim.vec import add, apply, apply_transposed, cross, dot, norm, put, row, scaled, sub

# The search ends when a corner of the difference body can be nearer than the simplex by no more than this fraction.
_GAP = 1e-15

# Hulls nearer than this fraction of their sizes count as touching here; the separating axis test takes over.
TOUCHING = 1e-10

# Every step shortens the distance, so hulls of MAX_MESH_VERTICES never come near this bound.
_MAX_STEPS = 256


@kernel
def support(vertices, size, matrix, direction):
    """The vertex of a hull farthest along ``direction``, relative to its centroid, in world axes.

    ``vertices`` (v, 3) are those of size 1 in body axes.
    """
    local = apply_transposed(matrix, direction)
    best = 0
    farthest = -math.inf
    for v in range(len(vertices)):
        reach = dot(row(vertices, v), local)
        if reach > farthest:
            farthest = reach
            best = v
    return apply(matrix, scaled(row(vertices, best), size))


@kernel
def _weigh_segment(a, b):
    """Weight of b in the point of the line ab nearest to the origin; negative if none is wanted."""
    e = sub(b, a)
    length2 = dot(e, e)
    return -dot(a, e) / length2 if length2 > 0.0 else -1.0


@kernel
def _weigh_triangle(a, b, c):
    """Weights of b and c in the point of the plane abc nearest to the origin."""
    e, f = sub(b, a), sub(c, a)
    n = cross(e, f)
    area2 = dot(n, n)
    if area2 <= 0.0:
        return -1.0, -1.0
    return dot(cross(f, a), n) / area2, dot(cross(a, e), n) / area2


@kernel
def _weigh_tetrahedron(a, b, c, d):
    """Weights of b, c and d that make the origin of a tetrahedron's corners."""
    e, f, g = sub(b, a), sub(c, a), sub(d, a)
    volume = dot(e, cross(f, g))
    if volume == 0.0:
        return -1.0, -1.0, -1.0
    return -dot(a, cross(f, g)) / volume, -dot(a, cross(g, e)) / volume, -dot(a, cross(e, f)) / volume


@kernel
def _try_part(corners, part, weights, nearest, best_weights, best):
    """Keep the point that ``weights`` make of the corners in ``part`` if it is nearer than the best so far."""
    x = y = z = 0.0
    for k in range(4):
        if weights[k] < 0.0:
            return best
        x += weights[k] * corners[part[k], 0]
        y += weights[k] * corners[part[k], 1]
        z += weights[k] * corners[part[k], 2]
    distance2 = x * x + y * y + z * z
    if distance2 < best:
        for k in range(4):
            best_weights[k] = 0.0
        for k in range(4):
            best_weights[part[k]] += weights[k]
        put(nearest, 0, (x, y, z))
        return distance2
    return best


@kernel
def _nearest_of_simplex(corners, count, best_weights, nearest):
    """Weights of the point of a simplex nearest to the origin; the point is written to ``nearest[0]``."""
    best = math.inf
    for i in range(count):
        best = _try_part(corners, (i, i, i, i), (1.0, 0.0, 0.0, 0.0), nearest, best_weights, best)
        for j in range(i + 1, count):
            t = _weigh_segment(row(corners, i), row(corners, j))
            best = _try_part(corners, (i, j, j, j), (1.0 - t, t, 0.0, 0.0), nearest, best_weights, best)
            for k in range(j + 1, count):
                t, u = _weigh_triangle(row(corners, i), row(corners, j), row(corners, k))
                best = _try_part(corners, (i, j, k, k), (1.0 - t - u, t, u, 0.0), nearest, best_weights, best)
    if count == 4:
        t, u, v = _weigh_tetrahedron(row(corners, 0), row(corners, 1), row(corners, 2), row(corners, 3))
        best = _try_part(corners, (0, 1, 2, 3), (1.0 - t - u - v, t, u, v), nearest, best_weights, best)
    return best


@kernel
def _drop_unused(corners, of_a, of_b, weights, count):
    """Move the corners that carry weight to the front; returns how many there are."""
    kept = 0
    for k in range(count):
        if weights[k] > 0.0:
            weights[kept] = weights[k]
            put(corners, kept, row(corners, k))
            put(of_a, kept, row(of_a, k))
            put(of_b, kept, row(of_b, k))
            kept += 1
    return kept


@kernel
def apart_along(vertices_a, size_a, matrix_a, vertices_b, size_b, matrix_b, offset, direction):
    """How far hull b, centred at ``offset`` from hull a, lies beyond it along ``direction``, times its length."""
    a = support(vertices_a, size_a, matrix_a, direction)
    b = add(offset, support(vertices_b, size_b, matrix_b, scaled(direction, -1.0)))
    return dot(direction, sub(b, a))


@kernel
def hull_distance(vertices_a, size_a, matrix_a, vertices_b, size_b, matrix_b, offset, touching, only_whether):
    """Distance of hull b, centred at ``offset`` from hull a, and the nearest points relative to a's centroid.

    Returns (distance, point of a, point of b); distance 0 means that they overlap or are nearer than ``touching``.
    With ``only_whether`` any positive number may stand for the distance of hulls that are apart: the first
    separating direction ends the search.
    """
    corners, of_a, of_b = np.empty((4, 3)), np.empty((4, 3)), np.empty((4, 3))
    weights = np.empty(4)
    nearest = np.empty((1, 3))

    v = offset if norm(offset) > 0.0 else (1.0, 0.0, 0.0)
    length2 = math.inf
    count = 0
    for _ in range(_MAX_STEPS):
        a = support(vertices_a, size_a, matrix_a, v)
        b = add(offset, support(vertices_b, size_b, matrix_b, scaled(v, -1.0)))
        w = sub(b, a)
        gain = dot(v, w)
        if only_whether and gain > touching * norm(v):
            return gain, a, b
        if count > 0 and length2 - gain <= _GAP * length2:
            break
        seen = False
        for k in range(count):
            seen = seen or (w[0] == corners[k, 0] and w[1] == corners[k, 1] and w[2] == corners[k, 2])
        if seen:
            break
        put(corners, count, w)
        put(of_a, count, a)
        put(of_b, count, b)
        count += 1
        shorter2 = _nearest_of_simplex(corners, count, weights, nearest)
        count = _drop_unused(corners, of_a, of_b, weights, count)
        stalled = shorter2 >= length2
        length2 = shorter2
        v = row(nearest, 0)
        if stalled or length2 <= touching * touching:
            break

    point_a = point_b = (0.0, 0.0, 0.0)
    for k in range(count):
        point_a = add(point_a, scaled(row(of_a, k), weights[k]))
        point_b = add(point_b, scaled(row(of_b, k), weights[k]))
    distance = math.sqrt(length2)
    return (distance if distance > touching else 0.0), point_a, point_b
