"""Impacts with friction by other ways: Keller's equations as a differential equation, and the planar case by hand."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from particlesim.model.materials import CONTACT_LAW

# Below this fraction of the velocity of the impact a point no longer slides.
STOPPED = 1e-9


class Impact(NamedTuple):
    """What an impact came to."""

    impulse: np.ndarray  # (3,) along the normal and two tangents
    rubbed: float  # energy that friction took
    mode: str  # how it ended: slip, stick, or straight (slipping off after a stop)


def law(restitution=1.0, friction=0.0, static_friction=0.0, rolling_friction=0.0, tangential_restitution=0.0):
    """A contact law as kernels take it."""
    values = (
        restitution,
        friction,
        max(friction, static_friction),
        rolling_friction,
        tangential_restitution,
    )
    return np.array([values], dtype=CONTACT_LAW)[0]


def energy_of(inverse_mass, velocity, impulse):
    """The energy that an impulse gives."""
    return velocity @ impulse + 0.5 * impulse @ inverse_mass @ impulse


def _direction(inverse_mass, friction):
    """The direction in which a point slides off that friction cannot hold."""
    coupling, across = inverse_mass[1:, 0], inverse_mass[1:, 1:]

    def excess(faster):
        return np.linalg.norm(np.linalg.solve(friction * across + faster * np.eye(2), coupling)) - 1.0

    high = 1.0
    while excess(high) > 0.0:
        high *= 2.0
    faster = brentq(excess, 0.0, high, xtol=1e-300, rtol=1e-15)
    return np.linalg.solve(friction * across + faster * np.eye(2), coupling)


def keller(inverse_mass, start, restitution, friction, static_friction=None):
    """An impact by Keller's equations in the normal impulse, with events, and Stronge's energetic restitution.

    It knows nothing of how the solver does it: other variables, an explicit method of order 8 with error control.
    """
    across, coupling = inverse_mass[1:, 1:], inverse_mass[1:, 0]
    static = friction if static_friction is None else static_friction
    hold = -np.linalg.solve(across, coupling)
    scale, impulse, rubbed, stored = np.linalg.norm(start), np.zeros(3), 0.0, 0.0
    mode = "slip" if np.linalg.norm(start[1:]) > 1e-12 * scale else "stopped"
    straight = None
    pressing, velocity = True, np.array(start, dtype=float)
    for _ in range(20):
        if mode == "stopped":
            mode = "stick" if np.linalg.norm(hold) <= static else "straight"
            straight = hold if mode == "stick" else -friction * _direction(inverse_mass, friction)

        def at(x, y, velocity=velocity):
            return velocity + inverse_mass @ np.array([x, y[0], y[1]])

        def rates(x, y, at=at, mode=mode, straight=straight):
            u = at(x, y)
            push = -friction * u[1:] / np.linalg.norm(u[1:]) if mode == "slip" else straight
            return [push[0], push[1], u[0], push @ u[1:]]

        def normal_velocity(x, y, at=at):
            return at(x, y)[0]

        def sliding(x, y, at=at):
            return np.linalg.norm(at(x, y)[1:]) - STOPPED * scale

        def work_left(x, y, stored=stored):
            return y[2] - restitution**2 * stored

        ends = [normal_velocity] if pressing else [normal_velocity, work_left]
        normal_velocity.direction, sliding.direction, work_left.direction = (1 if pressing else -1), -1, 1
        if mode == "slip":
            ends.append(sliding)
        for end in ends:
            end.terminal = True
        longest = 1e3 * scale / np.linalg.eigvalsh(inverse_mass)[0]
        small = 1e-14 * scale**2 / np.trace(inverse_mass)
        path = solve_ivp(rates, (0.0, longest), np.zeros(4), "DOP853", events=ends, rtol=1e-12, atol=small)
        assert path.status == 1
        final = path.y[:, -1]
        impulse += np.array([path.t[-1], final[0], final[1]])
        rubbed -= final[3]
        velocity = start + inverse_mass @ impulse
        happened = ends[next(k for k, times in enumerate(path.t_events) if len(times))]
        stored -= final[2] if pressing else final[2] / restitution**2
        if happened is work_left or (happened is normal_velocity and pressing and restitution == 0.0):
            return Impact(impulse, rubbed, mode)
        if happened is normal_velocity:
            pressing, velocity[0] = not pressing, 0.0
        else:
            mode, left = "stopped", np.linalg.solve(across, velocity[1:])
            impulse[1:] -= left
            rubbed += 0.5 * left @ velocity[1:]
            velocity = start + inverse_mass @ impulse
    raise AssertionError("an impact without end")


def planar(inverse_mass, start, restitution, friction):
    """An impact in a plane by hand: between stops all is linear in the normal impulse, works are parabolas.

    ``inverse_mass`` is ((n, c), (c, t)) and ``start`` (normal, tangential). Returns the impulse (2,).
    (W. J. Stronge, Impact Mechanics, 2000, chapter 5.)
    """
    (along, coupling), (_, across) = inverse_mass
    normal, sliding = start
    impulse, stored = np.zeros(2), 0.0
    slope = -friction * np.sign(sliding)
    if sliding == 0.0:
        hold = -coupling / across
        slope = hold if abs(hold) <= friction else -friction * np.sign(coupling)
    for _ in range(4):
        faster, turning = along + coupling * slope, coupling + across * slope
        until_stop = -sliding / turning if sliding * turning < 0.0 else np.inf
        if normal < 0.0:
            until_zero = -normal / faster if faster > 0.0 else np.inf
            done = min(until_stop, until_zero)
            stored -= normal * done + 0.5 * faster * done**2
        else:
            # The root without cancellation.
            goal = restitution**2 * stored
            root = np.sqrt(normal**2 + 2.0 * faster * goal)
            until_zero = 2.0 * goal / (normal + root) if goal else 0.0
            done = min(until_stop, until_zero)
            if done == until_zero:
                return impulse + done * np.array([1.0, slope])
            stored -= (normal * done + 0.5 * faster * done**2) / restitution**2
        impulse = impulse + done * np.array([1.0, slope])
        normal, sliding = (normal + faster * done, sliding + turning * done)
        if done == until_stop:
            sliding, hold = 0.0, -coupling / across
            slope = hold if abs(hold) <= friction else -friction * np.sign(coupling)
        else:
            normal = 0.0
    raise AssertionError("an impact without end")
