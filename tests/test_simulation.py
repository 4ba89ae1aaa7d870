"""The loop: it ends where it is told, and nothing but the scene decides what happens."""

import numpy as np
import pytest

from particlesim.dynamics.settings import STEP_DISPLACEMENT
from particlesim.simulation.simulation import Simulation
from particlesim.simulation.soundness import SimulationError
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
        paced = np.sqrt(np.mean((surface / particles.radius) ** 2)) * step
        fallen = np.mean(0.5 * 9.81 * step**2 / particles.radius)
        assert paced + fallen == pytest.approx(STEP_DISPLACEMENT, rel=1e-9)
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


def test_impacts_are_counted_for_each_particle():
    """Balls in a row at unlike speeds: the first catches up with both, and each then reaches the wall alone."""
    row = [{"position": (x, 0, 0), "velocity": (v, 0, 0)} for x, v in ((-8, 9), (-4, 3), (0, 1))]
    sim = Simulation(scene(listed("sphere", *row), boundary="wall"))
    # Equal masses exchange their speeds: impacts of 1 and 2, of 2 and 3, of 1 and 2, then 3 at the wall.
    sim.run(duration=1.8)
    assert sim.particles.impacts.tolist() == [2, 3, 2]
    assert sim.frame().impacts.sum() == 2 * 3 + 1


@pytest.mark.parametrize("shape", ["sphere", "cube"])
def test_impacts_of_particles_add_up_to_those_of_the_ledger(shape):
    """Also where islands are joined and run again, and where several meet at one moment."""
    crowd = {"shape": shape, "count": 150, "size": 0.2, "velocity": {"kind": "maxwell", "temperature": 1.0}}
    sim = Simulation(scene(crowd, size=(1.9, 1.9, 1.9), boundary="periodic", step=0.2))
    sim.run(steps=20)
    assert sim.ledger.impacts > 1000
    assert sim.particles.impacts.sum() == 2 * sim.ledger.impacts


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


# Places [m] and velocities [m/s] of eleven spheres, found among the first 20 million impacts of a million of them.
ELEVEN = (
    (0.010766594, 0.546828255, -3.579573745, -1.404957232, 0.568453278, -0.971022715),
    (0.016398085, 0.472718762, -3.563001977, -0.161957199, -0.373832953, 0.149059538),
    (-0.012303476, 0.562457556, -3.604802485, -0.493098396, 0.273773719, -0.935881451),
    (0.048809703, 0.533919546, -3.581744105, -1.680155602, 0.020981321, -0.008430488),
    (0.013537833, 0.512894141, -3.561253059, 0.425202879, 0.854414362, -0.894216625),
    (0.054167126, 0.528849694, -3.544362073, 0.173802254, -0.519210573, -0.35514066),
    (-0.010313696, 0.579585285, -3.463676721, 0.385418691, 0.457141508, -0.08050498),
    (0.030872899, 0.541684611, -3.509210703, -0.697748871, 0.114079839, -0.359534179),
    (0.074622968, 0.503668418, -3.516078703, -0.511830534, 1.727517948, -0.778391625),
    (0.062795468, 0.541147927, -3.451628521, -0.735054852, -0.177454649, -1.690975039),
    (0.068170338, 0.528408529, -3.487638712, -1.400152514, 0.691562367, -1.063827016),
)


def test_who_is_deflected_no_more_is_compared_with_those_who_were_meanwhile():
    # Sphere 3 would hit 4, but 0 knocks that away before. Meanwhile 5 was deflected, and meets 3 on its old path.
    poses = [{"position": row[:3], "velocity": row[3:]} for row in ELEVEN]
    world = scene(listed("sphere", *poses, size=0.0375), size=(10.0, 10.0, 8.0), boundary="open", step=0.0036)
    whole, halves = Simulation(world), Simulation(world)
    whole.step(0.0036)
    halves.step(0.0018)
    halves.step(0.0018)
    for simulation in (whole, halves):
        assert simulation.ledger.impacts == 7
        assert simulation.largest_overlap() == 0.0
    assert np.abs(whole.particles.position - halves.particles.position).max() < 1e-12
