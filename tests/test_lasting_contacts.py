"""Lasting contacts without a closed form: stacks, heavy bodies on light ones, and bodies that meet over and over."""

import itertools

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from particlesim.dynamics.contact import resting
from particlesim.dynamics.settings import RESTING_SUBSTEPS
from particlesim.simulation.simulation import Simulation
from tests.worlds import listed, scene

GRAVITY = (0.0, 0.0, -9.81)


def run_watched(what, duration, pieces):
    """The simulation, its energies at the start and after each piece, and the largest overlap at those moments."""
    sim = Simulation(what)
    energies, deepest = [sim.ledger.energy], 0.0
    for _ in range(pieces):
        sim.run(duration=duration / pieces)
        energies.append(sim.ledger.energy)
        deepest = max(deepest, sim.largest_overlap())
    return sim, np.array(energies), deepest


# ---- against an independent solver ---------------------------------------------------------------------------------


def jacobian(points, bodies):
    """Rows (m, 6 n): what the normal velocities of contact points are of velocities and angular velocities."""
    rows = np.zeros((len(points), bodies, 6))
    for row, p in zip(rows, points, strict=True):
        row[p["a"], :3], row[p["a"], 3:] = -p["normal"], -np.cross(p["arm_a"], p["normal"])
        if p["b"] < bodies:
            row[p["b"], :3], row[p["b"], 3:] = p["normal"], np.cross(p["arm_b"], p["normal"])
    return rows.reshape(len(points), -1)


def inverse_root(sim):
    """The square root of the inverse mass matrix (6 n, 6 n)."""
    blocks = np.zeros((len(sim.particles.mass), 6, 6))
    for block, mass, inertia in zip(blocks, sim.particles.mass, sim.particles.inertia, strict=True):
        block[:] = np.diag([mass**-0.5] * 3 + [inertia[0] ** -0.5] * 3)  # cubes and spheres
    root = np.zeros((blocks[..., 0].size, blocks[..., 0].size))
    for k, block in enumerate(blocks):
        root[6 * k : 6 * k + 6, 6 * k : 6 * k + 6] = block
    return root


@pytest.mark.parametrize("seed", range(6))
def test_bodies_without_friction_take_the_nearest_motion_that_closes_no_gap(monkeypatch, seed):
    """Gauss's principle, by the non-negative least squares of scipy: one step of a few bodies that just touch.

    Where impulses are not unique, velocities are.
    """
    rng = np.random.default_rng(seed)
    poses = [
        {"position": (1.0 * (k % 2) - 0.5, 0.0, -4.5 + 1.0 * (k // 2)), "velocity": tuple(0.01 * rng.normal(size=3))}
        for k in range(6)
    ]
    sim = Simulation(scene(listed("cube", *poses), size=(10, 10, 10), gravity=GRAVITY, restitution=0.0))
    before, seen = sim.particles.velocity.copy(), {}

    original = resting.RestingContacts._step

    def step(self, islands, duration, until_fields):
        left = original(self, islands, duration, until_fields)
        seen["points"], seen["terms"], seen["duration"] = islands.points.copy(), islands.terms.copy(), duration
        return left

    monkeypatch.setattr(resting.RestingContacts, "_step", step)
    monkeypatch.setattr(Simulation, "next_time_step", lambda _: 1e-5)
    sim.step()
    points, terms, duration = seen["points"], seen["terms"], seen["duration"]
    closed = terms["gap"] < terms["slack"]
    rows = jacobian(points[closed], len(before)) @ inverse_root(sim)
    wanted, fall = np.zeros((len(before), 6)), np.zeros((len(before), 6))
    wanted[:, :3], fall[:, :3] = before, np.array(GRAVITY) * duration / RESTING_SUBSTEPS
    for _ in range(RESTING_SUBSTEPS):
        scaled = np.linalg.solve(inverse_root(sim), (wanted + fall).ravel())
        impulses = lsq_linear(rows.T, -scaled, bounds=(0.0, np.inf), method="bvls", tol=1e-15, max_iter=10_000).x
        wanted = (inverse_root(sim) @ (scaled + rows.T @ impulses)).reshape(-1, 6)
    assert np.allclose(sim.particles.velocity, wanted[:, :3], rtol=0, atol=1e-7)
    assert np.allclose(sim.particles.angular_velocity, wanted[:, 3:], rtol=0, atol=1e-6)


# ---- stacks --------------------------------------------------------------------------------------------------------


def test_a_stack_of_twenty_cubes_stands():
    poses = [{"position": (0, 0, -10.0 + k)} for k in range(20)]
    stack = scene(listed("cube", *poses), size=(20, 20, 21), gravity=GRAVITY, restitution=0.0, friction=0.5)
    sim = Simulation(stack)
    start = sim.particles.position.copy()
    sim.run(duration=10.0)
    assert np.abs(sim.particles.position - start).max() < 1e-6
    assert sim.largest_overlap() < 1e-6


def test_a_pyramid_of_boxes_stands():
    poses = [
        {"position": (1.02 * (k - 0.5 * (10 - level)), 0, -9.5 + level)}
        for level in range(10)
        for k in range(10 - level)
    ]
    sim = Simulation(scene(listed("cube", *poses), size=(20, 20, 20), gravity=GRAVITY, restitution=0.0, friction=0.5))
    start = sim.particles.position.copy()
    sim.run(duration=5.0)
    assert np.abs(sim.particles.position - start).max() < 1e-4
    assert sim.largest_overlap() < 1e-4


@pytest.mark.parametrize("ratio", [1e3, 1e4, 1e6])
@pytest.mark.parametrize("restitution", [0.0, 0.3])
def test_a_heavy_cube_stands_on_a_light_one(ratio, restitution):
    light = listed("cube", {"position": (0, 0, -3.5)}, mass=1.0)
    heavy = listed("cube", {"position": (0, 0, -2.5)}, mass=ratio)
    sim, energies, deepest = run_watched(
        scene(light, heavy, size=(6, 6, 8), gravity=GRAVITY, restitution=restitution), 2, 20
    )
    assert np.abs(sim.particles.position - [(0, 0, -3.5), (0, 0, -2.5)]).max() < 1e-6
    assert np.abs(sim.particles.velocity).max() < 1e-6
    assert deepest < 1e-6
    assert (np.diff(energies) <= 1e-11 * energies[0]).all()


@pytest.mark.parametrize("ratio", [1e3, 1e6])
def test_a_heavy_ball_comes_to_rest_on_a_light_one_between_walls(ratio):
    light = listed("sphere", {"position": (0, 0, -1.5)}, mass=1.0)
    heavy = listed("sphere", {"position": (0, 0, 0.0)}, mass=ratio)
    sim, energies, deepest = run_watched(
        scene(light, heavy, size=(1.0, 1.0, 4.0), gravity=GRAVITY, restitution=0.3), 3, 60
    )
    assert deepest < 1e-3
    assert sim.particles.position[1, 2] == pytest.approx(-0.5, abs=2e-3)
    assert (np.diff(energies) <= 1e-11 * energies[0]).all()


# ---- without gravity -----------------------------------------------------------------------------------------------


def turning_cubes(step):
    """Two cubes of restitution 0.2 that stay in touch and turn against each other after their first impacts."""
    poses = [
        {"position": (-0.6, 0, 0), "orientation": (0.2174, 0.5169, 0.2079, -0.8013), "velocity": (0.5, 0, 0)},
        {"position": (0.6, 0.2, 0.1), "orientation": (0.6, -0.3, 0.5, 0.55), "velocity": (-0.5, 0, 0)},
    ]
    cubes = listed("cube", *poses, size=0.4, mass=1.0)
    return scene(cubes, size=(20, 20, 20), boundary="open", restitution=0.2, step=step)


def test_bodies_in_touch_without_gravity_end_alike_whatever_the_step():
    energies, deepest = [], []
    for step in (0.1, 0.01, 0.001):
        sim, course, overlap = run_watched(turning_cubes(step), 1.5, 15)
        assert (np.diff(course) <= 1e-12 * course[0]).all()
        energies.append(sim.ledger.energy)
        deepest.append(overlap)
    assert max(deepest) < 1e-3 * 0.4
    assert energies[0] == pytest.approx(energies[2], rel=0.05)
    assert energies[1] == pytest.approx(energies[2], rel=0.05)


@pytest.mark.parametrize(
    ("shapes", "restitution"),
    list(itertools.product([("cube", "cube"), ("sphere", "cube"), ("tetrahedron", "cube")], [0.0, 0.2, 0.5])),
)
def test_pairs_that_meet_do_not_sink_into_each_other(shapes, restitution):
    for seed in range(4):
        rng = np.random.default_rng(seed)
        groups = []
        for sign, shape in zip((-1.0, 1.0), shapes, strict=True):
            axis = tuple(rng.normal(size=3).tolist())
            pose = {
                "position": (0.6 * sign, *(0.1 * rng.normal(size=2)).tolist()),
                "orientation": {"axis": axis, "angle": float(rng.uniform(0, 360))},
                "velocity": (-0.5 * sign, 0, 0),
            }
            groups.append(listed(shape, pose, size=0.4, mass=1.0))
        sim, energies, deepest = run_watched(
            scene(*groups, size=(20, 20, 20), boundary="open", restitution=restitution), 2.0, 100
        )
        assert (np.diff(energies) <= 1e-12 * energies[0]).all()
        assert deepest < 1e-3 * 0.4
        assert np.abs(sim.ledger.momentum).max() < 1e-12
