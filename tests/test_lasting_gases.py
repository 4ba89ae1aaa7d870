"""Gases of bodies that rebound little: they meet over and over, cling together, and take bounded work for it."""

import numpy as np
import pytest

from particlesim.simulation.simulation import Simulation
from tests.worlds import listed, scene


def only_falls_and_stays_apart(what, size, duration, pieces):
    """Run a scene in pieces: no energy is gained in any, nothing is in anything after any, and the ledger closes."""
    sim = Simulation(what)
    energies, deepest = [sim.ledger.energy], 0.0
    for _ in range(pieces):
        sim.run(duration=duration / pieces)
        energies.append(sim.ledger.energy)
        deepest = max(deepest, sim.largest_overlap())
    assert (np.diff(energies) <= 1e-12 * energies[0]).all()
    assert deepest < 1e-3 * size
    assert sim.ledger.dissipated.sum() == pytest.approx(energies[0] - energies[-1], rel=1e-12)
    assert sim.ledger.unresolved < 0.01 * sim.steps
    return sim


@pytest.mark.parametrize(("restitution", "impacts"), [(0.8, 10_000), (0.2, 10_000)])
@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_a_cooling_gas_of_hulls(restitution, impacts, friction):
    motion = {kind: {"kind": "maxwell", "temperature": 20.0} for kind in ("velocity", "spin")}
    groups = [{"shape": shape, "count": 20, "size": 0.3, **motion} for shape in ("cube", "tetrahedron", "pyramid")]
    gas = scene(*groups, size=(2.5, 2.5, 2.5), restitution=restitution, friction=friction, seed=2)
    sim = only_falls_and_stays_apart(gas, 0.3, 4.0, 40)
    assert sim.ledger.impacts < impacts


@pytest.mark.parametrize("shape", ["cube", "tetrahedron"])
def test_hulls_that_fly_inward_gather(shape):
    """Ten hulls of restitution 0.05 that meet in the middle; the momentum that they have together stays."""
    rng = np.random.default_rng(5)
    poses = []
    for k in range(10):
        way = rng.normal(size=3)
        way /= np.linalg.norm(way)
        axis, angle = tuple(rng.normal(size=3).tolist()), float(rng.uniform(0, 360))
        pose = {"position": tuple(((1.2 + 0.15 * k) * way).tolist()), "velocity": tuple((-2.0 * way).tolist())}
        poses.append({**pose, "orientation": {"axis": axis, "angle": angle}})
    inward = scene(listed(shape, *poses, size=0.4, mass=1.0), size=(20, 20, 20), boundary="open", restitution=0.05)
    momentum = Simulation(inward).ledger.momentum
    sim = only_falls_and_stays_apart(inward, 0.4, 3.0, 60)
    assert sim.ledger.impacts < 1_000
    assert sim.ledger.momentum == pytest.approx(momentum, abs=1e-12)


def test_balls_thrown_at_a_wall():
    balls = {"shape": "sphere", "count": 12, "size": 0.3, "velocity": (5.0, 0, 0)}
    sim = only_falls_and_stays_apart(scene(balls, size=(2, 1, 1), restitution=0.2, seed=3), 0.3, 4.0, 40)
    assert sim.ledger.impacts < 1_000
