"""How surfaces may move in a step, and how far they have come: what is far enough apart need not be looked at."""

from __future__ import annotations

import math

import numpy as np

from particlesim.core.jit import entry_kernel, kernel, without_refcounts
from particlesim.core.math3d import (
    add,
    conjugate,
    cross,
    dot,
    load_vec3,
    norm,
    quat_multiply,
    scale,
    set_quat,
    set_vec3,
    sub,
    to_quat,
    to_vec3,
)
from particlesim.dynamics.ccd.swept_bounds import largest_acceleration
from particlesim.dynamics.settings import CHANGE_HANDED_ON
from particlesim.geometry.narrow_phase.mesh import is_any_near
from particlesim.geometry.support import half_space_plane, is_half_space, is_sphere
from particlesim.model.bodies import KINEMATIC, angular_velocity, placed
from particlesim.model.domain import nearest_image


@kernel
def turning_speed(system, spin, i):
    """How fast the surface of a bounded body that is no sphere moves at most by turning [m/s]."""
    shapes, b = system.shapes, system.body[i]
    still = i >= system.bounded or is_sphere(shapes, b.shape_row)
    return 0.0 if still else norm(load_vec3(spin, i)) * b.radius


@kernel
def _approach(system, spin, i, j, duration):
    """How fast surfaces of two bounded bodies meet at most that may do so in a time [s], 0 if they do not."""
    a, b = system.body[i], system.body[j]
    offset = nearest_image(sub(to_vec3(b.position), to_vec3(a.position)), system.domain[0].period)
    velocity = sub(to_vec3(b.velocity), to_vec3(a.velocity))
    distance = norm(offset)
    if distance == 0.0 or distance - a.radius - b.radius > norm(velocity) * duration:
        return 0.0
    turning = norm(load_vec3(spin, i)) * a.radius + norm(load_vec3(spin, j)) * b.radius
    # What is large is met beside its middle.
    straight = norm(velocity) if j >= system.particles else max(-dot(velocity, offset) / distance, 0.0)
    return straight + turning


@kernel
def _approach_to_plane(system, spin, i, j, duration):
    """How fast a particle nears a half-space that it may meet in a time [s], 0 if it does not."""
    a, b = system.body[i], system.body[j]
    outward, level = half_space_plane(system.shapes, placed(b))
    inward = scale(outward, -1.0)
    offset = sub(to_vec3(a.position), to_vec3(b.position))
    room = -dot(inward, offset) - level - a.radius
    of_plane = add(to_vec3(b.velocity), cross(load_vec3(spin, j), offset))
    speed = dot(inward, sub(to_vec3(a.velocity), of_plane))
    return speed if speed > 0.0 and room <= speed * duration else 0.0


@kernel
def _approach_to_mesh(system, meshes, spin, i, j, duration):
    """How fast surfaces of a particle and a mesh meet at most that may do so in a time [s], 0 if they do not."""
    a, b = system.body[i], system.body[j]
    offset = nearest_image(sub(to_vec3(a.position), to_vec3(b.position)), system.domain[0].period)
    of_mesh = add(to_vec3(b.velocity), cross(load_vec3(spin, j), offset))
    speed = norm(sub(to_vec3(a.velocity), of_mesh)) + (norm(load_vec3(spin, i)) + norm(load_vec3(spin, j))) * a.radius
    near = is_any_near(system.shapes, meshes, placed(b), offset, offset, a.radius + speed * duration)
    return speed if near else 0.0


@kernel
def _approach_to_surroundings(system, meshes, spin, i, j, duration):
    """How fast a particle nears a half-space or a mesh that it may meet in a time [s], 0 if it does not."""
    if meshes is not None and not is_half_space(system.shapes, system.body[j].shape_row):
        return _approach_to_mesh(system, meshes, spin, i, j, duration)
    return _approach_to_plane(system, spin, i, j, duration)


@entry_kernel
def expected_changes(system, neighbours, spin, held, duration, gain):
    """By how much the surface velocity of each body may change in a step (n,) [m/s]: by ``gain``, or as others push.

    Of obstacles it does as they swing, of what is ``held`` (n,) not at all.
    """
    system, neighbours, spin, held = without_refcounts((system, neighbours, spin, held))
    change = np.zeros(len(system.body))
    for j in range(system.particles, len(system.body)):
        if system.body[j].kind == KINEMATIC:
            change[j] = largest_acceleration(system, system.body[j]) * duration
    for i in range(system.particles):
        if held[i]:
            continue
        place = neighbours.place[i]
        for near in range(neighbours.start[place], neighbours.start[place + 1]):
            j = neighbours.body[neighbours.other[near]]
            share = CHANGE_HANDED_ON if j < system.particles else 1.0
            change[i] = max(change[i], share * _approach(system, spin, i, j, duration))
        for j in range(system.bounded, len(system.body)):
            change[i] = max(change[i], _approach_to_surroundings(system, system.meshes, spin, i, j, duration))
        change[i] += gain
    return change


@kernel
def _rotation_rate(b, then, duration):
    """The constant angular velocity [rad/s] that turns a body to where it is ahead, to third order in the angle."""
    half = quat_multiply(to_quat(then.orientation), conjugate(to_quat(b.orientation)))
    return scale((half[1], half[2], half[3]), math.copysign(2.0 / duration, half[0]))


@entry_kernel
def changes_ahead(system, spin, duration, member, ahead):
    """By how much surface velocities of members change in a step of ``duration`` [s] (n,) [m/s], 0 of all others.

    What is pushed apart or held back does not go as its velocity says: what counts is the larger of both changes.
    """
    system, spin, member, ahead = without_refcounts((system, spin, member, ahead))
    change = np.zeros(len(system.body))
    for i in member:
        b, then = system.body[i], ahead[i]
        velocity, turning = to_vec3(b.velocity), load_vec3(spin, i)
        gone = scale(sub(to_vec3(then.position), to_vec3(b.position)), 1.0 / duration)
        straight = max(norm(sub(to_vec3(then.velocity), velocity)), norm(sub(gone, velocity)))
        turned = sub(_rotation_rate(b, then, duration), turning)
        change[i] = straight + max(norm(sub(angular_velocity(then), turning)), norm(turned)) * b.radius
    return change


@entry_kernel
def add_displacements(system, seen, displacement):
    """Add to ``displacement`` (n,) how far surfaces are from where they were ``seen`` [m], which becomes the present.

    ``seen`` (n,) SEEN are poses.
    """
    system, seen, displacement = without_refcounts((system, seen, displacement))
    period = system.domain[0].period
    for i in range(len(displacement)):
        b, s = system.body[i], seen[i]
        x, q = to_vec3(b.position), to_quat(b.orientation)
        half = quat_multiply(q, conjugate(to_quat(s.orientation)))
        turned = 2.0 * b.radius * norm((half[1], half[2], half[3]))
        displacement[i] += norm(nearest_image(sub(x, to_vec3(s.position)), period)) + turned
        set_vec3(s.position, x)
        set_quat(s.orientation, q)
