"""Position correction: where an island is at the end of its step, nothing may have sunk in there.

Velocities are found for gaps as they seem from the start of the step, and in large heaps only nearly. So bodies are
looked at where they lead to: those that would overlap there are pushed apart, pair by pair, along the normals found
there (nonlinear Gauss-Seidel). What is still left after that collides there, and goes only as far as it has room to.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from particlesim.core.constants import MAX_MANIFOLD
from particlesim.core.jit import entry_kernel, kernel, without_refcounts
from particlesim.core.math3d import (
    add,
    axpy,
    conjugate,
    cross,
    dot,
    inverse_rotate,
    load_vec3,
    norm,
    quat_from_rotvec,
    quat_multiply,
    quat_normalize,
    rotate,
    scale,
    set_quat,
    set_vec3,
    sub,
    to_quat,
)
from particlesim.core.math3d import to_vec3 as vec
from particlesim.dynamics.contact.cone_solver import turned_by
from particlesim.dynamics.contact.contact import inverse_mass_at, normal_velocity_at, work_of_obstacle
from particlesim.dynamics.contact.contact_records import OF_A, OF_B
from particlesim.dynamics.contact.parts_ahead import parts_contact_ahead
from particlesim.dynamics.settings import (
    CORRECTED_DEPTH,
    CORRECTION_ROUNDS,
    GAP_ROUNDING,
    HELD_BACK_DEPTH,
    LIFT_SHARE,
    MAX_CORRECTION,
    TIMES_HELD_BACK,
)
from particlesim.geometry.narrow_phase.half_space import half_space_separation
from particlesim.geometry.narrow_phase.pair import pair_contact
from particlesim.geometry.support import has_parts, is_half_space, is_sphere, support_distance
from particlesim.model.bodies import KINEMATIC, placed
from particlesim.model.domain import nearest_image
from particlesim.model.free_motion import path_of_body, place_on_path, set_pose

_STILL = (0.0, 0.0, 0.0)


class Pair(NamedTuple):
    """Two bodies that have contact points, and how deep they may be in each other at the end of the step."""

    a: int
    b: int
    gap: float  # at the start [m]
    least: float  # at the end [m]
    inradius: float  # [m]
    normal: tuple[float, float, float]  # at the start
    owner: int  # whose face it turns with (see contact_records.py)


@entry_kernel
def place_obstacles_ahead(system, asleep, duration, ahead):
    """Write into ``ahead`` (n,) BODY where obstacles are after ``duration`` [s], and particles that sleep (n,)."""
    system, asleep, ahead = without_refcounts((system, asleep, ahead))
    for i in range(len(system.body)):
        b, then = system.body[i], ahead[i]
        if i >= system.particles:
            ahead[i] = b
            set_pose(then, *place_on_path(path_of_body(system, i), vec(b.principal_inertia), duration))
        elif asleep[i]:
            ahead[i] = b
            then.inverse_mass = 0.0
            set_vec3(then.inverse_inertia, _STILL)


@kernel
def _first_points(points, span):
    """Where the points of each pair begin that has some among those of a span (first, last), (p,)."""
    starts = np.empty(span[1] - span[0], dtype=np.int64)
    count = 0
    for k in range(span[0], span[1]):
        if k == span[0] or points[k].a != points[k - 1].a or points[k].b != points[k - 1].b:
            starts[count] = k
            count += 1
    return starts[:count]


@kernel
def _pair_of(islands, first, depth):
    """The pair that contact points from the ``first`` on belong to, which may be so deep in each other [inradii].

    What is deeper than it was pushed to comes out little by little.
    """
    p, t = islands.points[first], islands.terms[first]
    least = min(-depth * t.inradius, t.separation)
    if depth == CORRECTED_DEPTH:
        least = min(-depth * t.inradius, (1.0 - LIFT_SHARE) * t.separation)
    return Pair(p.a, p.b, t.separation, least, t.inradius, vec(p.normal), t.owner)


@kernel
def travel(system, ahead, i):
    """How far a body goes in the step, and the surface of what is no sphere by turning at most [m]."""
    b, then = system.body[i], ahead[i]
    shift = sub(vec(then.position), vec(b.position))
    if is_sphere(system.shapes, b.shape_row):
        return shift, 0.0
    half = quat_multiply(to_quat(then.orientation), conjugate(to_quat(b.orientation)))
    sine = norm((half[1], half[2], half[3]))
    return shift, 2.0 * b.radius * sine if sine > 0.0 else 0.0


@kernel
def _may_sink(system, ahead, pair):
    """Whether bodies move so far that they may be nearer at the end than they may."""
    shift_a, turn_a = travel(system, ahead, pair.a)
    shift_b, turn_b = travel(system, ahead, pair.b)
    return pair.gap - norm(sub(shift_b, shift_a)) - turn_a - turn_b < pair.least


@kernel
def _turned_ahead(b, then, vector):
    """A vector that turns with a body to where it is ahead."""
    return rotate(to_quat(then.orientation), inverse_rotate(to_quat(b.orientation), vector))


@kernel
def _is_clear(system, ahead, pair):
    """Whether the normal of a pair, turned with the face that it belongs to, shows that the two are far enough apart.

    They are no less so than along any direction (separating axis theorem). It takes a tenth of the time of a contact.
    """
    a, b, normal = ahead[pair.a], ahead[pair.b], pair.normal
    least = pair.least + GAP_ROUNDING * pair.inradius
    if has_parts(system.shapes, a.shape_row) or has_parts(system.shapes, b.shape_row):
        return False
    offset = nearest_image(sub(vec(b.position), vec(a.position)), system.domain[0].period)
    if is_half_space(system.shapes, b.shape_row):
        return half_space_separation(system.shapes, placed(a), placed(b), offset)[0] >= least
    if pair.owner == OF_A:
        normal = _turned_ahead(system.body[pair.a], a, normal)
    elif pair.owner == OF_B:
        normal = _turned_ahead(system.body[pair.b], b, normal)
    reach = support_distance(system.shapes, placed(a), normal)
    reach += support_distance(system.shapes, placed(b), scale(normal, -1.0))
    return dot(normal, offset) - reach >= least


@kernel
def _contact_ahead(system, meshes, ahead, pair, room):
    """Separation, normal, offset and middle of the contact points, of a pair as it is ahead."""
    a, b = ahead[pair.a], ahead[pair.b]
    if meshes is not None and (has_parts(system.shapes, a.shape_row) or has_parts(system.shapes, b.shape_row)):
        return parts_contact_ahead(system, meshes, ahead, (pair.a, pair.b), room)
    offset = nearest_image(sub(vec(b.position), vec(a.position)), system.domain[0].period)
    separation, normal, count = pair_contact(system.shapes, placed(a), placed(b), offset, room)
    middle = (0.0, 0.0, 0.0)
    for k in range(count):
        middle = axpy(middle, load_vec3(room, k), 1.0 / count)
    return separation, normal, offset, middle


@kernel
def _move(b, m, arm, push):
    """Move a body as an impulse at ``arm`` gives velocities, ``push`` [kg m]."""
    set_vec3(b.position, axpy(vec(b.position), push, m.inverse_mass))
    turn = quat_from_rotvec(turned_by(m, cross(arm, push)))
    set_quat(b.orientation, quat_normalize(quat_multiply(turn, to_quat(b.orientation))))


@kernel
def _push_apart(mover, ahead, pair, touch, pushed):
    """Push two bodies apart, by a quarter farther than they must; returns whether they may go so far.

    ``pushed`` (n,) is how far each of the island has been pushed [m].
    """
    separation, normal, offset, arm_a = touch
    a, b = mover[pair.a], mover[pair.b]
    arm_b = sub(arm_a, offset)
    of_a, of_b = cross(arm_a, normal), cross(arm_b, normal)
    inverse = a.inverse_mass + dot(of_a, turned_by(a, of_a))
    if b.row >= 0:
        inverse += b.inverse_mass + dot(of_b, turned_by(b, of_b))
    way, farthest = 0.75 * pair.least - separation, pushed[a.row]
    if b.row >= 0:
        farthest = max(farthest, pushed[b.row])
    if farthest + way > MAX_CORRECTION * pair.inradius:
        return False
    push = scale(normal, way / inverse)
    pushed[a.row] += way / inverse * a.inverse_mass
    _move(ahead[pair.a], a, arm_a, scale(push, -1.0))
    if b.row >= 0:
        pushed[b.row] += way / inverse * b.inverse_mass
        _move(ahead[pair.b], b, arm_b, push)
    return True


@kernel
def _hold_back(b, then, share):
    """Let a body go but a ``share`` of its way to where it is ahead."""
    shift = sub(vec(then.position), vec(b.position))
    set_vec3(then.position, axpy(vec(b.position), shift, share))
    half = quat_multiply(to_quat(then.orientation), conjugate(to_quat(b.orientation)))
    axis = half[1], half[2], half[3]
    sine = norm(axis)
    if sine > 0.0:
        angle = 2.0 * math.atan2(sine, half[0])
        turn = quat_from_rotvec(scale(axis, share * angle / sine))
        set_quat(then.orientation, quat_normalize(quat_multiply(turn, to_quat(b.orientation))))


@kernel
def _collide(ahead, pair, touch, terms):
    """Let two bodies approach no more where they touch ahead; what b got, and works, is added to the ``terms``."""
    _, normal, offset, arm_a = touch
    a, b = ahead[pair.a], ahead[pair.b]
    arm_b = sub(arm_a, offset)
    approach, _ = normal_velocity_at(a, b, arm_a, offset, normal)
    if approach < 0.0:
        size = -approach / (inverse_mass_at(a, arm_a, normal) + inverse_mass_at(b, arm_b, normal))
        impulse = scale(normal, size)
        _strike(a, arm_a, scale(impulse, -1.0))
        if b.inverse_mass > 0.0:
            _strike(b, arm_b, impulse)
        elif b.kind == KINEMATIC:
            terms.work += work_of_obstacle(b, impulse, cross(arm_b, impulse))
        set_vec3(terms.impulse, add(vec(terms.impulse), impulse))


@kernel
def _strike(b, arm, impulse):
    """Give a body an impulse at ``arm`` from its position."""
    set_vec3(b.velocity, axpy(vec(b.velocity), impulse, b.inverse_mass))
    set_vec3(b.angular_momentum, add(vec(b.angular_momentum), cross(arm, impulse)))


@kernel
def _hold_pair_back(system, mover, ahead, pair, gap, held):
    """Let two bodies, ``gap`` apart ahead, go as far as they may, and nowhere when that was tried often enough."""
    for i in (pair.a, pair.b):
        row = mover[i].row
        if row >= 0:
            share = (pair.gap - pair.least) / (pair.gap - gap) if held[row] < TIMES_HELD_BACK else 0.0
            held[row] += 1
            _hold_back(system.body[i], ahead[i], max(share, 0.0))


@kernel
def _look(system, mover, ahead, pair, moved, round_, room):
    """How a pair touches ahead, or that it is apart where none of the two has ``moved`` lately."""
    of_a, of_b = mover[pair.a].row, mover[pair.b].row
    lately = max(moved[of_a], moved[of_b] if of_b >= 0 else 0)
    if (round_ == 1 and not _may_sink(system, ahead, pair)) or (round_ > 1 and lately < round_ - 1):
        return math.inf, _STILL, _STILL, _STILL
    if _is_clear(system, ahead, pair):
        return math.inf, _STILL, _STILL, _STILL
    return _contact_ahead(system, system.meshes, ahead, pair, room)


@kernel
def _mark(mover, pair, moved, round_):
    """Note that a pair has moved in a round."""
    for i in (pair.a, pair.b):
        if mover[i].row >= 0:
            moved[mover[i].row] = round_


@kernel
def _push_all_apart(system, islands, mover, first, ahead, count):
    """Push apart what overlaps ahead; returns whether nothing does any more."""
    room, moved, pushed = np.empty((MAX_MANIFOLD, 3)), np.zeros(count, dtype=np.int64), np.zeros(count)
    left = False
    for round_ in range(1, CORRECTION_ROUNDS + 1):
        more = False
        for k in first:
            pair = _pair_of(islands, k, CORRECTED_DEPTH)
            touch = _look(system, mover, ahead, pair, moved, round_, room)
            if touch[0] < pair.least:
                if _push_apart(mover, ahead, pair, touch, pushed):
                    _mark(mover, pair, moved, round_)
                    more = True
                else:
                    left = True
        if not more:
            return not left
    return False


@kernel
def _hold_all_back(system, islands, mover, first, ahead, count):
    """Hold back what overlaps ahead by too much, until nothing does; returns whether anything did."""
    room, moved, held = np.empty((MAX_MANIFOLD, 3)), np.zeros(count, dtype=np.int64), np.zeros(count, dtype=np.int64)
    more, round_ = True, 0
    while more:
        more, round_ = False, round_ + 1
        for k in first:
            pair = _pair_of(islands, k, HELD_BACK_DEPTH)
            touch = _look(system, mover, ahead, pair, moved, round_, room)
            of_a, of_b = mover[pair.a].row, mover[pair.b].row
            free = held[of_a] <= TIMES_HELD_BACK or (of_b >= 0 and held[of_b] <= TIMES_HELD_BACK)
            if touch[0] < pair.least and free:
                _collide(ahead, pair, touch, islands.terms[k])
                _hold_pair_back(system, mover, ahead, pair, touch[0], held)
                _mark(mover, pair, moved, round_)
                more = True
    return round_ > 1


@kernel
def correct_positions(system, islands, mover, span, ahead, count):
    """Push bodies apart that overlap where they are ``ahead``; returns whether any of the ``count`` was held back."""
    first = _first_points(islands.points, span)
    if _push_all_apart(system, islands, mover, first, ahead, count):
        return False
    return _hold_all_back(system, islands, mover, first, ahead, count)
