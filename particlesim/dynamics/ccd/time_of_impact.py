"""When two bodies first meet along their paths: closed forms for spheres, advancement by proven steps for the rest.

The search knows two bodies to be apart along the normal of their nearest points. It lets the normal stand, or turn with
either body or with an edge of each, and knows how fast every corner moves along it. Taking corners to go straight, and
allowing for the most that rotation can bend their ways, gives a time in which that normal certainly goes on separating
them; there the next one is taken. No step can pass an impact, however short, and near one the steps converge to it
quadratically: over short times the corners do go straight, and the normal that turns with the features in contact keeps
them level. (Conservative advancement, B. Mirtich, Impulse-based Dynamic Simulation of Rigid Body Systems, PhD thesis,
Berkeley 1996, section 2.3.2, bounds the speed of all corners alike and closes in on an impact by a constant factor.)

A body is (shape, size, radius, principal moments), a path (position, orientation, velocity, angular momentum,
acceleration) at time 0.
"""

import math

from particlesim.core.constants import IMPACT_TOLERANCE, SPHERE
from particlesim.core.jit import kernel
from particlesim.core.math3d import axpy, dot, inverse_rotate, norm, scale, sub
from particlesim.dynamics.ccd.conservative_advancement import (
    ANY_WAY,
    STANDING,
    farthest,
    longest_proven_step,
    step_of_turning,
)
from particlesim.geometry.narrow_phase.half_space import wall_normal, wall_separation
from particlesim.geometry.narrow_phase.pair import nearest_image, pair_separation
from particlesim.model.free_motion import free_rotation, spin_of

# Looks at the separation in one search, which ends where it is then. Few searches take more than ten.
_MAX_LOOKS = 60

# The way that was best in the last look is tried alone as long as each look leaves at most this fraction of the gap.
_CLOSING_IN = 0.25


@kernel(inline=True)
def spheres_meet(offset, velocity, reach, duration):
    """When two points at ``offset`` moving apart at ``velocity`` come within ``reach``; inf if not in ``duration``.

    0 if they are nearer now and approach. The root of |offset + t velocity| = reach without cancellation.
    """
    closing = dot(offset, velocity)
    time = math.inf
    if closing < 0.0:
        speed2 = dot(velocity, velocity)
        room = dot(offset, offset) - reach * reach
        if room <= 0.0:
            time = 0.0
        else:
            under_root = closing * closing - speed2 * room
            if under_root >= 0.0:
                time = room / (math.sqrt(under_root) - closing)
    return time if time <= duration else math.inf


@kernel(inline=True)
def sphere_meets_wall(room, speed, acceleration, duration):
    """When a distance that shrinks at ``speed``, itself growing by ``acceleration``, is used up; inf if it is not."""
    time = math.inf
    room = max(room, 0.0)
    under_root = speed * speed + 2.0 * acceleration * room
    if under_root >= 0.0:
        root = math.sqrt(under_root)
        if speed > 0.0:
            time = 2.0 * room / (speed + root)
        elif acceleration > 0.0:
            time = (root - speed) / acceleration
    return time if time <= duration else math.inf


@kernel(inline=True)
def spheres_near(offset, velocity, reach, duration):
    """From when to when two points are within ``reach``, in 0 .. ``duration``; the first is inf if never."""
    speed2 = dot(velocity, velocity)
    closing = dot(offset, velocity)
    room = dot(offset, offset) - reach * reach
    first, last = math.inf, duration
    if speed2 == 0.0:
        first = 0.0 if room <= 0.0 else math.inf
    else:
        under_root = closing * closing - speed2 * room
        if under_root >= 0.0:
            root = math.sqrt(under_root)
            first = max((-closing - root) / speed2, 0.0)
            last = min((root - closing) / speed2, duration)
            if first > last:
                first = math.inf
    return first, last


@kernel
def _fastest_corner(body, path):
    """The largest speed of a point of a body by its rotation [m/s]."""
    return body[2] * _fastest_spin(body, path)


@kernel
def _fastest_spin(body, path):
    """The largest angular speed of a free body [rad/s]: it keeps its angular momentum and its energy."""
    a, b, c = body[3]
    least = min(a, b, c)
    twice = dot(path[3], spin_of(path[1], path[3], body[3]))
    return min(norm(path[3]) / least, math.sqrt(twice / least))


@kernel(inline=True)
def _turning_speed(kind, body, path):
    """A bound of the speed of any point of a body by its rotation [m/s], sooner had than the speed itself."""
    moments = body[3]
    return body[2] * norm(path[3]) / min(moments[0], moments[1], moments[2]) if kind != SPHERE else 0.0


@kernel
def most_closing(body_i, path_i, body_j, path_j, duration):
    """How far two surfaces can come nearer within ``duration`` at the most [m]."""
    speed = norm(sub(path_j[2], path_i[2])) + 0.5 * norm(sub(path_j[4], path_i[4])) * duration
    return (speed + _fastest_corner(body_i, path_i) + _fastest_corner(body_j, path_j)) * duration


@kernel(inline=True)
def _place(kind, body, path, time):
    """Position, orientation and angular velocity at ``time``; those of a sphere's rotation do not matter."""
    position, turn, velocity, momentum, acceleration = path
    position = axpy(axpy(position, velocity, time), acceleration, 0.5 * time * time)
    spin = (0.0, 0.0, 0.0)
    if kind != SPHERE:
        turn = free_rotation(turn, momentum, body[3], time)
        spin = spin_of(turn, momentum, body[3])
    return position, turn, spin


@kernel(inline=True)
def _bend(kind, body, path):
    """The largest acceleration of a point of a body by its rotation [m/s^2].

    It is w x (w x r) + w' x r, and the angular velocity w of a free body changes as w' = -I^-1 (w x L), where
    w x L = w x (I - c) w for any number c.
    """
    bend = 0.0
    if kind != SPHERE:
        a, b, c = body[3]
        whole = norm(path[3])
        twice = dot(path[3], spin_of(path[1], path[3], body[3]))
        x, y, z = (
            min(whole / a, math.sqrt(twice / a)),
            min(whole / b, math.sqrt(twice / b)),
            min(whole / c, math.sqrt(twice / c)),
        )
        change = norm((abs(b - c) / a * y * z, abs(c - a) / b * z * x, abs(a - b) / c * x * y))
        fastest = min(_fastest_spin(body, path), norm((x, y, z)))
        bend = body[2] * (fastest * fastest + change)
    return bend


@kernel
def stays_apart(table, body_i, path_i, body_j, path_j, offset, normal, duration):
    """Whether a normal that stands is proven to separate two bodies, now at ``offset``, for ``duration`` [s]."""
    vertex, vertex_start = table.vertex, table.vertex_start
    kind_i, kind_j = table.kind[body_i[0]], table.kind[body_j[0]]
    range_i = vertex_start[body_i[0]], vertex_start[body_i[0] + 1]
    range_j = vertex_start[body_j[0]], vertex_start[body_j[0] + 1]
    nothing = (0.0, 0.0, 0.0)
    reach_i, reach_j = body_i[2], body_j[2]
    if kind_i != SPHERE:
        way = scale(inverse_rotate(path_i[1], normal), body_i[1])
        reach_i, _ = farthest(vertex, range_i[0], range_i[1], way, nothing, 0.0)
    if kind_j != SPHERE:
        way = scale(inverse_rotate(path_j[1], normal), -body_j[1])
        reach_j, _ = farthest(vertex, range_j[0], range_j[1], way, nothing, 0.0)
    # What nearly touches is left to the search, which knows whether that is an impact.
    gap = dot(offset, normal) - reach_i - reach_j - 2.0 * IMPACT_TOLERANCE * (body_i[1] + body_j[1])
    if gap <= 0.0:
        return False
    # Most are so far apart that not even their fastest corners close the gap.
    turning = _turning_speed(kind_i, body_i, path_i) + _turning_speed(kind_j, body_j, path_j)
    pull = norm(sub(path_j[4], path_i[4])) * duration
    if gap >= (max(0.0, dot(sub(path_i[2], path_j[2]), normal)) + 0.5 * pull + turning) * duration:
        return True
    bend = norm(sub(path_j[4], path_i[4])) + _bend(kind_i, body_i, path_i) + _bend(kind_j, body_j, path_j)
    now_i = body_i[1], path_i[1], spin_of(path_i[1], path_i[3], body_i[3])
    now_j = body_j[1], path_j[1], spin_of(path_j[1], path_j[3], body_j[3])
    velocity, speed = sub(path_j[2], path_i[2]), (0.0, 0.0)
    step = step_of_turning(
        vertex, range_i, now_i, range_j, now_j, normal, nothing, gap, offset, velocity, speed, bend, duration
    )
    return step >= duration


@kernel
def first_touch(table, lower, upper, period, body_i, path_i, body_j, path_j, wall, start, end, sunk, corners, points):
    """When the separation of two bodies first falls to nothing in ``start .. end`` [s]; inf if it does not.

    The partner is wall ``wall``, or body j if that is -1. With ``sunk`` [m] it is when the separation falls to minus
    that. At the moment returned it is larger, by IMPACT_TOLERANCE of their sizes at the most. ``corners`` are those by
    which hulls are likely to be nearest, or NO_CORNERS.
    """
    vertex, vertex_start = table.vertex, table.vertex_start
    kind_i, kind_j = table.kind[body_i[0]], table.kind[body_j[0]]
    range_i = vertex_start[body_i[0]], vertex_start[body_i[0] + 1]
    range_j = vertex_start[body_j[0]], vertex_start[body_j[0] + 1]
    sizes, radii = body_i[1] + body_j[1], body_i[2] + body_j[2]
    velocity, acceleration = sub(path_j[2], path_i[2]), sub(path_j[4], path_i[4])
    turning = _fastest_corner(body_i, path_i)
    if wall >= 0:
        range_j, sizes, radii = (0, 0), body_i[1], body_i[2]
        velocity, acceleration = scale(path_i[2], -1.0), scale(path_i[4], -1.0)
    else:
        turning += _fastest_corner(body_j, path_j)
    way = norm(velocity) + norm(acceleration) * end
    time, last_gap, best, bend = start, math.inf, ANY_WAY, -1.0
    for _ in range(_MAX_LOOKS):
        x, q, w = _place(kind_i, body_i, path_i, time)
        p, u = q, (0.0, 0.0, 0.0)
        if wall >= 0:
            gap = wall_separation(table, lower, upper, wall, body_i[0], body_i[1], q, x)
            normal = wall_normal(wall)
            offset = (0.0, 0.0, 0.0)
        else:
            y, p, u = _place(kind_j, body_j, path_j, time)
            offset = nearest_image(sub(y, x), period)
            gap, normal, corners = pair_separation(
                table, body_i[0], body_i[1], q, body_j[0], body_j[1], p, offset, corners, points
            )
        gap += sunk
        if gap <= IMPACT_TOLERANCE * sizes:
            return time
        left = end - time
        now = axpy(velocity, acceleration, time)
        # Most are so far apart that not even their fastest corners close the gap.
        closing = turning + max(0.0, -dot(now, normal)) + norm(acceleration) * left
        if gap - IMPACT_TOLERANCE * sizes > closing * left:
            return math.inf
        if bend < 0.0:
            bend = norm(acceleration) + _bend(kind_i, body_i, path_i)
            bend += _bend(kind_j, body_j, path_j) if wall < 0 else 0.0
        way_of_normal = best if gap <= _CLOSING_IN * last_gap else ANY_WAY
        step, best = longest_proven_step(
            vertex,
            range_i,
            (body_i[1], q, w),
            range_j,
            (body_j[1], p, u),
            normal,
            STANDING if wall >= 0 else way_of_normal,
            gap,
            offset,
            now,
            (way + turning, norm(offset) + radii + way * left),
            bend,
            left,
        )
        if step >= left:
            return math.inf
        time, last_gap = time + step, gap
    return time
