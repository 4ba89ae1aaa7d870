"""Kicks: fields and other forces act on particles in place, half before and half after their exact free paths.

The second half is the mirror image of the first, so that a step is of second order in its length and, with forces that
follow from a potential, keeps the energy to that order for ever (G. Strang, SIAM J. Numer. Anal. 5 (1968) 506).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from particlesim.core.parallel import ThreadTeam
from particlesim.dynamics.settings import SUM_BLOCK
from particlesim.model.fields import kick
from particlesim.model.system import Model

# The forces (n, 3) [N] on the particles as they are now.
Force = Callable[[], np.ndarray]


class Kicks:
    """The fields of a model, and forces that are added to it."""

    def __init__(self) -> None:
        self.forces: list[Force] = []

    def there_are(self, model: Model) -> bool:
        """Whether anything acts on the particles of a model."""
        return bool(len(model.fields) or self.forces)

    def act(self, model: Model, duration: float, backwards: bool) -> tuple[float, np.ndarray]:
        """Let fields, then forces, act for ``duration`` [s], or ``backwards``, the last one first.

        Returns their work [J], and the accelerations of the particles, (n, 3) [m/s^2].
        """
        acts = [partial(_by_fields, backwards=backwards), *(partial(_by_force, force=force) for force in self.forces)]
        before = model.particles["velocity"].copy()
        work = sum(act(model, duration) for act in (reversed(acts) if backwards else acts))
        return work, (model.particles["velocity"] - before) / duration


def _by_fields(model: Model, duration: float, backwards: bool) -> float:
    """The work [J] of fields that act for ``duration`` [s]; added up in blocks, the same on any number of threads."""
    system, fields = model.system, model.fields
    work = np.zeros(-(-system.particles // SUM_BLOCK))
    ThreadTeam(system.particles).each(
        lambda _, first, last: kick(system, fields, (duration, backwards), SUM_BLOCK, work, first, last), len(work)
    )
    return float(work.sum())


def _by_force(model: Model, duration: float, force: Force) -> float:
    """The work [J] of a force that acts for ``duration`` [s]."""
    particles = model.particles
    before = particles["velocity"].copy()
    particles["velocity"] += duration * force() * particles["inverse_mass"][:, None]
    after = particles["velocity"]
    return float((0.5 * particles["mass"][:, None] * (after - before) * (after + before)).sum())
