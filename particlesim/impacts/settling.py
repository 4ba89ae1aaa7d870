"""How bodies that settle move on for a stretch of time: all their contact points at once.

Gravity acts for the whole stretch at once. Impulses, none of which pulls, then leave no contact point closing more
than its gap (J. J. Moreau, Unilateral contact and dry friction in finite freedom dynamics, 1988; gaps as in
M. Anitescu, F. A. Potra, Nonlinear Dynamics 14 (1997) 231-247); they are found by going round the points (M. Jean,
Computer Methods in Applied Mechanics and Engineering 177 (1999) 235-257). What is pressed moves on steadily for the
stretch, what is not falls as ever.

The new velocities are the nearest, by their kinetic energy, to those with gravity that close no gap. So the energy,
with what the bodies lose of their height, falls by the kinetic energy of the change in velocity, and never rises.
Points that met fast then part as their restitution says, and what has sunk in is lifted, as far as that energy goes.
"""

from __future__ import annotations

import math

import numpy as np

from particlesim.impacts.cluster import (
    GAP,
    INRADIUS,
    LEVER_I,
    LEVER_J,
    MASS,
    NORMAL,
    PARTING,
    RESTITUTION,
    SLOW,
    TWIST_I,
    TWIST_J,
    column,
)
from particlesim.jit import borrowed, kernel
from particlesim.vec import along, dot, put, row, sub, vector

# Rounds over all contact points. Piles that lie still need one or two, as they start from the forces of before.
_MAX_SWEEPS = 100

# Rounds end when no speed at a contact point changes by more than this fraction of what gravity adds in the stretch.
_CONVERGED = 1e-9

# Contact points that have sunk deeper than this fraction of the inscribed radius are lifted, by a tenth at a time.
_DEEP = 2e-5


@kernel(inline=True)
def _push(velocity, spin, mass, i, j, point, k, impulse):
    """Give the impulse of a contact point to the velocities and spins of its two partners."""
    normal = column(point, k, NORMAL)
    put(velocity, i, along(row(velocity, i), normal, -impulse / mass[i]))
    put(spin, i, along(row(spin, i), column(point, k, TWIST_I), -impulse))
    if j >= 0:
        put(velocity, j, along(row(velocity, j), normal, impulse / mass[j]))
        put(spin, j, along(row(spin, j), column(point, k, TWIST_J), impulse))


@kernel(inline=True)
def _parting(velocity, spin, i, j, point, k):
    """Speed at which the partners part at a contact point."""
    normal = column(point, k, NORMAL)
    parting = -dot(normal, row(velocity, i)) - dot(column(point, k, LEVER_I), row(spin, i))
    if j >= 0:
        parting += dot(normal, row(velocity, j)) + dot(column(point, k, LEVER_J), row(spin, j))
    return parting


@kernel
def _press(partner, point, mass, wanted, small, velocity, spin, impulse):
    """Change ``impulse`` (m,), velocities and spins until partners part at each point at the speed ``wanted`` at least.

    Ends when no such speed changes by more than ``small`` [m/s], or after _MAX_SWEEPS rounds. Up and down by turns:
    what bears on a heap from above is soon known at its foot.
    """
    count = len(impulse)
    for sweep in range(_MAX_SWEEPS):
        change = 0.0
        for step in range(count):
            k = step if sweep % 2 == 0 else count - 1 - step
            i, j = partner[k, 0], partner[k, 1]
            lack = wanted[k] - _parting(velocity, spin, i, j, point, k)
            more = max(-impulse[k], lack * point[k, MASS])
            if more != 0.0:
                _push(velocity, spin, mass, i, j, point, k, more)
                impulse[k] += more
                change = max(change, abs(more) / point[k, MASS])
        if change <= small:
            break


@kernel
def _turned(partner, point, impulse, before):
    """The angular momenta (n, 3) after the impulses, from those ``before``."""
    after = before.copy()
    for k in range(len(impulse)):
        i, j = partner[k, 0], partner[k, 1]
        put(after, i, along(row(after, i), column(point, k, LEVER_I), -impulse[k]))
        if j >= 0:
            put(after, j, along(row(after, j), column(point, k, LEVER_J), impulse[k]))
    return after


@kernel
def _raise(point, impulse, duration, wanted):
    """Add what restitution and depth want of the speeds at contact points; returns whether that is anything."""
    anything = False
    for k in range(len(impulse)):
        if impulse[k] > 0.0 and point[k, PARTING] < -point[k, SLOW] and point[k, RESTITUTION] > 0.0:
            wanted[k] = -point[k, RESTITUTION] * point[k, PARTING]
            anything = True
        elif point[k, GAP] < -_DEEP * point[k, INRADIUS]:
            wanted[k] = min(-0.1 * point[k, GAP] / duration, point[k, SLOW])
            anything = True
    return anything


@kernel
def _gain(mass, fall, pressed, old, new):
    """Energy that bodies gain by going from the motion ``old`` to ``new``: (velocity, spin, angular momentum) (n, 3).

    ``fall`` is gravity times the duration [m/s].
    """
    gain = 0.0
    for i in range(len(mass)):
        if pressed[i]:
            v, w = row(old[0], i), row(new[0], i)
            gain += mass[i] * (0.5 * dot(w, w) - 0.5 * dot(v, v) - dot(fall, w))
            gain += 0.5 * (dot(row(new[1], i), row(new[2], i)) - dot(row(old[1], i), row(old[2], i)))
    return gain


@kernel
def _difference(mass, pressed, one, two):
    """Kinetic energy of the difference between two motions (velocity, spin, angular momentum)."""
    energy = 0.0
    for i in range(len(mass)):
        if pressed[i]:
            v = sub(row(two[0], i), row(one[0], i))
            spin, turn = sub(row(two[1], i), row(one[1], i)), sub(row(two[2], i), row(one[2], i))
            energy += 0.5 * (mass[i] * dot(v, v) + dot(spin, turn))
    return energy


@kernel
def _affordable(mass, fall, pressed, start, low, high):
    """How far to go from the motion ``low`` towards ``high`` so that no energy is gained from the ``start``, 0 to 1."""
    of_low = min(_gain(mass, fall, pressed, start, low), 0.0)
    of_high = _gain(mass, fall, pressed, start, high)
    if of_high <= 0.0:
        return 1.0
    # The gain is a parabola in how far one goes.
    square = _difference(mass, pressed, low, high)
    linear = of_high - of_low - square
    root = math.sqrt(max(linear * linear - 4.0 * square * of_low, 0.0))
    denominator = linear + root
    share = -2.0 * of_low / denominator if denominator > 0.0 else 0.0
    return min(max(share, 0.0), 1.0)


@kernel
def _mark(partner, impulse, pressed):
    """Mark the bodies that the impulses act on."""
    for k in range(len(impulse)):
        if impulse[k] > 0.0:
            pressed[partner[k, 0]] = True
            if partner[k, 1] >= 0:
                pressed[partner[k, 1]] = True


@kernel
def settle(world, constants, state, spin, partner, point, duration, impulse, acceleration):
    """Give pressed bodies the velocity and angular momentum with which they go on steadily for ``duration`` [s].

    ``impulse`` (m,) holds a guess of the impulses at the contact points, and is what they are in the end. ``spin``
    (n, 3) are the angular velocities now. Pressed bodies have an ``acceleration`` (n, 3) of 0. Returns which they are.
    """
    world, constants, state = borrowed((world, constants, state))
    mass = constants.mass
    g = vector(world.gravity)
    fall = g[0] * duration, g[1] * duration, g[2] * duration
    small = _CONVERGED * math.sqrt(dot(fall, fall))
    velocity, turning = state.velocity.copy(), spin.copy()
    for i in range(len(mass)):
        put(velocity, i, along(row(velocity, i), fall, 1.0))
    wanted = np.empty(len(impulse))
    for k in range(len(impulse)):
        wanted[k] = -max(point[k, GAP], 0.0) / duration
        _push(velocity, turning, mass, partner[k, 0], partner[k, 1], point, k, impulse[k])
    _press(partner, point, mass, wanted, small, velocity, turning, impulse)
    pressed = np.zeros(len(mass), dtype=np.bool_)
    _mark(partner, impulse, pressed)
    momentum = _turned(partner, point, impulse, state.angular_momentum)
    if _raise(point, impulse, duration, wanted):
        low, before = (velocity.copy(), turning.copy(), momentum), impulse.copy()
        _press(partner, point, mass, wanted, small, velocity, turning, impulse)
        _mark(partner, impulse, pressed)
        start = state.velocity, spin, state.angular_momentum
        high = velocity, turning, _turned(partner, point, impulse, state.angular_momentum)
        share = _affordable(mass, fall, pressed, start, low, high)
        for i in range(len(mass)):
            put(velocity, i, along(row(low[0], i), sub(row(high[0], i), row(low[0], i)), share))
        for k in range(len(impulse)):
            impulse[k] = before[k] + share * (impulse[k] - before[k])
        momentum = _turned(partner, point, impulse, state.angular_momentum)
        for i in range(len(mass)):
            pressed[i] = False
        _mark(partner, impulse, pressed)
    for i in range(len(mass)):
        if pressed[i]:
            put(state.velocity, i, row(velocity, i))
            put(state.angular_momentum, i, row(momentum, i))
            put(acceleration, i, (0.0, 0.0, 0.0))
    return pressed
