"""Where a particle touches a body of which either has parts, or nearly does: the points in each plane, with its normal.

Triangles in one plane are one face, however it is divided, and so are faces of the parts of a compound: their points
are those of one patch. A part whose nearest normal its body has not, as other parts go on there, is seen along that of
its face: what lies over many triangles, inclined by as little as it may, is over them all.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from particlesim.core.constants import MAX_MANIFOLD
from particlesim.core.jit import kernel
from particlesim.core.math3d import (
    axpy,
    dot,
    load_vec3,
    norm,
    scale,
    store_vec3,
    sub,
    to_quat,
    to_vec3,
)
from particlesim.geometry.narrow_phase.contact_manifold import contact_manifold
from particlesim.geometry.narrow_phase.pair import pair_manifold
from particlesim.geometry.narrow_phase.parts import (
    box_about_part,
    facing_normal,
    next_part,
    parts_of,
    which_hides,
)
from particlesim.geometry.narrow_phase.patch import MAX_GATHERED, corners_of, keep_some
from particlesim.geometry.support import is_half_space, is_point
from particlesim.model.bodies import placed
from particlesim.model.domain import nearest_image

# Patches of two bodies at one moment. Of more the nearest count; the others are met one after the other.
MAX_PATCHES = 16

# The most contact points of two bodies of which one has parts.
MAX_PATCH_POINTS = MAX_PATCHES * MAX_MANIFOLD

# Parts are looked at that are farther apart than asked for by this fraction of it, so that others are known to be.
SEARCH_MARGIN = 0.01


class Patches(NamedTuple):
    """Patches of two bodies; points are half way between them, from the first one's position [m], with the gap [m]."""

    normal: np.ndarray  # (MAX_PATCHES, 3) from the first to the second
    level: np.ndarray  # (MAX_PATCHES,) of the plane of the second, along the normal from the first one's position [m]
    row: np.ndarray  # (MAX_PATCHES, 2) int64, of the shape table: the parts of both that have the nearest point
    nearest: np.ndarray  # (MAX_PATCHES, 4) the point with the smallest gap
    size: np.ndarray  # (MAX_PATCHES,) int64, how many points there are
    point: np.ndarray  # (MAX_PATCHES, MAX_GATHERED, 4)


@kernel
def new_patches():
    """Room for the patches of two bodies."""
    return Patches(
        np.empty((MAX_PATCHES, 3)),
        np.empty(MAX_PATCHES),
        np.empty((MAX_PATCHES, 2), dtype=np.int64),
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
def _add_points(patches, k, rows, found, count):
    """Add the ``count`` points ``found`` (MAX_MANIFOLD, 4) of two parts, by their ``rows``, to patch k.

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
            patches.nearest[k] = found[m]
            patches.row[k, 0], patches.row[k, 1] = rows
    patches.size[k] = size + count


@kernel
def _half_way(points, gaps, count, normal):
    """Let points on the surface of what is above a half-space be half way between; the one with the smallest gap."""
    nearest = 0
    for k in range(count):
        store_vec3(points, k, axpy(load_vec3(points, k), normal, 0.5 * gaps[k]))
        if gaps[k] < gaps[nearest]:
            nearest = k
    return load_vec3(points, nearest)


@kernel
def _part_points(system, meshes, wholes, parts, offset, limits, found):
    """Points of two placed ``parts`` of bodies: separation, normal and how many; see ``gather_patches``.

    ``found`` is (MAX_MANIFOLD, 4), written.
    """
    (a, b), (reach, tilt, margin) = parts, limits
    shapes, points, gaps = system.shapes, np.empty((MAX_MANIFOLD, 3)), np.empty(MAX_MANIFOLD)
    separation, normal, middle, count = pair_manifold(shapes, a, b, offset, limits, points, gaps)
    if count > 0 and is_half_space(shapes, b[0]):
        middle = _half_way(points, gaps, count, normal)
    hides = -1
    if count > 0:
        hides = which_hides(shapes, meshes, wholes, parts, offset, (separation, normal, middle))
    if hides >= 0:
        count = 0
        if not (is_point(shapes, a[0]) or is_point(shapes, b[0])):
            if hides == 0:
                normal = facing_normal(shapes, a, normal)
            else:
                normal = scale(facing_normal(shapes, b, scale(normal, -1.0)), -1.0)
            contact = offset, normal, math.inf, middle
            count = contact_manifold(shapes, a, b, contact, (tilt, 0.0), points, gaps)
    least, kept = math.inf, 0
    for k in range(count):
        least = min(least, gaps[k])
        # What is not over the part that hides the normal is infinitely far from it.
        if hides < 0 or (
            gaps[k] <= reach
            and which_hides(shapes, meshes, wholes, parts, offset, (gaps[k], normal, load_vec3(points, k))) < 0
        ):
            store_vec3(found, kept, load_vec3(points, k))
            found[kept, 3] = gaps[k]
            kept += 1
    if hides < 0 and count > 0 and least > separation + margin:
        slot = min(kept, MAX_MANIFOLD - 1)
        store_vec3(found, slot, middle)
        found[slot, 3] = separation
        kept = slot + 1
    return separation, normal, kept


@kernel
def gather_patches(system, meshes, a, b, limits, sine, patches):
    """Find where bodies ``a`` and ``b`` touch or are near: offset of b, how many patches, least separation.

    Parameters
    ----------
    limits : (reach [m], tilt [sine of an angle], margin [m])
        As of ``pair_manifold``.
    sine : float
        By how much the normals of parts with one patch may differ.
    patches : Patches
        Written.
    """
    offset = nearest_image(sub(to_vec3(b.position), to_vec3(a.position)), system.domain[0].period)
    found, count, least = np.empty((MAX_MANIFOLD, 4)), 0, math.inf
    shapes, wholes = system.shapes, (placed(a), placed(b))
    first, last = parts_of(shapes, a.shape_row)
    for own in range(first, last):
        part = own, a.scale, to_quat(a.orientation)
        box = box_about_part(meshes, part, wholes[1], offset, (1.0 + SEARCH_MARGIN) * limits[0])
        place, row = next_part(shapes, meshes, b.shape_row, (0, 0), box)
        while row >= 0:
            parts = part, (row, b.scale, to_quat(b.orientation))
            separation, normal, points = _part_points(system, meshes, wholes, parts, offset, limits, found)
            least = min(least, separation)
            if points > 0:
                k, count = _patch_for(patches, count, normal, found, sine, 4.0 * sine * a.radius)
                if k >= 0:
                    _add_points(patches, k, (own, row), found, points)
            place, row = next_part(shapes, meshes, b.shape_row, place, box)
    return offset, count, least


@kernel
def patch_corners(patches, k, kept):
    """Write the corners of patch k, as many as a manifold keeps, to ``kept`` (MAX_MANIFOLD, 3 or 4); how many."""
    point = patches.point[k]
    return keep_some(point, corners_of(point, patches.size[k], load_vec3(patches.normal, k)), kept)
