"""The projected solver: how bodies that settle move on for a substep, all their contact points at once.

Gravity acts for the whole substep at once. Impulses, none of which pulls, then leave no contact point closing more than
its gap (J. J. Moreau, Unilateral contact and dry friction in finite freedom dynamics, 1988; gaps as in M. Anitescu,
F. A. Potra, Nonlinear Dynamics 14 (1997) 231-247); they are found by sweeps over the points (M. Jean, Computer Methods
in Applied Mechanics and Engineering 177 (1999) 235-257). What is pressed moves on steadily for the substep, what is not
falls as ever.

The new velocities are the nearest, by their kinetic energy, to those with gravity that close no gap. So the energy,
with what the bodies lose of their height, falls by the kinetic energy of the change in velocity, and never rises:
should impulses that are not yet exact gain any, all are made smaller until they do not. Points that met fast then part
as their restitution says, and what has sunk in is lifted, as far as the energy lost goes.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from particlesim.core.jit import entry_kernel, kernel, without_refcounts
from particlesim.core.math3d import axpy, dot, load_vec3, set_vec3, store_vec3, sub, to_vec3
from particlesim.dynamics.settings import (
    DEEPEST_REST,
    ENERGY_ROUNDING,
    LEAST_SLACK,
    LIFT_SHARE,
    MAX_SWEEPS,
    MIN_SWEEPS,
    REST_SLACK,
    SLACK_SHARE,
    SWEEP_CONVERGED,
    SWEEP_VISITS,
    URGENT_PENETRATION,
)
from particlesim.model.bodies import DYNAMIC, per_mass


@kernel
def _push(motion, lightness, p, impulse):
    """Give the impulse of contact point ``p`` to the motions of its bodies."""
    of_a, of_b = impulse * lightness[p.a], impulse * lightness[p.b]
    for axis in range(3):
        motion[p.a, axis] -= of_a * p.normal[axis]
        motion[p.b, axis] += of_b * p.normal[axis]
        motion[p.a, 3 + axis] -= impulse * p.twist_a[axis]
        motion[p.b, 3 + axis] += impulse * p.twist_b[axis]


@kernel
def _normal_velocity(motion, p):
    """Normal velocity at contact point ``p`` with these motions."""
    speed = 0.0
    for axis in range(3):
        speed += p.normal[axis] * (motion[p.b, axis] - motion[p.a, axis])
        speed += p.lever_b[axis] * motion[p.b, 3 + axis] - p.lever_a[axis] * motion[p.a, 3 + axis]
    return speed


@kernel
def _sweep(point, lightness, wanted, upwards, motion, impulse):
    """Let each contact point in turn have the normal velocity ``wanted`` at least, as far as pushing alone does it.

    Returns the largest change of such a velocity.
    """
    count, change = len(impulse), 0.0
    for step in range(count):
        k = step if upwards else count - 1 - step
        p = point[k]
        lack = wanted[k] - _normal_velocity(motion, p)
        more = max(-impulse[k], lack * p.effective_mass)
        if more != 0.0:
            _push(motion, lightness, p, more)
            impulse[k] += more
            change = max(change, abs(more) / p.effective_mass)
    return change


@kernel
def _sinking(point, wanted, slack, duration, motion):
    """How much farther than its ``slack`` [m] any point sinks in, as a fraction of the inscribed radius."""
    most = 0.0
    for k in range(len(wanted)):
        lack = wanted[k] - _normal_velocity(motion, point[k])
        most = max(most, (lack * duration - slack[k]) / point[k].inradius)
    return most


@kernel
def _bodies_of(point, count):
    """Those of ``count`` bodies that have a contact point."""
    listed = np.zeros(count, dtype=np.bool_)
    for k in range(len(point)):
        listed[point[k].a] = listed[point[k].b] = True
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
    """Whether the sweeps that began at impulses ``begun`` went back on the way there from ``before``."""
    along_way = 0.0
    for k in range(len(impulse)):
        along_way += (impulse[k, 0] - begun[k, 0]) * (impulse[k, 0] - before[k, 0]) / point[k].effective_mass
    return along_way < 0.0


class Aim(NamedTuple):
    """What contact points are to reach."""

    wanted: np.ndarray  # (m,) normal velocity at least [m/s]
    slack: np.ndarray  # (m,) how far each may sink in for want of sweeps [m]
    small: float  # a change of normal velocity that ends the sweeps [m/s]
    duration: float  # of the substep [s]


@kernel
def _press(point, lightness, aim, motion, impulse):
    """Change ``impulse`` (m, 1) and ``motion`` until every contact point has the normal velocity wanted at least.

    ``motion`` (n, 6) are velocities and angular velocities; ``lightness`` (n,) is 1 / mass. Sweeps go up and down by
    turns: what bears on a heap from above is soon known at its foot. Two such sweeps are as a step along a gradient,
    and go on along the way of those before (Y. Nesterov, Soviet Mathematics Doklady 27 (1983) 372-376; for contacts
    H. Mazhar, T. Heyn, D. Negrut, A. Tasora, ACM Transactions on Graphics 34 (2015) 32) until they turn back
    (B. O'Donoghue, E. Candes, Foundations of Computational Mathematics 15 (2015) 715-732). In heaps that needs a third
    to a seventh of the sweeps. Returns whether no point sinks in too far.
    """
    pushed, moved, begun = impulse.copy(), motion.copy(), impulse.copy()
    points, bodies = np.arange(len(impulse)), _bodies_of(point, len(lightness))
    least = min(max(SWEEP_VISITS // max(len(impulse), 1), MIN_SWEEPS), MAX_SWEEPS)
    pace, change = 1.0, 0.0
    for sweep in range(2, MAX_SWEEPS + 1, 2):
        for upwards in (True, False):
            change = _sweep(point, lightness, aim.wanted, upwards, motion, impulse[:, 0])
        if change <= aim.small:
            return True
        if sweep >= least and _sinking(point, aim.wanted, aim.slack, aim.duration, motion) <= URGENT_PENETRATION:
            return True
        if _turned_back(point, impulse, begun, pushed):
            pace = 1.0
        faster = 0.5 + math.sqrt(0.25 + pace * pace)
        share = (pace - 1.0) / faster if sweep < MAX_SWEEPS else 0.0
        pace = faster
        _go_on(impulse, pushed, points, share)
        _go_on(motion, moved, bodies, share)
        begun[:] = impulse
    return False


@kernel
def _momenta_after(body, point, impulse):
    """The angular momenta (n, 3) of bodies after the impulses."""
    after = np.empty((len(body), 3))
    for i in range(len(body)):
        store_vec3(after, i, to_vec3(body[i].angular_momentum))
    for k in range(len(impulse)):
        p = point[k]
        store_vec3(after, p.a, axpy(load_vec3(after, p.a), to_vec3(p.lever_a), -impulse[k]))
        if body[p.b].kind == DYNAMIC:
            store_vec3(after, p.b, axpy(load_vec3(after, p.b), to_vec3(p.lever_b), impulse[k]))
    return after


@kernel
def _aim_of(point, duration, small):
    """What contact points are to reach at first: no gap closes by more than there is of it."""
    wanted, slack = np.empty(len(point)), np.empty(len(point))
    for k in range(len(point)):
        p = point[k]
        gap, room = p.gap - p.bend, REST_SLACK * p.inradius
        wanted[k] = -max(gap - room, 0.0) / duration
        slack[k] = max(SLACK_SHARE * (min(gap, room) + DEEPEST_REST * p.inradius), LEAST_SLACK * p.inradius)
    return Aim(wanted, slack, small, duration)


@kernel
def _raise(point, impulse, aim):
    """Add what restitution and depth want of the normal velocities; returns whether that is anything.

    Points that do not part as fast as is wanted have not sunk in for it: their slack grows by as much.
    """
    anything = False
    for k in range(len(impulse)):
        p, back = point[k], 0.0
        if impulse[k] > 0.0 and p.normal_velocity < -p.threshold:
            back = -p.restitution * p.normal_velocity
        if p.gap - p.bend < 0.0:
            lift = -p.gap / aim.duration
            if p.gap < 0.0:
                lift = min(-LIFT_SHARE * p.gap / aim.duration, p.threshold)
            back = max(back, p.bend / aim.duration + lift)
        if back > 0.0:
            aim.slack[k] += (back - aim.wanted[k]) * aim.duration
            aim.wanted[k] = back
            anything = True
    return anything


# ---- energy --------------------------------------------------------------------------------------------------------
# A state of all bodies is (motion (n, 6), angular momentum (n, 3)).


@kernel
def _velocity_in(motion, i):
    """Velocity of body ``i``."""
    return motion[i, 0], motion[i, 1], motion[i, 2]


@kernel
def _spin_in(motion, i):
    """Angular velocity of body ``i``."""
    return motion[i, 3], motion[i, 4], motion[i, 5]


@kernel
def _gain(body, fall, pressed, old, new):
    """Energy that bodies gain by going from state ``old`` to ``new``; ``fall`` is gravity times the duration [m/s]."""
    gain = 0.0
    for i in range(len(pressed)):
        if pressed[i]:
            v, w = _velocity_in(old[0], i), _velocity_in(new[0], i)
            gain += body[i].mass * (0.5 * dot(w, w) - 0.5 * dot(v, v) - dot(fall, w))
            gain += 0.5 * (
                dot(_spin_in(new[0], i), load_vec3(new[1], i)) - dot(_spin_in(old[0], i), load_vec3(old[1], i))
            )
    return gain


@kernel
def _difference(body, pressed, one, two):
    """Kinetic energy of the difference between two states."""
    energy = 0.0
    for i in range(len(pressed)):
        if pressed[i]:
            v = sub(_velocity_in(two[0], i), _velocity_in(one[0], i))
            spin, turned = (
                sub(_spin_in(two[0], i), _spin_in(one[0], i)),
                sub(load_vec3(two[1], i), load_vec3(one[1], i)),
            )
            energy += 0.5 * (body[i].mass * dot(v, v) + dot(spin, turned))
    return energy


@kernel
def _affordable(body, fall, pressed, start, low, high):
    """How far to go from state ``low`` towards ``high`` so that no energy is gained from the ``start``, 0 to 1."""
    of_low = min(_gain(body, fall, pressed, start, low), 0.0)
    of_high = _gain(body, fall, pressed, start, high)
    if of_high <= 0.0:
        return 1.0
    # The gain is a parabola in how far one goes.
    square = _difference(body, pressed, low, high)
    linear = of_high - of_low - square
    root = math.sqrt(max(linear * linear - 4.0 * square * of_low, 0.0))
    denominator = linear + root
    share = -2.0 * of_low / denominator if denominator > 0.0 else 0.0
    return min(max(share, 0.0), 1.0)


@kernel
def _lift_energy(body, gravity, pressed):
    """The energy that lifts pressed bodies by their radii [J]."""
    energy = 0.0
    for i in range(len(pressed)):
        if pressed[i]:
            energy += body[i].mass * body[i].radius
    return energy * math.sqrt(dot(gravity, gravity))


@kernel
def _mark(point, impulse, pressed, afresh):
    """Mark the particles that the impulses act on; ``afresh`` no others, else those marked before too."""
    for i in range(len(pressed)):
        pressed[i] = pressed[i] and not afresh
    for k in range(len(impulse)):
        if impulse[k] > 0.0:
            pressed[point[k].a] = True
            if point[k].b < len(pressed):
                pressed[point[k].b] = True


@kernel
def _go_between(low, high, share):
    """Bring the motion ``high`` back to where a ``share`` of the way from ``low`` ends."""
    for i in range(high.shape[0]):
        for k in range(high.shape[1]):
            high[i, k] = low[i, k] + share * (high[i, k] - low[i, k])


# ---- a substep -----------------------------------------------------------------------------------------------------


@kernel
def _free_motions(body, spin, particles, fall):
    """Motions (n, 6) at the start and with gravity of the substep, and the lightness (n,) of bodies."""
    start, lightness = np.zeros((len(body), 6)), np.zeros(len(body))
    for i in range(len(body)):
        lightness[i] = per_mass(body[i], 1.0)
        for axis in range(3):
            start[i, axis], start[i, 3 + axis] = body[i].velocity[axis], spin[i, axis]
    motion = start.copy()
    for i in range(particles):
        for axis in range(3):
            motion[i, axis] += fall[axis]
    return start, motion, lightness


@entry_kernel
def settle(system, spin, point, duration, impulse):
    """Give pressed bodies the velocity and angular momentum with which they go on steadily for ``duration`` [s].

    ``impulse`` (m,) holds a guess of the impulses at the contact points, and is what they are in the end. ``spin``
    (n, 3) are the angular velocities now. Pressed bodies rest: they do not fall. Returns whether the impulses
    are good enough, and those without what makes points part again.
    """
    system, spin, point, impulse = without_refcounts((system, spin, point, impulse))
    body = system.body
    g = to_vec3(system.domain[0].gravity)
    fall = g[0] * duration, g[1] * duration, g[2] * duration
    begin, motion, lightness = _free_motions(body, spin, system.particles, fall)
    aim = _aim_of(point, duration, SWEEP_CONVERGED * math.sqrt(dot(fall, fall)))
    before = _momenta_after(body, point, impulse[:0])
    start, free = (begin, before), motion.copy()
    for k in range(len(impulse)):
        _push(motion, lightness, point[k], impulse[k])
    pressed = np.zeros(system.particles, dtype=np.bool_)
    pushes = impulse.reshape((-1, 1))
    done = _press(point, lightness, aim, motion, pushes)
    _mark(point, impulse, pressed, True)
    momentum = _momenta_after(body, point, impulse)
    rounding = ENERGY_ROUNDING * _lift_energy(body, g, pressed)
    gain = _gain(body, fall, pressed, start, (motion, momentum))
    if gain > rounding:
        share = _affordable(body, fall, pressed, start, (free, before), (motion, momentum))
        _go_between(free, motion, share)
        for k in range(len(impulse)):
            impulse[k] *= share
        momentum = _momenta_after(body, point, impulse)
    steady = impulse.copy()
    if gain < -rounding and _raise(point, impulse, aim):
        low = motion.copy(), momentum
        done = _press(point, lightness, aim, motion, pushes) and done
        _mark(point, impulse, pressed, False)
        share = _affordable(body, fall, pressed, start, low, (motion, _momenta_after(body, point, impulse)))
        _go_between(low[0], motion, share)
        for k in range(len(impulse)):
            impulse[k] = steady[k] + share * (impulse[k] - steady[k])
        momentum = _momenta_after(body, point, impulse)
        _mark(point, impulse, pressed, True)
    for i in range(system.particles):
        if pressed[i]:
            set_vec3(body[i].velocity, _velocity_in(motion, i))
            set_vec3(body[i].angular_momentum, load_vec3(momentum, i))
            body[i].resting = 1
    return done, steady
