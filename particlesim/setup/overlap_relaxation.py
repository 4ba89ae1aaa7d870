"""Overlap relaxation: particles that overlap are pushed apart, a little at a time, until none does.

Random insertion jams at a third of the volume, because nothing in place makes room. Here everything that was placed at
random does (after W. S. Jodrey and E. M. Tory, Phys. Rev. A 32 (1985) 2347-2351), up to what is called random close
packing: 0.64 for equal spheres.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from particlesim.broad_phase import find_pairs
from particlesim.core.constants import MAX_MANIFOLD
from particlesim.core.jit import entry_kernel, kernel, without_refcounts
from particlesim.core.math3d import axpy, dot, scale, set_vec3, sub, to_vec3
from particlesim.geometry.mesh_table import MeshTable
from particlesim.geometry.shape_table import ShapeTable
from particlesim.model.bodies import placed
from particlesim.model.domain import nearest_image
from particlesim.model.overlap import separation_along
from particlesim.setup.random_insertion import Insertion

# The shapes that there are, the meshes among them, and the obstacles, (k,) BODY.
Known = tuple[ShapeTable, MeshTable | None, np.ndarray]

# Two that overlap are pushed to a gap of this fraction of their inscribed radii. Without one they come apart in ever
# smaller steps; a wider one takes room, three times as much of the fill.
_GAP = 1e-3

# How far they are pushed, as a multiple of what is missing. Thousand spheres at a fill of 0.6 take 718 passes at 1, 303
# at 1.4, and never end at 1.8.
_OVERRELAXATION = 1.4

# Pairs are found anew when a particle has gone this fraction of its bounding radius.
_SKIN = 0.1

# Passes over all pairs. It is jammed if, from _FIRST_LOOK passes on, twice as many leave more than _LEFT_BY_DOUBLING of
# all overlaps: of spheres at a fill of 0.6 it is less than a half, at 0.66 nine tenths.
_MAX_PASSES, _FIRST_LOOK, _LEFT_BY_DOUBLING = 4096, 64, 0.65


def push_apart(
    known: Known,
    insertion: Insertion,
    extent: tuple[np.ndarray, np.ndarray],
    movable: np.ndarray,
    bring_back: Callable[[], None],
) -> bool:
    """Move particles until none of them overlaps another or an obstacle; whether that was achieved.

    Parameters
    ----------
    extent : two (n, 3) float64
        Lower and upper corners of the particles' AABBs relative to their centroids [m].
    movable : (n,) bool
        Which particles give way.
    bring_back : callable
        Moves particles back into where they may be; called after each pass.
    """
    body, period = insertion.body, insertion.space[0]["period"]
    position, radius = body["position"], body["radius"]
    # The smaller of two gives way, as the lighter one of two bodies would.
    mobility = np.where(movable, (radius.min() / radius) ** 3, 0.0)
    skin, reference = _SKIN * radius[:, None], np.full_like(position, math.inf)
    pairs = np.zeros((0, 2), dtype=np.int64)
    overlap, before, look = math.inf, math.inf, _FIRST_LOOK
    for count in range(1, _MAX_PASSES + 1):
        if (np.abs(position - reference) > skin).any():
            pairs = find_pairs(position + extent[0] - skin, position + extent[1] + skin, period=period)
            pairs, reference = pairs[movable[pairs].any(axis=1)], position.copy()
        overlap = _pass(known, insertion, mobility, pairs)
        if not overlap:
            break
        bring_back()
        if count == look:
            if overlap > _LEFT_BY_DOUBLING * before:
                break
            before, look = overlap, 2 * look
    wraps, lower = period > 0.0, insertion.space[0]["lower"]
    position[:, wraps] -= period[wraps] * np.floor((position - lower)[:, wraps] / period[wraps])
    return not overlap


@kernel
def _lack(table, meshes, a, b, offset, thickness, points):
    """How deep a and b overlap, as a fraction of their ``thickness``, and by how much a is to move [m], as a vector.

    ``thickness`` is the sum of the inscribed radii; b is at ``offset`` from a, and does not move.
    """
    reach = a.radius + b.radius
    depth, way = 0.0, (0.0, 0.0, 0.0)
    if dot(offset, offset) < reach * reach:
        separation, normal = separation_along(table, meshes, placed(a), placed(b), offset, points)
        if separation < 0.0:
            depth = -separation / thickness
            way = scale(normal, _OVERRELAXATION * (separation - _GAP * thickness))
    return depth, way


@entry_kernel
def _pass(known, insertion, mobility, pairs):
    """Push all that overlaps apart, pair by pair, each by its ``mobility`` (n,), which is 0 for what stays.

    Returns the sum of the overlaps that were found, as fractions of the inscribed radii.
    """
    (table, meshes, obstacles), insertion = without_refcounts(known), without_refcounts(insertion)
    mobility, pairs = without_refcounts(mobility), without_refcounts(pairs)
    body, period, points = insertion.body, to_vec3(insertion.space[0].period), np.empty((MAX_MANIFOLD, 3))
    overlap = 0.0
    for i in range(len(body)):
        a = body[i]
        for k in range(len(obstacles) if mobility[i] > 0.0 else 0):
            offset = nearest_image(sub(to_vec3(obstacles[k].position), to_vec3(a.position)), period)
            thickness = table.shape[a.shape_row].inradius * a.scale
            depth, way = _lack(table, meshes, a, obstacles[k], offset, thickness, points)
            set_vec3(a.position, axpy(to_vec3(a.position), way, 1.0))
            overlap += depth
    for k in range(len(pairs)):
        a, b = body[pairs[k, 0]], body[pairs[k, 1]]
        offset = nearest_image(sub(to_vec3(b.position), to_vec3(a.position)), period)
        thickness = table.shape[a.shape_row].inradius * a.scale + table.shape[b.shape_row].inradius * b.scale
        depth, way = _lack(table, meshes, a, b, offset, thickness, points)
        share = mobility[pairs[k, 0]] / (mobility[pairs[k, 0]] + mobility[pairs[k, 1]])
        set_vec3(a.position, axpy(to_vec3(a.position), way, share))
        set_vec3(b.position, axpy(to_vec3(b.position), way, share - 1.0))
        overlap += depth
    return overlap
