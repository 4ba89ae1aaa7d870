"""Distance between two convex cores: the algorithm of Gilbert, Johnson and Keerthi.

E. G. Gilbert, D. W. Johnson, S. S. Keerthi, IEEE Journal of Robotics and Automation 4 (1988) 193-203. It walks a
simplex of up to four vertices of the difference body B - A towards the origin. The nearest point of the simplex is
the best over all of its parts that hold the newest vertex: a few more flops than Johnson's recursion, and no answer
that lies outside the simplex, however thin it is. The vector to that point is made perpendicular to its part by
construction, not by subtraction of nearly equal points: cores that all but touch keep their distance and normal.
"""

import math

from particlesim.core.jit import kernel
from particlesim.core.math3d import add, axpy, cross, dot, mat_transposed_vec, norm, scale, sub
from particlesim.geometry.support import support_vertex, vertex_position
from particlesim.geometry.tolerances import GJK_GAP, GJK_MAX_IDLE, GJK_MAX_STEPS, GJK_ROUNDING

_ORIGIN = (0.0, 0.0, 0.0)

# A simplex without vertices: how many there are, and the vertices of either core that they are differences of.
NO_SIMPLEX = (0, (-1, -1, -1, -1), (-1, -1, -1, -1))


@kernel
def _support(table, body, direction):
    """The number of the vertex of a turned core farthest along ``direction``, which is in world axes."""
    return support_vertex(table, body[0], mat_transposed_vec(body[2], direction))


@kernel
def _nearest_on_segment(p, a):
    """Weight of a, and the nearest point to the origin of the line pa; the weight is negative if there is none."""
    e = sub(a, p)
    length2 = dot(e, e)
    if length2 <= 0.0:
        return -1.0, _ORIGIN
    return -dot(p, e) / length2, scale(cross(e, cross(p, e)), 1.0 / length2)


@kernel
def _nearest_on_triangle(p, a, b):
    """Weights of a and b, and the nearest point to the origin of the plane pab; negative weights if there is none."""
    e, f = sub(a, p), sub(b, p)
    n = cross(e, f)
    area2 = dot(n, n)
    if area2 <= 0.0:
        return -1.0, -1.0, _ORIGIN
    # The normal of a sliver is uncertain across it, where it is narrow: only that part of p may meet the error.
    longer = e if dot(e, e) > dot(f, f) else f
    across = axpy(p, longer, -dot(p, longer) / dot(longer, longer))
    return dot(cross(f, p), n) / area2, dot(cross(p, e), n) / area2, scale(n, dot(across, n) / area2)


@kernel
def _weigh_tetrahedron(p, a, b, c):
    """Weights of a, b and c that make the origin of a tetrahedron's corners; negative if it is flat."""
    e, f, g = sub(a, p), sub(b, p), sub(c, p)
    volume = dot(e, cross(f, g))
    if volume == 0.0:
        return -1.0, -1.0, -1.0
    return -dot(p, cross(f, g)) / volume, -dot(p, cross(g, e)) / volume, -dot(p, cross(e, f)) / volume


@kernel
def _nearest_of_simplex(simplex, newest):
    """The nearest point to the origin of the parts of a simplex that hold vertex ``newest``, its last.

    Returns (squared distance, nearest point, number of corners of its part, which corners, their weights).
    """
    p = simplex[newest]
    best, nearest, count, part, weights = dot(p, p), p, 1, (newest, 0, 0, 0), (1.0, 0.0, 0.0, 0.0)
    for i in range(newest):
        t, v = _nearest_on_segment(p, simplex[i])
        if 0.0 <= t <= 1.0 and dot(v, v) < best:
            best, nearest, count = dot(v, v), v, 2
            part, weights = (newest, i, 0, 0), (1.0 - t, t, 0.0, 0.0)
        for j in range(i + 1, newest):
            t, u, v = _nearest_on_triangle(p, simplex[i], simplex[j])
            if t >= 0.0 and u >= 0.0 and t + u <= 1.0 and dot(v, v) < best:
                best, nearest, count = dot(v, v), v, 3
                part, weights = (newest, i, j, 0), (1.0 - t - u, t, u, 0.0)
    if newest == 3:
        t, u, s = _weigh_tetrahedron(p, simplex[0], simplex[1], simplex[2])
        if t >= 0.0 and u >= 0.0 and s >= 0.0 and t + u + s <= 1.0:
            best, nearest, count = 0.0, _ORIGIN, 4
            part, weights = (newest, 0, 1, 2), (1.0 - t - u - s, t, u, s)
    return best, nearest, count, part, weights


@kernel
def _chosen(four, part):
    """Four things in the order of the numbers in ``part``."""
    return four[part[0]], four[part[1]], four[part[2]], four[part[3]]


@kernel
def _replaced(four, k, new):
    """Four things of which number ``k`` is new."""
    return (
        new if k == 0 else four[0],
        new if k == 1 else four[1],
        new if k == 2 else four[2],
        new if k == 3 else four[3],
    )


@kernel
def _holds(picks_a, picks_b, count, a, b):
    """Whether the first ``count`` vertices of a simplex hold the difference of vertices a and b."""
    found = False
    for k in range(count):
        found = found or (picks_a[k] == a and picks_b[k] == b)
    return found


@kernel
def _weighted(table, body, picks, weights, count):
    """The point that ``weights`` make of ``count`` vertices of a turned core, from its centroid."""
    point = _ORIGIN
    for k in range(count):
        point = axpy(point, vertex_position(table, body, picks[k]), weights[k])
    return point


@kernel
def core_distance(table, a, b, offset, touching, only_whether, known):
    """Distance of core b, centred at ``offset`` from core a, and the nearest points from a's centroid.

    Returns (distance, direction from a to b, point of a, point of b, corners). The direction, of any length, is the one
    along which they are proven to be that far apart: near contact it is more certain than the difference of the points.
    ``a`` and ``b`` are turned shapes (see geometry/support.py). The search begins with the simplex ``known`` and
    returns its last one: that of the same two shapes when they were a little elsewhere saves most of the search.
    The distance is 0 if the cores overlap, are nearer than ``touching`` [m], or if rounding ended the search farther
    than that from a proof of the distance. With ``only_whether`` any number above ``touching`` may stand for the
    distance of cores that are apart: the first separating direction ends the search.
    """
    simplex = (_ORIGIN, _ORIGIN, _ORIGIN, _ORIGIN)
    picks_a = picks_b = (-1, -1, -1, -1)
    weights = (1.0, 0.0, 0.0, 0.0)
    v = offset if norm(offset) > 0.0 else (1.0, 0.0, 0.0)
    apart = v
    length, at_least = math.inf, -math.inf
    count = idle = 0
    for step in range(GJK_MAX_STEPS):
        searched = step >= known[0]
        pick_a = _support(table, a, v) if searched else known[1][step]
        pick_b = _support(table, b, scale(v, -1.0)) if searched else known[2][step]
        w = sub(add(offset, vertex_position(table, b, pick_b)), vertex_position(table, a, pick_a))
        if searched:
            bound = dot(v, w) / norm(v)
            if bound > at_least:
                at_least, apart = bound, v
            if only_whether and at_least > touching:
                return at_least, v, _ORIGIN, _ORIGIN, NO_SIMPLEX
            if count > 0 and length - at_least <= GJK_GAP * length:
                break
            if _holds(picks_a, picks_b, count, pick_a, pick_b):
                break
        simplex = _replaced(simplex, count, w)
        picks_a, picks_b = _replaced(picks_a, count, pick_a), _replaced(picks_b, count, pick_b)
        shorter2, nearest, found, part, of_part = _nearest_of_simplex(simplex, count)
        shorter = math.sqrt(shorter2)
        if not searched and shorter >= length:
            continue
        idle += shorter >= length
        if shorter > length + touching + GJK_ROUNDING * length or idle > GJK_MAX_IDLE:
            break
        simplex, picks_a, picks_b = _chosen(simplex, part), _chosen(picks_a, part), _chosen(picks_b, part)
        length, v, count, weights = shorter, nearest, found, of_part
        if length <= touching:
            break
    if only_whether or length <= touching or length - at_least > touching + GJK_ROUNDING * length:
        length = 0.0
    point_a = _weighted(table, a, picks_a, weights, count)
    point_b = add(offset, _weighted(table, b, picks_b, weights, count))
    return length, apart, point_a, point_b, (count, picks_a, picks_b)
