"""Any two convex cores with their rounding: exact distance outside, exact depth inside.

The surface is the rounding radius outside of the core. Of cores that are apart, the separation is their distance less
both radii. Of cores that overlap it is minus their depth less both radii: from a point in a convex body K, the boundary
of all points within r of K is farther by r than the boundary of K.
"""

from particlesim.core.jit import kernel
from particlesim.core.math3d import add, axpy, norm, scale
from particlesim.geometry.narrow_phase.gjk import NO_SIMPLEX, core_distance
from particlesim.geometry.narrow_phase.separating_axis import core_depth
from particlesim.geometry.support import bounding_radius, rounding_of, turned
from particlesim.geometry.tolerances import JOINED, TOUCHING


@kernel
def core_pair_nearer(table, a, b, offset, distance):
    """Whether two placed shapes are nearer than ``distance`` [m]; 0 asks whether they touch or overlap."""
    sizes = bounding_radius(table, a) + bounding_radius(table, b)
    touching = distance + (rounding_of(table, a) + rounding_of(table, b)) + TOUCHING * sizes
    length, _, _, _, _ = core_distance(table, turned(a), turned(b), offset, touching, True, NO_SIMPLEX)
    return length <= touching


@kernel
def core_pair_separation(table, a, b, offset, known):
    """Separation, normal from a to b, half way between the nearest points, and simplex, of placed shapes.

    b is at ``offset`` from a; ``known`` is a simplex to begin with (see core_distance).
    """
    body_a, body_b = turned(a), turned(b)
    rounding_a, rounding_b = rounding_of(table, a), rounding_of(table, b)
    joined = JOINED * (bounding_radius(table, a) + bounding_radius(table, b))
    separation, apart, point_a, point_b, simplex = core_distance(table, body_a, body_b, offset, joined, False, known)
    if separation > 0.0:
        normal = scale(apart, 1.0 / norm(apart))
    else:
        separation, normal = core_depth(table, body_a, body_b, offset)
    middle = axpy(scale(add(point_a, point_b), 0.5), normal, 0.5 * (rounding_a - rounding_b))
    return separation - (rounding_a + rounding_b), normal, middle, simplex
