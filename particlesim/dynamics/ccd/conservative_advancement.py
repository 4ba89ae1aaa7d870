"""Conservative steps: for how long a normal that separates two bodies certainly goes on to do so.

A vertex moves along a normal at a speed that is known now, and bends away from its straight path by so much at most:
while that leaves a gap between all vertices of the two cores, whatever they do, the normal separates the bodies. A
normal that turns with the features that face each other keeps them level, and lasts longest near an impact.

A side is (core, orientation, angular velocity) of a body, a core (what support.core_of says of it, size); that of a
half-space has no vertices, its normal turns with it. ``hull`` are the arrays (vertex, link) of the shape table. What
is known of the gap is (normal, gap [m], offset [m], velocity [m/s], bounds, acceleration bound [m/s^2]): offset and
velocity are of the second body from the first, bounds those of the speed and the distance of any two of their points.
"""

import math

from particlesim.core.jit import kernel
from particlesim.core.math3d import add, axpy, cross, dot, inverse_rotate, load_vec3, norm, rotate, scale, sub
from particlesim.dynamics.settings import STEP_REFINEMENTS
from particlesim.geometry.shape_links import ring_of
from particlesim.geometry.support import farthest_vertex, is_climbed

# Motions of a normal: it stands, turns with the first body, with the second, or with an edge of each.
STANDING = 0
_WITH_FIRST = 1
WITH_SECOND = 2
_WITH_EDGES = 3
_MOTIONS = 4
ANY_MOTION = -1

_NOWHERE = (0.0, 0.0, 0.0)


@kernel
def core_reach(hull, core, direction, change, time):
    """How far a core reaches along ``direction + time * change`` (body axes), and how fast this grows."""
    (first, last, _), _ = core
    if first == last:
        return 0.0, 0.0
    towards = axpy(direction, change, time)
    best = load_vec3(hull[0], farthest_vertex(hull, core[0], towards))
    return dot(best, towards), dot(best, change)


@kernel
def _step(hull, cores, ways, gap, rates, longest):
    """For how long [s], ``longest`` at most, a normal certainly goes on separating two bodies.

    ``gap`` [m] lies between them along the normal; ``rates`` are the normal velocity of their centroids [m/s] and the
    bound of how vertices bend away from straight paths [m/s^2]. A way is the normal in body axes, outwards, and how it
    turns there. What is left of the gap is a concave function of time: between a chord's zero, which is too early, and
    a tangent's, which is too late.
    """
    (core_a, core_b), (way_a, way_b), (normal_velocity, acceleration) = cores, ways, rates
    reach_a, rate_a = core_reach(hull, core_a, way_a[0], way_a[1], 0.0)
    reach_b, rate_b = core_reach(hull, core_b, way_b[0], way_b[1], 0.0)
    gap += reach_a + reach_b
    sure, late = 0.0, longest
    left_sure = gap - reach_a - reach_b
    for refinement in range(STEP_REFINEMENTS):
        slope = normal_velocity - acceleration * sure - rate_a - rate_b
        if slope < 0.0:
            late = min(late, sure - left_sure / slope)
        reach_a, rate_a = core_reach(hull, core_a, way_a[0], way_a[1], late)
        reach_b, rate_b = core_reach(hull, core_b, way_b[0], way_b[1], late)
        left_late = gap + (normal_velocity - 0.5 * acceleration * late) * late - reach_a - reach_b
        if left_late >= 0.0:
            return late
        sure += (late - sure) * left_sure / (left_sure - left_late)
        if refinement + 1 == STEP_REFINEMENTS:
            break
        reach_a, rate_a = core_reach(hull, core_a, way_a[0], way_a[1], sure)
        reach_b, rate_b = core_reach(hull, core_b, way_b[0], way_b[1], sure)
        left_sure = max(0.0, gap + (normal_velocity - 0.5 * acceleration * sure) * sure - reach_a - reach_b)
    return sure


@kernel
def _next_of_ring(hull, core, vertex, but, direction):
    """The neighbour of a vertex, other than ``but``, that reaches farthest along ``direction``, and how far."""
    best, reach = vertex, -math.inf
    first, last = ring_of(hull[1], core, vertex)
    for k in range(first, last):
        r = dot(load_vec3(hull[0], hull[1][k]), direction)
        if r > reach and hull[1][k] != but:
            best, reach = hull[1][k], r
    return best, reach


@kernel
def _facing_edge_of_rings(hull, core, direction):
    """As ``facing_edge``, of a core of many vertices: the second is a neighbour of the first, the third of either."""
    best = farthest_vertex(hull, core, direction)
    second, nearly = _next_of_ring(hull, core, best, best, direction)
    _, beside_best = _next_of_ring(hull, core, best, second, direction)
    _, beside_second = _next_of_ring(hull, core, second, best, direction)
    start = load_vec3(hull[0], best)
    reach = dot(start, direction)
    return sub(load_vec3(hull[0], second), start), reach - nearly, reach - max(beside_best, beside_second)


@kernel
def facing_edge(hull, core, direction):
    """From the vertex of a core that reaches farthest along ``direction`` to the one that comes next.

    Returns how far the second and the third lag behind the first as well: (edge, lag, lag).
    """
    vertex, (first, last, _) = hull[0], core[0]
    if first == last:
        return _NOWHERE, 0.0, 0.0
    if is_climbed(core[0]):
        return _facing_edge_of_rings(hull, core[0], direction)
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
    return sub(load_vec3(vertex, second), load_vec3(vertex, best)), reach - nearly, reach - hardly


@kernel
def turning_with_edges(edge_a, with_a, edge_b, with_b, normal):
    """How a normal turns that stays across an edge of each of two bodies; (0, 0, 0) if the edges are parallel.

    ``with_a`` and ``with_b`` are how it turns with either body.
    """
    across_a, across_b = cross(normal, edge_a), cross(edge_b, normal)
    area = dot(edge_a, across_b)
    turning = _NOWHERE
    if area != 0.0:
        turning = axpy(scale(across_b, dot(with_a, edge_a) / area), across_a, dot(with_b, edge_b) / area)
    return turning


@kernel
def _way_of(side, normal, turning):
    """A normal and how it turns in the body axes of a side, scaled so that vertices of size 1 reach along it.

    A vertex at r moves along the normal n at n . (w x r), which is r . (n x w), and gains r . n' by the normal's own
    turning.
    """
    (_, size), orientation, angular_velocity = side
    return (
        scale(inverse_rotate(orientation, normal), size),
        scale(inverse_rotate(orientation, add(turning, cross(normal, angular_velocity))), size),
    )


@kernel
def conservative_step(hull, side_a, side_b, known, turning, longest):
    """For how long [s], ``longest`` at most, a normal that turns at ``turning`` [1/s] separates two bodies."""
    normal, gap, offset, velocity, (speed, distance), acceleration = known
    ways = _way_of(side_a, normal, turning), _way_of(side_b, scale(normal, -1.0), scale(turning, -1.0))
    rate = norm(turning)
    # Along a turning normal n, points a vector s apart bend by n'' . s + 2 n' . s' + n . s''.
    acceleration += rate * (rate * distance + 2.0 * speed)
    normal_velocity = dot(velocity, normal) + dot(offset, turning)
    return _step(hull, (side_a[0], side_b[0]), ways, gap, (normal_velocity, acceleration), longest)


@kernel
def _turning_of(motion, hull, side_a, side_b, normal):
    """How a normal turns [1/s] that has a motion."""
    if motion == STANDING:
        return _NOWHERE
    with_a, with_b = cross(side_a[2], normal), cross(side_b[2], normal)
    if motion != _WITH_EDGES:
        return with_a if motion == _WITH_FIRST else with_b
    edge_a, _, _ = facing_edge(hull, side_a[0], inverse_rotate(side_a[1], normal))
    edge_b, _, _ = facing_edge(hull, side_b[0], inverse_rotate(side_b[1], scale(normal, -1.0)))
    return turning_with_edges(rotate(side_a[1], edge_a), with_a, rotate(side_b[1], edge_b), with_b, normal)


@kernel
def longest_step(hull, side_a, side_b, known, motion, longest):
    """The conservative step of a normal that has a ``motion``, or the longest of all: the time, and its motion."""
    found, best = -1.0, STANDING
    for each in range(_MOTIONS):
        if found < longest and motion in (each, ANY_MOTION):
            turning = _turning_of(each, hull, side_a, side_b, known[0])
            step = conservative_step(hull, side_a, side_b, known, turning, longest)
            if step > found:
                found, best = step, each
    return found, best
