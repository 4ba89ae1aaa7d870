"""What a gas does, against theory: pressure, rate of impacts, equal shares of energy, cooling.

Tolerances are four standard errors of what is measured where nothing else is said, so that right physics fails once in
16,000 seeds; each test says how small its standard error must be for the test to mean something.
"""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from particlesim.simulation.simulation import Simulation
from tests.gases import (
    blocks,
    carnahan_starling,
    impact_rate,
    mixed_impact_rate,
    mixture,
    over_blocks,
    spheres,
    temperature_of,
)
from tests.worlds import gas, scene

STANDARD_ERRORS = 4.0


def agrees(measured, expected, precision):
    """Whether a measured mean is that expected, and known to a fraction ``precision`` of it."""
    assert measured.error < precision * expected
    return abs(measured.mean - expected) < STANDARD_ERRORS * measured.error


def settled(sim, steps, step):
    """Some impacts a particle later: placed at random, particles first keep clear of each other in another way."""
    for _ in range(steps):
        sim.step(step)
    return sim


# ---- pressure and rate of impacts --------------------------------------------------------------------------------


@pytest.mark.parametrize(("fill", "duration"), [(0.1, 2.0), (0.3, 0.8)])
def test_compressibility_and_rate_of_impacts_of_the_hard_sphere_fluid(fill, duration):
    """Against Carnahan-Starling, itself 0.03 and 0.3 % below the virial series at these fills, and Enskog."""
    sim = settled(spheres(1000, fill), 25, 0.1)
    compressibility, rate = blocks(sim, 20, duration, 0.1)
    assert agrees(over_blocks(compressibility), carnahan_starling(fill), 0.004)
    assert agrees(over_blocks(rate), impact_rate(1000, fill) * math.sqrt(temperature_of(sim)), 0.006)
    assert sim.ledger.unresolved == 0


def test_the_pressure_does_not_depend_on_the_time_step():
    """Drifting first and testing then would be off by a tenth at the larger one."""
    measured = []
    for step in (0.02, 0.4):
        sim = settled(spheres(500, 0.3), round(2.4 / step), step)
        measured.append(over_blocks(blocks(sim, 10, 0.8, step)[0]))
    small, large = measured
    assert abs(small.mean - large.mean) < STANDARD_ERRORS * math.hypot(small.error, large.error)
    assert large.error < 0.008 * large.mean


def test_compressibility_and_rate_of_impacts_of_a_mixture():
    """As many spheres of diameter 1 as of 1/2, against Boublik, Mansoori, Carnahan, Starling and Leland."""
    diameters, fill = (1.0, 0.5), 0.3
    assert mixture((1.0,), fill) == pytest.approx(carnahan_starling(fill), rel=1e-12)
    assert mixed_impact_rate(500, (1.0,), fill) == pytest.approx(impact_rate(500, fill), rel=1e-12)
    sim = settled(spheres(500, fill, diameters=diameters), 25, 0.05)
    compressibility, rate = blocks(sim, 20, 0.4, 0.05)
    assert agrees(over_blocks(compressibility), mixture(diameters, fill), 0.005)
    assert agrees(over_blocks(rate), mixed_impact_rate(500, diameters, fill) * math.sqrt(temperature_of(sim)), 0.005)


def test_the_pressure_on_walls_is_that_of_the_fluid_between_them():
    """Centres keep a radius off the walls and crowd there; what the walls feel is the pressure of the undisturbed
    fluid, whose density is counted in the middle half of the room, two diameters and more away from that."""
    count, fill, height, step = 1000, 0.2, 10.0, 0.1
    side = math.sqrt(count * math.pi / 6.0 / fill / height)
    walls = {"size": (side, side, height), "boundary": ["periodic", "periodic", "wall"]}
    sim = settled(spheres(count, fill, **walls), 30, step)
    momentum = sim.ledger.momentum
    # Along the walls momentum is kept: what is left of the motion has 3 N - 2 degrees of freedom.
    temperature = (2.0 * sim.ledger.kinetic - (momentum[:2] ** 2).sum() / count) / (3 * count - 2)
    difference, expected = [], []
    for _ in range(15):
        before, inside = sim.ledger.wall_impulse, 0
        for _ in range(20):
            sim.step(step)
            inside += int((np.abs(sim.particles.position[:, 2]) < height / 4).sum())
        pressure = (sim.ledger.wall_impulse - before)[4:].sum() / (2.0 * side**2 * 20 * step)
        density = inside / 20 / (side**2 * height / 2)
        expected.append(density * temperature * carnahan_starling(density * math.pi / 6.0))
        difference.append(pressure - expected[-1])
    measured = over_blocks(difference)
    assert measured.error < 0.015 * np.mean(expected)
    assert abs(measured.mean) < STANDARD_ERRORS * measured.error


def test_the_virial_theorem_holds_to_rounding():
    """The sum of p . r changes by 2 K t, plus the virial of all impacts, less that of the walls a radius nearer."""
    sim = spheres(300, 0.25, boundary="wall")

    def moment():
        particles = sim.particles
        return float((particles.mass[:, None] * particles.velocity * particles.position).sum())

    before = moment()
    settled(sim, 50, 0.1)
    ledger = sim.ledger
    inward = (ledger.wall_impulse * (sim.model.system.domain[0]["upper"][0] - 0.5)).sum()
    assert ledger.impacts > 5000
    assert moment() - before == pytest.approx(2.0 * ledger.kinetic * sim.time + ledger.virial - inward, rel=1e-9)


# ---- equal shares ------------------------------------------------------------------------------------------------


def shares(sim):
    """Of the kinetic energy: rotation about each principal axis, and translation about the centre of mass."""
    particles, ledger = sim.particles, sim.ledger
    drift = float(ledger.momentum @ ledger.momentum) / (2.0 * particles.mass.sum())
    to_world = Rotation.from_quat(np.roll(particles.orientation, -1, axis=1))
    own = to_world.apply(particles.angular_momentum, inverse=True)
    about_axes = (own**2 / (2.0 * particles.inertia)).sum(axis=0)
    return np.array([*about_axes, ledger.kinetic_translational - drift]) / (ledger.kinetic - drift)


@pytest.mark.parametrize(
    ("shape", "volume"), [("cube", 1.0), ("pyramid", 1.0 / 3.0), ({"kind": "box", "edges": [1.0, 0.7, 0.4]}, 0.28)]
)
def test_bodies_started_without_spin_share_their_energy_equally(shape, volume):
    """Each of D = 6 N - 3 degrees of freedom gets as much (three are the momentum, which is kept).

    At given energy momenta are spread evenly over a sphere in D dimensions: the share of k of them is beta distributed
    about k / D with variance k (D - k) / (D^2 (D / 2 + 1)). Samples some impacts a particle apart are independent.
    """
    count, samples = 100, 20
    edge = (count * volume / 0.1) ** (1.0 / 3.0)
    thrown = {"shape": shape, "count": count, "mass": 1.0, "velocity": {"kind": "maxwell", "temperature": 1.0}}
    sim = settled(Simulation(scene(thrown, size=(edge,) * 3, boundary="periodic", seed=2)), 50, 0.3)
    assert 2 * sim.ledger.impacts > 30 * count
    seen = []
    for _ in range(samples):
        settled(sim, 4, 0.3)
        seen.append(shares(sim))
    free = np.array([count, count, count, 3 * count - 3])
    total = free.sum()
    error = np.sqrt(free * (total - free) / (total**2 * (0.5 * total + 1.0)) / samples)
    assert (np.abs(np.mean(seen, axis=0) - free / total) < STANDARD_ERRORS * error).all()
    assert error[3] < 0.01


def test_kinds_of_particles_come_to_one_temperature():
    """Spheres, cubes, pyramids and boxes of different masses, of which only the spheres move at first."""
    sim = Simulation(gas(25, size=(2.0, 2.0, 2.0), seed=4))
    particles = sim.particles
    at_rest = particles.shape != particles.shape[0]
    particles.velocity[at_rest] = 0.0
    particles.angular_momentum[:] = 0.0
    samples, seen = 20, []
    settled(sim, 150, 0.01)
    for _ in range(samples):
        settled(sim, 45, 0.01)
        p = sim.particles
        each = 0.5 * p.mass * (p.velocity**2).sum(axis=1)
        seen.append(np.bincount(p.shape, each) / sim.ledger.kinetic)
    # Spheres do not turn: they have 3 degrees of freedom, all others 6; between walls no momentum is kept.
    count = np.bincount(particles.shape)
    free = 3.0 * count
    total = 6.0 * count.sum() - 3.0 * count[particles.shape[0]]
    error = np.sqrt(free * (total - free) / (total**2 * (0.5 * total + 1.0)) / samples)
    assert (np.abs(np.mean(seen, axis=0) - free / total) < STANDARD_ERRORS * error).all()


# ---- cooling -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("restitution", [0.9, 0.8])
def test_a_gas_of_inelastic_spheres_cools_by_haffs_law(restitution):
    """T = T0 / (1 + t / t0)^2 (P. K. Haff, J. Fluid Mech. 134 (1983) 401), to ten impacts a particle.

    An impact of velocities g along the line of centres loses (1 - e^2) m g^2 / 4, on average (1 - e^2) T, so that
    1 / t0 = (1 - e^2) w / 6 with w the rate at which a particle meets others at first. The law leaves out that
    velocities do not stay quite Maxwellian (0.3 % of the rate). After C impacts a particle the temperature has gone
    by exp(-(1 - e^2) C / 3): if 20,000 impacts came by chance (0.7 %), it would be uncertain by 0.9 % at e = 0.8.
    """
    count, fill = 4000, 0.05
    sim = spheres(count, fill, restitution=restitution)
    start, impacts = temperature_of(sim), 0
    often = 2.0 * impact_rate(count, fill) / count * math.sqrt(start)
    while impacts < 10 * count / 2:
        sim.step(0.5 / math.sqrt(temperature_of(sim)))
        impacts = sim.ledger.impacts
        law = start / (1.0 + (1.0 - restitution**2) / 6.0 * often * sim.time) ** 2
        assert temperature_of(sim) == pytest.approx(law, rel=0.02)
