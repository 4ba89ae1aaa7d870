"""Any bounded shape against a half-space."""

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
    mat_vec,
    scale,
    store_vec3,
    sub,
)
from particlesim.geometry.narrow_phase.contact_manifold import MAX_CORNERS, support_feature
from particlesim.geometry.support import (
    bounding_radius,
    half_space_plane,
    is_point,
    rounding_of,
    support_distance,
    turned,
    vertex_position,
)
from particlesim.geometry.tolerances import PARALLEL_TOLERANCE, SPREAD_SLOPE


@kernel
def _room(table, b, offset):
    """How far the plane of half-space b, at ``offset``, is from the origin, and the unit normal into the half-space."""
    outwards, height = half_space_plane(table, b)
    normal = sub((0.0, 0.0, 0.0), outwards)
    return dot(normal, offset) - height, normal


@kernel
def half_space_separation(table, a, b, offset):
    """Separation of shape a from half-space b at ``offset`` from it, and the normal from a into the half-space."""
    room, normal = _room(table, b, offset)
    return room - support_distance(table, a, normal), normal


@kernel
def half_space_contact(table, a, b, offset, points):
    """Separation, normal from a into half-space b at ``offset``, and number of contact points, from a's centroid.

    The points are on the surface of a: at the face, edge or vertex of the core that faces the half-space.
    """
    separation, normal = half_space_separation(table, a, b, offset)
    rounding = rounding_of(table, a)
    if is_point(table, a[0]):
        store_vec3(points, 0, axpy(vertex_position(table, turned(a), table.shape[a[0]].first_vertex), normal, rounding))
        return separation, normal, 1
    feature = np.empty((MAX_CORNERS, 3))
    count, _ = support_feature(table, turned(a), (0.0, 0.0, 0.0), normal, PARALLEL_TOLERANCE, feature)
    kept = min(count, MAX_MANIFOLD)
    for k in range(kept):
        store_vec3(points, k, axpy(load_vec3(feature, k * count // kept), normal, rounding))
    return separation, normal, kept


@kernel
def _farthest_out(table, a, plane, out, slope, chosen):
    """The vertex of a core within reach of a plane (room, normal, reach) farthest out to one side, and its gap.

    It may be nearer to the plane by as much times the ``slope`` as it is less far out; it is none of those ``chosen``.
    """
    room, normal, reach = plane
    body, shape = turned(a), table.shape[a[0]]
    best, most, gap = 0, -math.inf, 0.0
    for v in range(shape.first_vertex, shape.last_vertex):
        vertex = vertex_position(table, body, v)
        height = room - dot(normal, vertex)
        if height <= reach and slope * dot(out, vertex) - height > most:
            new = True
            for k in range(len(chosen)):
                new = new and chosen[k] != v
            if new:
                best, most, gap = v, slope * dot(out, vertex) - height, height
    return best, gap


@kernel
def _spread_points(table, a, plane, points, gaps):
    """Write the nearest point of shape a to a plane (room, normal, reach), and others that are far out on all sides.

    There are more than MAX_MANIFOLD within reach. The sides turn with the shape, so that it lies on the same points
    from step to step.
    """
    normal = plane[1]
    rounding, body, chosen = rounding_of(table, a), turned(a), np.empty(MAX_MANIFOLD, dtype=np.int64)
    x, y, z = mat_transposed_vec(body[2], normal)
    axis = (0.0, 0.0, 1.0)
    if abs(x) <= min(abs(y), abs(z)):
        axis = (1.0, 0.0, 0.0)
    elif abs(y) <= abs(z):
        axis = (0.0, 1.0, 0.0)
    first = cross(normal, mat_vec(body[2], axis))
    second = cross(normal, first)
    for side in range(MAX_MANIFOLD):
        angle = 2.0 * math.pi * side / (MAX_MANIFOLD - 1)
        out = add(scale(first, math.cos(angle)), scale(second, math.sin(angle)))
        vertex, gap = _farthest_out(table, a, plane, out, 0.0 if side == 0 else SPREAD_SLOPE, chosen[:side])
        chosen[side], gaps[side] = vertex, gap - rounding
        store_vec3(points, side, axpy(vertex_position(table, body, vertex), normal, rounding))


@kernel
def half_space_points(table, a, b, offset, reach, points, gaps):
    """Write the points of shape a below the vertices of its core that are within ``reach`` [m] of half-space b.

    Of more than MAX_MANIFOLD the nearest, and others far out all round. ``points`` is (MAX_MANIFOLD, 3), from a's
    centroid, on its surface; ``gaps`` (MAX_MANIFOLD,) how far each is from the half-space. Returns how many there are.
    """
    room, normal = _room(table, b, offset)
    rounding, count = rounding_of(table, a), 0
    if room - bounding_radius(table, a) > reach:
        return count
    body, shape = turned(a), table.shape[a[0]]
    for v in range(shape.first_vertex, shape.last_vertex):
        vertex = vertex_position(table, body, v)
        gap = room - dot(normal, vertex) - rounding
        if gap <= reach and count == MAX_MANIFOLD:
            _spread_points(table, a, (room, normal, reach + rounding), points, gaps)
            return count
        if gap <= reach:
            store_vec3(points, count, axpy(vertex, normal, rounding))
            gaps[count] = gap
            count += 1
    return count
