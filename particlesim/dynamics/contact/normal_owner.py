"""Whose normal that of a contact is: with which of the two bodies it turns."""

from __future__ import annotations

from particlesim.core.jit import kernel
from particlesim.core.math3d import cross, dot, inverse_rotate, norm, rotate, scale, set_vec3, to_quat
from particlesim.core.math3d import to_vec3 as vec
from particlesim.dynamics.ccd.conservative_advancement import facing_edge
from particlesim.dynamics.ccd.time_of_impact import sized_core
from particlesim.dynamics.contact.contact_records import NOBODY, OF_A, OF_B, OF_EDGES
from particlesim.dynamics.settings import LEVEL_VERTICES, MIN_EDGE_SINE, SAME_NORMAL
from particlesim.geometry.support import is_half_space, is_point


@kernel
def _faces(system, b, direction):
    """Whether a face of a polyhedron has ``direction`` for its normal."""
    faces, shape, own = (
        system.shapes.face,
        system.shapes.shape[b.shape_row],
        inverse_rotate(to_quat(b.orientation), direction),
    )
    found = False
    for f in range(shape.first_face, shape.last_face):
        found = found or dot(vec(faces[f].normal), own) > 1.0 - SAME_NORMAL
    return found


@kernel
def normal_owner(system, a, b, normal):
    """Whose face the normal of two bodies belongs to.

    A plane that supports a polyhedron where a sphere is nearest goes on doing so as it turns with the polyhedron.
    """
    if is_half_space(system.shapes, b.shape_row):
        return OF_B
    sphere_a, sphere_b = is_point(system.shapes, a.shape_row), is_point(system.shapes, b.shape_row)
    if sphere_a and sphere_b:
        return NOBODY
    if sphere_a or (not sphere_b and _faces(system, b, scale(normal, -1.0))):
        return OF_B
    if sphere_b or _faces(system, a, normal):
        return OF_A
    return OF_EDGES


@kernel
def _edge_facing(system, b, direction):
    """The edge of a polyhedron that faces ``direction``, in world axes; (0, 0, 0) if a vertex or a face does."""
    orientation = to_quat(b.orientation)
    hull, core = (system.shapes.vertex, system.shapes.link), sized_core(system, b)
    edge, lag, next_lag = facing_edge(hull, core, inverse_rotate(orientation, direction))
    level = lag <= LEVEL_VERTICES < next_lag
    return scale(rotate(orientation, edge), b.scale if level else 0.0)


@kernel
def write_edges(system, a, b, normal, terms):
    """Write how a normal turns that stays across the edges of two bodies that cross (see turning_with_edges)."""
    edge_a, edge_b = _edge_facing(system, a, normal), _edge_facing(system, b, scale(normal, -1.0))
    across_a, across_b = cross(normal, edge_a), cross(edge_b, normal)
    area = dot(edge_a, across_b)
    if abs(area) <= MIN_EDGE_SINE * norm(edge_a) * norm(edge_b):
        terms.owner = NOBODY
        return
    set_vec3(terms.edge_a, edge_a)
    set_vec3(terms.edge_b, edge_b)
    set_vec3(terms.with_a, scale(across_b, 1.0 / area))
    set_vec3(terms.with_b, scale(across_a, 1.0 / area))
