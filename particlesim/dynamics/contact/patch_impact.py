"""The impact of a contact patch with friction: all points of a face or an edge that lands flat, at once.

First the points stop approaching: impulses p, none of which pulls and each within its cone, leave every point parting
or at rest, and friction opposes the sliding that there is then (Coulomb's law and Signorini's on the velocities after
the impact: J. J. Moreau, Unilateral contact and dry friction in finite freedom dynamics, 1988). Then each point gets e
times its normal impulse again (Poisson), and friction within e mu times it takes as much energy as it can.

(C. Glocker, F. Pfeiffer, Nonlinear Dynamics 7 (1995) 471-497.)

Energy is never gained. With u the velocities at the points after the first part and W the inverse mass, u . p <= 0, so
that part takes p . W p / 2 at least. The second one would give e u . p + e^2 p . W p / 2 if friction went on as before,
and gives less, for it takes as much as it can. Should the sweeps not find impulses with u . p <= 0, which they may not
where friction is far above 1, the patch has no answer, and is resolved point by point.

Vectors have three components for each point: along the normal and along the two tangents.
"""

from __future__ import annotations

import math

import numpy as np

from particlesim.core.jit import kernel
from particlesim.core.math3d import add, load_vec3, sub, to_vec3
from particlesim.dynamics.contact.contact import basis_of, components, contact_velocity, velocity_change
from particlesim.dynamics.contact.point_impact import within_cone
from particlesim.dynamics.settings import (
    IDLE_SWEEPS,
    MAX_PATCH_SWEEPS,
    PATCH_ACCEPTED,
    PATCH_CONVERGED,
    SHORTER_SWEEPS,
)


@kernel
def _fill_inverse_mass(a, b, contact, points, inverse_mass):
    """Fill in how the velocities of b against a at all points change by a unit impulse on b along each direction."""
    basis, offset = basis_of(contact), to_vec3(contact.offset)
    for j in range(contact.count):
        arm = load_vec3(points, j)
        for d in range(3):
            for i in range(contact.count):
                at = load_vec3(points, i)
                change = velocity_change(a, arm, basis[d], at)
                change = add(change, velocity_change(b, sub(arm, offset), basis[d], sub(at, offset)))
                along = components(basis, change)
                for c in range(3):
                    inverse_mass[3 * i + c, 3 * j + d] = along[c]


@kernel
def _velocity_at(inverse_mass, before, impulse, row):
    """Component ``row`` of the velocities with the impulses."""
    velocity = before[row]
    for column in range(len(impulse)):
        velocity += inverse_mass[row, column] * impulse[column]
    return velocity


@kernel
def _product(inverse_mass, impulse, other):
    """other . W impulse"""
    total = 0.0
    for row in range(len(impulse)):
        change = 0.0
        for column in range(len(impulse)):
            change += inverse_mass[row, column] * impulse[column]
        total += other[row] * change
    return total


@kernel
def _combine(out, factor, one, other_factor, other):
    """out = factor * one + other_factor * other; ``out`` may be one of them."""
    for row in range(len(out)):
        out[row] = factor * one[row] + other_factor * other[row]


@kernel
def _rub_point(inverse_mass, before, impulse, k, edge, share):
    """Let friction at point ``k``, at most ``edge``, end the sliding there, or oppose it; the change of the impulse.

    It goes a ``share`` of the way.
    """
    r = 3 * k + 1
    x, y = _velocity_at(inverse_mass, before, impulse, r), _velocity_at(inverse_mass, before, impulse, r + 1)
    a, b, d = inverse_mass[r, r], inverse_mass[r, r + 1], inverse_mass[r + 1, r + 1]
    determinant = a * d - b * b
    old_x, old_y = impulse[r], impulse[r + 1]
    new_x = old_x - share * (d * x - b * y) / determinant
    new_y = old_y - share * (a * y - b * x) / determinant
    if math.hypot(new_x, new_y) > edge:
        # A step down the gradient of the energy, to the nearest that is allowed: a fixed point opposes the sliding.
        half = 0.5 * (a + d)
        largest = half + math.sqrt(max(half * half - determinant, 0.0))
        new_x, new_y = old_x - share * x / largest, old_y - share * y / largest
        length = math.hypot(new_x, new_y)
        if length > edge:
            new_x, new_y = new_x * (edge / length), new_y * (edge / length)
    impulse[r], impulse[r + 1] = new_x, new_y
    return abs(new_x - old_x) + abs(new_y - old_y)


@kernel
def _press(inverse_mass, before, friction, impulse):
    """Stop the approach at all points, by sweeps over them.

    Where friction is large, sweeps may go round in circles: they take shorter ways while they do not get better.
    """
    share, least, idle = 1.0, math.inf, 0
    for _ in range(MAX_PATCH_SWEEPS):
        change = total = 0.0
        for k in range(len(impulse) // 3):
            n = 3 * k
            old = impulse[n]
            approach = _velocity_at(inverse_mass, before, impulse, n)
            impulse[n] = max(0.0, old - share * approach / inverse_mass[n, n])
            change += abs(impulse[n] - old)
            change += _rub_point(inverse_mass, before, impulse, k, friction * impulse[n], share)
            total += impulse[n]
        if change <= PATCH_CONVERGED * total:
            break
        idle += 1
        if change < 0.5 * least:
            least, idle = change, 0
        elif idle == IDLE_SWEEPS:
            share, least, idle = SHORTER_SWEEPS * share, change, 0


@kernel
def _rub(inverse_mass, before, friction, impulse):
    """Let friction take the most energy for the normal impulses there are; every sweep takes more."""
    for _ in range(MAX_PATCH_SWEEPS):
        change = total = 0.0
        for k in range(len(impulse) // 3):
            change += _rub_point(inverse_mass, before, impulse, k, friction * impulse[3 * k], 1.0)
            total += impulse[3 * k]
        if change <= PATCH_CONVERGED * total:
            break


@kernel
def _share_evenly(inverse_mass, velocity, impulse):
    """Begin with the same normal impulse everywhere, so that the middle stops approaching: a flat landing is that."""
    approach = response = 0.0
    for i in range(0, len(impulse), 3):
        approach -= velocity[i]
        for j in range(0, len(impulse), 3):
            response += inverse_mass[i, j]
    for row in range(len(impulse)):
        impulse[row] = max(0.0, approach / response) if row % 3 == 0 else 0.0


@kernel
def _energy(inverse_mass, velocity, impulse):
    """The energy that impulses give to bodies whose points have these velocities [J]."""
    energy = 0.5 * _product(inverse_mass, impulse, impulse)
    for row in range(len(impulse)):
        energy += velocity[row] * impulse[row]
    return energy


@kernel
def _coulomb_impulses(inverse_mass, velocity, restitution, friction, impulse):
    """Fill in the impulses of an impact of points with these velocities (3 k,) before it; what friction took [J].

    Of what all of it took, that is all but what restitution did not give back of the energy that pressing took up. It
    is below 0 if there is no answer.
    """
    _share_evenly(inverse_mass, velocity, impulse)
    _press(inverse_mass, velocity, friction, impulse)
    square = _product(inverse_mass, impulse, impulse)
    taken = 0.5 * square - _energy(inverse_mass, velocity, impulse)
    if taken <= (1.0 - PATCH_ACCEPTED) * square:
        return -1.0
    if taken < square:
        _combine(impulse, taken / square, impulse, 0.0, impulse)
    after = np.empty(len(impulse))
    pressing = 0.0
    for row in range(len(impulse)):
        after[row] = _velocity_at(inverse_mass, velocity, impulse, row)
        if row % 3 == 0:
            pressing -= 0.5 * impulse[row] * (velocity[row] + after[row])
    if restitution > 0.0:
        again = np.empty(len(impulse))
        _combine(again, restitution, impulse, 0.0, impulse)
        _rub(inverse_mass, after, friction, again)
        _combine(impulse, 1.0, impulse, 1.0, again)
    lost = max(-_energy(inverse_mass, velocity, impulse), 0.0)
    return lost - min(max((1.0 - restitution * restitution) * pressing, 0.0), lost)


# ---- tangential restitution (see point_impact.py) --------------------------------------------------------------------


@kernel
def _give_back(inverse_mass, velocity, law, impulse, rubbed):
    """Let a patch that stuck go on along its friction, up to the tangential restitution of it; what it gave back [J].

    As far as all points stay within their cones and none approaches, and no more energy comes back than the square of
    that of what friction took.
    """
    back, after = np.empty(len(impulse)), np.empty(len(impulse))
    for row in range(len(impulse)):
        back[row] = 0.0 if row % 3 == 0 else impulse[row]
        after[row] = _velocity_at(inverse_mass, velocity, impulse, row)
    square = _product(inverse_mass, back, back)
    factor = law.tangential_restitution
    if 0.5 * square > rubbed:
        factor *= math.sqrt(2.0 * rubbed / square)
    for n in range(0, len(impulse), 3):
        change = (0.0, factor * back[n + 1], factor * back[n + 2])
        factor *= within_cone((impulse[n], impulse[n + 1], impulse[n + 2]), change, law.friction)
        closing = after[n] - _velocity_at(inverse_mass, after, back, n)
        if factor * closing > max(after[n], 0.0):
            factor = max(after[n], 0.0) / closing
    before = _energy(inverse_mass, velocity, impulse)
    _combine(impulse, 1.0, impulse, factor, back)
    return _energy(inverse_mass, velocity, impulse) - before


@kernel
def _smooth(inverse_mass, velocity, restitution, law, impulse):
    """Fill in the impulses of a patch whose tangential restitution is below 0: between smooth and rougher ones."""
    share = 1.0 + law.tangential_restitution
    rubbed = _coulomb_impulses(inverse_mass, velocity, restitution, 0.0, impulse)
    if share <= 0.0 or rubbed < 0.0:
        return rubbed
    change = np.empty(len(impulse))
    rubbed = _coulomb_impulses(inverse_mass, velocity, restitution, law.friction / share, change)
    if rubbed < 0.0:
        return rubbed
    _combine(change, 1.0, change, -1.0, impulse)
    for n in range(0, len(impulse), 3):
        # Smooth impulses have nothing across the normal.
        beyond = math.hypot(change[n + 1], change[n + 2]) - law.friction * change[n]
        if share * beyond > law.friction * impulse[n]:
            share = law.friction * impulse[n] / beyond
    _combine(impulse, 1.0, impulse, share, change)
    return share * rubbed + 0.5 * share * (1.0 - share) * _product(inverse_mass, change, change)


@kernel
def patch_impulses(a, b, contact, points, restitution, law, impulse):
    """Fill in the impulses on b (3 k,) at the points of a contact.

    Returns what restitution and what friction took [J], and whether there is an answer.
    """
    count = contact.count
    inverse_mass, velocity = np.empty((3 * count, 3 * count)), np.empty(3 * count)
    _fill_inverse_mass(a, b, contact, points, inverse_mass)
    basis, offset = basis_of(contact), to_vec3(contact.offset)
    for k in range(count):
        n = 3 * k
        velocity[n], velocity[n + 1], velocity[n + 2] = contact_velocity(a, b, load_vec3(points, k), offset, basis)
    if law.tangential_restitution < 0.0:
        rubbed = _smooth(inverse_mass, velocity, restitution, law, impulse)
    else:
        rubbed = _coulomb_impulses(inverse_mass, velocity, restitution, law.friction, impulse)
        if law.tangential_restitution > 0.0 and rubbed > 0.0:
            rubbed = max(rubbed - _give_back(inverse_mass, velocity, law, impulse, rubbed), 0.0)
    return -_energy(inverse_mass, velocity, impulse) - rubbed, rubbed, rubbed >= 0.0
