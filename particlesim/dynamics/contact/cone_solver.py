"""The cone solver: impulses at all contact points of an island, each within Coulomb's cone, by sweeps over the points.

Normal impulses push only, and leave no point closing faster than is wanted (Signorini's condition at velocity level);
those across the normal oppose sliding, and are at most friction times the normal one (J. J. Moreau, Unilateral contact
and dry friction in finite freedom dynamics, 1988; sweeps as in M. Jean, Computer Methods in Applied Mechanics and
Engineering 177 (1999) 235-257). The cone is round: no direction is preferred.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from particlesim.core.jit import kernel
from particlesim.core.math3d import add, axpy, cross, dot, load_vec3, norm, scale, set_vec3, store_vec3, sub
from particlesim.core.math3d import to_vec3 as vec
from particlesim.core.records import record
from particlesim.dynamics.contact.conjugate_ways import go_on, length2_of, list_point, set_out
from particlesim.dynamics.contact.contact_records import along_normal
from particlesim.dynamics.settings import (
    FAR_ENOUGH,
    FEW_SWEEPS,
    GRADIENT_STEPS,
    LEAST_SHARE,
    PAIRS_BETWEEN,
    SAME_IMPULSES,
    STICKING,
    SWEEPS_OF_ALL,
)

# A body as the sweeps see it: all that they read is in the first two cache lines.
MOVER = record(
    [
        ("velocity", "f8", (3,)),  # [m/s]
        ("spin", "f8", (3,)),  # angular velocity [rad/s]
        ("inverse_mass", "f8"),  # [1/kg]
        ("inverse_inertia", "f8", (6,)),  # world axes: xx, yy, zz, yz, zx, xy [1/(kg m^2)]
        ("stirred", "i8"),  # the last sweep that changed its velocity by what counts
        ("row", "i8"),  # its number among the members of its island, -1 of an obstacle
        ("shift", "f8", (3,)),  # displacement since the start of the step [m]
        ("turn", "f8", (3,)),  # and rotation [rad]
        ("before", "f8", (6,)),  # velocity and angular velocity at the start of the step
        ("trial_velocity", "f8", (3,)),  # what impulses that are tried do to it
        ("trial_spin", "f8", (3,)),
        ("average", "f8", (6,)),  # velocity and angular velocity as a part of the step begins, then their means in it
        ("pull", "f8", (3,)),  # acceleration by gravity and fields [m/s^2]
    ]
)


class Sweeps(NamedTuple):
    """How long sweeps go on."""

    most: int  # pairs of sweeps, up and down
    small: float  # a change of velocities that ends them [m/s]
    together: bool  # whether points are also solved together
    partly: bool  # whether most of these visit only the points that they may change
    rolls: bool  # whether anything has rolling friction


@kernel
def briefly(sweeps):
    """As many sweeps as are made one by one."""
    return Sweeps(min(sweeps.most, FEW_SWEEPS), sweeps.small, False, sweeps.partly, sweeps.rolls)


@kernel
def turned_by(m, angular_impulse):
    """The change of the angular velocity of a mover by an angular impulse."""
    x, y, z = angular_impulse
    i = m.inverse_inertia
    return (
        i[0] * x + i[5] * y + i[4] * z,
        i[5] * x + i[1] * y + i[3] * z,
        i[4] * x + i[3] * y + i[2] * z,
    )


@kernel
def relative_velocity(p, a, b):
    """Velocity of mover b against mover a at a contact point."""
    return sub(
        add(vec(b.velocity), cross(vec(b.spin), vec(p.arm_b))), add(vec(a.velocity), cross(vec(a.spin), vec(p.arm_a)))
    )


@kernel
def give(p, a, b, impulse):
    """Give mover b an impulse at a contact point, and mover a its reaction."""
    set_vec3(a.velocity, axpy(vec(a.velocity), impulse, -a.inverse_mass))
    set_vec3(a.spin, sub(vec(a.spin), turned_by(a, cross(vec(p.arm_a), impulse))))
    if b.inverse_mass > 0.0:
        set_vec3(b.velocity, axpy(vec(b.velocity), impulse, b.inverse_mass))
        set_vec3(b.spin, add(vec(b.spin), turned_by(b, cross(vec(p.arm_b), impulse))))


@kernel
def give_turn(a, b, angular_impulse):
    """Give mover b an angular impulse, and mover a its reaction."""
    set_vec3(a.spin, sub(vec(a.spin), turned_by(a, angular_impulse)))
    if b.inverse_mass > 0.0:
        set_vec3(b.spin, add(vec(b.spin), turned_by(b, angular_impulse)))


@kernel
def within(vector, kinetic, static):
    """A vector cut to the length ``kinetic`` if it is longer than ``static``."""
    length = norm(vector)
    return scale(vector, kinetic / length) if length > static else vector


@kernel
def _resist_rolling(p, t, a, b):
    """Let the angular velocity of two bodies against each other be stopped as far as rolling friction does it."""
    roll, rolling = vec(t.roll), sub(vec(b.spin), vec(a.spin))
    most = t.rolling_friction * p.push
    wanted = within(axpy(roll, rolling, -t.rolling_mass), most, most)
    give_turn(a, b, sub(wanted, roll))
    set_vec3(t.roll, wanted)


@kernel
def _visit(p, a, b):
    """Let a contact point have the velocity wanted: along the normal at least, across it as far as its cone allows.

    Returns by how much a velocity there changed.
    """
    velocity, normal = sub(relative_velocity(p, a, b), vec(p.wanted)), vec(p.normal)
    more = max(-p.push, -dot(normal, velocity) * p.normal_mass)
    if more == 0.0 and p.push == 0.0 and dot(vec(p.drag), vec(p.drag)) == 0.0:
        return 0.0
    p.push += more
    change, impulse = abs(more) / p.normal_mass, scale(normal, more)
    if p.static_friction > 0.0:
        _, sliding = along_normal(p, axpy(velocity, vec(p.response), more))
        drag = within(axpy(vec(p.drag), sliding, -p.tangential_mass), p.friction * p.push, p.static_friction * p.push)
        across = sub(drag, vec(p.drag))
        set_vec3(p.drag, drag)
        change = max(change, norm(across) / p.tangential_mass)
        impulse = add(impulse, across)
    if change > 0.0:
        give(p, a, b, impulse)
    return change


# ---- together ------------------------------------------------------------------------------------------------------
# Sweeps hand impulses on from body to body, which takes long where heavy bodies stand on light ones. What they have
# found out is which points push, and which of them stick: that all of these reach what they are to is a linear system,
# solved by conjugate gradients (M. Silcowitz-Hansen, S. Niebuhr, K. Erleben, The Visual Computer 26 (2010) 893-901).


@kernel
def _sticks(p):
    """Whether a point that pushes has friction and does not slide."""
    return p.static_friction > 0.0 and norm(vec(p.drag)) < (1.0 - STICKING) * p.static_friction * p.push


@kernel
def _free_part(p, vector):
    """The part of a vector in which the impulse of a contact point may change."""
    if p.push <= 0.0:
        return 0.0, 0.0, 0.0
    if _sticks(p):
        return vector
    return scale(vec(p.normal), dot(vec(p.normal), vector))


@kernel
def _conditioned(p, vector):
    """An impulse that would change the velocity at a contact point by about a vector."""
    along, across = along_normal(p, vector)
    return axpy(scale(across, p.tangential_mass), vec(p.normal), along * p.normal_mass)


@kernel
def _try(points, mover, span, members, impulse):
    """Write what impulses (m, 3) at contact points do to the movers as their trial velocities."""
    for i in members:
        set_vec3(mover[i].trial_velocity, (0.0, 0.0, 0.0))
        set_vec3(mover[i].trial_spin, (0.0, 0.0, 0.0))
    for k in range(span[0], span[1]):
        p, push = points[k], load_vec3(impulse, k - span[0])
        if p.push > 0.0:
            a, b = mover[p.a], mover[p.b]
            set_vec3(a.trial_velocity, axpy(vec(a.trial_velocity), push, -a.inverse_mass))
            set_vec3(a.trial_spin, sub(vec(a.trial_spin), turned_by(a, cross(vec(p.arm_a), push))))
            if b.inverse_mass > 0.0:
                set_vec3(b.trial_velocity, axpy(vec(b.trial_velocity), push, b.inverse_mass))
                set_vec3(b.trial_spin, add(vec(b.trial_spin), turned_by(b, cross(vec(p.arm_b), push))))


@kernel
def _trial_velocity(p, a, b):
    """Velocity of mover b against mover a at a contact point by their trial velocities."""
    of_b = 0.0, 0.0, 0.0
    if b.inverse_mass > 0.0:
        of_b = add(vec(b.trial_velocity), cross(vec(b.trial_spin), vec(p.arm_b)))
    return sub(of_b, add(vec(a.trial_velocity), cross(vec(a.trial_spin), vec(p.arm_a))))


@kernel
def _conjugate_gradients(points, mover, span, members, small):
    """Impulses (m, 3) by which points that push come to what they are to, as far as those that stick let them."""
    size = span[1] - span[0]
    total, left, way = np.zeros((size, 3)), np.zeros((size, 3)), np.zeros((size, 3))
    along = 0.0
    for k in range(size):
        p = points[span[0] + k]
        lack = _free_part(p, sub(vec(p.wanted), relative_velocity(p, mover[p.a], mover[p.b])))
        store_vec3(left, k, lack)
        store_vec3(way, k, _free_part(p, _conditioned(p, lack)))
        along += dot(lack, load_vec3(way, k))
    for _ in range(GRADIENT_STEPS):
        _try(points, mover, span, members, way)
        bend = most = alone = 0.0
        for k in range(size):
            p = points[span[0] + k]
            if p.push > 0.0:
                bend += dot(load_vec3(way, k), _trial_velocity(p, mover[p.a], mover[p.b]))
                alone += dot(load_vec3(way, k), load_vec3(way, k)) / p.normal_mass
        if bend <= SAME_IMPULSES * alone:
            break  # impulses that cancel each other: what is left cannot be reached
        step, again = along / bend, 0.0
        for k in range(size):
            p = points[span[0] + k]
            if p.push > 0.0:
                store_vec3(total, k, axpy(load_vec3(total, k), load_vec3(way, k), step))
                change = _free_part(p, _trial_velocity(p, mover[p.a], mover[p.b]))
                lack = axpy(load_vec3(left, k), change, -step)
                store_vec3(left, k, lack)
                again += dot(lack, _free_part(p, _conditioned(p, lack)))
                most = max(most, norm(lack))
        if most <= small:
            break
        for k in range(size):
            p = points[span[0] + k]
            if p.push > 0.0:
                towards = _free_part(p, _conditioned(p, load_vec3(left, k)))
                store_vec3(way, k, axpy(towards, load_vec3(way, k), again / along))
        along = again
    return total


@kernel
def _within_cones(points, span, change):
    """How far points may go on along ``change`` (m, 3) until one of them no longer pushes, or begins to slide."""
    share = 1.0
    for k in range(span[0], span[1]):
        p = points[k]
        if p.push <= 0.0:
            continue
        along, across = along_normal(p, load_vec3(change, k - span[0]))
        if p.push + share * along < 0.0:
            share = -p.push / along
        if _sticks(p):
            while share > LEAST_SHARE and norm(axpy(vec(p.drag), across, share)) > p.static_friction * (
                p.push + share * along
            ):
                share *= 0.5
    return share


@kernel
def _together(points, mover, span, members, small):
    """Let all points that push reach what they are to at once, as far as their cones allow; returns how far that is."""
    change = _conjugate_gradients(points, mover, span, members, 0.1 * small)
    share = _within_cones(points, span, change)
    _try(points, mover, span, members, change)
    for i in members:
        m = mover[i]
        set_vec3(m.velocity, axpy(vec(m.velocity), vec(m.trial_velocity), share))
        set_vec3(m.spin, axpy(vec(m.spin), vec(m.trial_spin), share))
    for k in range(span[0], span[1]):
        p = points[k]
        if p.push > 0.0:
            along, across = along_normal(p, load_vec3(change, k - span[0]))
            p.push = max(p.push + share * along, 0.0)
            if p.static_friction > 0.0:
                set_vec3(p.drag, axpy(vec(p.drag), across, share))
    return share


# ---- sweeps along conjugate ways ----------------------------------------------------------------------------


@kernel
def _visit_stirred(p, t, mover, number, sweeps):
    """Visit a contact point; returns by how much a velocity there changed. By what counts, it stirs the two."""
    a, b = mover[p.a], mover[p.b]
    change = _visit(p, a, b)
    if sweeps.rolls and t.rolling_friction > 0.0:
        _resist_rolling(p, t, a, b)
    if change > sweeps.small:
        a.stirred = number
        if b.row >= 0:
            b.stirred = number
    return change


@kernel
def _sweep_all(points, terms, mover, span, ways, sweep, sweeps):
    """Visit all points of a span, and list those that push; returns (largest change of a velocity, how many do)."""
    number, count = sweep
    change = 0.0
    for k in range(span[0], span[1]):
        p = points[k]
        change = max(change, _visit_stirred(p, terms[k], mover, number, sweeps))
        if p.push > 0.0 and not ways.listed[k - span[0]]:
            count = list_point(ways, span, k, count)
    return change, count


@kernel
def _sweep_listed(points, terms, mover, ways, sweep, sweeps, every):
    """Visit every listed point, or those of bodies that this sweep or the last has stirred; the largest change."""
    number, count = sweep
    change = 0.0
    for n in range(count):
        k = ways.point[n]
        p = points[k]
        b = mover[p.b]
        if every or mover[p.a].stirred >= number - 1 or (b.row >= 0 and b.stirred >= number - 1):
            change = max(change, _visit_stirred(p, terms[k], mover, number, sweeps))
    return change


@kernel
def _solve_by_sweeps(points, terms, mover, span, members, sweeps, ways):
    """Sweep over points; each sweep goes on along the way of those before, as long as they get shorter.

    Where they visit points ``partly``, those that do not push, or of bodies that others leave as they are, have their
    turn now and then. All whose impulses went on have it at once: what has left its cone comes back. Returns the last
    change of a velocity.
    """
    change, last, count, rolls = math.inf, 0.0, 0, sweeps.rolls
    for k in range(span[0], span[1]):
        ways.listed[k - span[0]] = False
        if points[k].push > 0.0:
            count = list_point(ways, span, k, count)
    for i in members:
        mover[i].stirred = -1
    whole, went_on = True, False
    for sweep in range(2 * sweeps.most):
        set_out(points, terms, mover, span, members, ways, (count, rolls))
        if whole:
            change, count = _sweep_all(points, terms, mover, span, ways, (sweep, count), sweeps)
        else:
            change = _sweep_listed(points, terms, mover, ways, (sweep, count), sweeps, went_on)
        if (whole and change <= sweeps.small) or sweep + 1 == 2 * sweeps.most:
            break
        length2 = length2_of(points, terms, span, ways, (count, rolls))
        share = length2 / last if length2 < last else 0.0
        go_on(points, terms, mover, span, members, ways, (share, count, rolls))
        last, went_on = length2, share > 0.0
        whole = not sweeps.partly or change <= sweeps.small or (sweep + 1) % SWEEPS_OF_ALL == 0
    return change


@kernel
def solve(points, terms, mover, span, members, sweeps, ways):
    """Change impulses and movers until every contact point of a span (first, last) is within its cone.

    Where points are also solved together, that is after some pairs of sweeps, and the later where it gets nowhere, as
    points that slide or leave each other stand in the way. ``ways`` are room. Returns the last change of a velocity
    [m/s].
    """
    if not sweeps.together:
        return _solve_by_sweeps(points, terms, mover, span, members, sweeps, ways)
    left = sweeps.most
    while True:
        few = Sweeps(min(ways.pause[0], left), sweeps.small, False, False, sweeps.rolls)
        change = _solve_by_sweeps(points, terms, mover, span, members, few, ways)
        left -= few.most
        if change <= sweeps.small or left == 0:
            return change
        share = _together(points, mover, span, members, sweeps.small)
        ways.pause[0] = PAIRS_BETWEEN if share >= FAR_ENOUGH else 2 * ways.pause[0]
