"""What surfaces are made of, and the contact law of every pair of materials."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from particlesim.core.records import record

# What a pair of materials does to each other. Friction has its room here: further fields of this record, read by
# dynamics/contact/law.py alone.
CONTACT_LAW = record([("restitution", "f8")])


class Material(NamedTuple):
    """The surface of a body."""

    restitution: float = 1.0  # of an impact of two bodies of this material


def contact_laws(materials: Sequence[Material]) -> np.ndarray:
    """The law of every pair of materials, (m, m) CONTACT_LAW: a pair takes the smaller of its two restitutions."""
    restitution = np.array([material.restitution for material in materials])
    laws = np.zeros((len(materials), len(materials)), dtype=CONTACT_LAW)
    laws["restitution"] = np.minimum(restitution[:, None], restitution[None, :])
    return laws
