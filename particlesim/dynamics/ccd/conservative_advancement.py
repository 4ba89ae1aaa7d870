"""For how long a normal that separates two bodies certainly goes on to do so: the steps of the search for an impact.

A corner moves along a normal at a speed that is known now, and bends away from its straight way by so much at the
most: while that leaves a gap between all corners of the two bodies, whatever they do, the normal separates them. A
normal that turns with the features that face each other keeps them level, and lasts longest near an impact.
"""

import math

from particlesim.core.jit import kernel
from particlesim.core.math3d import add, axpy, cross, dot, inverse_rotate, load_vec3, norm, rotate, scale, sub

# Ways that a normal may go: it stands, turns with the first body, with the second, or with an edge of each.
STANDING = 0
_WITH_FIRST = 1
_WITH_EDGES = 3
_WAYS = 4
ANY_WAY = -1

# Refinements of a proven step, which is shorter than it could be where other corners come to the fore.
_REFINEMENTS = 3


@kernel
def farthest(vertex, first, last, direction, change, time):
    """How far vertices ``first .. last`` reach along ``direction + time * change``, and how fast this grows."""
    if first == last:
        return 0.0, 0.0
    towards = axpy(direction, change, time)
    most, corner = -math.inf, first
    for v in range(first, last):
        reach = dot(load_vec3(vertex, v), towards)
        if reach > most:
            most, corner = reach, v
    return most, dot(load_vec3(vertex, corner), change)


@kernel
def _proven_step(vertex, range_i, way_i, range_j, way_j, gap, parting, bend, most):
    """For how long [s], ``most`` at the most, a normal certainly goes on separating two bodies.

    ``gap`` [m] lies between them along the normal, their centroids part at ``parting`` [m/s], corners bend away from
    their straight ways by ``bend`` [m/s^2] at the most. ``way`` is the normal in body axes, outwards, and how it
    turns there. What is left of the gap is a concave function of time: between a chord's zero, which is too early,
    and a tangent's, which is too late.
    """
    reach_i, rate_i = farthest(vertex, range_i[0], range_i[1], way_i[0], way_i[1], 0.0)
    reach_j, rate_j = farthest(vertex, range_j[0], range_j[1], way_j[0], way_j[1], 0.0)
    gap += reach_i + reach_j
    sure, late = 0.0, most
    left_sure = gap - reach_i - reach_j
    for refinement in range(_REFINEMENTS):
        slope = parting - bend * sure - rate_i - rate_j
        if slope < 0.0:
            late = min(late, sure - left_sure / slope)
        reach_i, rate_i = farthest(vertex, range_i[0], range_i[1], way_i[0], way_i[1], late)
        reach_j, rate_j = farthest(vertex, range_j[0], range_j[1], way_j[0], way_j[1], late)
        left_late = gap + (parting - 0.5 * bend * late) * late - reach_i - reach_j
        if left_late >= 0.0:
            return late
        sure += (late - sure) * left_sure / (left_sure - left_late)
        if refinement + 1 == _REFINEMENTS:
            break
        reach_i, rate_i = farthest(vertex, range_i[0], range_i[1], way_i[0], way_i[1], sure)
        reach_j, rate_j = farthest(vertex, range_j[0], range_j[1], way_j[0], way_j[1], sure)
        left_sure = max(0.0, gap + (parting - 0.5 * bend * sure) * sure - reach_i - reach_j)
    return sure


@kernel
def facing_edge(vertex, first, last, direction):
    """From the vertex that reaches farthest along ``direction`` to the one that comes next.

    Returns how far the second and the third lag behind the first as well: (edge, lag, lag).
    """
    best = second = first
    reach = nearly = hardly = -math.inf
    for v in range(first, last):
        r = dot(load_vec3(vertex, v), direction)
        if r > reach:
            best, second, reach, nearly, hardly = v, best, r, reach, nearly
        elif r > nearly:
            second, nearly, hardly = v, r, nearly
        else:
            hardly = max(hardly, r)
    edge = sub(load_vec3(vertex, second), load_vec3(vertex, best)) if first < last else (0.0, 0.0, 0.0)
    return edge, reach - nearly, reach - hardly


@kernel
def turning_with_edges(edge_i, with_i, edge_j, with_j, normal):
    """How a normal turns that stays across an edge of each of two bodies; (0, 0, 0) if the edges are parallel.

    ``with_i`` and ``with_j`` are how it turns with either body.
    """
    across_i, across_j = cross(normal, edge_i), cross(edge_j, normal)
    area = dot(edge_i, across_j)
    turning = (0.0, 0.0, 0.0)
    if area != 0.0:
        turning = axpy(scale(across_j, dot(with_i, edge_i) / area), across_i, dot(with_j, edge_j) / area)
    return turning


@kernel
def step_of_turning(
    vertex, range_i, body_i, range_j, body_j, normal, turning, gap, offset, velocity, speed, bend, most
):
    """The proven step (see _proven_step) of a normal that turns at ``turning`` [1/s].

    A body is (size, orientation, angular velocity) here; ``offset`` and ``velocity`` are of the second from the
    first, ``speed`` bounds that of any two of their points. A corner at r moves along the normal n at n . (w x r),
    which is r . (n x w), and gains r . n' by the normal's own turning.
    """
    size_i, turn_i, spin_i = body_i
    size_j, turn_j, spin_j = body_j
    back, turning_back = scale(normal, -1.0), scale(turning, -1.0)
    way_i = (
        scale(inverse_rotate(turn_i, normal), size_i),
        scale(inverse_rotate(turn_i, add(turning, cross(normal, spin_i))), size_i),
    )
    way_j = (
        scale(inverse_rotate(turn_j, back), size_j),
        scale(inverse_rotate(turn_j, add(turning_back, cross(back, spin_j))), size_j),
    )
    rate = norm(turning)
    # Along a turning normal n, corners a vector s apart bend by n'' . s + 2 n' . s' + n . s''.
    bend += rate * (rate * speed[1] + 2.0 * speed[0])
    parting = dot(velocity, normal) + dot(offset, turning)
    return _proven_step(vertex, range_i, way_i, range_j, way_j, gap, parting, bend, most)


@kernel
def _turning_of(way, vertex, range_i, body_i, range_j, body_j, normal):
    """How a normal turns [1/s] that goes a way (see ``longest_proven_step``)."""
    if way == STANDING:
        return 0.0, 0.0, 0.0
    with_i, with_j = cross(body_i[2], normal), cross(body_j[2], normal)
    if way != _WITH_EDGES:
        return with_i if way == _WITH_FIRST else with_j
    edge_i, _, _ = facing_edge(vertex, range_i[0], range_i[1], inverse_rotate(body_i[1], normal))
    edge_j, _, _ = facing_edge(vertex, range_j[0], range_j[1], inverse_rotate(body_j[1], scale(normal, -1.0)))
    return turning_with_edges(rotate(body_i[1], edge_i), with_i, rotate(body_j[1], edge_j), with_j, normal)


@kernel
def longest_proven_step(
    vertex, range_i, body_i, range_j, body_j, normal, way, gap, offset, velocity, speed, bend, most
):
    """For how long [s], ``most`` at the most, a normal is proven to go on separating two bodies, if it goes a ``way``.

    It stands, or turns with either body, or with an edge of each; ANY_WAY is the best of these. The other arguments are
    those of ``step_of_turning``. Returns the time, and the way.
    """
    longest, best = -1.0, STANDING
    for each in range(_WAYS):
        if longest < most and way in (each, ANY_WAY):
            turning = _turning_of(each, vertex, range_i, body_i, range_j, body_j, normal)
            step = step_of_turning(
                vertex, range_i, body_i, range_j, body_j, normal, turning, gap, offset, velocity, speed, bend, most
            )
            if step > longest:
                longest, best = step, each
    return longest, best
