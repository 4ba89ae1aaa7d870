"""When two bodies first touch along their paths: closed forms for spheres, conservative advancement for the rest.

The search knows two bodies to be apart along the normal of their nearest points. It lets the normal stand, or turn with
either body or with an edge of each, and knows how fast every vertex moves along it. Taking vertices to go straight, and
allowing for the most that rotation can bend their paths, gives a time in which that normal certainly goes on separating
them; there the next one is taken. No step can pass an impact, however short, and near one the steps converge to it
quadratically: over short times the vertices do go straight, and the normal that turns with the features in contact
keeps them level. (Conservative advancement, B. Mirtich, Impulse-based Dynamic Simulation of Rigid Body Systems, PhD
thesis, Berkeley 1996, section 2.3.2, bounds the speed of all points alike and closes in on an impact by a constant
factor.)
"""

import math

from particlesim.core.jit import kernel
from particlesim.core.math3d import add, axpy, cross, dot, inverse_rotate, norm, scale, sub, to_vec3
from particlesim.dynamics.ccd.conservative_advancement import (
    ANY_MOTION,
    STANDING,
    WITH_SECOND,
    conservative_step,
    core_reach,
    longest_step,
)
from particlesim.dynamics.settings import IMPACT_TOLERANCE, KEEP_NORMAL_MOTION, MAX_ADVANCEMENTS
from particlesim.geometry.narrow_phase.pair import pair_separation
from particlesim.geometry.support import core_of, is_half_space, is_sphere
from particlesim.model.bodies import angular_velocity_of
from particlesim.model.domain import nearest_image
from particlesim.model.free_motion import free_rotation
from particlesim.model.prescribed_motion import swing_acceleration, swing_shift

_STILL = (0.0, 0.0, 0.0)


# ---- closed forms --------------------------------------------------------------------------------------------------


@kernel
def sphere_sphere_impact(offset, velocity, reach, duration):
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


@kernel
def sphere_half_space_impact(room, speed, acceleration, duration):
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


@kernel
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


# ---- bounds of motion ----------------------------------------------------------------------------------------------


@kernel
def sized_core(system, b):
    """A body's core and its size, as the steps of conservative advancement take them."""
    return core_of(system.shapes.shape[b.shape_row]), b.scale


@kernel
def _core_radius(system, b):
    """How far points of a body's core are from its position at most [m]; rotation moves nothing else that counts."""
    if is_half_space(system.shapes, b.shape_row):
        return 0.0
    return max(b.radius - system.shapes.shape[b.shape_row].rounding * b.scale, 0.0)


@kernel
def largest_angular_speed(b, path):
    """The largest angular speed of a free body [rad/s]: it keeps its angular momentum and its energy."""
    inertia = b.principal_inertia
    least = min(inertia[0], inertia[1], inertia[2])
    twice = dot(path[3], angular_velocity_of(path[1], path[3], to_vec3(inertia)))
    return min(norm(path[3]) / least, math.sqrt(twice / least))


@kernel
def _surface_speed(system, b, path):
    """The largest speed of a point of a body by its rotation [m/s]."""
    return _core_radius(system, b) * largest_angular_speed(b, path)


@kernel
def _surface_speed_bound(system, b, path):
    """A bound of the speed of any point of a body's core by its rotation [m/s], sooner had than the speed itself."""
    inertia = b.principal_inertia
    return _core_radius(system, b) * norm(path[3]) / min(inertia[0], inertia[1], inertia[2])


@kernel
def largest_displacement(system, a, b, paths, duration):
    """How far two surfaces can come nearer within ``duration`` at most [m]."""
    path_a, path_b = paths
    speed = norm(sub(path_b[2], path_a[2])) + 0.5 * relative_acceleration(paths) * duration
    return (speed + _surface_speed(system, a, path_a) + _surface_speed(system, b, path_b)) * duration


@kernel
def relative_acceleration(paths):
    """The largest acceleration of the positions of two bodies against each other [m/s^2]."""
    path_a, path_b = paths
    return norm(sub(path_b[4], path_a[4])) + swing_acceleration(path_b[5])


@kernel
def _vertex_acceleration(system, b, path):
    """The largest acceleration of a point of a body's core by its rotation [m/s^2].

    It is w x (w x r) + w' x r, and the angular velocity w of a free body changes as w' = -I^-1 (w x L), where
    w x L = w x (I - c) w for any number c.
    """
    radius = _core_radius(system, b)
    if radius == 0.0:
        return 0.0
    p, q, r = to_vec3(b.principal_inertia)
    whole = norm(path[3])
    twice = dot(path[3], angular_velocity_of(path[1], path[3], (p, q, r)))
    x, y, z = (
        min(whole / p, math.sqrt(twice / p)),
        min(whole / q, math.sqrt(twice / q)),
        min(whole / r, math.sqrt(twice / r)),
    )
    change = norm((abs(q - r) / p * y * z, abs(r - p) / q * z * x, abs(p - q) / r * x * y))
    fastest = min(largest_angular_speed(b, path), norm((x, y, z)))
    return radius * (fastest * fastest + change)


# ---- advancement ---------------------------------------------------------------------------------------------------


@kernel
def _pose_at(system, b, path, time):
    """Position, orientation and angular velocity at ``time``; those of a sphere's rotation do not matter."""
    position, orientation, velocity, momentum, acceleration, swing = path
    position = axpy(axpy(position, velocity, time), acceleration, 0.5 * time * time)
    if swing[1] != 0.0:
        position = add(position, swing_shift(swing, time)[0])
    spin = _STILL
    if not is_sphere(system.shapes, b.shape_row):
        inertia = to_vec3(b.principal_inertia)
        orientation = free_rotation(orientation, momentum, inertia, time)
        spin = angular_velocity_of(orientation, momentum, inertia)
    return position, orientation, spin


@kernel
def _velocity_at(paths, time):
    """Velocity of the second body against the first at ``time``."""
    path_a, path_b = paths
    velocity = axpy(sub(path_b[2], path_a[2]), sub(path_b[4], path_a[4]), time)
    if path_b[5][1] != 0.0:
        velocity = add(velocity, swing_shift(path_b[5], time)[1])
    return velocity


@kernel
def stays_apart(system, a, b, paths, offset, normal, duration):
    """Whether a normal that stands is proven to separate two bodies, now at ``offset``, for ``duration`` [s]."""
    hull = system.shapes.vertex, system.shapes.link
    path_a, path_b = paths
    core_a, core_b = sized_core(system, a), sized_core(system, b)
    reach_a = core_reach(hull, core_a, scale(inverse_rotate(path_a[1], normal), a.scale), _STILL, 0.0)[0]
    reach_b = core_reach(hull, core_b, scale(inverse_rotate(path_b[1], normal), -b.scale), _STILL, 0.0)[0]
    reach_a += system.shapes.shape[a.shape_row].rounding * a.scale
    reach_b += system.shapes.shape[b.shape_row].rounding * b.scale
    # What nearly touches is left to the search, which knows whether that is an impact.
    gap = dot(offset, normal) - reach_a - reach_b - 2.0 * IMPACT_TOLERANCE * (a.scale + b.scale)
    if gap <= 0.0:
        return False
    # Most are so far apart that not even their fastest points close the gap.
    turning = _surface_speed_bound(system, a, path_a) + _surface_speed_bound(system, b, path_b)
    acceleration = relative_acceleration(paths)
    if gap >= (max(0.0, dot(sub(path_a[2], path_b[2]), normal)) + 0.5 * (acceleration * duration) + turning) * duration:
        return True
    bound = acceleration + _vertex_acceleration(system, a, path_a) + _vertex_acceleration(system, b, path_b)
    side_a = core_a, path_a[1], angular_velocity_of(path_a[1], path_a[3], to_vec3(a.principal_inertia))
    side_b = core_b, path_b[1], angular_velocity_of(path_b[1], path_b[3], to_vec3(b.principal_inertia))
    known = normal, gap, offset, sub(path_b[2], path_a[2]), (0.0, 0.0), bound
    return conservative_step(hull, side_a, side_b, known, _STILL, duration) >= duration


@kernel
def first_touch(system, a, b, paths, interval, depth, simplex, points):
    """When the separation of two bodies first falls to nothing in an interval [s]; inf if it does not.

    With ``depth`` [m] it is when the separation falls to minus that. At the moment returned it is larger, by
    IMPACT_TOLERANCE of their sizes at most. ``simplex`` is the one by which they were nearest before, or NO_SIMPLEX.
    """
    hull, period = (system.shapes.vertex, system.shapes.link), system.domain[0].period
    path_a, path_b = paths
    time, end = interval
    half_space = is_half_space(system.shapes, b.shape_row)
    sizes = a.scale if b.inradius == math.inf else a.scale + b.scale
    tolerance = IMPACT_TOLERANCE * sizes
    core_a, core_b = sized_core(system, a), sized_core(system, b)
    acceleration = relative_acceleration(paths)
    turning = _surface_speed(system, a, path_a) + _surface_speed(system, b, path_b)
    radii = _core_radius(system, a) + _core_radius(system, b)
    displacement = norm(sub(path_b[2], path_a[2])) + acceleration * end
    last_gap, best, bound = math.inf, ANY_MOTION, -1.0
    for _ in range(MAX_ADVANCEMENTS):
        x, q, w = _pose_at(system, a, path_a, time)
        y, p, u = _pose_at(system, b, path_b, time)
        offset = nearest_image(sub(y, x), period)
        gap, normal, simplex = pair_separation(
            system.shapes, (a.shape_row, a.scale, q), (b.shape_row, b.scale, p), offset, simplex, points
        )
        gap += depth
        if gap <= tolerance:
            return time
        left = end - time
        velocity = _velocity_at(paths, time)
        # Most are so far apart that not even their fastest points close the gap.
        closing = turning + max(0.0, -dot(velocity, normal)) + acceleration * left
        if half_space:
            closing += norm(u) * (norm(offset) + displacement * left + radii)
        if gap - tolerance > closing * left:
            return math.inf
        if bound < 0.0:
            bound = acceleration + _vertex_acceleration(system, a, path_a)
            bound += _vertex_acceleration(system, b, path_b)
        motion = best if gap <= KEEP_NORMAL_MOTION * last_gap else ANY_MOTION
        if half_space:
            motion = WITH_SECOND if dot(u, u) > 0.0 else STANDING
        bounds = displacement + turning, norm(offset) + radii + displacement * left
        # The normal of a half-space must turn with it, on a cone; any other goes the shortest way.
        coning = norm(u) * norm(cross(u, normal)) * bounds[1] if half_space else 0.0
        known = normal, gap, offset, velocity, bounds, bound + coning
        step, best = longest_step(hull, (core_a, q, w), (core_b, p, u), known, motion, left)
        if step >= left:
            return math.inf
        time, last_gap = time + step, gap
    return time
