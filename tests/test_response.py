"""Impacts against closed forms."""

import math

import numpy as np
import pytest

from particlesim.simulation.simulation import Simulation
from tests.worlds import gas, listed, scene


def paper_response(m1, v1, m2, v2):
    """The paper's formula for a head-on elastic impact."""
    return (v1 * (m1 - m2) + 2 * m2 * v2) / (m1 + m2), (v2 * (m2 - m1) + 2 * m1 * v1) / (m1 + m2)


def totals(sim):
    ledger = sim.ledger
    return ledger.energy, ledger.momentum, ledger.angular_momentum


@pytest.mark.parametrize("shape", ["sphere", "cube", {"kind": "box", "edges": [1.0, 2.0, 0.5]}])
def test_equal_masses_swap_velocities_head_on(shape):
    a = {"position": (-2, 0, 0), "velocity": (3, 0, 0)}
    b = {"position": (2, 0, 0), "velocity": (-1, 0, 0)}
    sim = Simulation(scene(listed(shape, a, b), boundary="open"))
    sim.run(duration=1.5)
    assert np.allclose(sim.particles.velocity, [(-1, 0, 0), (3, 0, 0)], rtol=0, atol=1e-12)
    # They met after 3/4 s, centres at 1/4 and 5/4, and went on for as long.
    assert np.allclose(sim.particles.position, [(0.25 - 0.75, 0, 0), (1.25 + 2.25, 0, 0)], rtol=0, atol=1e-10)
    assert np.allclose(sim.particles.angular_velocity, 0.0, atol=1e-12)
    assert sim.ledger.impacts == 1


@pytest.mark.parametrize(("mass_1", "mass_2"), [(1.0, 2.0), (1.0, 1e6), (5.0, 0.01)])
def test_the_papers_formula_is_the_one_dimensional_case(mass_1, mass_2):
    one = listed("sphere", {"position": (-2, 0, 0), "velocity": (2, 0, 0)}, mass=mass_1)
    two = listed("cube", {"position": (2, 0, 0), "velocity": (-1, 0, 0)}, mass=mass_2)
    sim = Simulation(scene(one, two, boundary="open"))
    sim.run(duration=1.5)
    assert np.allclose(sim.particles.velocity[:, 0], paper_response(mass_1, 2.0, mass_2, -1.0), rtol=1e-12)
    assert np.allclose(sim.particles.velocity[:, 1:], 0.0, atol=1e-12)


def test_an_oblique_hit_of_spheres_sends_them_off_at_right_angles():
    """Equal masses, one at rest: the struck ball goes along the line of centres, the other across it."""
    offset = 0.6
    hit = {"position": (-3, 0, 0), "velocity": (2, 0, 0)}
    sim = Simulation(scene(listed("sphere", hit, {"position": (0, offset, 0)}), boundary="open"))
    sim.run(duration=2.0)
    normal = np.array([math.sqrt(1 - offset**2), offset, 0.0])
    struck = (2.0 * normal[0]) * normal
    assert np.allclose(sim.particles.velocity[1], struck, rtol=0, atol=1e-10)
    assert np.allclose(sim.particles.velocity[0], np.array([2.0, 0, 0]) - struck, rtol=0, atol=1e-10)
    assert np.allclose(sim.particles.angular_velocity, 0.0, atol=1e-12)


@pytest.mark.parametrize("restitution", [1.0, 0.5, 0.0])
@pytest.mark.parametrize("tilt", [0.0, 1e-3, 10.0, 30.0, 44.0, -20.0])
def test_a_cube_edge_down_on_a_wall(tilt, restitution):
    """One impulse at the edge, d beside the centre of mass: j = (1 + e) v / (1/m + d^2/I)."""
    turn = {"axis": (0, 1, 0), "angle": 45.0 + tilt}
    falling = {"position": (0, 0, 0), "orientation": turn, "velocity": (0, 0, -2)}
    sim = Simulation(scene(listed("cube", falling), size=(20, 20, 4), restitution=restitution))
    mass, inertia = sim.particles.mass[0], sim.particles.inertia[0, 1]
    arm = math.sqrt(0.5)
    beside, above = arm * math.sin(math.radians(tilt)), arm * math.cos(math.radians(tilt))
    impulse = (1 + restitution) * 2.0 / (1 / mass + beside**2 / inertia)
    met = (2.0 - above) / 2.0
    sim.run(duration=met + 0.005)
    assert sim.ledger.impacts == 1
    assert np.allclose(sim.particles.velocity[0], [0, 0, -2.0 + impulse / mass], rtol=0, atol=1e-9)
    # The edge strikes on the side it leans to: turning about y, the lowest edge goes to -x.
    assert np.allclose(sim.particles.angular_velocity[0], [0, beside * impulse / inertia, 0], rtol=0, atol=1e-9)
    assert sim.particles.position[0, 2] == pytest.approx(-2.0 + above + 0.005 * (-2.0 + impulse / mass), abs=1e-9)


@pytest.mark.parametrize("shape", ["cube", "pyramid", {"kind": "box", "edges": [1.0, 2.0, 3.0]}])
def test_a_face_landing_flat_does_not_start_to_spin(shape):
    falling = {"position": (0.3, -0.2, 0), "velocity": (0.5, 0, -3)}
    sim = Simulation(scene(listed(shape, falling)))
    sim.run(duration=4.0)
    assert sim.ledger.impacts == 1
    assert np.allclose(sim.particles.velocity[0], [0.5, 0, 3], rtol=0, atol=1e-12)
    assert np.allclose(sim.particles.angular_velocity[0], 0.0, atol=1e-12)


def test_two_cubes_face_to_face_swap_velocities_without_spin():
    a = {"position": (-2, 0.2, 0.1), "velocity": (1, 0, 0)}
    b = {"position": (2, 0.2, 0.1), "velocity": (-2, 0, 0)}
    sim = Simulation(scene(listed("cube", a, b), boundary="open"))
    sim.run(duration=2.0)
    assert np.allclose(sim.particles.velocity, [(-2, 0, 0), (1, 0, 0)], rtol=0, atol=1e-12)
    assert np.allclose(sim.particles.angular_velocity, 0.0, atol=1e-12)


@pytest.mark.parametrize("gap", [0.0, 1e-9, 0.01, 0.3])
def test_newtons_cradle_hands_the_velocity_on(gap):
    row = [{"position": (k * (1 + gap), 0, 0)} for k in range(5)]
    first = {"position": (-3, 0, 0), "velocity": (2, 0, 0)}
    sim = Simulation(scene(listed("sphere", first, *row), boundary="open"))
    sim.run(duration=2.0)
    assert np.allclose(sim.particles.velocity[:-1], 0.0, atol=1e-12)
    assert np.allclose(sim.particles.velocity[-1], (2, 0, 0), rtol=0, atol=1e-12)
    assert sim.ledger.impacts == 5
    # The quickest way through: 2 m to the first ball, the gaps, and the rest of 2 s with the last one.
    assert sim.particles.position[-1, 0] == pytest.approx(4 * (1 + gap) + 4.0 - 2.0 - 4 * gap, abs=1e-9)


@pytest.mark.parametrize("restitution", [1.0, 0.8, 0.5])
def test_bounces_under_gravity_rise_to_the_height_times_e_squared(restitution):
    """After n bounces the energy is m g h e^(2n), whatever the time step."""
    dropped = {"position": (0, 0, 0)}
    sim = Simulation(scene(listed("sphere", dropped), size=(5, 5, 5), gravity=(0, 0, -9.81), restitution=restitution))
    height, mass = 2.0, sim.particles.mass[0]
    floor = mass * 9.81 * 0.5  # the ledger counts from the floor, the ball touches with its centre a radius above
    for bounces in range(1, 6):
        while sim.ledger.impacts < bounces:
            sim.step()
        expected = mass * 9.81 * height * restitution ** (2 * bounces)
        assert sim.ledger.energy - floor == pytest.approx(expected, rel=1e-9)


def test_the_smaller_restitution_of_a_pair_counts():
    soft = listed("sphere", {"position": (-2, 0, 0), "velocity": (1, 0, 0)}, restitution=0.25)
    hard = listed("sphere", {"position": (2, 0, 0), "velocity": (-1, 0, 0)}, restitution=0.75)
    sim = Simulation(scene(soft, hard, boundary="open"))
    sim.run(duration=3.0)
    assert np.allclose(sim.particles.velocity[:, 0], [-0.25, 0.25], rtol=0, atol=1e-12)


@pytest.mark.parametrize("boundary", ["wall", "open", "periodic"])
def test_every_impulse_keeps_what_it_must(boundary):
    settings = {"size": (3.2, 3.2, 3.2)} if boundary == "periodic" else {}
    sim = Simulation(gas(boundary=boundary, **settings))
    energy, momentum, angular = totals(sim)
    sim.run(steps=300)
    ledger = sim.ledger
    assert ledger.impacts > 20
    assert ledger.unresolved == 0
    assert ledger.energy == pytest.approx(energy, rel=1e-13)
    scale = math.sqrt(2 * energy * sim.particles.mass.sum())
    walls = ledger.wall_impulse
    to_walls = np.array([walls[1] - walls[0], walls[3] - walls[2], walls[5] - walls[4]])
    assert np.allclose(ledger.momentum + to_walls, momentum, rtol=0, atol=1e-12 * scale)
    if boundary == "open":
        assert np.allclose(ledger.angular_momentum, angular, rtol=0, atol=1e-12 * scale)
    assert np.allclose(np.linalg.norm(sim.particles.orientation, axis=1), 1.0, rtol=0, atol=1e-15)


def test_nothing_is_inside_anything_else_or_outside_the_box():
    sim = Simulation(gas(seed=3))
    for _ in range(20):
        sim.run(duration=1 / 30)
        assert sim.largest_overlap() < 0.02 * 0.3
    reach = sim.particles.inradius[:, None]
    assert (np.abs(sim.particles.position) + reach <= 1.25 + 0.02 * 0.3).all()


def test_energy_only_falls_with_restitution_below_one():
    sim = Simulation(gas(10, restitution=0.7))
    last = sim.ledger.energy
    for _ in range(150):
        sim.step()
        now = sim.ledger.energy
        assert now <= last * (1 + 1e-13)
        last = now


def test_a_ball_coming_to_rest_stays_on_the_floor():
    """Its bounces neither end in a loop without end nor let it sink."""
    dropped = {"position": (0, 0, 0)}
    sim = Simulation(scene(listed("sphere", dropped), size=(3, 3, 3), gravity=(0, 0, -9.81), restitution=0.5))
    sim.run(duration=6.0)
    height = sim.particles.position[0, 2] + 1.5 - 0.5
    assert -1e-3 < height < 2e-3
    assert np.linalg.norm(sim.particles.velocity[0]) < 0.2
    assert sim.ledger.unresolved == 0


def test_shapes_overlapping_at_rest_are_left_alone():
    """Only what approaches is answered: two that lie in each other and part are not held."""
    a, b = {"position": (0, 0, 0), "velocity": (-1, 0, 0)}, {"position": (1, 0, 0), "velocity": (1, 0, 0)}
    sim = Simulation(scene(listed("cube", a, b), boundary="open"))
    sim.particles.position[1, 0] = 0.7
    sim.run(duration=0.5)
    assert sim.ledger.impacts == 0
    assert np.allclose(sim.particles.velocity, [(-1, 0, 0), (1, 0, 0)])
