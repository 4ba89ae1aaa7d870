"""Heaps of hundreds of contact points, and of so many that sweeps leave something undone, from drop to near rest."""

import numpy as np
import pytest

from particlesim.dynamics.contact import resting
from particlesim.dynamics.settings import FEW_SWEEPS, RESTING_SUBSTEPS, SWEEP_VISITS
from particlesim.simulation.simulation import Simulation
from tests.worlds import scene

SIZE, DURATION, PIECES = 0.2, 0.9, 30
SHAPES = "sphere", "cube", "tetrahedron"

# Islands of more points are swept along conjugate ways.
MANY = SWEEP_VISITS // (2 * RESTING_SUBSTEPS * (FEW_SWEEPS + 1))

# How many there are of each shape, the box that these fall in [m], and how many contact points the heap has at least.
HEAPS = {"small": ((25, 25, 25), (0.8, 0.8, 1.6), 160), "large": ((60, 200, 60), (1.2, 1.2, 3.6), MANY + 1)}


@pytest.fixture
def islands_seen(monkeypatch):
    """How many contact points the largest island of each step has."""
    seen = []
    original = resting.RestingContacts._step

    def step(self, islands, duration, until_fields):
        seen.append(int(np.diff(islands.first_point).max()))
        return original(self, islands, duration, until_fields)

    monkeypatch.setattr(resting.RestingContacts, "_step", step)
    return seen


def dropped(heap, seed, **how):
    """A heap's simulation, not begun yet."""
    counts, size, _ = HEAPS[heap]
    groups = [{"shape": shape, "count": count, "size": SIZE} for shape, count in zip(SHAPES, counts, strict=True)]
    world = {"size": size, "gravity": (0.0, 0.0, -9.81), "restitution": 0.3, "friction": 0.5}
    return Simulation(scene(*groups, **world, seed=seed), **how)


@pytest.mark.parametrize(("heap", "seed"), [("small", 1), ("large", 1), ("large", 2)])
def test_a_heap_loses_what_is_booked_and_overlaps_hardly(heap, seed, islands_seen):
    sim = dropped(heap, seed)
    start = last = sim.ledger.energy
    for _ in range(PIECES):
        sim.run(duration=DURATION / PIECES)
        ledger = sim.ledger
        assert np.isfinite(sim.particles.position).all() and np.isfinite(sim.particles.velocity).all()
        assert ledger.energy <= last + 1e-11 * start
        assert abs(ledger.energy + ledger.dissipated.sum() - start) < 1e-12 * start
        assert sim.largest_overlap() < 1e-3 * SIZE
        last = ledger.energy
    assert max(islands_seen) >= HEAPS[heap][2]
    assert sim.ledger.kinetic < 1e-3 * start


def test_neither_threads_nor_the_broad_phase_change_a_heap(islands_seen):
    one = dropped("large", 3, threads=1, broad_phase="octree")
    two = dropped("large", 3, threads=2, broad_phase="grid")
    for sim in (one, two):
        sim.run(duration=0.5)
    assert one.particles.position.tobytes() == two.particles.position.tobytes()
    assert one.particles.velocity.tobytes() == two.particles.velocity.tobytes()
    assert one.state_hash() == two.state_hash()
    assert max(islands_seen) > MANY


def test_what_a_step_leaves_in_the_solver_does_not_change_the_next(islands_seen):
    one, other = dropped("large", 4), dropped("large", 4)
    for sim in (one, other):
        sim.run(duration=0.45)
    other._solver._resting._mover["stirred"] = 10**6
    for sim in (one, other):
        sim.run(duration=0.05)
    assert max(islands_seen) > MANY
    assert one.state_hash() == other.state_hash()
