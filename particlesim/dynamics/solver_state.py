"""Everything that the next substep depends on, by name: what is hashed, saved and gone on from."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

from particlesim.core.constants import DISSIPATION
from particlesim.core.records import record
from particlesim.dynamics.contact.booking import IMPACTS, LOST, SHEAR, VIRIAL, WALLS, WORK, Borne
from particlesim.dynamics.neighbour_list import NeighbourList, Order
from particlesim.model.system import System

# A pose that displacements are counted from.
SEEN = record([("position", "f8", (3,)), ("orientation", "f8", (4,))])

# The force of a contact point at the end of the step before: a number for the pair of bodies, where the point is from
# the first of them [m], the force on the second [N], and the torque against rolling [N m].
FORCE = record([("contact", "i8"), ("arm", "f8", (3,)), ("force", "f8", (3,)), ("torque", "f8", (3,))])

# Since when a particle has been still [s], and how far its surface had come by then [m].
STILL = record([("since", "f8"), ("displacement", "f8")])


@dataclass
class Counts:
    """What was done since the start. It decides nothing."""

    each: np.ndarray  # (n,) int64, impacts of each particle
    impacts: int = 0
    virial: float = 0.0  # sum of r_ij . impulse over pair impacts [J s]
    wall_impulse: np.ndarray = field(default_factory=lambda: np.zeros(6))  # outward, on each wall [N s]
    wall_shear: np.ndarray = field(default_factory=lambda: np.zeros((6, 3)))  # and along it, a vector
    dissipated: np.ndarray = field(default_factory=lambda: np.zeros(len(DISSIPATION)))  # by cause [J]
    work: float = 0.0  # that obstacles did by moving, and fields [J]
    pairs_tested: int = 0  # boxes compared by the broad phase
    candidate_pairs: int = 0  # pairs it found
    unresolved: int = 0  # substeps in which more happened than was worked through (see MAX_IMPACTS)

    def add(self, total: np.ndarray, borne: Borne) -> None:
        """Add what the islands of a substep accumulated (c,), and what lasting contacts bore."""
        self.impacts += int(total[IMPACTS])
        self.virial += float(total[VIRIAL])
        columns = slice(WALLS, LOST), slice(LOST, SHEAR), slice(SHEAR, WORK)
        for sums, place in zip((self.wall_impulse, self.dissipated, self.wall_shear), columns, strict=True):
            sums.flat[: len(total[place])] += total[place]
        self.work += float(total[WORK:].sum())
        self.bear(borne)

    def bear(self, borne: Borne) -> None:
        """Add what lasting contacts bore."""
        self.virial += borne.virial
        self.work += borne.work
        self.wall_impulse += borne.wall_impulse
        self.wall_shear += borne.wall_shear
        self.dissipated += borne.lost


@dataclass
class SolverState:
    """What persists from substep to substep, but for the bodies themselves."""

    time: float  # [s]
    order: Order  # of the bodies along the space-filling curve
    searches: int  # of neighbours so far
    skin: np.ndarray  # (n,) of each bounded body [m]
    time_within_skins: float  # for how long the neighbour list is certainly true [s]
    neighbours: NeighbourList
    standing: np.ndarray  # (n,) int64: FREE, SETTLES or LOOSE, (0,) where nothing comes to rest
    seen: np.ndarray  # (n,) SEEN, (0,) where nothing comes to rest
    displacement: np.ndarray  # (n,) how far surfaces have come [m], (0,) where nothing comes to rest
    clearance: np.ndarray  # beside ``neighbours.other``: how far apart they were, plus displacements [m]
    forces: np.ndarray  # (k,) FORCE
    lasting: np.ndarray  # (n,) int8, whether a particle was in lasting contact, (0,) where none comes to be
    still: np.ndarray  # (n,) STILL, (0,) where nothing comes to rest
    asleep: np.ndarray  # (n,) bool, whether a particle sleeps, (0,) where nothing comes to rest

    def remember(self, before: SolverState, origin: np.ndarray) -> None:
        """Take over what was known of particles ``before``: of those that each of the present ones was, -1 for none."""
        if not len(before.lasting):
            return
        self.lasting = np.append(before.lasting, np.int8(0))[origin]
        self.asleep = np.append(before.asleep, np.False_)[origin]
        self.still["since"] = np.append(before.still["since"], before.time)[origin]
        way = before.still["displacement"] - before.displacement[: len(before.still)]
        self.still["displacement"] = np.append(way, 0.0)[origin]

    def arrays(self) -> dict[str, np.ndarray]:
        """Everything by name; what is not an array as one of no dimensions."""
        found: dict[str, np.ndarray] = {}
        for name in (f.name for f in fields(self)):
            value = getattr(self, name)
            if isinstance(value, Order | NeighbourList):
                found |= {f"{name}.{part}": array for part, array in value._asdict().items()}
            else:
                found[name] = np.asarray(value)
        return found

    @classmethod
    def of_arrays(cls, arrays: dict[str, np.ndarray]) -> SolverState:
        """The state that ``arrays`` gave."""
        kinds: dict[str, Any] = {"order": Order, "neighbours": NeighbourList}
        values: dict[str, Any] = {}
        for name in (f.name for f in fields(cls)):
            if name in kinds:
                values[name] = kinds[name](**{part: arrays[f"{name}.{part}"] for part in kinds[name]._fields})
            else:
                values[name] = arrays[name].item() if arrays[name].ndim == 0 else arrays[name]
        return cls(**values)


def nothing_remembered(system: System, comes_to_rest: bool) -> tuple[np.ndarray, ...]:
    """The last eight arrays of a SolverState at a start; they are empty where nothing comes to rest."""
    body, known = system.body, system.bounded if comes_to_rest else 0
    seen = np.zeros(known, dtype=SEEN)
    for name in SEEN.names or ():
        seen[name] = body[name][:known]
    particles = system.particles if known else 0
    standing, lasting = np.zeros(len(body) if known else 0, np.int64), np.zeros(particles, np.int8)
    still, asleep = np.zeros(particles, dtype=STILL), np.zeros(particles, np.bool_)
    return standing, seen, np.zeros(known), np.empty(0), np.empty(0, dtype=FORCE), lasting, still, asleep


def digest(*arrays: np.ndarray) -> str:
    """SHA-256 of the bytes of arrays."""
    total = hashlib.sha256()
    for array in arrays:
        total.update(np.ascontiguousarray(array).tobytes())
    return total.hexdigest()
