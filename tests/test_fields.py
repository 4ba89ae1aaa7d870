"""Fields of force and forces from Python: closed forms, and the order of the error."""

import math

import numpy as np
import pytest

import particlesim as ps
from tests.worlds import gas, listed, scene

# A comet about a centre of strength 4: r = 2 at its farthest, where it goes at half the speed of a circle.
COMET = {"position": (2, 0, 0), "velocity": (0, 0.5 * math.sqrt(2), 0)}
SUN = {"kind": "central", "strength": 4.0}


def alone(pose, *fields, step=0.01, **settings):
    """A particle of 1 kg, so large that its steps are not made shorter."""
    return scene(
        listed("sphere", pose, size=8.0, mass=1.0), fields=list(fields), boundary="open", step=step, **settings
    )


def orbit_energy(sim):
    """Energy a mass of a particle about the sun [J/kg]."""
    v, x = sim.particles.velocity[0], sim.particles.position[0]
    return 0.5 * v @ v - 4.0 / np.linalg.norm(x)


def test_a_uniform_field_is_gravity():
    """A parabola is a kick, a straight line and a kick, whatever the step."""
    falling = {"position": (0, 0, 1), "velocity": (1, 0, 2)}
    sim = ps.Simulation(alone(falling, {"kind": "uniform", "acceleration": [0, 1, -3]}, step=0.13))
    sim.run(duration=1.3)
    assert np.allclose(sim.particles.position[0], [1.3, 0.845, 1 + 2.6 - 1.5 * 1.69], rtol=0, atol=1e-13)


def test_drag_slows_down_exponentially():
    """v = u + (v0 - u) exp(-c t / m), exactly; the way to second order in the step."""
    moving = {"position": (0, 0, 0), "velocity": (3, 0, 0)}
    ways = []
    for step in (0.02, 0.01):
        sim = ps.Simulation(alone(moving, {"kind": "drag", "coefficient": 2.0, "velocity": [0, 1, 0]}, step=step))
        sim.run(duration=1.0)
        rate = 2.0
        left = math.exp(-rate)
        assert np.allclose(sim.particles.velocity[0], [3 * left, 1 - left, 0], rtol=0, atol=1e-12)
        ways.append(abs(sim.particles.position[0, 0] - 3 * (1 - left) / rate))
    assert 3.9 < ways[0] / ways[1] < 4.1


def test_the_error_of_an_orbit_is_of_second_order():
    """Kepler: semi-major axis from the energy, and back at the start after 2 pi (a^3 / strength)^(1/2)."""
    a = 1.0 / (2.0 / 2.0 - 0.5 / 4.0)
    period = 2.0 * math.pi * math.sqrt(a**3 / 4.0)
    errors, energies = [], []
    for parts in (400, 800, 1600):
        sim = ps.Simulation(alone(COMET, SUN, step=period / parts))
        sim.run(steps=parts // 2)
        energies.append(abs(orbit_energy(sim) + 2.0 / a))
        sim.run(steps=parts // 2)
        errors.append(np.linalg.norm(sim.particles.position[0] - COMET["position"]))
    for each in (errors, energies):
        assert 3.8 < each[0] / each[1] < 4.2
        assert 3.8 < each[1] / each[2] < 4.2


def test_the_energy_of_an_orbit_does_not_drift():
    """Over forty periods: it goes to and fro, and is after them what it was after one."""
    a = 1.0 / (2.0 / 2.0 - 0.5 / 4.0)
    period = 2.0 * math.pi * math.sqrt(a**3 / 4.0)
    sim = ps.Simulation(alone(COMET, SUN, step=period / 300))
    worst = []
    for _ in range(40):
        errors = []
        for _ in range(10):
            sim.run(steps=30)
            errors.append(abs(orbit_energy(sim) + 2.0 / a))
        worst.append(max(errors))
    assert max(worst) < 1.5 * worst[0]
    work = sim.ledger.work / sim.particles.mass[0]
    assert sim.ledger.kinetic / sim.particles.mass[0] == pytest.approx(0.25 + work, rel=1e-12)


def test_a_vortex_drives_what_stands_round():
    sim = ps.Simulation(
        alone({"position": (1, 2, 3)}, {"kind": "vortex", "centre": [1, 0, 0], "strength": 5.0}, step=1e-5)
    )
    sim.run(steps=2)
    assert np.allclose(sim.particles.velocity[0], [-10 * 2e-5, 0, 0], rtol=1e-4, atol=1e-12)


@pytest.mark.parametrize("form", ["box", "ellipsoid"])
def test_a_field_may_end(form):
    """A lift: a particle in it gains its height times the acceleration, one beside it none."""
    region = {"lower": [-1, -1, -1], "upper": [1, 1, 1], "form": form}
    inside, corner = {"position": (0, 0, -0.99)}, {"position": (0.9, 0.9, 0.9)}
    what = scene(
        listed("sphere", inside, corner, size=0.1),
        fields=[{"kind": "uniform", "acceleration": [0, 0, 2], "region": region}],
        boundary="open",
        step=0.001,
    )
    sim = ps.Simulation(what)
    sim.run(duration=2.0)
    assert sim.particles.velocity[0, 2] == pytest.approx(math.sqrt(2 * 2 * 1.99), rel=2e-3)
    beside = 0.0 if form == "ellipsoid" else math.sqrt(2 * 2 * 0.1)
    assert sim.particles.velocity[1, 2] == pytest.approx(beside, rel=1e-2)


def test_a_force_from_python_is_a_field():
    """A spring: x = cos(w t), with w of the leapfrog, sin(w h / 2) = w0 h / 2 (exactly so)."""
    h = 0.05
    sim = ps.Simulation(alone({"position": (1, 0, 0)}, step=h))
    sim.add_force(lambda particles: -9.0 * particles.mass[:, None] * particles.position)
    sim.run(steps=100)
    w = 2.0 / h * math.asin(0.5 * 3.0 * h)
    assert sim.particles.position[0, 0] == pytest.approx(math.cos(w * 100 * h), abs=1e-11)


def test_a_force_of_another_shape_is_refused():
    sim = ps.Simulation(alone({"position": (1, 0, 0)}))
    sim.add_force(lambda particles: np.zeros(3))
    with pytest.raises(ValueError, match=r"force must return finite numbers of the shape \(1, 3\), not \(3,\)"):
        sim.step()


def test_impacts_between_kicks_keep_what_they_keep(tmp_path):
    """A gas under fields and a force: the ledger closes; broad phases, threads and checkpoints change no bit."""
    fields = [{"kind": "central", "strength": 3.0, "softening": 0.2}, {"kind": "drag", "coefficient": 0.5}]
    fields += [{"kind": "vortex", "strength": 4.0, "region": {"lower": [-1, -1, -1], "upper": [1, 1, 0]}}]
    hashes = set()
    for method, threads in (("octree", 1), ("grid", 2), ("naive", 4)):
        sim = ps.Simulation(gas(10, fields=fields), method, threads)
        sim.add_force(lambda particles: np.cross(particles.velocity, [0.0, 0.0, 2.0]))
        start = sim.ledger.kinetic
        sim.run(steps=40)
        hashes.add(sim.state_hash())
        assert sim.ledger.kinetic - start == pytest.approx(sim.ledger.work, abs=1e-11 * start)
    assert len(hashes) == 1
    assert sim.ledger.impacts > 20
    half = ps.Simulation(gas(10, fields=fields))
    half.run(steps=20)
    half.save(tmp_path / "run.ckpt")
    other = ps.Simulation.load(tmp_path / "run.ckpt")
    for one in (half, other):
        one.run(steps=20)
    assert other.state_hash() == half.state_hash()
