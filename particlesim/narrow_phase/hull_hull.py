"""Hull against hull: exact distance outside, exact depth inside, and the contact patch."""

from particlesim.jit import kernel
from particlesim.narrow_phase.gjk import hull_distance
from particlesim.narrow_phase.manifold import hull_patch
from particlesim.narrow_phase.separating_axis import hull_depth
from particlesim.vec import add, matrix_of, scaled, sub


@kernel
def hulls_overlap(table, shape_a, size_a, turn_a, shape_b, size_b, turn_b, offset):
    """Whether two hulls touch or overlap."""
    distance, _, _ = hull_distance(
        table, shape_a, size_a, matrix_of(turn_a), shape_b, size_b, matrix_of(turn_b), offset, True
    )
    return distance == 0.0


@kernel
def hull_hull(table, shape_a, size_a, turn_a, shape_b, size_b, turn_b, offset, points):
    """Separation, normal from a to b and number of contact points of hull b at ``offset`` from hull a."""
    matrix_a, matrix_b = matrix_of(turn_a), matrix_of(turn_b)
    separation, point_a, point_b = hull_distance(
        table, shape_a, size_a, matrix_a, shape_b, size_b, matrix_b, offset, False
    )
    if separation > 0.0:
        normal = scaled(sub(point_b, point_a), 1.0 / separation)
    else:
        separation, normal = hull_depth(table, shape_a, size_a, matrix_a, shape_b, size_b, matrix_b, offset)
    middle = scaled(add(point_a, point_b), 0.5)
    count = hull_patch(
        table, shape_a, size_a, matrix_a, shape_b, size_b, matrix_b, offset, normal, separation, middle, points
    )
    return separation, normal, count
