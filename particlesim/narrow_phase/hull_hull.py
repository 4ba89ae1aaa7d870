"""Hull against hull: exact distance outside, exact depth inside, and the contact patch."""

from particlesim.jit import kernel
from particlesim.narrow_phase.gjk import TOUCHING, apart_along, hull_distance
from particlesim.narrow_phase.manifold import hull_patch
from particlesim.narrow_phase.separating_axis import hull_depth
from particlesim.vec import add, matrix_of, norm, scaled, sub


@kernel(inline=True)
def _vertices(table, shape):
    """The vertices of a shape of size 1, a view (v, 3)."""
    return table.vertex[table.vertex_start[shape] : table.vertex_start[shape + 1]]


@kernel
def _apart(vertices_a, size_a, turn_a, vertices_b, size_b, turn_b, offset, touching):
    """Whether two hulls are farther apart than ``touching``."""
    matrix_a, matrix_b = matrix_of(turn_a), matrix_of(turn_b)
    # The line of centres separates most pairs, at a fraction of the cost of the whole search.
    gap = apart_along(vertices_a, size_a, matrix_a, vertices_b, size_b, matrix_b, offset, offset)
    if gap > touching * norm(offset):
        return True
    distance, _, _ = hull_distance(vertices_a, size_a, matrix_a, vertices_b, size_b, matrix_b, offset, touching, True)
    return distance > 0.0


@kernel(inline=True)
def hulls_overlap(table, shape_a, size_a, turn_a, shape_b, size_b, turn_b, offset):
    """Whether two hulls touch or overlap."""
    touching = TOUCHING * (table.radius[shape_a] * size_a + table.radius[shape_b] * size_b)
    return not _apart(
        _vertices(table, shape_a), size_a, turn_a, _vertices(table, shape_b), size_b, turn_b, offset, touching
    )


@kernel
def hull_hull(table, shape_a, size_a, turn_a, shape_b, size_b, turn_b, offset, points):
    """Separation, normal from a to b and number of contact points of hull b at ``offset`` from hull a."""
    matrix_a, matrix_b = matrix_of(turn_a), matrix_of(turn_b)
    touching = TOUCHING * (table.radius[shape_a] * size_a + table.radius[shape_b] * size_b)
    separation, point_a, point_b = hull_distance(
        _vertices(table, shape_a),
        size_a,
        matrix_a,
        _vertices(table, shape_b),
        size_b,
        matrix_b,
        offset,
        touching,
        False,
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
