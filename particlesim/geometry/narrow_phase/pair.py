"""The exact test of any two particles: dispatch by geometry kind."""

from particlesim.core.constants import SPHERE
from particlesim.core.jit import kernel
from particlesim.core.math3d import add, load_vec3, quat_to_matrix, scale, store_vec3
from particlesim.geometry.narrow_phase.hull_hull import hull_hull, hull_separation, hulls_nearer
from particlesim.geometry.narrow_phase.sphere_hull import hull_sphere
from particlesim.geometry.narrow_phase.sphere_sphere import sphere_sphere


@kernel
def nearest_image(offset, period):
    """An offset between two particles, by the shortest way round each periodic axis."""
    x, y, z = offset
    # Few pairs lie on two sides of a face: the others are spared the division.
    if abs(x) > 0.5 * period[0] and period[0] > 0.0:
        x -= period[0] * round(x / period[0])
    if abs(y) > 0.5 * period[1] and period[1] > 0.0:
        y -= period[1] * round(y / period[1])
    if abs(z) > 0.5 * period[2] and period[2] > 0.0:
        z -= period[2] * round(z / period[2])
    return x, y, z


@kernel(inline=True)
def _sphere_contact(table, shape_a, size_a, turn_a, shape_b, size_b, turn_b, offset, points):
    """The contact of two particles of which one at least is a sphere (see pair_contact)."""
    if table.kind[shape_a] != SPHERE:
        separation, normal, count = hull_sphere(table, shape_a, size_a, turn_a, size_b, offset, points)
    elif table.kind[shape_b] != SPHERE:
        separation, normal, count = hull_sphere(table, shape_b, size_b, turn_b, size_a, scale(offset, -1.0), points)
        normal = scale(normal, -1.0)
        store_vec3(points, 0, add(offset, load_vec3(points, 0)))
    else:
        separation, normal, count = sphere_sphere(size_a, size_b, offset, points)
    return separation, normal, count


@kernel
def pair_contact(table, shape_a, size_a, turn_a, shape_b, size_b, turn_b, offset, points):
    """Separation (negative: overlap), unit normal from a to b, and number of contact points written.

    ``turn`` are orientations, ``offset`` is b's centroid from a's; points are relative to a's centroid, half way
    between the two surfaces.
    """
    if table.kind[shape_a] == SPHERE or table.kind[shape_b] == SPHERE:
        return _sphere_contact(table, shape_a, size_a, turn_a, shape_b, size_b, turn_b, offset, points)
    return hull_hull(table, shape_a, size_a, turn_a, shape_b, size_b, turn_b, offset, points)


@kernel(inline=True)
def pair_separation(table, shape_a, size_a, turn_a, shape_b, size_b, turn_b, offset, known, points):
    """Separation and normal as of pair_contact, without the corners of the patch; ``points`` is scratch.

    And the corners from which hulls find them sooner when they have moved a little: ``known``, or NO_CORNERS.
    """
    corners = known
    if table.kind[shape_a] == SPHERE or table.kind[shape_b] == SPHERE:
        separation, normal, _ = _sphere_contact(table, shape_a, size_a, turn_a, shape_b, size_b, turn_b, offset, points)
    else:
        separation, normal, _, corners = hull_separation(
            table, shape_a, size_a, quat_to_matrix(turn_a), shape_b, size_b, quat_to_matrix(turn_b), offset, known
        )
    return separation, normal, corners


@kernel(inline=True)
def pair_overlaps(table, shape_a, size_a, turn_a, shape_b, size_b, turn_b, offset, points):
    """Whether two particles touch or overlap; cheaper than the contact for most that do not."""
    if table.kind[shape_a] == SPHERE or table.kind[shape_b] == SPHERE:
        separation, _, _ = pair_contact(table, shape_a, size_a, turn_a, shape_b, size_b, turn_b, offset, points)
        overlap = separation <= 0.0
    else:
        overlap = hulls_nearer(table, shape_a, size_a, turn_a, shape_b, size_b, turn_b, offset, 0.0)
    return overlap
