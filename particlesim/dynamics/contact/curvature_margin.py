"""How far a gap closes by what is not seen of it in the speed at which two bodies part now: turning bends ways.

Bodies that settle go on steadily for a stretch of time, as if the normal of each contact stood and each point went
straight. A point at r from the centroid of a body that turns at w accelerates by w x (w x r). Seen from a body that
turns, what slides across its surface bends as well: the normal turns with a face, and with two edges that cross it
turns the faster the more nearly parallel they are.
"""

from particlesim.core.constants import HULL
from particlesim.core.jit import kernel
from particlesim.core.math3d import (
    add,
    axpy,
    cross,
    dot,
    inverse_rotate,
    load_quat,
    load_vec3,
    norm,
    rotate,
    scale,
    sub,
)
from particlesim.dynamics.ccd.conservative_advancement import facing_edge, turning_with_edges

_STILL = (0.0, 0.0, 0.0)

# Corners that reach as far as the farthest but for this fraction of the size reach as far.
_LEVEL = 1e-6


@kernel
def _edge_facing(table, shape, turn, direction):
    """The edge of a hull that faces ``direction``, in world axes; (0, 0, 0) if a corner or a face does."""
    first, last = table.vertex_start[shape], table.vertex_start[shape + 1]
    edge, lag, next_lag = facing_edge(table.vertex, first, last, inverse_rotate(turn, direction))
    return rotate(turn, edge) if lag <= _LEVEL < next_lag else _STILL


@kernel
def _turning_of_edges(table, constants, state, spin, i, j, normal):
    """How fast the normal of two hulls turns whose edges cross [1/s]; 0 if it is not edges that face each other."""
    edge_i = _edge_facing(table, constants.shape[i], load_quat(state.orientation, i), normal)
    edge_j = _edge_facing(table, constants.shape[j], load_quat(state.orientation, j), scale(normal, -1.0))
    with_i, with_j = cross(load_vec3(spin, i), normal), cross(load_vec3(spin, j), normal)
    return norm(turning_with_edges(edge_i, with_i, edge_j, with_j, normal))


@kernel
def _bending(spin, arm, normal):
    """How fast the point of a body at ``arm`` that turns at ``spin`` accelerates along a normal [m/s^2]."""
    return dot(normal, cross(spin, cross(spin, arm)))


@kernel
def bend(table, constants, state, spin, i, j, normal, offset, arm, duration):
    """The most by which turning closes the gap between particle i and partner j at a point within ``duration`` [m].

    The ``normal`` points from i to j, the point is at ``arm`` from the centroid of i, that of j at ``offset``.
    """
    hull_i = table.kind[constants.shape[i]] == HULL
    spin_i = load_vec3(spin, i) if hull_i else _STILL
    if j < 0:
        return 0.5 * max(_bending(spin_i, arm, normal), 0.0) * duration * duration
    hull_j = table.kind[constants.shape[j]] == HULL
    spin_j = load_vec3(spin, j) if hull_j else _STILL
    # A sphere may turn as it likes: it is its centre that comes near.
    arm_i = arm if hull_j else offset
    arm_j = sub(arm, offset) if hull_i else scale(offset, -1.0)
    of_i = add(load_vec3(state.velocity, i), cross(spin_i, arm_i))
    of_j = add(load_vec3(state.velocity, j), cross(spin_j, arm_j))
    sliding = sub(of_j, of_i)
    across = norm(axpy(sliding, normal, -dot(sliding, normal)))
    turning = max(norm(cross(normal, spin_i)), norm(cross(normal, spin_j)))
    if hull_i and hull_j:
        turning = max(turning, _turning_of_edges(table, constants, state, spin, i, j, normal))
    bending = abs(_bending(spin_i, arm_i, normal)) + abs(_bending(spin_j, arm_j, normal))
    return (0.5 * bending * duration + min(turning * duration, 1.0) * across) * duration
