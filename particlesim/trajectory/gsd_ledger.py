"""The ledger of a frame in a GSD file: a logged quantity for each of its fields."""

from __future__ import annotations

from dataclasses import MISSING, Field, fields
from typing import Any

import numpy as np

from particlesim.core.constants import DISSIPATION, WALL_NAMES
from particlesim.trajectory.frames import Ledger
from particlesim.trajectory.gsd_chunks import Chunks

_LEDGER = "log/particlesim/ledger/"

# What the arrays of a ledger are.
_SHAPES: dict[str, tuple[int, ...]] = {
    "momentum": (3,),
    "angular_momentum": (3,),
    "wall_impulse": (len(WALL_NAMES),),
    "dissipated": (len(DISSIPATION),),
    "wall_shear": (len(WALL_NAMES), 3),
    "flow_mass": (2,),
    "flow_energy": (2,),
}


def ledger_log(ledger: Ledger | None) -> dict[str, np.ndarray]:
    """What is known of a ledger, each field under its name."""
    if ledger is None:
        return {}
    values = {field.name: getattr(ledger, field.name) for field in fields(Ledger)}
    return {_LEDGER + name: np.atleast_1d(value) for name, value in values.items() if value is not None}


def ledger_names() -> list[str]:
    """The chunks that every ledger has."""
    return [_LEDGER + field.name for field in fields(Ledger) if field.default is MISSING]


def read_ledger(chunks: Chunks, k: int) -> Ledger:
    """The ledger of a frame, by the names of its fields; those that may be unknown may be missing."""
    known = [field for field in fields(Ledger) if field.default is MISSING or chunks.has(_LEDGER + field.name)]
    return Ledger(**{field.name: _typed(chunks.read(_LEDGER + field.name, k), field) for field in known})


def _typed(value: np.ndarray, field: Field[Any]) -> Any:
    """The value of a field as its type says. ValueError if it is not as many numbers."""
    if field.name in _SHAPES:
        return value.astype(np.float64).reshape(_SHAPES[field.name])
    (number,) = value.reshape(-1)
    return int(number) if str(field.type).startswith("int") else float(number)
