"""A row of dominoes as a mechanism of one degree of freedom.

J. M. J. van Leeuwen, The domino effect, Am. J. Phys. 78 (2010) 721: dominoes turn about their front lower edges and do
not slide on the floor; whatever was struck is leant on from then on, the upper edge sliding down the next one's back
under friction; impacts are without rebound, and so is their friction. The forces between dominoes drop out by weights:
a row of n obeys sum R_k (I angle_k'' - T_k) = 0, and keeps sum R_k I angle_k' in an impact.
"""

from __future__ import annotations

import math

import numpy as np

G = 9.81


class Row:
    """Dominoes of a height, a thickness and gaps between them [m], with their friction; mass 1."""

    def __init__(self, height: float, thickness: float, gap: float, friction: float) -> None:
        self.height, self.thickness, self.friction = height, thickness, friction
        self.pitch = gap + thickness
        self.inertia = (height**2 + thickness**2) / 3.0  # about an edge
        self.struck_at = math.asin(gap / height)

    def fallen(self, angle: float, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Angles of the first and those behind it, their rates by that angle, and the weights R; (count,) each."""
        angles, rates, weights = [angle], [1.0], [1.0]
        for _ in range(count - 1):
            front = angles[-1]
            between = math.asin((self.pitch * math.cos(front) - self.thickness) / self.height)
            arm = self.height * math.cos(between)
            lever = arm - self.pitch * math.sin(front) - self.friction * self.thickness
            weights.append(weights[-1] * lever / (arm + self.friction * self.height * math.sin(between)))
            rates.append(rates[-1] * (1.0 - self.pitch * math.sin(front) / arm))
            angles.append(front + between)
        return np.array(angles), np.array(rates), np.array(weights)

    def acceleration(self, angle: float, rate: float, count: int) -> float:
        """Of the first one's angle [1/s^2]."""
        angles, rates, weights = self.fallen(angle, count)
        apart = 1e-6
        bend = (self.fallen(angle + apart, count)[1] - self.fallen(angle - apart, count)[1]) / (2.0 * apart)
        torque = 0.5 * G * (self.height * np.sin(angles) - self.thickness * np.cos(angles))
        return float(weights @ (torque - self.inertia * bend * rate**2) / (self.inertia * weights @ rates))

    def speeds(self, rate: float, count: int, step: float = 1e-4) -> np.ndarray:
        """Speeds of the wave from each of ``count`` dominoes to the next [m/s], the first pushed at ``rate`` [1/s].

        By Heun's rule, of second order in the step [s].
        """
        found = []
        for n in range(1, count + 1):
            angle, time = 0.0, 0.0
            while angle < self.struck_at:
                slope = self.acceleration(angle, rate, n)
                ahead = self.acceleration(angle + step * rate, rate + step * slope, n)
                angle += step * (rate + 0.5 * step * slope)
                rate += 0.5 * step * (slope + ahead)
                time += step
            found.append(self.pitch / (time - (angle - self.struck_at) / rate))
            before = np.dot(*self.fallen(self.struck_at, n)[1:])
            _, rates, weights = self.fallen(0.0, n + 1)
            rate *= before * weights[1] / (rates @ weights)
        return np.array(found)
