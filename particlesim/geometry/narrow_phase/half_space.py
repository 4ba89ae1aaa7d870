"""Any bounded shape against a half-space."""

import numpy as np

from particlesim.core.constants import MAX_MANIFOLD
from particlesim.core.jit import kernel
from particlesim.core.math3d import axpy, dot, load_vec3, scale, store_vec3, sub
from particlesim.geometry.narrow_phase.contact_manifold import MAX_CORNERS, support_feature
from particlesim.geometry.support import (
    bounding_radius,
    half_space_plane,
    is_sphere,
    rounding_of,
    support_distance,
    turned,
    vertex_position,
)
from particlesim.geometry.tolerances import PARALLEL_TOLERANCE


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
    if is_sphere(table, a[0]):
        store_vec3(points, 0, scale(normal, rounding))
        return separation, normal, 1
    feature = np.empty((MAX_CORNERS, 3))
    count, _ = support_feature(table, turned(a), (0.0, 0.0, 0.0), normal, PARALLEL_TOLERANCE, feature)
    kept = min(count, MAX_MANIFOLD)
    for k in range(kept):
        store_vec3(points, k, axpy(load_vec3(feature, k * count // kept), normal, rounding))
    return separation, normal, kept


@kernel
def _slot(gaps, count, gap):
    """Where to keep a point with this gap: at the end, or in place of the one with the largest gap; -1 for nowhere."""
    if count < MAX_MANIFOLD:
        return count
    largest = 0
    for k in range(1, count):
        largest = k if gaps[k] > gaps[largest] else largest
    return largest if gaps[largest] > gap else -1


@kernel
def half_space_points(table, a, b, offset, reach, points, gaps):
    """Write the points of shape a below the vertices of its core that are within ``reach`` [m] of half-space b.

    Of more than MAX_MANIFOLD the nearest. ``points`` is (MAX_MANIFOLD, 3), from a's centroid, on its surface; ``gaps``
    (MAX_MANIFOLD,) how far each is from the half-space. Returns how many there are.
    """
    room, normal = _room(table, b, offset)
    rounding, count = rounding_of(table, a), 0
    if room - bounding_radius(table, a) > reach:
        return count
    body, shape = turned(a), table.shape[a[0]]
    for v in range(shape.first_vertex, shape.last_vertex):
        vertex = vertex_position(table, body, v)
        gap = room - dot(normal, vertex) - rounding
        slot = _slot(gaps, count, gap) if gap <= reach else -1
        if slot >= 0:
            store_vec3(points, slot, axpy(vertex, normal, rounding))
            gaps[slot] = gap
            count = max(count, slot + 1)
    return count
