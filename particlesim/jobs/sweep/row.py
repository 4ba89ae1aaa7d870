"""A case of a sweep: simulated, and summed up as a row of plain values."""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
import time as clock
from typing import Any

import numpy as np

from particlesim.core.constants import DISSIPATION
from particlesim.jobs.frame_source import frame_source
from particlesim.jobs.pictures import summary_of
from particlesim.jobs.task import task_of
from particlesim.scene import Scene
from particlesim.scene.errors import SceneError
from particlesim.simulation.soundness import SimulationError
from particlesim.trajectory.analysis.observables import pressure
from particlesim.trajectory.frames import Ledger

# The columns of a row, what a table says of each case beside its values, with their units.
COLUMNS = {
    "particles": "",
    "simulated": "s",
    "kinetic_translational": "J",
    "kinetic_rotational": "J",
    "potential": "J",
    "energy": "J",
    "energy_drift": "",
    "impacts": "",
    "dissipated": "J",
    **{f"dissipated_{cause}": "J" for cause in DISSIPATION},
    "work": "J",
    "pressure": "Pa",
    "largest_overlap": "m",
    "unresolved": "",
    "seconds": "s",
    "state": "",
    "hash": "",
    "error": "",
}


def case_hash(scene: Scene) -> str:
    """SHA-256 of all that a row depends on: the scene, the files that it names, and the version of particlesim."""
    task = {"version": importlib.metadata.version("particlesim"), **task_of(scene)}
    return hashlib.sha256(json.dumps(task, sort_keys=True).encode()).hexdigest()


def run_case(scene: Scene) -> dict[str, Any]:
    """The row of a case. A scene that cannot be built, or runs away, has a row that says so under ``error``."""
    start = clock.perf_counter()
    try:
        row = _simulated(scene)
    except (SceneError, SimulationError) as error:
        row = {"error": str(error)}
    return {**dict.fromkeys(COLUMNS), **row, "seconds": clock.perf_counter() - start, "hash": case_hash(scene)}


def _simulated(scene: Scene) -> dict[str, Any]:
    source = frame_source(scene, None, None, None)
    summary, ledgers = summary_of(scene, source.header), []
    for _, frame in source.frames:
        if frame is not None and frame.ledger is not None:
            summary.add(frame)
            ledgers.append(frame.ledger)
    assert source.simulation is not None
    first, last = ledgers[0], ledgers[-1]
    return {
        "particles": scene.number,
        "simulated": summary.simulated_seconds,
        "kinetic_translational": last.kinetic_translational,
        "kinetic_rotational": last.kinetic_rotational,
        "potential": last.potential,
        "energy": last.energy,
        "energy_drift": summary.worst_energy_drift,
        "impacts": summary.impacts,
        **_dissipated(first, last),
        "work": last.work,
        "pressure": pressure(scene, ledgers) if len(ledgers) > 1 else None,
        "largest_overlap": summary.largest_overlap,
        "unresolved": summary.unresolved,
        "state": source.simulation.state_hash(),
    }


def _dissipated(first: Ledger, last: Ledger) -> dict[str, float]:
    """What was dissipated between two frames, in all and by its causes [J]."""
    assert first.dissipated is not None and last.dissipated is not None
    taken: np.ndarray = last.dissipated - first.dissipated
    by_cause = zip(DISSIPATION, taken.tolist(), strict=True)
    return {"dissipated": float(taken.sum()), **{f"dissipated_{cause}": energy for cause, energy in by_cause}}
