"""Two smooth spheres that strike each other and nothing else: most islands in a gas of spheres.

They need no event queue, as there is one event. What it does to them is worked out here on plain numbers, by the
formulas of ``impact.resolve_contacts`` in the same order: the result is the same to the last bit. Without it all
islands of a gas of spheres take two to three times as long.
"""

from __future__ import annotations

import math

from particlesim.core.jit import kernel
from particlesim.core.math3d import axpy, cross, dot, norm, scale, set_vec3, sub, to_vec3
from particlesim.dynamics.ccd.time_of_impact import sphere_half_space_impact
from particlesim.dynamics.ccd.touch import point_velocity
from particlesim.dynamics.contact.booking import IMPACTS, LOST, VIRIAL
from particlesim.dynamics.contact.law import has_friction, restitution_of
from particlesim.dynamics.events.paths import UNCHAINED, UNDISTURBED, write_segment
from particlesim.dynamics.settings import APPROACH_TOLERANCE
from particlesim.geometry.support import half_space_plane, is_sphere
from particlesim.model.bodies import angular_velocity_of, per_mass, placed
from particlesim.model.domain import nearest_image
from particlesim.model.free_motion import advance_path, path_of_body, set_pose

# What is left of the approach, as a fraction of it, above which the impulse was not all that was needed: rounding.
_LEFT_APPROACH = 1e-3


@kernel
def strike_alone(system, predicted, i, j):
    """Whether an island of i and j is two spheres, without friction, gravity and obstacles, with one impact."""
    first, pairs = predicted.first, predicted.pair
    k = first[i]
    only_impact = k >= 0 and pairs[k, 1] == j and (k + 1 == len(pairs) or pairs[k + 1, 0] != i) and first[j] < 0
    gravity, shapes = to_vec3(system.domain[0].gravity), system.shapes
    free = dot(gravity, gravity) == 0.0 and system.bounded == system.particles and len(system.motion) == 0
    free = free and system.meshes is None
    spheres = is_sphere(shapes, system.body[i].shape_row) and is_sphere(shapes, system.body[j].shape_row)
    return only_impact and free and spheres and not has_friction(system, system.body[i], system.body[j])


@kernel
def _strikes_half_space(system, position, velocity, radius, duration):
    """Whether a sphere without acceleration strikes any half-space."""
    strikes = False
    for k in range(system.bounded, len(system.body)):
        b = system.body[k]
        inward = scale(half_space_plane(system.shapes, placed(b))[0], -1.0)
        room = dot(inward, sub(to_vec3(b.position), position)) - radius
        strikes = strikes or sphere_half_space_impact(room, dot(inward, velocity), 0.0, duration) < math.inf
    return strikes


@kernel
def _inverse_mass_at(b, orientation, lever_arm, normal):
    """How much speed along ``normal`` a unit impulse along it gives a point (see impact.py) [1/kg]."""
    lever = cross(lever_arm, normal)
    return per_mass(b, dot(normal, normal)) + dot(
        lever, angular_velocity_of(orientation, lever, to_vec3(b.principal_inertia))
    )


@kernel
def _record(b, clock, i, time, after, segment):
    """Write the two segments of a sphere with one impact at ``time``, and its record just ``after`` it."""
    write_segment(segment[0], b, i, 0.0)
    position, orientation, velocity, momentum = after
    set_pose(b, position, orientation, velocity)
    set_vec3(b.angular_momentum, momentum)
    write_segment(segment[1], b, i, time)
    b.time, b.disturbed = time, 1
    clock.first_segment, clock.stamp, clock.impacts = UNCHAINED, 1, 1


@kernel
def resolve_sphere_pair(system, clock, i, j, interval, accumulator, segment):
    """Resolve the one impact of two spheres at a time [s] of an interval (time, end), and write their four segments.

    False, with nothing changed, if that may not be all that happens to them until the end.
    """
    time, end = interval
    a, b = system.body[i], system.body[j]
    path_a = advance_path(path_of_body(system, i), to_vec3(a.principal_inertia), time)
    path_b = advance_path(path_of_body(system, j), to_vec3(b.principal_inertia), time)
    (x_a, q_a, v_a), (x_b, q_b, v_b) = path_a[:3], path_b[:3]
    offset = nearest_image(sub(x_b, x_a), system.domain[0].period)
    distance = norm(offset)
    if distance == 0.0 or clock[i].first_segment != UNDISTURBED or clock[j].first_segment != UNDISTURBED:
        return False
    normal = scale(offset, 1.0 / distance)
    separation = distance - 0.5 * (a.scale + b.scale)
    arm_a = scale(normal, 0.5 * (a.scale + separation))
    arm_b = sub(arm_a, offset)
    of_a, of_b = point_velocity(a, path_a, arm_a), point_velocity(b, path_b, arm_b)
    speed = -dot(of_a, normal) + dot(of_b, normal)
    if speed >= -(APPROACH_TOLERANCE * (norm(of_a) + norm(of_b)) + system.domain[0].rest_speed):
        return False
    inverse_mass = _inverse_mass_at(a, q_a, arm_a, normal) + _inverse_mass_at(b, q_b, arm_b, normal)
    restitution = restitution_of(system, a, b)
    impulse = (1.0 + restitution) * (-speed / inverse_mass)
    v_a = axpy(v_a, scale(normal, -impulse), per_mass(a, 1.0))
    v_b = axpy(v_b, scale(normal, impulse), per_mass(b, 1.0))
    if (
        dot(sub(v_b, v_a), normal) <= -_LEFT_APPROACH * speed
        or _strikes_half_space(system, x_a, v_a, a.radius, end - time)
        or _strikes_half_space(system, x_b, v_b, b.radius, end - time)
    ):
        return False
    momentum_a = axpy(to_vec3(a.angular_momentum), scale(cross(arm_a, normal), -impulse), 1.0)
    momentum_b = axpy(to_vec3(b.angular_momentum), scale(cross(arm_b, normal), impulse), 1.0)
    _record(a, clock[i], i, time, (x_a, q_a, v_a, momentum_a), segment[:2])
    _record(b, clock[j], j, time, (x_b, q_b, v_b, momentum_b), segment[2:4])
    accumulator[VIRIAL] += impulse * dot(offset, normal)
    accumulator[IMPACTS] += 1
    if len(accumulator) > LOST:
        accumulator[LOST] -= 0.5 * (1.0 - restitution) * impulse * speed
    return True
