"""What comes to rest under gravity stays where it is, and nothing gains energy on the way there."""

import numpy as np
import pytest

from particlesim.simulation.simulation import Simulation
from tests.worlds import listed, scene

GRAVITY = (0.0, 0.0, -9.81)


def settled(what, duration, pieces):
    """The simulation after ``duration``, with the energies after each of so many pieces of it."""
    sim = Simulation(what)
    energies = [sim.ledger.energy]
    for _ in range(pieces):
        sim.run(duration=duration / pieces)
        energies.append(sim.ledger.energy)
    return sim, np.array(energies)


def only_falls(energies):
    return (np.diff(energies) <= 1e-12 * energies[0]).all()


@pytest.mark.parametrize("restitution", [0.3, 0.8])
@pytest.mark.parametrize("shape", ["sphere", "cube", "pyramid"])
def test_a_body_dropped_askew_ends_on_the_floor_without_a_tremble(shape, restitution):
    dropped = {"position": (0, 0, 0.2), "orientation": {"axis": (1, 2, 0.5), "angle": 40}}
    sim, energies = settled(
        scene(listed(shape, dropped), size=(4, 4, 4), gravity=GRAVITY, restitution=restitution), 9, 30
    )
    assert only_falls(energies)
    assert sim.ledger.kinetic <= 1e-12 * energies[0]
    assert sim.largest_overlap() < 1e-4
    assert sim.ledger.unresolved == 0
    resting = sim.particles.position.copy()
    sim.run(duration=2.0)
    assert np.allclose(sim.particles.position, resting, rtol=0, atol=1e-12)


def test_a_ball_that_rebounds_in_full_lies_still_if_it_lay_still():
    sim, energies = settled(scene(listed("sphere", {"position": (0, 0, -1.5)}), size=(4, 4, 4), gravity=GRAVITY), 3, 3)
    assert np.array_equal(sim.particles.position[0], (0, 0, -1.5))
    assert energies == pytest.approx(energies[0], rel=1e-14)
    assert sim.ledger.impacts == 0


def test_a_ball_at_rest_is_sent_off_by_one_that_hits_it():
    """Equal masses head on: the velocity is handed on, along the floor."""
    lying, coming = {"position": (1, 0, -1.5)}, {"position": (-1, 0, -1.5), "velocity": (2, 0, 0)}
    table = scene(listed("sphere", lying, coming), size=(30, 4, 4), gravity=GRAVITY)
    sim, _ = settled(table, 1.5, 3)
    assert np.allclose(sim.particles.velocity[:, :2], [(2, 0), (0, 0)], rtol=0, atol=1e-6)
    # Sent off it may leave the floor by the depth that touches may go (PENETRATION_SLOP), as it rebounds in full.
    assert (np.abs(sim.particles.velocity[:, 2]) < 5e-3).all()


# Without friction one that has room on the floor slides for ever, and what stands on a ridge falls off late: with these
# seeds there is neither.
@pytest.mark.parametrize("seed", [10, 12, 17])
def test_a_heap_of_balls_comes_to_rest(seed):
    balls = {"shape": "sphere", "count": 20, "size": 0.3, "restitution": 0.5}
    sim, energies = settled(scene(balls, size=(1, 1, 2), gravity=GRAVITY, restitution=0.5, seed=seed), 6, 60)
    assert only_falls(energies)
    assert sim.ledger.kinetic <= 1e-15 * energies[-1]
    assert sim.largest_overlap() < 1e-4 * 0.3
    assert sim.ledger.unresolved == 0
    resting = sim.particles.position.copy()
    sim.run(duration=0.5)
    assert np.allclose(sim.particles.position, resting, rtol=0, atol=1e-9)
