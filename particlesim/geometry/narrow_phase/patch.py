"""Points in a plane as the patch that they enclose: its corners, as few as a manifold keeps."""

import numpy as np

from particlesim.core.constants import MAX_MANIFOLD
from particlesim.core.jit import kernel
from particlesim.core.math3d import cross, dot, load_vec3, norm, sub
from particlesim.geometry.tolerances import PATCH_CORNER

# Points that are gathered before those are dropped which are no corners.
MAX_GATHERED = 6 * MAX_MANIFOLD


@kernel
def _is_next(normal, here, best, other, near):
    """Whether a point comes before the best so far as the next corner, counter-clockwise about the normal.

    Of those in a line, but for ``near`` [m], the farthest.
    """
    ahead, way = sub(best, here), sub(other, here)
    length = norm(ahead)
    if norm(way) <= near:
        return False
    if length <= near:
        return True
    off = dot(cross(ahead, way), normal) / length
    return off < -near or (off <= near and norm(way) > length)


@kernel
def corners_of(points, count, normal):
    """Move the corners of the convex hull of ``count`` points in a plane across ``normal`` to the front; how many.

    ``points`` (n, 3 or more), with whatever else is known of each. What stands out by less than rounding is no corner.
    """
    hull = np.empty((count, points.shape[1]))
    start, extent = 0, 0.0
    first = load_vec3(points, 0)
    for k in range(1, count):
        distance = norm(sub(load_vec3(points, k), first))
        if distance > extent:
            start, extent = k, distance
    near, size, here = PATCH_CORNER * extent, 0, start
    while size < count and (size == 0 or here != start):
        hull[size] = points[here]
        size += 1
        best = here
        for k in range(count):
            if _is_next(normal, load_vec3(points, here), load_vec3(points, best), load_vec3(points, k), near):
                best = k
        if best == here or norm(sub(load_vec3(points, best), load_vec3(points, start))) <= near:
            break
        here = best
    points[:size] = hull[:size]
    return size


@kernel
def keep_some(points, count, kept):
    """Write ``count`` points, or as many of them as a manifold keeps, evenly spread, to ``kept``; returns how many."""
    size = min(count, MAX_MANIFOLD)
    for k in range(size):
        for column in range(kept.shape[1]):
            kept[k, column] = points[k * count // size, column]
    return size
