"""What surfaces are made of, and the contact law of every pair of materials."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from particlesim.core.records import record

# What a pair of materials does to each other, read by dynamics/contact/law.py alone.
CONTACT_LAW = record(
    [
        ("restitution", "f8"),  # of impacts, 0 to 1
        ("friction", "f8"),  # Coulomb's coefficient while the surfaces slide
        ("static_friction", "f8"),  # and until they do, not below it
        ("rolling_friction", "f8"),  # the torque against rolling is at most this times the normal force [m]
        ("tangential_restitution", "f8"),  # the part of the sliding velocity that comes back if it sticks, -1 to 1
    ]
)

# What each field of a material may be. Friction without end would be 0 times infinity where nothing presses; 1e30 is
# as good.
_BOUNDS = {
    "restitution": (0.0, 1.0),
    "friction": (0.0, 1e30),
    "static_friction": (0.0, 1e30),
    "rolling_friction": (0.0, 1e30),
    "tangential_restitution": (-1.0, 1.0),
}


class Material(NamedTuple):
    """The surface of a body, by what two of them do to each other (see CONTACT_LAW)."""

    restitution: float = 1.0
    friction: float = 0.0
    static_friction: float = 0.0  # counts as the friction where it is below it
    rolling_friction: float = 0.0  # [m]
    tangential_restitution: float = 0.0  # Walton's beta_0: 0, as Coulomb has it: what sticks does not move on


class PairLaw(NamedTuple):
    """What two materials do to each other in place of what they usually do."""

    a: int  # rows of the materials
    b: int
    values: Mapping[str, float]  # by fields of CONTACT_LAW


def contact_laws(materials: Sequence[Material], pair_laws: Sequence[PairLaw] = ()) -> np.ndarray:
    """The law of every pair of materials: it takes the smaller of its two values where no pair law gives another.

    Parameters
    ----------
    materials : sequence of Material
        The first of them is that of the walls.
    pair_laws : sequence of PairLaw
        The exceptions.

    Returns
    -------
    (m, m) CONTACT_LAW

    Raises
    ------
    ValueError
        If a material has a value that there is not.
    """
    each = np.zeros(len(materials), dtype=CONTACT_LAW)
    for name, (low, high) in _BOUNDS.items():
        each[name] = [getattr(material, name) for material in materials]
        for value in each[name][~((each[name] >= low) & (each[name] <= high))]:
            raise ValueError(f"{name} of a material must be a number from {low:g} to {high:g}, not {value:g}")
    each["static_friction"] = np.maximum(each["static_friction"], each["friction"])
    laws = np.zeros((len(materials), len(materials)), dtype=CONTACT_LAW)
    for name in _BOUNDS:
        laws[name] = np.minimum.outer(each[name], each[name])
    for a, b, values in pair_laws:
        for name, value in values.items():
            laws[name][[a, b], [b, a]] = value
    laws["static_friction"] = np.maximum(laws["static_friction"], laws["friction"])
    return laws
