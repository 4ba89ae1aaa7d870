"""What must be kept, that nothing passes through anything, and that it is the same however it is computed."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from particlesim.core import parallel as crew
from particlesim.dynamics.settings import MAX_SUBSTEP_DISPLACEMENT
from particlesim.model.overlap import deepest_overlap
from particlesim.simulation.simulation import Simulation
from tests.brute_force import Spheres
from tests.gases import spheres
from tests.worlds import gas, listed, scene

# Steps a factor ten apart, and the shortest about what an automatic one is for the gases here [s].
STEPS = (0.002, 0.02, 0.2)


def overlap_of_any(sim):
    """The largest overlap of any two particles or with a wall [m], whatever the neighbour list says."""
    pairs = np.column_stack(np.triu_indices(len(sim.particles.mass), 1))
    return deepest_overlap(sim.model.system, pairs)


def turned(axis, degrees):
    return {"orientation": {"axis": axis, "angle": degrees}}


# ---- energy, momentum, angular momentum --------------------------------------------------------------------------


@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize(("gravity", "bound"), [(0.0, 1e-12), (-9.81, 1e-9)])
def test_energy_of_many_impacts_of_spheres(step, gravity, bound):
    """The bound is for 10^6 impacts; these are fewer, and stay within it as well."""
    sim = spheres(200, 0.28, boundary="wall", gravity=(0, 0, gravity))
    before = sim.ledger.energy
    while sim.ledger.impacts < 7000:
        sim.step(step)
    assert sim.ledger.energy == pytest.approx(before, rel=bound)
    assert sim.ledger.unresolved == 0


@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize(("gravity", "bound"), [(0.0, 1e-12), (-9.81, 1e-9)])
def test_energy_of_many_impacts_of_all_shapes(step, gravity, bound):
    sim = Simulation(gas(16, size=(1.8, 1.8, 1.8), gravity=(0, 0, gravity)))
    before = sim.ledger.energy
    while sim.ledger.impacts < 1500:
        sim.step(step)
    assert sim.ledger.energy == pytest.approx(before, rel=bound)
    assert sim.ledger.unresolved == 0


def test_rounding_does_not_add_up():
    """To 1e-12 per 10^6 impacts: a bias of rounding grows with their number, chance only with its root."""
    sim = spheres(64, 0.2, boundary="wall")
    before = sim.ledger.energy
    while sim.ledger.impacts < 30000:
        sim.step(0.2)
    assert sim.ledger.energy == pytest.approx(before, rel=1e-12 * sim.ledger.impacts / 1e6)


def test_an_isolated_cluster_keeps_momentum_and_angular_momentum():
    """It falls together, meets in the middle and flies apart, spinning."""
    shapes = ["sphere", "cube", "pyramid", "tetrahedron"]
    inward = {"kind": "inward", "speed": 3.0, "centre": (0.2, 0.0, -0.1)}
    groups = [
        {"shape": shape, "count": 12, "size": 0.4, "velocity": inward, "spin": {"kind": "uniform", "speed": 9.0}}
        for shape in shapes
    ]
    sim = Simulation(scene(*groups, size=(4, 4, 4), boundary="open", seed=3))
    before = sim.ledger
    sim.run(duration=2.0)
    after = sim.ledger
    assert after.impacts > 100
    scale = math.sqrt(2.0 * before.energy * sim.particles.mass.sum())
    assert after.energy == pytest.approx(before.energy, rel=1e-13)
    assert np.allclose(after.momentum, before.momentum, rtol=0, atol=1e-14 * scale)
    assert np.allclose(after.angular_momentum, before.angular_momentum, rtol=0, atol=1e-13 * scale * 4.0)


# ---- the same however it is computed -----------------------------------------------------------------------------


def test_the_time_step_does_not_change_what_happens():
    """Until rounding, which grows some tenfold with each impact of a particle, is seen."""
    ends = []
    for step in STEPS:
        sim = Simulation(gas(3, size=(1.6, 1.6, 1.6), step=step, seed=2))
        sim.run(duration=0.4)
        ends.append((sim.particles.position.copy(), sim.ledger.impacts))
    assert ends[0][1] > 20
    for position, impacts in ends[1:]:
        assert impacts == ends[0][1]
        assert np.allclose(position, ends[0][0], rtol=0, atol=1e-8)


@pytest.mark.parametrize("step", ["auto", 0.1, 2.0])
def test_a_second_opinion_on_the_first_sixty_impacts(step):
    """Spheres of unlike sizes, so close that each meets several others within the longer steps."""
    edge = 4.5
    crowd = {"shape": "sphere", "count": 26, "size": {"kind": "uniform", "low": 0.5, "high": 1.2}, "density": 2.0}
    moving = crowd | {"velocity": {"kind": "maxwell", "temperature": 1.0}}
    sim = Simulation(scene(moving, size=(edge,) * 3, boundary="periodic", seed=5, step=step))
    p = sim.particles
    other = Spheres(p.position, p.velocity, p.mass, p.radius, edge)
    impacts = np.zeros(26, dtype=int)
    for number in range(20, 61, 20):
        for _ in range(20):
            last, *both = other.impact()
            impacts[both] += 1
        sim.run_until(last + 1e-9)
        other.run_until(last + 1e-9)
        assert sim.ledger.impacts == number
        assert np.array_equal(sim.particles.impacts, impacts)
        assert np.allclose(sim.particles.position + edge * sim.particles.image, other.position, rtol=0, atol=1e-8)
        assert np.allclose(sim.particles.velocity, other.velocity, rtol=0, atol=1e-8)


@pytest.mark.parametrize("boundary", ["wall", "periodic"])
def test_threads_that_share_the_impacts_change_no_bit(boundary, monkeypatch):
    """All shapes, in islands of many sizes; few particles are shared out as if they were many."""
    monkeypatch.setattr(crew, "ALONE", 8)
    hashes = set()
    for threads, method in ((1, "octree"), (2, "grid"), (4, "naive"), (4, "octree")):
        sim = Simulation(gas(40, size=(3.6, 3.6, 3.6), boundary=boundary), broad_phase=method, threads=threads)
        for _ in range(8):
            sim.step(0.02)
        assert sim.ledger.impacts > 50
        hashes.add(sim.state_hash())
    assert len(hashes) == 1


def test_threads_change_no_bit_of_a_crowd():
    """So many that more particles meet something in a step than one thread takes on alone."""
    crowd, hashes = spheres(20000, 0.3).scene, set()
    for threads, method in ((1, "octree"), (2, "grid"), (4, "octree")):
        sim = Simulation(crowd, broad_phase=method, threads=threads)
        before = sim.particles.velocity.copy()
        sim.step(0.2)
        assert (sim.particles.velocity != before).any(axis=1).sum() > crew.ALONE
        hashes.add(sim.state_hash())
    assert len(hashes) == 1


# ---- nothing passes through anything -----------------------------------------------------------------------------


@pytest.mark.parametrize("step", STEPS)
def test_spheres_do_not_overlap(step):
    sim = spheres(150, 0.28, boundary="wall")
    for _ in range(math.ceil(0.2 / step)):
        sim.step(step)
        assert overlap_of_any(sim) < 1e-9
    assert sim.ledger.impacts > 100
    assert (np.abs(sim.particles.position) <= 0.5 * np.array(sim.scene.world.size) - 0.5 + 1e-9).all()


@pytest.mark.parametrize("boundary", ["wall", "periodic"])
@pytest.mark.parametrize("step", STEPS[1:])
def test_bodies_do_not_overlap(step, boundary):
    size = 0.3
    sim = Simulation(gas(16, size=(1.9, 1.9, 1.9), boundary=boundary, seed=3))
    for _ in range(math.ceil(0.4 / step)):
        sim.step(step)
        assert overlap_of_any(sim) < 1e-6 * size
    assert sim.ledger.impacts > 100


def test_sizes_a_hundredfold_apart_and_masses_a_millionfold():
    """Pebbles between boulders, and light boulders among heavy pebbles."""
    moving = {"velocity": {"kind": "uniform", "speed": 2.0}, "spin": {"kind": "uniform", "speed": 3.0}}
    pebbles = {"shape": "sphere", "count": 100, "size": 0.01, **moving}
    boulders = {"shape": "cube", "count": 4, "placement": {"kind": "lattice", "spacing": 1.8}, **moving}
    for densities in ((1000.0, 1000.0), (1e6, 1e-3)):
        groups = (boulders | {"density": densities[0]}, pebbles | {"density": densities[1]})
        sim = Simulation(scene(*groups, size=(3.6, 3.6, 3.6), seed=7))
        before = sim.ledger.energy
        for _ in range(5):
            sim.run(duration=0.05)
            assert overlap_of_any(sim) < 1e-6 * 0.01
        assert sim.ledger.impacts > 20
        assert sim.ledger.energy == pytest.approx(before, rel=1e-12)


@pytest.mark.parametrize("shape", ["sphere", "cube", "pyramid"])
def test_a_bullet_that_crosses_a_hundred_diameters_a_step_hits_what_is_in_its_way(shape):
    target = listed(shape, {"position": (3, 0, 0), **turned((0, 0, 1), 20)}, size=0.2, mass=1e6)
    bullet = listed("sphere", {"position": (-6, 0.02, 0), "velocity": (100, 0, 0)}, size=0.1, mass=1e-3)
    sim = Simulation(scene(target, bullet, boundary="open", step=0.1))
    sim.step()
    assert sim.ledger.impacts == 1
    assert np.linalg.norm(sim.particles.velocity[1]) == pytest.approx(100.0, rel=1e-6)
    assert sim.particles.velocity[1, 0] < 0.0


def after_spheres_met(x, v, mass, reach, time):
    """Positions and velocities at ``time`` of two spheres that meet once before (closed form)."""
    offset, relative = x[1] - x[0], v[1] - v[0]
    a, b, c = relative @ relative, offset @ relative, offset @ offset - reach**2
    met = (-b - math.sqrt(b * b - a * c)) / a
    normal = (offset + met * relative) / reach
    impulse = -2.0 * (relative @ normal) / (1.0 / mass[0] + 1.0 / mass[1])
    after = np.array([v[0] - impulse / mass[0] * normal, v[1] + impulse / mass[1] * normal])
    return x + met * v + (time - met) * after, after


def test_two_bullets_that_cross_each_other_meet():
    """At right angles, 600 diameters a step; one is a little early, so that they graze."""
    x = np.array([(-30.0, 0.01, 0.0), (0.02, -30.03, 0.03)])
    v = np.array([(600.0, 0.0, 0.0), (0.0, 600.0, 0.0)])
    poses = [{"position": tuple(x[k]), "velocity": tuple(v[k])} for k in (0, 1)]
    sim = Simulation(scene(listed("sphere", *poses, size=0.1, mass=1.0), size=(80, 80, 80), boundary="open", step=0.1))
    sim.step()
    position, velocity = after_spheres_met(x, v, (1.0, 1.0), 0.1, 0.1)
    assert sim.ledger.impacts == 1
    assert np.allclose(sim.particles.velocity, velocity, rtol=0, atol=1e-8)
    assert np.allclose(sim.particles.position, position, rtol=0, atol=1e-9)


def test_a_bullet_between_thin_plates_stays_between_them():
    """Plates of a fiftieth of their width leave no way round; the bullet crosses the room a dozen times a step."""
    plate = {"kind": "box", "edges": [0.08, 3.98, 3.98]}
    plates = listed(plate, {"position": (-1, 0, 0)}, {"position": (1, 0, 0)}, mass=50.0)
    bullet = listed("sphere", {"position": (0, 0.3, 0.2), "velocity": (250, 30, -40)}, size=0.2, mass=0.01)
    sim = Simulation(scene(plates, bullet, size=(4, 4, 4), step=0.1))
    before = sim.ledger.energy
    for _ in range(10):
        sim.step()
        left, right, ball = sim.particles.position[:, 0]
        assert -2.0 < left < ball < right < 2.0
        assert overlap_of_any(sim) < 1e-6 * 0.2
    assert sim.ledger.impacts > 50
    assert sim.ledger.energy == pytest.approx(before, rel=1e-12)


@pytest.mark.parametrize("step", ["auto", 0.3])
def test_a_thin_box_that_spins_fast_hits_the_wall_with_its_corner(step):
    """A bar turning about z: the first corner to reach the wall gets j = 2 u / (1/m + y^2/I), u how fast it comes."""
    long, thin, wall, speed, spin = 1.0, 0.05, 2.0, 3.0, 40.0
    bar = listed(
        {"kind": "box", "edges": [long, thin, 0.2]},
        {"position": (0, 0, 0), "velocity": (speed, 0, 0), "spin": (0, 0, spin)},
    )
    sim = Simulation(scene(bar, size=(2 * wall, 8, 8), step=step))
    mass, inertia = sim.particles.mass[0], mass_moment(sim.particles.mass[0], long, thin)

    def corners(time):
        c, s = math.cos(spin * time), math.sin(spin * time)
        return [(x * c - y * s, x * s + y * c) for x in (-long / 2, long / 2) for y in (-thin / 2, thin / 2)]

    def gap(time):
        return wall - speed * time - max(x for x, _ in corners(time))

    times = np.arange(0.0, 1.0, 1e-4)
    first = next(k for k, t in enumerate(times) if gap(t) < 0.0)
    met = brentq(gap, times[first - 1], times[first], xtol=1e-15)
    _, beside = max(corners(met))
    impulse = 2.0 * (speed - spin * beside) / (1.0 / mass + beside**2 / inertia)
    after = speed - impulse / mass, spin + beside * impulse / inertia
    sim.run(duration=met + 1e-3)
    assert sim.ledger.impacts == 1
    assert sim.particles.velocity[0, 0] == pytest.approx(after[0], rel=1e-8)
    assert sim.particles.angular_velocity[0, 2] == pytest.approx(after[1], rel=1e-8)
    assert sim.particles.position[0, 0] == pytest.approx(speed * met + 1e-3 * after[0], abs=1e-9)


def mass_moment(mass, one, two):
    """Moment of inertia of a box about the axis across the edges ``one`` and ``two`` [kg m^2]."""
    return mass * (one**2 + two**2) / 12.0


def test_thin_boxes_that_spin_fast_between_walls_stay_there():
    """A plate and a bar, edges one to twenty, tips far faster than centres, and steps of many turns."""
    plate = listed({"kind": "box", "edges": [1, 1, 0.05]}, {"position": (0, 0, 0.5), "velocity": (0.3, 1, 2)})
    bar = listed({"kind": "box", "edges": [1, 0.05, 0.05]}, {"position": (0, 0, -0.5), "velocity": (0.2, -1, -2)})
    plate["spin"], bar["spin"] = [30.0, 4.0, 7.0], [3.0, 40.0, 7.0]
    sim = Simulation(scene(plate, bar, size=(2, 2, 2), step=0.25))
    before = sim.ledger.energy
    for _ in range(4):
        sim.step()
        assert overlap_of_any(sim) < 1e-6 * 0.05
        assert (np.abs(sim.particles.position) < 1.0).all()
    assert sim.ledger.impacts > 15
    assert sim.ledger.energy == pytest.approx(before, rel=1e-12)


def test_a_ball_knocked_far_off_is_followed_while_others_meet_unforeseen():
    """In one stretch of time: a light ball at rest, knocked to where it had no neighbours, hits the ball there; and a
    ball struck aside hits a neighbour that nobody was heading for."""
    heavy = listed("sphere", {"position": (-3, 0, 0), "velocity": (100, 0, 0)}, mass=1e6)
    far = listed("sphere", {"position": (0, 0, 0)}, {"position": (9, 0, 0)}, mass=1.0)
    aside = [
        {"position": (0, 50, 0), "velocity": (20, 0, 0)},
        {"position": (2, 50.6, 0)},
        {"position": (2.96, 51.32, 0)},
    ]
    # The root mean square speed says how long a stretch may be: these have none.
    resting = [{"position": (3.0 * (k % 60), 3.0 * (k // 60), -40)} for k in range(3000)]
    balls = listed("sphere", *aside, *resting, mass=1.0)
    sim = Simulation(scene(heavy, far, balls, size=(400, 400, 400), boundary="open", step=0.09))
    assert sim._solver.longest_substep(MAX_SUBSTEP_DISPLACEMENT) > 0.09
    sim.step()
    velocity = sim.particles.velocity
    assert sim.ledger.impacts == 4
    assert np.allclose(velocity[1:3, 0], (0.0, 200.0), rtol=0, atol=1e-3)
    # The balls of equal mass swap what they have along the line of centres, (4, 3) / 5.
    assert np.allclose(velocity[3:6, :2], [(7.2, -9.6), (0, 0), (12.8, 9.6)], rtol=0, atol=1e-9)
    assert overlap_of_any(sim) == 0.0


# ---- many at once ------------------------------------------------------------------------------------------------


def test_a_ball_hits_two_that_touch():
    """Momentum and energy with equal pushes along both lines of centres: it rebounds at a fifth of its speed."""
    half, aside = math.sqrt(0.75), 0.5
    pair = listed("sphere", {"position": (0, aside, 0)}, {"position": (0, -aside, 0)})
    cue = listed("sphere", {"position": (-half - 1.0, 0, 0), "velocity": (1, 0, 0)})
    sim = Simulation(scene(cue, pair, boundary="open"))
    sim.run(duration=2.0)
    ahead = 0.6
    across = ahead * aside / half
    assert np.allclose(sim.particles.velocity, [(-0.2, 0, 0), (ahead, across, 0), (ahead, -across, 0)], atol=1e-9)


def test_two_balls_that_roll_up_on_touching_balls_send_two_on():
    row = [{"position": (k, 0, 0)} for k in range(4)]
    coming = [{"position": (k - 6.0, 0, 0), "velocity": (2, 0, 0)} for k in range(2)]
    sim = Simulation(scene(listed("sphere", *coming, *row), boundary="open"))
    sim.run(duration=4.0)
    assert np.allclose(sim.particles.velocity[:4], 0.0, atol=1e-12)
    assert np.allclose(sim.particles.velocity[4:], (2, 0, 0), rtol=0, atol=1e-12)


@pytest.mark.parametrize("shape", ["sphere", "cube"])
def test_a_corner_of_two_or_three_walls_sends_back_where_it_came_from(shape):
    """Aimed so that all walls are met at once: each turns its own part of the velocity round."""
    for velocity in ((3.0, 3.0, 0.0), (-3.0, 3.0, 3.0)):
        sim = Simulation(scene(listed(shape, {"position": (0, 0, 0), "velocity": velocity}), size=(4, 4, 4)))
        sim.run(duration=0.9)
        assert np.allclose(sim.particles.velocity[0], np.negative(velocity), rtol=0, atol=1e-12)
        assert np.allclose(sim.particles.angular_velocity[0], 0.0, atol=1e-12)


@pytest.mark.parametrize("mass", [1e-3, 1.0, 1e3])
def test_a_ball_wedged_between_two_cubes(mass):
    """It comes down where two tilted cubes touch, and what is symmetric stays symmetric."""
    left = {"position": (-math.sqrt(0.5), 0, 0), **turned((0, 1, 0), 45)}
    right = {"position": (math.sqrt(0.5), 0, 0), **turned((0, 1, 0), 45)}
    ball = listed("sphere", {"position": (0, 0, 3), "velocity": (0, 0, -2)}, mass=mass)
    sim = Simulation(scene(listed("cube", left, right, mass=1.0), ball, boundary="open"))
    before = sim.ledger
    sim.run(duration=2.5)
    after = sim.ledger
    one, two, three = sim.particles.velocity
    spins = sim.particles.angular_velocity
    fast = np.abs(sim.particles.velocity).max()
    assert after.impacts >= 2
    assert after.energy == pytest.approx(before.energy, rel=1e-12)
    assert np.allclose(after.momentum, before.momentum, rtol=0, atol=1e-12 * mass)
    assert np.allclose(one, two * (-1, 1, 1), rtol=0, atol=1e-9 * fast)
    assert np.allclose(spins[0], spins[1] * (1, -1, 1), rtol=0, atol=1e-9 * fast)
    assert three[0] == pytest.approx(0.0, abs=1e-9 * fast)
    assert overlap_of_any(sim) < 1e-6


def test_a_ball_caught_between_a_wall_and_a_heavy_one_gets_out():
    """The heavy ball drives the light one against the wall, again and again, until it turns back itself."""
    heavy = listed("sphere", {"position": (-2, 0, 0), "velocity": (1, 0, 0)}, mass=400.0)
    light = listed("sphere", {"position": (1, 0, 0)}, mass=1.0, size=0.5)
    sim = Simulation(scene(heavy, light, size=(6, 6, 6)))
    before = sim.ledger.energy
    sim.run(duration=6.0)
    assert sim.particles.velocity[0, 0] < 0.0
    assert sim.ledger.unresolved == 0
    # As many as fit half a turn of angles 2 atan(sqrt(m / M)) (G. Galperin, Regular Chaotic Dyn. 8 (2003) 375).
    assert sim.ledger.impacts == math.ceil(math.pi / math.atan(math.sqrt(1.0 / 400.0))) - 1
    assert sim.ledger.energy == pytest.approx(before, rel=1e-12)
