"""Where a particle touches a mesh, or nearly does: the points in each plane, and the normal there.

Triangles in one plane are one face, however it is divided: their points are those of one patch. A triangle whose
nearest normal the mesh has not, as other triangles go on there, is seen along its own: what lies over many of them,
inclined by as little as it may, is over them all.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from particlesim.core.constants import MAX_MANIFOLD
from particlesim.core.jit import kernel
from particlesim.core.math3d import (
    dot,
    inverse_rotate,
    load_vec3,
    norm,
    rotate,
    scale,
    store_vec3,
    sub,
    to_quat,
    to_vec3,
)
from particlesim.geometry.narrow_phase.contact_manifold import contact_manifold
from particlesim.geometry.narrow_phase.mesh import box_about, face_towards, has_normal, next_triangle
from particlesim.geometry.narrow_phase.pair import pair_manifold
from particlesim.geometry.narrow_phase.patch import MAX_GATHERED, corners_of, keep_some
from particlesim.geometry.support import is_sphere
from particlesim.model.bodies import placed
from particlesim.model.domain import nearest_image

# Patches of a particle on a mesh at one moment. Of more the nearest count; the others are met one after the other.
MAX_PATCHES = 16

# The most contact points of a particle on a mesh.
MAX_PATCH_POINTS = MAX_PATCHES * MAX_MANIFOLD


class Patches(NamedTuple):
    """Patches of a particle on a mesh; points are from the particle's position [m], with the gap there [m]."""

    normal: np.ndarray  # (MAX_PATCHES, 3) from the particle to the mesh
    level: np.ndarray  # (MAX_PATCHES,) of the plane of the mesh, along the normal from the particle's position [m]
    row: np.ndarray  # (MAX_PATCHES,) int64, of the shape table: the triangle of the nearest point
    nearest: np.ndarray  # (MAX_PATCHES, 4) the point with the smallest gap
    size: np.ndarray  # (MAX_PATCHES,) int64, how many points there are
    point: np.ndarray  # (MAX_PATCHES, MAX_GATHERED, 4)


@kernel
def new_patches():
    """Room for the patches of a particle on a mesh."""
    return Patches(
        np.empty((MAX_PATCHES, 3)),
        np.empty(MAX_PATCHES),
        np.empty(MAX_PATCHES, dtype=np.int64),
        np.empty((MAX_PATCHES, 4)),
        np.zeros(MAX_PATCHES, dtype=np.int64),
        np.empty((MAX_PATCHES, MAX_GATHERED, 4)),
    )


@kernel
def _patch_for(patches, count, normal, point, sine, near):
    """The patch that a ``point`` (4,) with a normal belongs to, or a new one in its place; how many there are then.

    Normals of one patch differ by a ``sine``, levels by ``near`` [m] at most. Where there is no room, a new patch takes
    that of the farthest; -1 if all others are nearer.
    """
    farthest = 0
    for k in range(count):
        along = load_vec3(patches.normal, k)
        level = dot(along, load_vec3(point, 0)) + 0.5 * point[0, 3]
        if norm(sub(along, normal)) <= sine and abs(level - patches.level[k]) <= near:
            return k, count
        if patches.nearest[k, 3] > patches.nearest[farthest, 3]:
            farthest = k
    k = count if count < MAX_PATCHES else farthest
    if k == farthest and count == MAX_PATCHES and point[0, 3] >= patches.nearest[k, 3]:
        return -1, count
    store_vec3(patches.normal, k, normal)
    patches.level[k] = dot(normal, load_vec3(point, 0)) + 0.5 * point[0, 3]
    patches.nearest[k, 3] = math.inf
    patches.size[k] = 0
    return k, max(count, k + 1)


@kernel
def _add_points(patches, k, row, found, count):
    """Add the ``count`` points ``found`` (MAX_MANIFOLD, 4) of a triangle to patch k.

    Where there are too many, no more are kept than its corners.
    """
    point, normal, size = patches.point[k], load_vec3(patches.normal, k), patches.size[k]
    if size + count > MAX_GATHERED:
        size = corners_of(point, size, normal)
    if size + count > MAX_GATHERED:
        size = keep_some(point, size, point)
    for m in range(count):
        point[size + m] = found[m]
        if found[m, 3] < patches.nearest[k, 3]:
            patches.nearest[k], patches.row[k] = found[m], row
    patches.size[k] = size + count


@kernel
def _triangle_points(system, meshes, a, triangle, offset, limits, found):
    """Points of a particle over a ``triangle``: separation, normal and how many; see ``gather_patches``.

    ``found`` is (MAX_MANIFOLD, 4), written.
    """
    reach, tilt, margin = limits
    shapes, points, gaps = system.shapes, np.empty((MAX_MANIFOLD, 3)), np.empty(MAX_MANIFOLD)
    separation, normal, middle, count = pair_manifold(shapes, placed(a), triangle, offset, limits, points, gaps)
    kept, outwards = 0, inverse_rotate(triangle[2], scale(normal, -1.0))
    known = has_normal(shapes, meshes, triangle[0], outwards)
    if count > 0 and not known:
        count = 0
        if not is_sphere(shapes, a.shape_row):
            normal = scale(rotate(triangle[2], face_towards(shapes, triangle[0], outwards)), -1.0)
            contact = offset, normal, math.inf, middle
            count = contact_manifold(shapes, placed(a), triangle, contact, (tilt, 0.0), points, gaps)
    least = math.inf
    for k in range(count):
        least = min(least, gaps[k])
        # What is not over the triangle is infinitely far from it.
        if known or gaps[k] <= reach:
            store_vec3(found, kept, load_vec3(points, k))
            found[kept, 3] = gaps[k]
            kept += 1
    if known and count > 0 and least > separation + margin:
        slot = min(kept, MAX_MANIFOLD - 1)
        store_vec3(found, slot, middle)
        found[slot, 3] = separation
        kept = slot + 1
    return separation, normal, kept


@kernel
def gather_patches(system, meshes, a, b, limits, sine, patches):
    """Find where particle ``a`` touches mesh ``b`` or is near it: offset of b, how many patches, least separation.

    Parameters
    ----------
    limits : (reach [m], tilt [sine of an angle], margin [m])
        As of ``pair_manifold``.
    sine : float
        By how much the normals of triangles of one patch may differ.
    patches : Patches
        Written.
    """
    offset = nearest_image(sub(to_vec3(b.position), to_vec3(a.position)), system.domain[0].period)
    found, centre, count, least = np.empty((MAX_MANIFOLD, 4)), scale(offset, -1.0), 0, math.inf
    box = box_about(placed(b), centre, centre, a.radius + limits[0])
    place, row = next_triangle(system.shapes, meshes, b.shape_row, (0, 0), box)
    while row >= 0:
        triangle = row, b.scale, to_quat(b.orientation)
        separation, normal, points = _triangle_points(system, meshes, a, triangle, offset, limits, found)
        least = min(least, separation)
        if points > 0:
            k, count = _patch_for(patches, count, normal, found, sine, 4.0 * sine * a.radius)
            if k >= 0:
                _add_points(patches, k, row, found, points)
        place, row = next_triangle(system.shapes, meshes, b.shape_row, place, box)
    return offset, count, least


@kernel
def patch_corners(patches, k, kept):
    """Write the corners of patch k, as many as a manifold keeps, to ``kept`` (MAX_MANIFOLD, 3 or 4); how many."""
    point = patches.point[k]
    return keep_some(point, corners_of(point, patches.size[k], load_vec3(patches.normal, k)), kept)
