"""Scenes that are in the gallery, run as they are: what they show is what a law of its own says."""

from math import comb
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import trapezoid
from scipy.spatial import cKDTree
from scipy.stats import chisquare

import particlesim as ps

pytestmark = pytest.mark.slow

SCENES = Path(__file__).parents[1] / "scenes"


def shown(name):
    """The simulation of a scene, at its start."""
    return ps.Simulation(ps.load_scene(SCENES / f"{name}.toml"))


def test_the_bins_of_a_galton_board_fill_by_the_binomial_law():
    """Eight turns to either side, each with the same chance and of no memory: 8 over k in 256 come to bin k."""
    rows, pitch = 8, 0.1
    sim = shown("galton")
    sim.run(duration=sim.scene.duration)
    x, _, z = sim.particles.position.T
    assert (z < -0.2).all()  # all are down, and no bin is full
    bins = np.floor(x / pitch + 0.5 * (rows + 1)).astype(int)
    counts = np.bincount(bins, minlength=rows + 1)
    expected = len(x) / 2**rows * np.array([comb(rows, k) for k in range(rows + 1)])
    # As is usual for this statistic, in classes in which five or more are expected.
    classes = [0, 3, 4, 5, 6]
    assert chisquare(np.add.reduceat(counts, classes), np.add.reduceat(expected, classes)).pvalue > 0.01
    assert bins.mean() == pytest.approx(0.5 * rows, abs=3.0 * np.sqrt(0.25 * rows / len(x)))
    assert bins.var() == pytest.approx(0.25 * rows, rel=3.0 * np.sqrt(2.0 / len(x)))


def test_a_cloud_falls_towards_its_star_as_bodies_do_that_fall_freely():
    """From rest at R to r = R cos^2 a takes sqrt(R^3 / (2 GM)) (a + sin a cos a), in a straight line."""
    sim = shown("cloud")
    start = np.linalg.norm(sim.particles.position, axis=1)
    direction = sim.particles.position / start[:, np.newaxis]
    sim.run(duration=1.5)
    # A touch is an impact or lasts; what has had neither has not been turned by friction.
    free = (sim.particles.impacts == 0) & (sim.particles.angular_velocity == 0).all(axis=1)
    assert free.sum() > 500
    r = np.linalg.norm(sim.particles.position, axis=1)
    a = np.arccos(np.sqrt(r[free] / start[free]))
    time = np.sqrt(start[free] ** 3 / (2.0 * sim.scene.fields[0].strength)) * (a + np.sin(a) * np.cos(a))
    assert np.allclose(time, sim.time, rtol=1e-5, atol=0)
    assert np.allclose(sim.particles.position[free], (r[:, np.newaxis] * direction)[free], rtol=0, atol=1e-12)


def test_the_work_of_a_drum_is_what_its_heap_asks_for():
    """It holds the heap up on one side: with a torque of dL/dt - m g x, and so with a power of that times its rate."""
    sim = shown("drum")
    rate, gravity, mass = sim.scene.obstacles[0].motion.rate, 9.81, sim.particles.mass
    seconds, samples = 3, 100
    turning, moments, mixed = [], [], []
    for k in range(seconds * samples + 1):
        sim.run_until(k / samples)
        (x, _, z), (u, _, w) = sim.particles.position.T, sim.particles.velocity.T
        turning.append((mass * (z * u - x * w) + sim.particles.angular_momentum[:, 1]).sum())
        moments.append((mass * gravity * x).sum())
        if k % samples == 0:
            _, nearest = cKDTree(sim.particles.position).query(sim.particles.position, 7)
            mixed.append((sim.particles.group[nearest] != sim.particles.group[:, np.newaxis]).mean())
    held = rate * (turning[-1] - turning[0] - trapezoid(moments, dx=1.0 / samples))
    assert sim.ledger.work == pytest.approx(held, rel=1e-2)
    assert mixed[1] < mixed[2] < mixed[3]  # of the nearest six, those of the other colour


def test_cubes_on_a_conveyor_go_as_fast_as_its_surface():
    """What has slid v / (mu g) long, as what lies farther on has, goes at v in its direction and does not turn."""
    sim = shown("conveyor")
    belt, edge = sim.scene.obstacles[0], 0.1
    top, end = 0.05, 0.4  # of the belt
    sim.run(duration=6.0)
    x, _, z = sim.particles.position.T
    carried = (np.abs(z - top - 0.5 * edge) < 1e-3) & (x > -0.4) & (x < end - edge)
    assert carried.sum() >= 5
    assert np.allclose(sim.particles.velocity[carried], belt.surface_velocity, rtol=0, atol=1e-3)
    assert np.allclose(sim.particles.angular_velocity[carried], 0.0, rtol=0, atol=1e-2)
    # The others make a heap: where it is highest they lie on each other.
    beyond = x > end + edge
    assert beyond.sum() > 0.4 * len(x)
    assert z[beyond].max() > -0.5 + 2.0 * edge
