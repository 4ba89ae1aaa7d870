"""Where nothing touches anything bodies go in one stretch: the work is that of what they meet, not of their speed."""

import numpy as np
import pytest

import particlesim as ps
from particlesim.dynamics.ccd import undisturbed
from particlesim.dynamics.settings import ASK_AGAIN
from particlesim.dynamics.solver import Solver


@pytest.fixture
def substeps(monkeypatch):
    """Counts the substeps that are taken, in a list of their lengths [s]."""
    taken, substep = [], Solver._substep

    def count(solver, duration, bisections=0):
        taken.append(duration)
        substep(solver, duration, bisections)

    monkeypatch.setattr(Solver, "_substep", count)
    return taken


def spheres(*poses, **world):
    placed = [dict(zip(("position", "velocity"), pose, strict=False)) for pose in poses]
    group = {"shape": "sphere", "size": 0.5, "placement": {"kind": "list", "poses": placed}}
    return ps.Simulation(ps.Scene(world={"size": [4, 4, 4], **world}, particles=[group]))


def unwrapped(simulation):
    return simulation.particles.position + 4.0 * simulation.particles.image


def test_alone_in_a_periodic_world_speed_costs_nothing(substeps):
    velocity = np.array([1e5, 3e4, 1e4])
    simulation = spheres(([0, 0, 0], velocity.tolist()), boundary="periodic")
    simulation.step(1.0 / 64.0)
    assert not substeps
    np.testing.assert_allclose(unwrapped(simulation)[0], velocity / 64.0, rtol=1e-13)
    simulation.run(duration=1.0)
    assert simulation.steps < 40 and not substeps
    np.testing.assert_allclose(unwrapped(simulation)[0], velocity * (1.0 + 1.0 / 64.0), rtol=1e-12)


def test_what_falls_together_for_long_takes_a_step_a_frame(substeps):
    simulation = spheres(*(([x, 0, 0], [0.01 * x, 0, 0]) for x in (-1.8, -0.9, 0, 0.9, 1.8)), boundary="open")
    simulation.scene.world.gravity = (0.0, 0.0, -9.81)
    simulation = ps.Simulation(simulation.scene)
    simulation.run(duration=100.0)
    # At first they are so slow that a frame is no more than a few substeps.
    assert simulation.steps < 4500 and len(substeps) < 12_000
    taken = len(substeps)
    simulation.run(duration=10.0)
    assert len(substeps) == taken
    x, _, z = simulation.particles.position.T
    np.testing.assert_allclose(z, -0.5 * 9.81 * 110.0**2, rtol=1e-11)
    np.testing.assert_allclose(x, np.array([-1.8, -0.9, 0, 0.9, 1.8]) * 2.1, atol=1e-9)


@pytest.mark.parametrize("boundary", ["open", "periodic"])
def test_what_meets_after_a_long_way_meets_in_its_time(substeps, boundary):
    """Head on at 1e4 m/s each: they come from 2.5 m, across the border of a periodic world from 1.5 m, and swap."""
    towards = 1e4 if boundary == "open" else -1e4
    simulation = spheres(([-1.5, 0, 0], [towards, 0, 0]), ([1.5, 0, 0], [-towards, 0, 0]), boundary=boundary)
    gap = 2.5 if boundary == "open" else 0.5
    time = 1e-2 if boundary == "open" else 4e-5
    simulation.step(time)
    assert simulation.ledger.impacts == 1
    # As if they had gone through each other, but for the half metre that each of them is wide.
    out = 0.5 * gap - 1e4 * (time - 0.5 * gap / 1e4)
    moved = np.array([np.sign(towards), -np.sign(towards)]) * out
    np.testing.assert_allclose(unwrapped(simulation)[:, 0], np.array([-1.5, 1.5]) + moved, atol=1e-9)
    assert len(substeps) <= ASK_AGAIN


def test_past_each_other_by_a_hair_nothing_happens(substeps):
    simulation = spheres(([-1.5, 0, 0], [1e4, 0, 0]), ([1.5, 0.5 + 1e-9, 0], [-1e4, 0, 0]), boundary="open")
    simulation.step(1.0)
    assert simulation.ledger.impacts == 0 and not substeps
    np.testing.assert_allclose(simulation.particles.position[:, 0], [9998.5, -9998.5], rtol=1e-13)


def test_stretches_change_nothing_that_happens(monkeypatch):
    """A few bodies of all kinds between walls under gravity, with and without them."""
    groups = [
        {"shape": shape, "count": 3, "size": size, "velocity": {"kind": "uniform", "speed": 3.0}, "spin": [1, 2, 3]}
        for shape, size in (("cube", 0.3), ("sphere", 0.4), ({"kind": "box", "edges": [0.3, 0.4, 0.6]}, 1.0))
    ]
    scene = ps.Scene(
        seed=4,
        world={"size": [9, 9, 9], "boundary": ["wall", "periodic", "wall"], "gravity": [0, 0, -1]},
        particles=groups,
        movie={"fps": 1},
    )
    with_stretches = ps.Simulation(scene)
    with_stretches.run(duration=2.0)
    monkeypatch.setattr(undisturbed, "MAX_PAIRS_AT_ONCE", 0)
    without = ps.Simulation(scene)
    without.run(duration=2.0)
    assert with_stretches.steps < 0.9 * without.steps
    assert with_stretches.ledger.impacts == without.ledger.impacts > 5
    np.testing.assert_allclose(with_stretches.particles.position, without.particles.position, atol=1e-8)
    np.testing.assert_allclose(with_stretches.ledger.energy, without.ledger.energy, rtol=1e-12)


def test_stretches_are_the_same_bytes_for_all_threads_and_broad_phases(substeps):
    poses = [([-1.5, 0, 0], [9e3, 1, 2]), ([1.5, 0.1, 0], [-1e4, 0, 0]), ([0, 1.4, 1], [3, 0.2, 3])]
    scene = spheres(*poses, boundary=["open", "wall", "periodic"]).scene
    hashes = set()
    for broad_phase in ("naive", "grid", "octree"):
        for threads in (1, 2):
            substeps.clear()
            simulation = ps.Simulation(scene, broad_phase, threads)
            simulation.run(duration=0.5)
            hashes.add(simulation.state_hash())
    assert len(hashes) == 1 and simulation.ledger.impacts and 0 < sum(substeps) < 0.4


def test_what_there_would_be_no_end_to_is_refused():
    simulation = spheres(([0, 0, 0], [10, 0, 0]), ([1, 0, 0],))
    for time_step in (1e30, 1e9):
        with pytest.raises(ValueError, match=r"a time step of 1e\+\d+ s would take more than 10,000,000 substeps"):
            simulation.step(time_step)
    for time_step in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(ValueError, match="time_step must be a finite number of seconds above 0"):
            simulation.step(time_step)
    with pytest.raises(ValueError, match=r"duration = 1e\+30 s takes about \de\+\d\d time steps"):
        simulation.run(duration=1e30)
    for duration in (-1.0, np.nan, np.inf):
        with pytest.raises(ValueError, match="duration must be a finite number of seconds of 0 or more"):
            simulation.run(duration=duration)
    assert simulation.time == 0.0 and simulation.steps == 0
