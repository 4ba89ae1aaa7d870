"""When two bodies first meet along their paths: closed forms for spheres, a search that proves its steps for the rest.

The search knows how fast the separation of two bodies can fall at most: along the normal of the nearest points they
close in no faster than their centroids do, plus what their rotation can add. A separation divided by this speed is a
time in which they cannot meet (conservative advancement: B. Mirtich, Impulse-based Dynamic Simulation of Rigid Body
Systems, PhD thesis, Berkeley 1996, section 2.3.2). The same holds backwards from a later moment, and two such times
that overlap prove all that lies between: so the search may look far ahead and yet passes no impact.

A body is (shape, size, radius, principal moments), a path (position, orientation, velocity, angular momentum,
acceleration) at time 0.
"""

import math

from particlesim.constants import IMPACT_TOLERANCE, SINKING, SPHERE
from particlesim.jit import kernel
from particlesim.motion import free_rotation, spin_of
from particlesim.narrow_phase.pair import nearest_image, pair_separation
from particlesim.narrow_phase.walls import wall_normal, wall_separation
from particlesim.vec import along, cross, dot, norm, scaled, sub

# Looks at the separation in one search. Few searches take more than twenty.
_MAX_LOOKS = 400

# How far ahead the search looks, in times that are proven: while the separation falls, and while it grows.
_AHEAD_FALLING = 4.0
_AHEAD_GROWING = 16.0


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
def _spin_bounds(body, path):
    """Angular velocity now, its largest length ever, and how fast it can change.

    The angular velocity w of a free body changes as -I^-1 (w x L), and w x L = w x (I - c) w for any number c.
    """
    a, b, c = body[3]
    least, most = min(a, b, c), max(a, b, c)
    spin = spin_of(path[1], path[3], body[3])
    fastest = norm(path[3]) / least
    return spin, fastest, fastest * fastest * (most - least) / (2.0 * least)


@kernel(inline=True)
def _turning(radius, bounds, normal, duration):
    """How fast rotation can move a surface along ``normal`` within ``duration`` [m/s]."""
    spin, fastest, change = bounds
    return radius * min(fastest, norm(cross(normal, spin)) + change * duration)


@kernel(inline=True)
def _place(kind, body, path, time):
    """Position and orientation at ``time``; the orientation of a sphere does not matter."""
    position, turn, velocity, momentum, acceleration = path
    position = along(along(position, velocity, time), acceleration, 0.5 * time * time)
    if kind != SPHERE:
        turn = free_rotation(turn, momentum, body[3], time)
    return position, turn


@kernel
def _separation_at(table, lower, upper, period, body_i, path_i, body_j, path_j, wall, time, points):
    """Separation and normal of body i and wall ``wall``, or body j if that is -1, at ``time``."""
    x, q = _place(table.kind[body_i[0]], body_i, path_i, time)
    if wall >= 0:
        separation = wall_separation(table, lower, upper, wall, body_i[0], body_i[1], q, x)
        normal = wall_normal(wall)
    else:
        y, p = _place(table.kind[body_j[0]], body_j, path_j, time)
        offset = nearest_image(sub(y, x), period)
        separation, normal = pair_separation(table, body_i[0], body_i[1], q, body_j[0], body_j[1], p, offset, points)
    return separation, normal


@kernel
def _closing(velocity, acceleration, normal, start, end, sign):
    """The largest speed at which bodies with this relative velocity at time 0 close in (sign -1) or part (+1)."""
    at_start = dot(velocity, normal) + start * dot(acceleration, normal)
    at_end = dot(velocity, normal) + end * dot(acceleration, normal)
    return max(0.0, sign * at_start, sign * at_end)


@kernel(inline=True)
def _first_root(where, depth, tolerance, early, outside, late, inside, points):
    """The moment in ``early .. late`` when the separation falls to between 0 and the tolerance, by regula falsi.

    The Illinois variant halves the weight of an end that is kept twice in a row and so converges faster than
    linearly (M. Dowell, P. Jarratt, BIT 11 (1971) 168).
    """
    if inside >= 0.0:
        early, outside = late, 0.0
    gap = outside
    side = 0
    for _ in range(_MAX_LOOKS):
        if gap <= tolerance:
            break
        # Aim between nothing and the tolerance, so that the end kept is the one where they are apart.
        middle = late + (early - late) * (inside - 0.5 * tolerance) / (inside - outside)
        if not early < middle < late:
            break
        separation, _ = _separation_at(*where, middle, points)
        separation += depth
        if separation >= 0.0:
            early, outside, gap = middle, separation, separation
            inside *= 0.5 if side == 1 else 1.0
            side = 1
        else:
            late, inside = middle, separation
            outside *= 0.5 if side == -1 else 1.0
            side = -1
    return early


@kernel
def first_touch(table, lower, upper, period, body_i, path_i, body_j, path_j, wall, start, end, parted, points):
    """When the separation of two bodies first falls to nothing in ``start .. end`` [s]; inf if it does not.

    The partner is wall ``wall``, or body j if that is -1. With ``parted`` they touch at the start and part: then it
    is when they have sunk into each other by SINKING of their sizes, which ends the search among touches that are
    only rounding. The moment returned is one at which they are still apart, by IMPACT_TOLERANCE of their sizes at most.
    """
    where = table, lower, upper, period, body_i, path_i, body_j, path_j, wall
    sizes = body_i[1] + (body_j[1] if wall < 0 else 0.0)
    tolerance = IMPACT_TOLERANCE * sizes
    velocity, acceleration = scaled(path_i[2], -1.0), scaled(path_i[4], -1.0)
    spin_i = _spin_bounds(body_i, path_i)
    spin_j, radius_j = spin_i, 0.0
    if wall < 0:
        velocity, acceleration = sub(path_j[2], path_i[2]), sub(path_j[4], path_i[4])
        spin_j, radius_j = _spin_bounds(body_j, path_j), body_j[2]
    low = start
    gap, normal = _separation_at(*where, low, points)
    # Everything below looks at the separation plus this.
    depth = (max(0.0, -gap) + SINKING * sizes) if parted else 0.0
    gap += depth
    if gap <= tolerance:
        return low
    ahead = _AHEAD_FALLING
    guess = math.inf
    for _ in range(_MAX_LOOKS):
        turning = _turning(body_i[2], spin_i, normal, end) + _turning(radius_j, spin_j, normal, end)
        speed = _closing(velocity, acceleration, normal, low, end, -1.0) + turning
        if gap >= speed * (end - low):
            return math.inf
        sure = gap / speed
        high = min(low + min(max(guess, sure), ahead * sure), end)
        beyond, normal_beyond = _separation_at(*where, high, points)
        beyond += depth
        if beyond <= tolerance:
            return _first_root(where, depth, tolerance, low, gap, high, beyond, points)
        turning = _turning(body_i[2], spin_i, normal_beyond, end) + _turning(radius_j, spin_j, normal_beyond, end)
        back = _closing(velocity, acceleration, normal_beyond, low, high, 1.0) + turning
        unproven = (high - low - sure) * back - beyond
        # What could hide between the two proven stretches is no deeper than half of what is left to close and part.
        if unproven <= SINKING * sizes:
            falling = (gap - beyond) / (high - low)
            guess = beyond / falling if falling > 0.0 else math.inf
            ahead = _AHEAD_FALLING if falling > 0.0 else _AHEAD_GROWING
            low, gap, normal = high, beyond, normal_beyond
        else:
            guess = 0.5 * (high - low)
            ahead = _AHEAD_FALLING
    return low
