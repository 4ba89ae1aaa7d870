"""What counts as rest and as a touch in a system, how far its bodies may go, and how long they take for a way."""

from __future__ import annotations

import math

import numpy as np

from particlesim.dynamics.settings import APPROACH_TOLERANCE, PENETRATION_SLOP, PERIODIC_ROOM, RESTING_PENETRATION_SLOP
from particlesim.model.system import System


def set_tolerances(system: System) -> None:
    """Set what counts as rest and as a touch in a domain: fractions of the speed of a fall through it, and of sizes."""
    domain = system.domain[0]
    gravity = domain["gravity"]
    size = domain["upper"] - domain["lower"]
    domain["rest_speed"] = APPROACH_TOLERANCE * math.sqrt(2.0 * float(np.abs(gravity) @ size))
    loses = system.law["restitution"].min(initial=1.0) < 1.0
    domain["penetration_slop"] = RESTING_PENETRATION_SLOP if gravity.any() and loses else PENETRATION_SLOP


def periodic_room(system: System) -> float:
    """How far two bodies may both go on periodic axes [m] without coming near another image; inf without such axes."""
    period, radius = system.domain[0]["period"], system.body["radius"]
    radius = radius[np.isfinite(radius)]
    periods = period[period > 0.0]
    if not len(periods) or not len(radius):
        return math.inf
    return max(PERIODIC_ROOM * (0.5 * periods.min() - 2.0 * radius.max()), 1e-3 * radius.min())


def time_for(distance: float, speed: float, acceleration: float) -> float:
    """How long a distance takes from ``speed`` at ``acceleration``; inf without either."""
    denominator = speed + math.sqrt(speed * speed + 2.0 * acceleration * distance)
    return 2.0 * distance / denominator if denominator > 0.0 else math.inf
