"""How bodies that settle move on for a stretch of time: all their contact points at once.

Gravity acts for the whole stretch at once. Impulses, none of which pulls, then leave no contact point closing more
than its gap (J. J. Moreau, Unilateral contact and dry friction in finite freedom dynamics, 1988; gaps as in
M. Anitescu, F. A. Potra, Nonlinear Dynamics 14 (1997) 231-247); they are found by going round the points (M. Jean,
Computer Methods in Applied Mechanics and Engineering 177 (1999) 235-257). What is pressed moves on steadily for the
stretch, what is not falls as ever.

The new velocities are the nearest, by their kinetic energy, to those with gravity that close no gap. So the energy,
with what the bodies lose of their height, falls by the kinetic energy of the change in velocity, and never rises:
should impulses that are not yet exact gain any, all are made smaller until they do not. Points that met fast then
part as their restitution says, and what has sunk in is lifted, as far as the energy lost goes.
"""

from __future__ import annotations

import math

import numpy as np

from particlesim.core.jit import kernel, without_refcounts
from particlesim.core.math3d import axpy, dot, load_vec3, store_vec3, sub, to_vec3
from particlesim.dynamics.contact.contact_points import (
    BEND,
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

# Rounds over all contact points in a stretch: as many as make this number of visits to points, which takes a
# millisecond, but _ROUNDS at least. Thus few points, such as those of a tower, are done to rounding; a large heap
# starts from the forces of the stretch before, and gets better from one to the next. There are more rounds while some
# point would sink in farther than it may by more than a fraction _URGENT of the inscribed radius. Hardly a stretch
# needs _MOST_ROUNDS: of a pour of 2,001 bodies one in ten thousand.
_VISITS = 30_000
_ROUNDS = 12
_MOST_ROUNDS = 500
_URGENT = 2.4e-5

# Rounds end when no speed at a contact point changes by more than this fraction of what gravity adds in the stretch.
_CONVERGED = 1e-9

# Energy gained, as a fraction of what lifts all bodies by their radii, that is rounding.
_ROUNDING = 1e-13

# Bodies come to rest this fraction of the inscribed radius apart. What rounds leave undone they sink into this slack
# first, and into each other by _DEEP and a few times _URGENT. Neither can be seen; what touches is nearer than
# RESTITUTION_THRESHOLD_HEIGHT. In one stretch a point may sink by a part _SHARE of the way that is left to it. Where
# none is left, all but a tenth of what _URGENT leaves free is taken away: in a heap that is nearly at rest nothing
# gives the energy to lift what has sunk.
_SLACK = 2e-4
_DEEP = 3e-5
_SHARE = 0.25
_LEAST = -0.9 * _URGENT

# Contact points that have sunk in are lifted, by this fraction of their depth at a time.
_LIFTED = 0.2


@kernel
def _rows_of(partner, k, world):
    """The rows of the two partners of a contact point in an array of motions, whose row ``world`` is the walls'."""
    return partner[k, 0], partner[k, 1] if partner[k, 1] >= 0 else world


@kernel
def _push(motion, lightness, point, i, j, k, impulse):
    """Give the impulse of a contact point to the motions in rows ``i`` and ``j``."""
    of_i, of_j = impulse * lightness[i], impulse * lightness[j]
    for axis in range(3):
        normal = point[k, NORMAL + axis]
        motion[i, axis] -= of_i * normal
        motion[j, axis] += of_j * normal
        motion[i, 3 + axis] -= impulse * point[k, TWIST_I + axis]
        motion[j, 3 + axis] += impulse * point[k, TWIST_J + axis]


@kernel
def _parting(motion, point, i, j, k):
    """Speed at which the motions in rows ``i`` and ``j`` part at a contact point."""
    parting = 0.0
    for axis in range(3):
        parting += point[k, NORMAL + axis] * (motion[j, axis] - motion[i, axis])
        parting += point[k, LEVER_J + axis] * motion[j, 3 + axis] - point[k, LEVER_I + axis] * motion[i, 3 + axis]
    return parting


@kernel
def _go_round(partner, point, lightness, wanted, upwards, motion, impulse):
    """Let each contact point in turn part at the speed ``wanted`` at least, as far as pushing and not pulling does it.

    Returns the largest change of such a speed.
    """
    count, walls = len(impulse), len(motion) - 1
    change = 0.0
    for step in range(count):
        k = step if upwards else count - 1 - step
        i, j = _rows_of(partner, k, walls)
        lack = wanted[k] - _parting(motion, point, i, j, k)
        more = max(-impulse[k], lack * point[k, MASS])
        if more != 0.0:
            _push(motion, lightness, point, i, j, k, more)
            impulse[k] += more
            change = max(change, abs(more) / point[k, MASS])
    return change


@kernel
def _sinking(partner, point, wanted, slack, duration, motion):
    """How much farther than its ``slack`` [m] any point sinks in, as a fraction of the inscribed radius."""
    most = 0.0
    for k in range(len(wanted)):
        i, j = _rows_of(partner, k, len(motion) - 1)
        lack = wanted[k] - _parting(motion, point, i, j, k)
        most = max(most, (lack * duration - slack[k]) / point[k, INRADIUS])
    return most


@kernel
def _bodies(partner, count):
    """Those of ``count`` bodies that have a contact point."""
    listed = np.zeros(count, dtype=np.bool_)
    for k in range(len(partner)):
        for side in range(2):
            if partner[k, side] >= 0:
                listed[partner[k, side]] = True
    return np.flatnonzero(listed)


@kernel
def _go_on(array, before, rows, share):
    """Go on along the way from ``before`` to ``array``, by a ``share`` of it; ``before`` becomes what was reached."""
    for k in rows:
        for axis in range(array.shape[1]):
            reached = array[k, axis]
            array[k, axis] += share * (reached - before[k, axis])
            before[k, axis] = reached


@kernel
def _turned_back(point, impulse, begun, before):
    """Whether the rounds that began at impulses ``begun`` went back on the way there from ``before``."""
    along_way = 0.0
    for k in range(len(impulse)):
        along_way += (impulse[k, 0] - begun[k, 0]) * (impulse[k, 0] - before[k, 0]) / point[k, MASS]
    return along_way < 0.0


@kernel
def _press(partner, point, lightness, wanted, slack, small, duration, motion, impulse):
    """Change ``impulse`` (m, 1) and ``motion`` until partners part at each point at the speed ``wanted`` at least.

    ``motion`` (n + 1, 6) are velocities and spins, with a row for the walls; ``lightness`` (n + 1,) is 1 / mass.
    Rounds go up and down by turns: what bears on a heap from above is soon known at its foot. Two such rounds are as a
    step along a gradient, and go on along the way of those before (Y. Nesterov, Soviet Mathematics Doklady 27 (1983)
    372-376; for contacts H. Mazhar, T. Heyn, D. Negrut, A. Tasora, ACM Transactions on Graphics 34 (2015) 32) until
    they turn back (B. O'Donoghue, E. Candes, Foundations of Computational Mathematics 15 (2015) 715-732). In heaps that
    needs a third to a seventh of the rounds. Returns whether no point sinks in too far.
    """
    pushed, moved, begun = impulse.copy(), motion.copy(), impulse.copy()
    points, bodies = np.arange(len(impulse)), _bodies(partner, len(lightness))
    least = min(max(_VISITS // max(len(impulse), 1), _ROUNDS), _MOST_ROUNDS)
    pace = 1.0
    for turn in range(2, _MOST_ROUNDS + 1, 2):
        for upwards in (True, False):
            change = _go_round(partner, point, lightness, wanted, upwards, motion, impulse[:, 0])
        if change <= small:
            return True
        if turn >= least and _sinking(partner, point, wanted, slack, duration, motion) <= _URGENT:
            return True
        if _turned_back(point, impulse, begun, pushed):
            pace = 1.0
        faster = 0.5 + math.sqrt(0.25 + pace * pace)
        share = (pace - 1.0) / faster if turn < _MOST_ROUNDS else 0.0
        pace = faster
        _go_on(impulse, pushed, points, share)
        _go_on(motion, moved, bodies, share)
        begun[:] = impulse
    return False


@kernel
def _turned(partner, point, impulse, before):
    """The angular momenta (n, 3) after the impulses, from those ``before``."""
    after = before.copy()
    for k in range(len(impulse)):
        i, j = partner[k, 0], partner[k, 1]
        store_vec3(after, i, axpy(load_vec3(after, i), column(point, k, LEVER_I), -impulse[k]))
        if j >= 0:
            store_vec3(after, j, axpy(load_vec3(after, j), column(point, k, LEVER_J), impulse[k]))
    return after


@kernel
def _raise(point, impulse, duration, wanted, slack):
    """Add what restitution and depth want of the speeds at contact points; returns whether that is anything.

    Points that do not part as fast as is wanted have not sunk in for it: ``slack`` grows by as much.
    """
    anything = False
    for k in range(len(impulse)):
        back = 0.0
        if impulse[k] > 0.0 and point[k, PARTING] < -point[k, SLOW]:
            back = -point[k, RESTITUTION] * point[k, PARTING]
        gap, bend = point[k, GAP], point[k, BEND]
        if gap - bend < 0.0:
            lift = min(-_LIFTED * gap / duration, point[k, SLOW]) if gap < 0.0 else -gap / duration
            back = max(back, bend / duration + lift)
        if back > 0.0:
            slack[k] += (back - wanted[k]) * duration
            wanted[k] = back
            anything = True
    return anything


@kernel
def _velocity_in(motion, i):
    """Velocity of body ``i``."""
    return motion[i, 0], motion[i, 1], motion[i, 2]


@kernel
def _spin_in(motion, i):
    """Angular velocity of body ``i``."""
    return motion[i, 3], motion[i, 4], motion[i, 5]


@kernel
def _gain(mass, fall, pressed, old, new):
    """Energy that bodies gain by going from ``old`` to ``new``: each the motion and the angular momentum (n, 3).

    ``fall`` is gravity times the duration [m/s].
    """
    gain = 0.0
    for i in range(len(mass)):
        if pressed[i]:
            v, w = _velocity_in(old[0], i), _velocity_in(new[0], i)
            gain += mass[i] * (0.5 * dot(w, w) - 0.5 * dot(v, v) - dot(fall, w))
            gain += 0.5 * (
                dot(_spin_in(new[0], i), load_vec3(new[1], i)) - dot(_spin_in(old[0], i), load_vec3(old[1], i))
            )
    return gain


@kernel
def _difference(mass, pressed, one, two):
    """Kinetic energy of the difference between two motions, each with the angular momentum."""
    energy = 0.0
    for i in range(len(mass)):
        if pressed[i]:
            v = sub(_velocity_in(two[0], i), _velocity_in(one[0], i))
            spin, turn = sub(_spin_in(two[0], i), _spin_in(one[0], i)), sub(load_vec3(two[1], i), load_vec3(one[1], i))
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
def _lift(constants, gravity, pressed):
    """The energy that lifts pressed bodies by their radii [J]."""
    energy = 0.0
    for i in range(len(pressed)):
        if pressed[i]:
            energy += constants.mass[i] * constants.radius[i]
    return energy * math.sqrt(dot(gravity, gravity))


@kernel
def _mark(partner, impulse, pressed, afresh):
    """Mark the bodies that the impulses act on; ``afresh`` no others, else those marked before too."""
    for i in range(len(pressed)):
        pressed[i] = pressed[i] and not afresh
    for k in range(len(impulse)):
        if impulse[k] > 0.0:
            pressed[partner[k, 0]] = True
            if partner[k, 1] >= 0:
                pressed[partner[k, 1]] = True


@kernel
def _go_between(low, high, share):
    """Bring the motion ``high`` back to where a ``share`` of the way from ``low`` ends."""
    for i in range(high.shape[0]):
        for k in range(high.shape[1]):
            high[i, k] = low[i, k] + share * (high[i, k] - low[i, k])


@kernel
def settle(world, constants, state, spin, partner, point, duration, impulse, acceleration):
    """Give pressed bodies the velocity and angular momentum with which they go on steadily for ``duration`` [s].

    ``impulse`` (m,) holds a guess of the impulses at the contact points, and is what they are in the end. ``spin``
    (n, 3) are the angular velocities now. Pressed bodies have an ``acceleration`` (n, 3) of 0. Returns which they are,
    whether the impulses are good enough, and those without what makes points part again.
    """
    world, constants, state = without_refcounts((world, constants, state))
    mass = constants.mass
    g = to_vec3(world.gravity)
    fall = g[0] * duration, g[1] * duration, g[2] * duration
    small = _CONVERGED * math.sqrt(dot(fall, fall))
    count = len(mass)
    start, lightness = np.zeros((count + 1, 6)), np.zeros(count + 1)
    for i in range(count):
        lightness[i] = 1.0 / mass[i]
        for axis in range(3):
            start[i, axis], start[i, 3 + axis] = state.velocity[i, axis], spin[i, axis]
    motion = start.copy()
    for i in range(count):
        for axis in range(3):
            motion[i, axis] += fall[axis]
    free = motion.copy(), state.angular_momentum
    wanted, slack = np.empty(len(impulse)), np.empty(len(impulse))
    for k in range(len(impulse)):
        gap, room = point[k, GAP] - point[k, BEND], _SLACK * point[k, INRADIUS]
        wanted[k] = -max(gap - room, 0.0) / duration
        slack[k] = max(_SHARE * (min(gap, room) + _DEEP * point[k, INRADIUS]), _LEAST * point[k, INRADIUS])
        a, b = _rows_of(partner, k, count)
        _push(motion, lightness, point, a, b, k, impulse[k])
    pressed = np.zeros(count, dtype=np.bool_)
    at_first = start, state.angular_momentum
    pushes = impulse.reshape((-1, 1))
    done = _press(partner, point, lightness, wanted, slack, small, duration, motion, pushes)
    _mark(partner, impulse, pressed, True)
    momentum = _turned(partner, point, impulse, state.angular_momentum)
    rounding = _ROUNDING * _lift(constants, g, pressed)
    gain = _gain(mass, fall, pressed, at_first, (motion, momentum))
    if gain > rounding:
        share = _affordable(mass, fall, pressed, at_first, free, (motion, momentum))
        _go_between(free[0], motion, share)
        for k in range(len(impulse)):
            impulse[k] *= share
        momentum = _turned(partner, point, impulse, state.angular_momentum)
    steady = impulse.copy()
    if gain < -rounding and _raise(point, impulse, duration, wanted, slack):
        low = motion.copy(), momentum
        done = _press(partner, point, lightness, wanted, slack, small, duration, motion, pushes) and done
        _mark(partner, impulse, pressed, False)
        high = motion, _turned(partner, point, impulse, state.angular_momentum)
        share = _affordable(mass, fall, pressed, at_first, low, high)
        _go_between(low[0], motion, share)
        for k in range(len(impulse)):
            impulse[k] = steady[k] + share * (impulse[k] - steady[k])
        momentum = _turned(partner, point, impulse, state.angular_momentum)
        _mark(partner, impulse, pressed, True)
    for i in range(len(mass)):
        if pressed[i]:
            store_vec3(state.velocity, i, _velocity_in(motion, i))
            store_vec3(state.angular_momentum, i, load_vec3(momentum, i))
            store_vec3(acceleration, i, (0.0, 0.0, 0.0))
    return pressed, done, steady
