"""What has lain still for a while sleeps, and wakes when something happens to it."""

import math

import numpy as np
import pytest

import particlesim as ps
from particlesim.dynamics.contact.lasting_islands import forces_of
from tests.sleepers import G, asleep, check_taken_along
from tests.worlds import listed, scene

GRAVITY = (0.0, 0.0, -G)
FLOOR = {"shape": {"kind": "box", "edges": [40.0, 40.0, 1.0]}, "position": [0, 0, -0.5]}
SHAPES = "sphere", "cube", "tetrahedron"


def standing(*bodies, **settings):
    """A simulation of bodies on a floor at height 0 in an open world."""
    settings = {"boundary": "open", "gravity": GRAVITY, "restitution": 0.0, "obstacles": [FLOOR], **settings}
    return ps.Simulation(scene(*bodies, **settings))


def heap(seed=2, **how):
    """Fifteen bodies of three shapes dropped into a narrow box; none of them rolls for ever."""
    groups = [{"shape": shape, "count": 5, "size": 0.2, "rolling_friction": 2e-3} for shape in SHAPES]
    world = {"size": (0.7, 0.7, 1.4), "gravity": GRAVITY, "restitution": 0.3, "friction": 0.5, "seed": seed}
    return ps.Simulation(scene(*groups, **world), **how)


def left_over(sim, begin):
    """What energy, what was dissipated and what was worked do not add up to since ``begin`` [J]."""
    ledger = sim.ledger
    return ledger.energy + ledger.dissipated.sum() - ledger.work - begin


def borne_by_walls(ledger):
    """The impulse that walls took, (3,) [N s]."""
    walls = ledger.wall_impulse.reshape(3, 2)
    return walls[:, 1] - walls[:, 0] + ledger.wall_shear.sum(axis=0)


@pytest.fixture(scope="module")
def checkpoint(tmp_path_factory):
    """A heap that sleeps, as a file."""
    sim = heap()
    sim.run(duration=5.0)
    path = tmp_path_factory.mktemp("heap") / "asleep.ckpt"
    sim.save(path)
    return path


def test_a_heap_asleep_does_not_move_by_a_bit_in_a_minute(checkpoint):
    sim = ps.Simulation.load(checkpoint)
    assert asleep(sim).all()
    assert sim.ledger.kinetic == 0.0
    start, poses = sim.ledger, (sim.particles.position.tobytes(), sim.particles.orientation.tobytes())
    sim.run(duration=60.0)
    end = sim.ledger
    assert (sim.particles.position.tobytes(), sim.particles.orientation.tobytes()) == poses
    assert end.energy == start.energy
    assert np.array_equal(end.dissipated, start.dissipated)
    weight = sim.particles.mass.sum() * np.array(GRAVITY)
    assert borne_by_walls(end) - borne_by_walls(start) == pytest.approx(60.0 * weight, rel=1e-10, abs=1e-8)
    assert sim.largest_overlap() < 1e-4 * 0.2


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_ledger_closes_while_a_heap_falls_asleep(seed):
    sim = heap(seed)
    start = last = sim.ledger.energy
    for _ in range(40):
        sim.run(duration=0.1)
        ledger = sim.ledger
        assert ledger.energy <= last + 1e-12 * start
        assert abs(left_over(sim, start)) < 1e-12 * start
        given = sim.particles.mass.sum() * np.array(GRAVITY) * sim.time
        assert ledger.momentum + borne_by_walls(ledger) == pytest.approx(given, abs=1e-10 * np.abs(given).max())
        last = ledger.energy
    assert asleep(sim).any()


def test_neither_threads_nor_the_broad_phase_decide_who_sleeps():
    one, two = heap(threads=1, broad_phase="octree"), heap(threads=2, broad_phase="grid")
    for duration in (1.5, 2.5):
        for sim in (one, two):
            sim.run(duration=duration)
        assert one.state_hash() == two.state_hash()
    assert asleep(one).any()


def test_a_heap_asleep_is_gone_on_with_from_a_checkpoint(checkpoint, tmp_path):
    one = ps.Simulation.load(checkpoint)
    one.model.particles["velocity"][0] = 1.0, 0.5, 2.0
    one.run(duration=0.1)
    assert 0 < asleep(one).sum() < len(asleep(one))
    one.save(tmp_path / "half.ckpt")
    two = ps.Simulation.load(tmp_path / "half.ckpt", broad_phase="naive", threads=2)
    for sim in (one, two):
        sim.run(duration=0.5)
    assert one.state_hash() == two.state_hash()


# ---- wakes -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("speed", [0.1, 3.0])
def test_a_ball_at_rest_is_sent_off_by_one_that_hits_it(speed):
    """Equal masses head on, without friction: (1 - e) / 2 and (1 + e) / 2 of the velocity."""
    poses = {"position": (0, 0, 0.5)}, {"position": (-1.0 - 2.0 * speed, 0, 0.5), "velocity": (speed, 0, 0)}
    sim = standing(listed("sphere", *poses), restitution=0.5)
    sim.run(duration=1.5)
    assert asleep(sim).tolist() == [True, False]
    begin = sim.ledger.energy + sim.ledger.dissipated.sum()
    sim.run(duration=1.0)
    assert sim.particles.velocity[:, 0] == pytest.approx((0.75 * speed, 0.25 * speed), rel=1e-6)
    assert not asleep(sim).any()
    assert abs(left_over(sim, begin)) < 1e-12


def test_a_ball_shot_into_a_heap_wakes_what_it_strikes(checkpoint):
    sim = ps.Simulation.load(checkpoint)
    at, top = sim.particles.position.copy(), sim.particles.position[:, 2].argmax()
    ball = sim.model.particles[:1].copy()
    ball["position"], ball["velocity"], ball["id"] = at[top] + (0, 0, 0.4), (0.0, 0.0, -6.0), len(at)
    everyone = np.concatenate([sim.model.particles, ball])
    sim._solver.change_particles(everyone, np.append(np.arange(len(at)), -1))
    begin = last = sim.ledger.energy + sim.ledger.dissipated.sum()
    assert asleep(sim).sum() == len(at)
    moved = np.zeros(len(at), dtype=bool)
    for _ in range(100):
        sim.run(duration=0.01)
        moved |= np.abs(sim.particles.position[:-1] - at).max(axis=1) > 1e-5
        assert sim.ledger.energy <= last + 1e-11 * begin
        assert sim.largest_overlap() < 1e-3 * 0.2
        last = sim.ledger.energy
    assert moved[top] and moved.sum() > 2
    assert abs(left_over(sim, begin)) < 1e-11 * begin
    sim.run(duration=4.0)
    assert asleep(sim).sum() > len(at) // 2


def test_a_plate_that_begins_to_move_takes_along_what_sleeps_on_it():
    """It works m g v, and what lies on it goes as fast, from the step on in which it sets off."""
    speed, until = 0.5, 2.0
    motion = {"kind": "translate", "velocity": [0, 0, speed], "from": until}
    poses = [{"position": (0, 0, 0.5 + k)} for k in range(3)]
    sim = standing(listed("cube", *poses, mass=2.0), obstacles=[{**FLOOR, "motion": motion}], friction=0.5)
    sim.run(duration=until)
    check_taken_along(sim, speed)


def test_a_plate_that_comes_up_from_below_wakes_what_it_reaches():
    cube = listed("cube", {"position": (0, 0, 0.5)})
    sides = [{"shape": {"kind": "box", "edges": [1, 4, 1]}, "position": [x, 0, -0.5]} for x in (-0.8, 0.8)]
    motion = {"kind": "translate", "velocity": [0, 0, 0.5], "from": 2.0}
    lift = {"shape": {"kind": "box", "edges": [0.4, 0.4, 0.4]}, "position": [0, 0, -0.7], "motion": motion}
    sim = standing(cube, obstacles=[*sides, lift], friction=0.5)
    sim.run(duration=2.9)
    assert asleep(sim).all() and sim.particles.position[0, 2] == pytest.approx(0.5, abs=1e-3)
    sim.run(duration=1.1)
    assert sim.particles.position[0, 2] == pytest.approx(1.0, abs=1e-3)
    assert sim.particles.velocity[0] == pytest.approx((0, 0, 0.5), abs=1e-6)


def test_what_loses_its_prop_falls():
    poses = {"position": (0, 0, 0.5)}, {"position": (0, 0, 1.5)}, {"position": (5, 0, 0.5)}
    sim = standing(listed("cube", *poses), friction=0.5)
    sim.run(duration=2.0)
    assert asleep(sim).all()
    solver, height = sim._solver, sim.particles.position[1, 2]
    solver.change_particles(sim.model.particles[1:].copy(), np.array([1, 2]))
    assert asleep(sim).all()
    sim.run(duration=0.3)
    assert sim.particles.position[0, 2] == pytest.approx(height - 0.5 * G * 0.3**2, abs=1e-6)
    assert asleep(sim).tolist() == [False, True]


def test_what_loses_its_prop_to_a_sink_falls():
    prop, plank = {"position": (0, 0, 0.5)}, {"position": (0, 0, 1.05)}
    board = {"kind": "box", "edges": [3.0, 0.5, 0.1]}
    sink = {"region": {"lower": [8, 8, 8], "upper": [9, 9, 9]}}
    sim = standing(listed("cube", prop), listed(board, plank), friction=0.5, sinks=[sink])
    sim.run(duration=2.0)
    assert asleep(sim).all()
    height = sim.particles.position[1, 2]
    sim.particles.position[0] = 8.5, 8.5, 8.5
    sim.step(1e-3)
    assert len(sim.particles.mass) == 1
    sim.run(duration=0.3)
    assert sim.particles.position[0, 2] == pytest.approx(height - 0.5 * G * 0.3**2, abs=2e-2)
    assert not asleep(sim).any()


def test_gravity_that_changes_wakes():
    """Without friction what lay goes off with what gravity has along the floor."""
    sim = standing(listed("cube", {"position": (0, 0, 0.5)}))
    sim.run(duration=2.0)
    assert asleep(sim).all()
    sim.model.system.domain["gravity"] = 0.5, 0.0, -G
    sim.run(duration=1.0)
    assert sim.particles.velocity[0] == pytest.approx((0.5, 0, 0), abs=3e-3)


def test_a_force_that_begins_to_act_wakes():
    sim = standing(listed("cube", {"position": (0, 0, 0.5)}, mass=2.0))
    sim.run(duration=2.0)
    assert asleep(sim).all()
    sim.add_force(lambda particles: np.tile([0.01, 0.0, 0.0], (len(particles.mass), 1)))
    sim.run(duration=4.0)
    assert not asleep(sim).any()
    assert sim.particles.velocity[0] == pytest.approx((0.02, 0, 0), abs=1e-6)


@pytest.mark.parametrize("name", ["velocity", "position"])
def test_what_is_set_from_python_wakes(name):
    sim = standing(listed("cube", {"position": (0, 0, 0.5)}, {"position": (3, 0, 0.5)}))
    sim.run(duration=2.0)
    assert asleep(sim).all()
    getattr(sim.particles, name)[0] += (0.3, 0.0, 0.4)
    sim.step(1e-3)
    assert asleep(sim).tolist() == [False, True]


# ---- what does not sleep ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("excess", "sleeps"), [(1e-2, True), (-1e-3, False)])
def test_a_block_on_a_slope_sleeps_where_friction_holds_it(excess, sleeps):
    """Else it slides with g (sin - mu cos), be that a thousandth of g sin."""
    angle = math.radians(30.0)
    friction = math.tan(angle) * (1.0 + excess)
    gravity = (G * math.sin(angle), 0.0, -G * math.cos(angle))
    sim = standing(listed("cube", {"position": (0, 0, 0.5)}), gravity=gravity, friction=friction)
    sim.run(duration=4.0)
    assert asleep(sim).all() == sleeps
    acceleration = 0.0 if sleeps else G * (math.sin(angle) - friction * math.cos(angle))
    assert sim.particles.velocity[0, 0] == pytest.approx(4.0 * acceleration, abs=1e-5)


def turning(sim, i, angular_velocity):
    """Let ball ``i`` turn."""
    sim.particles.angular_momentum[i] = sim.particles.inertia[i] * angular_velocity


def test_what_spins_and_rolls_goes_on_while_others_sleep():
    poses = {"position": (0, 0, 0.5)}, {"position": (-5, 3, 0.5), "velocity": (0.02, 0, 0)}, {"position": (5, 3, 0.5)}
    sim = standing(listed("sphere", *poses), friction=0.5)
    turning(sim, 0, (0, 0, 3))
    turning(sim, 1, (0, 0.04, 0))
    sim.run(duration=10.0)
    assert asleep(sim).tolist() == [False, False, True]
    assert sim.particles.angular_velocity[0] == pytest.approx((0, 0, 3), abs=1e-9)
    assert sim.particles.velocity[1] == pytest.approx((0.02, 0, 0), abs=1e-9)


@pytest.mark.parametrize("layers", [1, 2])
def test_a_plank_tips_as_a_ball_rolls_along_it(layers):
    """It juts out over a table; it tips when the common centre of mass passes the edge, asleep before or not."""
    table = {"shape": {"kind": "box", "edges": [4, 4, 1]}, "position": [-2, 0, -0.5]}
    planks = [{"position": (-0.5, 0, 0.05 + 0.1 * k)} for k in range(layers)]
    speed, radius, top = 0.2, 0.2, 0.1 * layers
    roll = {"position": (-1.0, 0, top + radius), "velocity": (speed, 0, 0)}
    boards = listed({"kind": "box", "edges": [4.0, 1.0, 0.1]}, *planks, mass=1.0 / layers)
    sim = standing(boards, listed("sphere", roll, size=2.0 * radius, mass=1.0), obstacles=[table], friction=0.5)
    turning(sim, layers, (0, speed / radius, 0))
    tips = (0.5 + 1.0) / speed
    sim.run(duration=tips - 0.1)
    assert abs(sim.particles.orientation[0, 2]) < 1e-6
    sim.run(duration=0.8)
    assert sim.particles.orientation[0, 2] > 1e-3


def test_forces_asleep_are_kept_by_contact():
    """Whoever of two is the first in a contact point: forces are remembered from the lower number to the higher."""
    sim = standing(listed("cube", {"position": (0, 0, 1.5)}, {"position": (0, 0, 0.5)}), friction=0.5)
    sim.run(duration=2.0)
    state, bodies = sim._solver.state, len(sim.model.system.body)
    same = forces_of(state.forces, np.arange(2), bodies, bodies)
    assert np.array_equal(same, state.forces)
    between = state.forces[state.forces["contact"] == 1]
    assert between["force"].sum(axis=0) == pytest.approx((0, 0, -1000.0 * G), rel=1e-6, abs=1e-3)
