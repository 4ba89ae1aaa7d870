"""What happens at an impact: when it was, and the impulse that answers it.

A contact found at the end of a step is traced back along the free paths of its two partners to the moment they met;
the impulse acts there, and both go on from there to the end of the step. Every impulse acts equally and oppositely
at one point, so momentum and angular momentum are kept whatever its size; its size keeps the kinetic energy when
the restitution is 1.
"""

import math
from typing import NamedTuple

import numpy as np

from particlesim.constants import (
    APPROACH_TOLERANCE,
    IMPACT_TOLERANCE,
    MAX_MANIFOLD,
    MAX_PATCH_IMPULSES,
    RESTING_DROP,
)
from particlesim.jit import kernel
from particlesim.motion import move, particle_spin, path_of, spin_of
from particlesim.narrow_phase.contacts import contact_between, contact_now, wall_of_partner
from particlesim.vec import add, along, cross, dot, norm, put, row, row4, scaled, sub, vector

# Trials of the root finder, which needs about ten; rounding of the separation could keep it busy for ever.
_MAX_TRIES = 100

# Two that meet twice within a step are looked for apart in between down to this power of a half of the step.
_HALVINGS = 24


class Tally(NamedTuple):
    """What impacts add up to since the start."""

    impacts: np.ndarray  # (1,) int64
    virial: np.ndarray  # (1,) sum of r_ij . impulse over pair impacts [J s]
    wall_impulse: np.ndarray  # (6,) impulse given to each wall along its outward normal [N s]


# ---- one impulse -------------------------------------------------------------------------------------------------


@kernel
def _point_velocity(constants, state, i, arm):
    """Velocity of the point of particle ``i`` at ``arm`` from its centroid."""
    return add(row(state.velocity, i), cross(particle_spin(constants, state, i), arm))


@kernel
def _give(constants, state, i, impulse, arm):
    """Add an impulse [N s] at ``arm`` from the centroid of particle ``i``."""
    put(state.velocity, i, along(row(state.velocity, i), impulse, 1.0 / constants.mass[i]))
    put(state.angular_momentum, i, add(row(state.angular_momentum, i), cross(arm, impulse)))


@kernel
def _inverse_mass_at(constants, state, i, arm, normal):
    """How much speed along ``normal`` a unit impulse along it gives the point at ``arm`` [1/kg].

    1/m + n . ((I^-1 (r x n)) x r) (D. Baraff, SIGGRAPH 1997 course notes, Rigid Body Simulation II, eq. 8-18)
    """
    twist = cross(arm, normal)
    spin = spin_of(row4(state.orientation, i), twist, row(constants.inertia, i))
    return 1.0 / constants.mass[i] + dot(twist, spin)


@kernel
def _approach(constants, state, i, j, point, offset, normal):
    """Speed at which the partners part at a point (negative: they approach), and the speed that counts as none."""
    of_i = _point_velocity(constants, state, i, point)
    parting = -dot(of_i, normal)
    speed = norm(of_i)
    if j >= 0:
        of_j = _point_velocity(constants, state, j, sub(point, offset))
        parting += dot(of_j, normal)
        speed += norm(of_j)
    return parting, APPROACH_TOLERANCE * speed


@kernel
def _strike(constants, state, i, j, point, offset, normal, parting, restitution):
    """The impulse [N s] at a point along the normal, given to j and taken from i, that makes them part."""
    arm_j = sub(point, offset)
    inverse_mass = _inverse_mass_at(constants, state, i, point, normal)
    if j >= 0:
        inverse_mass += _inverse_mass_at(constants, state, j, arm_j, normal)
    impulse = -(1.0 + restitution) * parting / inverse_mass
    _give(constants, state, i, scaled(normal, -impulse), point)
    if j >= 0:
        _give(constants, state, j, scaled(normal, impulse), arm_j)
    return impulse


# ---- one impact: a patch of contact points ------------------------------------------------------------------------


@kernel
def _middle(points, count):
    total = (0.0, 0.0, 0.0)
    for k in range(count):
        total = add(total, row(points, k))
    return scaled(total, 1.0 / count)


@kernel
def _resting_speed(world, constants, i):
    """Speed below which an impact under gravity keeps its energy (see RESTING_DROP) [m/s]."""
    g = norm(vector(world.gravity))
    return math.sqrt(2.0 * g * RESTING_DROP * constants.inradius[i])


@kernel
def _restitution(world, constants, i, j):
    """Of a pair: the smaller one; and the speed below which it does not count."""
    if j < 0:
        return min(constants.restitution[i], world.restitution), _resting_speed(world, constants, i)
    resting = min(_resting_speed(world, constants, i), _resting_speed(world, constants, j))
    return min(constants.restitution[i], constants.restitution[j]), resting


@kernel
def _answer_patch(world, constants, state, i, j, offset, normal, points, count, tally):
    """Impulses on a patch until no point of it approaches: first in its middle, then where it approaches fastest.

    A face that lands flat is thus pushed in its middle and does not start to spin. Returns whether any was needed.
    """
    restitution, resting = _restitution(world, constants, i, j)
    middle = _middle(points, count)
    answered = False
    for _ in range(MAX_PATCH_IMPULSES):
        point = middle
        parting, tolerance = _approach(constants, state, i, j, middle, offset, normal)
        if parting >= -tolerance:
            for k in range(count):
                at_corner, small = _approach(constants, state, i, j, row(points, k), offset, normal)
                if at_corner < parting and at_corner < -small:
                    parting, tolerance, point = at_corner, small, row(points, k)
        if parting >= -tolerance:
            break
        e = restitution if -parting > resting else 1.0
        impulse = _strike(constants, state, i, j, point, offset, normal, parting, e)
        if j >= 0:
            tally.virial[0] += impulse * dot(offset, normal)
        else:
            tally.wall_impulse[wall_of_partner(j)] += impulse
        answered = True
    if answered:
        tally.impacts[0] += 1
    return answered


# ---- when it was ---------------------------------------------------------------------------------------------------


@kernel(inline=True)
def _separation_before(table, world, constants, state, i, j, earlier, points):
    """Separation of i and j ``earlier`` seconds before now, along their free paths."""
    other = max(j, 0)
    position_i, turn_i, _ = path_of(constants, state, world, i, -earlier)
    position_j, turn_j, _ = path_of(constants, state, world, other, -earlier)
    separation, _, _, _ = contact_between(table, world, constants, i, j, position_i, turn_i, position_j, turn_j, points)
    return separation


@kernel(inline=True)
def _moment_apart(table, world, constants, state, i, j, start, tolerance, points):
    """The first moment, ``start`` seconds ago or later, at which i and j were apart, and their separation then.

    Two that met within this step touch at its start and may meet again with other corners, sooner or later: moments
    at halving distances from the start are looked at as well. If they were apart at none, the start will do when
    they only touched then; else 0 seconds ago is returned.
    """
    at_start = _separation_before(table, world, constants, state, i, j, start, points)
    if at_start > tolerance:
        return start, at_start
    for k in range(_HALVINGS, 0, -1):
        earlier = start - start * 0.5**k
        separation = _separation_before(table, world, constants, state, i, j, earlier, points)
        if separation > tolerance:
            return earlier, separation
    return (start if at_start >= -tolerance else 0.0), at_start


@kernel(inline=True)
def _time_since_impact(table, world, constants, state, clock, i, j, points):
    """How long ago i and j met [s], by regula falsi on the exact separation; 0 if they overlapped all along.

    ``clock`` (n,) is how long each has been on its present free path. The Illinois variant halves the weight of an
    end that is kept twice in a row and so converges faster than linearly (M. Dowell, P. Jarratt, BIT 11 (1971) 168).
    """
    tolerance = IMPACT_TOLERANCE * (constants.size[i] + (constants.size[j] if j >= 0 else 0.0))
    start = clock[i] if j < 0 else min(clock[i], clock[j])
    late = 0.0
    inside = _separation_before(table, world, constants, state, i, j, late, points)
    early, outside = _moment_apart(table, world, constants, state, i, j, start, tolerance, points)
    if early == 0.0 or inside >= 0.0:
        return 0.0
    gap = outside
    side = 0
    for _ in range(_MAX_TRIES):
        if gap <= tolerance:
            break
        # Aim between nothing and the tolerance, so that the end kept is the one where they are apart.
        middle = late + (early - late) * (inside - 0.5 * tolerance) / (inside - outside)
        if not late < middle < early:
            break
        separation = _separation_before(table, world, constants, state, i, j, middle, points)
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
def _move_both(constants, state, world, i, j, time):
    """Move i, and j unless it is a wall, along their free paths for ``time`` [s] of either sign."""
    if time != 0.0:
        move(constants, state, world, i, time)
        if j >= 0:
            move(constants, state, world, j, time)


@kernel(inline=True)
def _answer(table, world, constants, state, clock, tally, i, j, earlier, points):
    """Take i and j back to their impact, answer it, and let them go on; returns whether they approached."""
    _move_both(constants, state, world, i, j, -earlier)
    _, normal, offset, count = contact_now(table, world, constants, state, i, j, points)
    answered = _answer_patch(world, constants, state, i, j, offset, normal, points, count, tally)
    _move_both(constants, state, world, i, j, earlier)
    if answered:
        clock[i] = earlier
        if j >= 0:
            clock[j] = earlier
    return answered


@kernel
def times_since_impact(table, world, constants, state, contacts, clock):
    """How long ago the partners of each contact met [s], (m,) (see _time_since_impact)."""
    points = np.empty((MAX_MANIFOLD, 3))
    earlier = np.empty(len(contacts))
    for k in range(len(contacts)):
        i, j = contacts[k, 0], contacts[k, 1]
        earlier[k] = _time_since_impact(table, world, constants, state, clock, i, j, points)
    return earlier


@kernel
def respond(table, world, constants, state, contacts, earlier, order, clock, tally, moved):
    """Answer contacts (m, 2) that met ``earlier`` (m,) [s] ago, in the given order, each particle at most once.

    ``clock`` (n,) [s] is how long each particle has been on its present path within the step. Particles whose
    path changed are marked in ``moved`` (n,): their other contacts are out of date and wait for the next round.
    Returns whether there must be one.
    """
    moved[:] = False
    points = np.empty((MAX_MANIFOLD, 3))
    again = False
    for k in order:
        i, j = contacts[k, 0], contacts[k, 1]
        other = i if j < 0 else j
        if moved[i] or moved[other]:
            continue
        answered = _answer(table, world, constants, state, clock, tally, i, j, earlier[k], points)
        if not answered and earlier[k] > 0.0:
            # They only grazed where they met, and approach now that they overlap.
            answered = _answer(table, world, constants, state, clock, tally, i, j, 0.0, points)
        if answered:
            again = True
            moved[i] = True
            moved[other] = True
    return again
