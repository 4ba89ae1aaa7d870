"""What impacts amount to: each island adds it up in columns of its own, as many as the scene needs."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from particlesim.core.constants import DISSIPATION, WALL_NAMES
from particlesim.core.jit import kernel
from particlesim.core.math3d import dot, to_vec3
from particlesim.model.bodies import DYNAMIC
from particlesim.model.system import System

# Columns: impacts, the virial, the impulse on each wall along its normal, what energy was lost by restitution, friction
# and rolling friction, the impulse on each wall across its normal, a vector, and the work of moving obstacles.
IMPACTS, VIRIAL, WALLS = 0, 1, 2
LOST = WALLS + len(WALL_NAMES)
SHEAR = LOST + 3
WORK = SHEAR + 3 * len(WALL_NAMES)
_END = WORK + 1


class Borne(NamedTuple):
    """What lasting contacts bore in a step."""

    wall_impulse: np.ndarray  # (6,) [N s]
    wall_shear: np.ndarray  # (6, 3) [N s]
    virial: float  # [J s]
    lost: np.ndarray  # (4,) energy by the causes in DISSIPATION [J]
    work: float  # that obstacles did [J]
    unresolved: bool  # whether the bound on the work was reached


NOTHING_BORNE = Borne(np.zeros(6), np.zeros((6, 3)), 0.0, np.zeros(len(DISSIPATION)), 0.0, False)


def together(one: Borne, other: Borne) -> Borne:
    """What two of them bore."""
    return Borne(
        one.wall_impulse + other.wall_impulse,
        one.wall_shear + other.wall_shear,
        one.virial + other.virial,
        one.lost + other.lost,
        one.work + other.work,
        one.unresolved or other.unresolved,
    )


def columns_needed(system: System) -> int:
    """How many columns there must be: no more than something can be in, for there is a row for each particle."""
    if len(system.motion):
        return _END
    bounded = len(system.body) == system.bounded
    if (system.law["friction"] > 0.0).any():
        return SHEAR if bounded else WORK
    if (system.law["restitution"] < 1.0).any():
        return SHEAR
    return WALLS if bounded else LOST


@kernel
def book_impulse(accumulator, b, impulse, offset, normal):
    """Book an impulse that body ``b`` got from a particle: on the virial, or on the wall that it is."""
    if b.kind == DYNAMIC:
        accumulator[VIRIAL] += impulse * dot(offset, normal)
    elif b.wall >= 0:
        accumulator[WALLS + b.wall] += impulse


@kernel
def book_shear(accumulator, b, shear, offset):
    """Book the part of an impulse across the normal that body ``b`` got from a particle."""
    if b.kind == DYNAMIC:
        accumulator[VIRIAL] += dot(offset, shear)
    elif b.wall >= 0:
        for axis in range(3):
            accumulator[SHEAR + 3 * b.wall + axis] += shear[axis]


@kernel
def book_contact(accumulator, b, contact, factor):
    """Book the ``factor`` of what a contact did in a round, whose second body is ``b``."""
    offset = to_vec3(contact.offset)
    book_impulse(accumulator, b, factor * contact.impulse, offset, to_vec3(contact.normal))
    if len(accumulator) > LOST:
        for cause in range(3):
            accumulator[LOST + cause] += factor * contact.lost[cause]
    if len(accumulator) > SHEAR:
        shear = to_vec3(contact.shear)
        book_shear(accumulator, b, (factor * shear[0], factor * shear[1], factor * shear[2]), offset)
    if len(accumulator) > WORK:
        accumulator[WORK] += factor * contact.work
