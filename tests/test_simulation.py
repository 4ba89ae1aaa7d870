"""The loop: it ends where it is told, and nothing but the scene decides what happens."""

import numpy as np
import pytest

from particlesim.constants import STEP_FRACTION
from particlesim.simulation import Simulation, SimulationError
from tests.worlds import gas, listed, scene


def hash_after(steps, threads=None, broad_phase=None, **settings):
    sim = Simulation(gas(**settings), broad_phase=broad_phase, threads=threads)
    sim.run(steps=steps)
    return sim.state_hash()


def test_the_broad_phase_changes_no_bit():
    hashes = {hash_after(60, broad_phase=method) for method in ("naive", "grid", "octree")}
    assert len(hashes) == 1


@pytest.mark.parametrize("boundary", ["periodic", "open"])
def test_the_broad_phase_changes_no_bit_without_walls(boundary):
    hashes = {hash_after(40, broad_phase=m, boundary=boundary, size=(3, 3, 3)) for m in ("naive", "grid", "octree")}
    assert len(hashes) == 1


def test_the_number_of_threads_changes_no_bit():
    """Enough particles and pairs for the work to be shared out."""
    packed = {"shape": "cube", "count": 17000, "size": 0.8, "velocity": {"kind": "uniform", "speed": 1.0}}
    crowd = scene(packed | {"placement": {"kind": "lattice", "spacing": 1.45}}, size=(40, 40, 40))
    hashes = set()
    for threads in (1, 2, 4):
        sim = Simulation(crowd, threads=threads)
        sim.run(steps=3)
        hashes.add(sim.state_hash())
    assert len(hashes) == 1


def test_a_run_in_pieces_is_the_same_run():
    whole, pieces = Simulation(gas()), Simulation(gas())
    for k in range(1, 5):
        whole.run_until(k / 30)
    for k in range(1, 5):
        pieces.run(duration=k / 30 - pieces.time)
    assert whole.state_hash() == pieces.state_hash()


def test_the_seed_decides():
    assert hash_after(5, seed=1) == hash_after(5, seed=1)
    assert hash_after(5, seed=1) != hash_after(5, seed=2)


def test_a_run_ends_where_it_is_told():
    sim = Simulation(gas(step=0.004))
    sim.run(duration=0.0101)
    assert sim.time == 0.0101
    assert sim.steps == 3
    assert sim.time_step <= 0.004
    sim.run(steps=2)
    assert sim.steps == 5
    assert sim.time == pytest.approx(0.0181, abs=1e-15)
    with pytest.raises(ValueError, match="a duration or a number of steps"):
        sim.run()


def test_surfaces_move_by_a_fraction_of_the_radii_in_an_automatic_step():
    sim = Simulation(gas(gravity=(0, 0, -9.81)))
    for _ in range(10):
        particles = sim.particles
        surface = np.linalg.norm(particles.velocity, axis=1)
        surface = surface + np.linalg.norm(particles.angular_velocity, axis=1) * particles.radius
        step = sim.next_time_step()
        moved = (surface * step + 0.5 * 9.81 * step**2) / particles.radius
        assert moved.mean() == pytest.approx(STEP_FRACTION, rel=1e-9)
        sim.step()


def test_a_fast_bullet_does_not_pass_through_a_thin_plate():
    plate = listed({"kind": "box", "edges": [0.05, 4.0, 4.0]}, {"position": (0, 0, 0)}, mass=1000.0)
    bullet = listed("sphere", {"position": (-5, 0.3, 0.2), "velocity": (300, 0, 0)}, size=0.05, mass=0.01)
    sim = Simulation(scene(plate, bullet, boundary="open"))
    sim.run(duration=0.03)
    assert sim.ledger.impacts == 1
    assert sim.particles.velocity[1, 0] < -299


def test_particles_wrap_round_a_periodic_world_and_meet_across_its_faces():
    a = {"position": (-4.0, 0, 0), "velocity": (-1, 0, 0)}
    b = {"position": (4.0, 0, 0), "velocity": (1, 0, 0)}
    sim = Simulation(scene(listed("sphere", a, b), size=(10, 10, 10), boundary="periodic"))
    sim.run(duration=1.0)
    assert sim.ledger.impacts == 1
    assert np.allclose(sim.particles.velocity[:, 0], [1, -1])
    # They met half a second in, on the two sides of the face.
    assert np.allclose(sim.particles.position[:, 0], [-4.0, 4.0], atol=1e-9)
    alone = Simulation(scene(listed("sphere", a), size=(10, 10, 10), boundary="periodic"))
    alone.run(duration=12.0)
    assert alone.particles.position[0, 0] == pytest.approx(4.0, abs=1e-9)
    assert alone.particles.image[0].tolist() == [-2, 0, 0]


def test_the_ledger_counts():
    sim = Simulation(gas(10), broad_phase="naive")
    sim.run(steps=10)
    ledger = sim.ledger
    assert ledger.steps == 10
    # Neighbours are looked up when somebody has gone far, not in every step.
    assert ledger.pairs_tested % (40 * 39 // 2) == 0
    assert 0 < ledger.pairs_tested <= 11 * (40 * 39 // 2)
    assert 0 < ledger.candidate_pairs < ledger.pairs_tested
    mass, velocity = sim.particles.mass[:, None], sim.particles.velocity
    assert ledger.kinetic_translational == pytest.approx(0.5 * (mass * velocity**2).sum(), rel=1e-12)
    momentum = sim.particles.angular_momentum
    rotational = 0.5 * (momentum * sim.particles.angular_velocity).sum()
    assert ledger.kinetic_rotational == pytest.approx(rotational, rel=1e-12)
    assert np.allclose(ledger.momentum, (mass * velocity).sum(axis=0))
    orbital = np.cross(sim.particles.position, mass * velocity) + momentum
    assert np.allclose(ledger.angular_momentum, orbital.sum(axis=0))


def test_the_virial_of_one_impact():
    """r_ij . J of a head-on impact: the distance of the centres times the impulse."""
    a, b = {"position": (-2, 0, 0), "velocity": (1, 0, 0)}, {"position": (2, 0, 0), "velocity": (-1, 0, 0)}
    sim = Simulation(scene(listed("sphere", a, b, mass=3.0), boundary="open"))
    sim.run(duration=2.0)
    assert sim.ledger.virial == pytest.approx(1.0 * 2 * 3.0, rel=1e-9)


def test_a_number_that_is_not_finite_is_named():
    sim = Simulation(gas(3))
    sim.particles.velocity[4, 1] = np.nan
    with pytest.raises(SimulationError, match=r"velocity of particle 4 \(particles\[1\] of the scene\)"):
        sim.frame()


def test_unknown_broad_phases_are_refused():
    with pytest.raises(ValueError, match="naive, grid, octree"):
        Simulation(gas(1), broad_phase="quadtree")


def test_an_empty_scene_and_a_lone_particle_run():
    empty = Simulation(scene({"shape": "cube", "count": 0}))
    empty.run(duration=0.1)
    assert empty.ledger.energy == 0.0
    lone = Simulation(scene({"shape": "cube", "count": 1, "velocity": [1, 0, 0], "size": 0.1}))
    lone.run(duration=0.1)
    assert lone.ledger.impacts == 0
