"""The pair table: the exact test of any two shapes.

A placed shape is a tuple (row of the shape table, size, orientation). ``offset`` is the centroid of b from that of a,
normals point from a to b, points are from a's centroid. A half-space may be b, never a.
Spheres have fast paths: among themselves, and against polyhedra by a walk over the faces (0.20 us on average over the
shapes of the tests where the general search takes 0.36 us; for cubes 0.15 and 0.18), but for those of many vertices.
"""

import numpy as np

from particlesim.core.constants import MAX_MANIFOLD
from particlesim.core.jit import entry_kernel, kernel, without_refcounts
from particlesim.core.math3d import add, axpy, load_vec3, scale, store_vec3
from particlesim.geometry.narrow_phase.contact_manifold import contact_manifold
from particlesim.geometry.narrow_phase.core_pair import core_pair_nearer, core_pair_separation
from particlesim.geometry.narrow_phase.gjk import NO_SIMPLEX
from particlesim.geometry.narrow_phase.half_space import half_space_contact, half_space_points, half_space_separation
from particlesim.geometry.narrow_phase.sphere_polyhedron import polyhedron_sphere
from particlesim.geometry.narrow_phase.sphere_sphere import sphere_sphere
from particlesim.geometry.support import (
    has_faces,
    has_many_vertices,
    is_half_space,
    is_point,
    is_sphere,
    rounding_of,
    turned,
    vertex_position,
)
from particlesim.geometry.tolerances import PARALLEL_TOLERANCE


@kernel
def _has_few_faces(table, shape):
    """Whether a shape is a polyhedron whose faces are soon gone through."""
    return has_faces(table, shape) and not has_many_vertices(table, shape)


@kernel
def _has_closed_form(table, a, b):
    """Whether one of two bounded shapes is a sphere, and the other a sphere or a polyhedron of few faces."""
    sphere_a, sphere_b = is_sphere(table, a[0]), is_sphere(table, b[0])
    return (sphere_a and (sphere_b or _has_few_faces(table, b[0]))) or (sphere_b and _has_few_faces(table, a[0]))


@kernel
def _sphere_contact(table, a, b, offset, points):
    """The contact of two shapes of which one is a sphere, the other a sphere or a polyhedron (see pair_contact)."""
    if not is_sphere(table, a[0]):
        separation, normal, count = polyhedron_sphere(table, a, rounding_of(table, b), offset, points)
    elif not is_sphere(table, b[0]):
        separation, normal, count = polyhedron_sphere(table, b, rounding_of(table, a), scale(offset, -1.0), points)
        normal = scale(normal, -1.0)
        store_vec3(points, 0, add(offset, load_vec3(points, 0)))
    else:
        separation, normal, count = sphere_sphere(rounding_of(table, a), rounding_of(table, b), offset, points)
    return separation, normal, count


@kernel
def _has_point(table, a, b):
    """Whether the core of one of two shapes is a point: the shapes touch in one."""
    return is_point(table, a[0]) or is_point(table, b[0])


@kernel
def _point_contact(table, a, b, contact, points):
    """Write the contact point of two shapes of which one has a point for a core (see contact_manifold); returns 1."""
    offset, normal, separation, _ = contact
    if is_point(table, a[0]):
        centre = vertex_position(table, turned(a), table.shape[a[0]].first_vertex)
        nearest = axpy(centre, normal, rounding_of(table, a) + 0.5 * separation)
    else:
        centre = add(offset, vertex_position(table, turned(b), table.shape[b[0]].first_vertex))
        nearest = axpy(centre, normal, -(rounding_of(table, b) + 0.5 * separation))
    store_vec3(points, 0, nearest)
    return 1


@kernel
def _core_contact(table, a, b, offset, points):
    """The contact of any two bounded shapes (see pair_contact)."""
    separation, normal, middle, _ = core_pair_separation(table, a, b, offset, NO_SIMPLEX)
    contact = offset, normal, separation, middle
    if _has_point(table, a, b):
        return separation, normal, _point_contact(table, a, b, contact, points)
    gaps = np.empty(MAX_MANIFOLD)
    return separation, normal, contact_manifold(table, a, b, contact, (PARALLEL_TOLERANCE, 0.0), points, gaps)


@entry_kernel
def pair_contact(table, a, b, offset, points):
    """Separation (negative: overlap), unit normal from a to b, and number of contact points written.

    ``points`` is (MAX_MANIFOLD, 3) [m], half way between the two surfaces; against a half-space, on the surface of a.
    """
    table, points = without_refcounts((table, points))
    if is_half_space(table, b[0]):
        return half_space_contact(table, a, b, offset, points)
    if _has_closed_form(table, a, b):
        return _sphere_contact(table, a, b, offset, points)
    return _core_contact(table, a, b, offset, points)


@kernel
def pair_separation(table, a, b, offset, simplex, points):
    """Separation and normal as of pair_contact, without the manifold, and the simplex that they were found from.

    ``simplex`` is that of the same pair when it was a little elsewhere, or NO_SIMPLEX. Row 0 of ``points`` becomes half
    way between the nearest points of two bounded shapes; the rest is scratch.
    """
    found = simplex
    if is_half_space(table, b[0]):
        separation, normal = half_space_separation(table, a, b, offset)
    elif _has_closed_form(table, a, b):
        separation, normal, _ = _sphere_contact(table, a, b, offset, points)
    else:
        separation, normal, middle, found = core_pair_separation(table, a, b, offset, simplex)
        store_vec3(points, 0, middle)
    return separation, normal, found


@kernel
def pair_nearer(table, a, b, offset, distance):
    """Whether two bounded shapes are nearer than ``distance`` [m]; 0 asks whether they touch or overlap."""
    return core_pair_nearer(table, a, b, offset, distance)


@kernel
def pair_overlaps(table, a, b, offset, points):
    """Whether two shapes touch or overlap; cheaper than the contact for most that do not. ``points`` is scratch."""
    if is_half_space(table, b[0]) or _has_closed_form(table, a, b):
        separation, _, _ = pair_separation(table, a, b, offset, NO_SIMPLEX, points)
        overlap = separation <= 0.0
    else:
        overlap = core_pair_nearer(table, a, b, offset, 0.0)
    return overlap


@kernel
def pair_manifold(table, a, b, offset, limits, points, gaps):
    """All points where two shapes are near to each other, for resting contacts.

    Parameters
    ----------
    limits : (reach [m], tilt [sine of an angle], margin [m])
        Shapes farther apart than ``reach`` have no points; for ``tilt`` and ``margin`` see contact_manifold.
    points : (MAX_MANIFOLD, 3) float64, written
        Half way between bounded shapes; against a half-space, those of a within ``reach`` of it.
    gaps : (MAX_MANIFOLD,) float64, written
        How far apart the shapes are at each of the points [m].

    Returns
    -------
    (separation, normal, half way between the nearest points of bounded shapes, number of points)
    """
    reach, tilt, margin = limits
    separation, normal, _ = pair_separation(table, a, b, offset, NO_SIMPLEX, points)
    middle, count = load_vec3(points, 0), 0
    gaps[0] = separation
    if separation > reach:
        return separation, normal, middle, count
    if is_half_space(table, b[0]):
        count = half_space_points(table, a, b, offset, reach, points, gaps)
    elif _has_closed_form(table, a, b):
        count = 1
    elif _has_point(table, a, b):
        count = _point_contact(table, a, b, (offset, normal, separation, middle), points)
    else:
        contact = offset, normal, separation, middle
        count = contact_manifold(table, a, b, contact, (tilt, margin), points, gaps)
    return separation, normal, middle, count
