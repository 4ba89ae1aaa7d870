"""What is built stands as long as statics lets it, and falls as it must."""

import math

import numpy as np
import pytest

from particlesim.simulation.simulation import Simulation
from tests import structures
from tests.dominoes import Row
from tests.worlds import listed, scene


def drift(what, duration):
    """How far particles are from their start after so many seconds, at most [m], and the simulation."""
    sim = Simulation(what)
    start = sim.particles.position.copy()
    sim.run(duration=duration)
    return np.linalg.norm(sim.particles.position - start, axis=1).max(), sim


def test_a_wall_of_bricks_stands():
    way, sim = drift(structures.wall_of_bricks(), 1.0)
    settled = sim.particles.position.copy()
    assert way < 1e-3 * structures.BRICK[2]
    sim.run(duration=2.0)
    assert np.abs(sim.particles.position - settled).max() < 1e-9
    assert sim.largest_overlap() < 1e-4 * structures.BRICK[2]


# ---- arches --------------------------------------------------------------------------------------------------------


def test_the_least_thickness_of_an_arch_is_that_of_milankovitch():
    """More and more stones need what the infinitely thin ones do, 0.1075; fewer joints need less."""
    thickness = [structures.least_thickness(stones=stones) for stones in (15, 45, 135)]
    assert (np.diff(thickness) > 0.0).all()
    assert thickness[-1] == pytest.approx(0.1075, abs=2e-4)


def test_an_arch_stands_if_it_is_thick_enough(tmp_path):
    least = structures.least_thickness()
    way, _ = drift(structures.arch(tmp_path, 1.03 * least), 2.0)
    assert way < 1e-4
    way, _ = drift(structures.arch(tmp_path, 0.97 * least), 0.7)
    assert way > 0.05


# ---- cards ---------------------------------------------------------------------------------------------------------


def test_two_cards_lean_on_each_other_if_friction_holds_them():
    least = structures.least_friction_of_cards()
    way, _ = drift(structures.house_of_cards(1, 1.02 * least), 1.0)
    assert way < 1e-7
    way, _ = drift(structures.house_of_cards(1, 0.98 * least), 1.0)
    assert way > 0.01


def test_a_house_of_cards_of_two_floors_stands():
    way, _ = drift(structures.house_of_cards(2, 0.6), 3.0)
    assert way < 1e-7


# ---- dominoes ------------------------------------------------------------------------------------------------------


def times_of_fall(row, count, push):
    """When each of a row of dominoes begins to turn [s], to a millisecond; the first is pushed at ``push`` [1/s]."""
    height, thickness = row.height, row.thickness
    poses = [{"position": (row.pitch * k, 0.0, 0.5 * height - 0.5)} for k in range(count)]
    poses[0] |= {"spin": (0, push, 0), "velocity": (0.5 * push * height, 0, 0.5 * push * thickness)}
    dominoes = listed({"kind": "box", "edges": (thickness, 0.5 * height, height)}, *poses, name="dominoes")
    floor = [{"between": ["dominoes", "walls"], "friction": 5.0}]
    sim = Simulation(
        scene(
            dominoes,
            size=(4.0, 2.0, 1.0),
            gravity=structures.GRAVITY,
            restitution=0.0,
            friction=row.friction,
            contact=floor,
        )
    )
    times = np.full(count, np.nan)
    while np.isnan(times).any() and sim.time < 2.0:
        sim.run(duration=1e-3)
        times[np.isnan(times) & (sim.particles.angular_velocity[:, 1] > 1e-6)] = sim.time
    return times


@pytest.mark.parametrize(("gap", "friction"), [(0.015, 0.2), (0.025, 0.0)])
def test_dominoes_fall_at_the_speed_of_van_leeuwens_wave(gap, friction):
    row = Row(0.048, 0.0075, gap, friction)
    times = times_of_fall(row, 20, push=5.0)
    expected = np.concatenate([[0.0], np.cumsum(row.pitch / row.speeds(5.0, 19))])
    # While the first ones tip over, a little is a lot of time: what counts is how the wave goes on.
    assert times[10:] - times[5] == pytest.approx(expected[10:] - expected[5], rel=0.02, abs=2e-3)
    # In units of sqrt(g h), as D. McLachlan et al., SIAM Review 25 (1983) 403, have it.
    assert row.pitch * 5.0 / (times[19] - times[14]) == pytest.approx(row.speeds(5.0, 40)[-1], rel=0.03)
    assert 1.0 < row.speeds(5.0, 40)[-1] / math.sqrt(9.81 * row.height) < 2.0
