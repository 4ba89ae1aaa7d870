"""Curvature margin: how far a gap closes by what the normal velocity of now does not show, as turning bends paths.

Bodies that settle go on steadily for a substep, as if the normal of each contact stood and each point went straight. A
point at r from the position of a body that turns at w accelerates by w x (w x r). Seen from a body that turns, what
slides across its surface bends as well: the normal turns with a face, and with two edges that cross it turns the faster
the more nearly parallel they are.
"""

from particlesim.core.jit import kernel
from particlesim.core.math3d import (
    add,
    axpy,
    cross,
    dot,
    inverse_rotate,
    load_vec3,
    norm,
    rotate,
    scale,
    sub,
    to_quat,
    to_vec3,
)
from particlesim.dynamics.ccd.conservative_advancement import facing_edge, turning_with_edges
from particlesim.dynamics.ccd.time_of_impact import sized_core
from particlesim.dynamics.settings import LEVEL_VERTICES
from particlesim.geometry.support import is_sphere

_STILL = (0.0, 0.0, 0.0)


@kernel
def _edge_facing(system, b, direction):
    """The edge of a polyhedron that faces ``direction``, in world axes; (0, 0, 0) if a vertex or a face does."""
    orientation = to_quat(b.orientation)
    hull, core = (system.shapes.vertex, system.shapes.link), sized_core(system, b)
    edge, lag, next_lag = facing_edge(hull, core, inverse_rotate(orientation, direction))
    return rotate(orientation, edge) if lag <= LEVEL_VERTICES < next_lag else _STILL


@kernel
def _turning_of_edges(system, a, b, spin_a, spin_b, normal):
    """How fast the normal of two polyhedra turns whose edges cross [1/s]; 0 if it is not edges that face each other."""
    edge_a, edge_b = _edge_facing(system, a, normal), _edge_facing(system, b, scale(normal, -1.0))
    return norm(turning_with_edges(edge_a, cross(spin_a, normal), edge_b, cross(spin_b, normal), normal))


@kernel
def _bending(spin, lever_arm, normal):
    """How fast the point of a body at ``lever_arm`` that turns at ``spin`` accelerates along a normal [m/s^2]."""
    return dot(normal, cross(spin, cross(spin, lever_arm)))


@kernel
def bend(system, motion, p, offset, lever_arm):
    """The most by which turning closes the gap at contact point ``p`` within the substep [m].

    The point is at ``lever_arm`` from the first body's position, that of the second at ``offset``.
    """
    a, b, duration, normal = system.body[p.a], system.body[p.b], motion.duration, to_vec3(p.normal)
    sphere_a, sphere_b = is_sphere(system.shapes, a.shape_row), is_sphere(system.shapes, b.shape_row)
    spin_a = _STILL if sphere_a else load_vec3(motion.spin, p.a)
    spin_b = _STILL if sphere_b else load_vec3(motion.spin, p.b)
    if p.b >= system.bounded and spin_b == _STILL:
        return 0.5 * max(_bending(spin_a, lever_arm, normal), 0.0) * duration * duration
    # A sphere may turn as it likes: it is its centre that comes near.
    arm_a = offset if sphere_b else lever_arm
    arm_b = scale(offset, -1.0) if sphere_a else sub(lever_arm, offset)
    of_a = add(to_vec3(a.velocity), cross(spin_a, arm_a))
    of_b = add(to_vec3(b.velocity), cross(spin_b, arm_b))
    sliding = sub(of_b, of_a)
    across = norm(axpy(sliding, normal, -dot(sliding, normal)))
    turning = max(norm(cross(normal, spin_a)), norm(cross(normal, spin_b)))
    if not sphere_a and not sphere_b:
        turning = max(turning, _turning_of_edges(system, a, b, spin_a, spin_b, normal))
    bending = abs(_bending(spin_a, arm_a, normal)) + abs(_bending(spin_b, arm_b, normal))
    return (0.5 * bending * duration + min(turning * duration, 1.0) * across) * duration
