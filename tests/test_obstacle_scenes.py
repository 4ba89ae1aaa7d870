"""Obstacles that scenes say: where they are at any time, what they do to particles, and the energy that they give."""

import math

import numpy as np
import pytest
import trimesh
from PIL import Image
from scipy.integrate import quad

import particlesim as ps
from particlesim.rendering import Renderer
from particlesim.rendering.look import look_of
from particlesim.setup.build import build
from particlesim.setup.obstacles import poses_at
from particlesim.setup.scene_obstacles import obstacles_of
from tests.worlds import gas, listed, off_a_blade, scene

FREE = {"shape": "sphere", "size": 0.2}


def among(*groups, obstacles, **settings):
    return scene(*(groups or ({**FREE, "count": 0},)), obstacles=list(obstacles), **settings)


def pose(said, time):
    """Position and rotation vector of an obstacle at a time."""
    (b,) = poses_at(obstacles_of(among(obstacles=[said])), time)
    return b["position"], b["orientation"]


def left_over(sim, start):
    """What the ledger does not account for of the energy, as a fraction of what there was at the ``start``."""
    ledger = sim.ledger
    return abs(ledger.energy - start - ledger.work + ledger.dissipated.sum()) / start


# ---- where they are --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("time", [0.0, 0.7, 1.0, 1.3, 2.9, 3.0, 5.0])
def test_what_spins_goes_round_its_centre_from_a_time_until_another(time):
    motion = {"kind": "spin", "axis": [0, 0, 2], "rate": 0.8, "centre": [1, 0, 5], "from": 1.0, "until": 3.0}
    position, q = pose({"shape": "cube", "position": [4, 0, 0], "motion": motion}, time)
    angle = 0.8 * (min(max(time, 1.0), 3.0) - 1.0)
    assert np.allclose(position, [1 + 3 * math.cos(angle), 3 * math.sin(angle), 0], rtol=0, atol=1e-14)
    assert np.allclose(q, [math.cos(angle / 2), 0, 0, math.sin(angle / 2)], rtol=0, atol=1e-14)


@pytest.mark.parametrize("time", [0.0, 0.5, 0.8, 1.6, 4.0])
def test_what_vibrates_begins_where_it_stands_and_stays_where_it_stops(time):
    motion = {"kind": "vibrate", "direction": [0, 3, 4], "amplitude": 0.1, "frequency": 2.0, "phase": 90}
    motion |= {"from": 0.5, "until": 1.6}
    position, _ = pose({"shape": "sphere", "position": [1, 1, 1], "motion": motion}, time)
    t = min(max(time, 0.5), 1.6) - 0.5
    shift = 0.1 * (math.cos(4 * math.pi * t) - 1.0)
    assert np.allclose(position, np.add([1, 1, 1], shift * np.array([0, 0.6, 0.8])), rtol=0, atol=1e-14)


def test_keys_are_gone_through_gently():
    """From key to key along a cycloid, which has no acceleration at its ends, while it turns evenly."""
    keys = [
        {"time": 1.0, "position": [0, 0, 0]},
        {"time": 3.0, "position": [2, 0, 1], "orientation": {"axis": [0, 0, 1], "angle": 90}},
        {"time": 4.0, "position": [2, 5, 1]},
    ]
    said = {"shape": "cube", "position": [9, 9, 9], "motion": {"kind": "keys", "keys": keys}}
    at = {time: pose(said, time) for time in (0.0, 1.0, 1.5, 2.0, 3.0, 3.25, 4.0, 9.0)}
    early = 0.25 - 1.0 / (2.0 * math.pi)
    expected = {0.0: (0, 0, 0), 1.0: (0, 0, 0), 1.5: (2 * early, 0, early), 2.0: (1, 0, 0.5), 3.0: (2, 0, 1)}
    expected |= {3.25: (2, 5 * early, 1), 4.0: (2, 5, 1), 9.0: (2, 5, 1)}
    for time, where in expected.items():
        assert np.allclose(at[time][0], where, rtol=0, atol=1e-13), time
    for time, angle in ((1.5, 22.5), (2.0, 45.0), (4.0, 90.0)):
        half = math.radians(angle) / 2
        assert np.allclose(at[time][1], [math.cos(half), 0, 0, math.sin(half)], rtol=0, atol=1e-13), time


# ---- what they do ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("step", [0.003, 0.2])
def test_a_bat_that_swings_about_a_far_centre_strikes_a_ball(step):
    """It is struck at the time, and as fast, as the angle says; what it has is the bat's work."""
    omega, distance, radius, thick, start = 3.0, 2.0, 0.25, 0.1, -0.6
    ball = {**listed("sphere", {"position": (distance, 0, 0)}), "size": 2 * radius}
    bat = {
        "shape": {"kind": "box", "edges": [2.0, 2 * thick, 1.0]},
        "position": [1.9 * math.cos(start), 1.9 * math.sin(start), 0],
        "orientation": {"axis": [0, 0, 1], "angle": math.degrees(start)},
        "motion": {"kind": "spin", "axis": [0, 0, 1], "rate": omega, "centre": [0, 0, 0], "from": 0.25},
    }
    met, velocity = off_a_blade(omega, distance, radius + thick, start)
    met += 0.25
    sim = ps.Simulation(among(ball, obstacles=[bat], boundary="open", step=step))
    sim.run(duration=met + 0.1)
    assert sim.ledger.impacts == 1
    assert np.allclose(sim.particles.velocity[0], velocity, rtol=0, atol=1e-8)
    assert np.allclose(sim.particles.position[0], [distance, 0, 0] + 0.1 * velocity, rtol=0, atol=1e-8)
    assert sim.ledger.work == pytest.approx(sim.ledger.kinetic, rel=1e-12)


def test_a_piston_that_compresses_a_gas_slowly():
    """Work in turns into heat: dT / T = -2/3 Z dV / V, with the pressure Z of hard spheres; T V^(2/3) as Z goes to 1.

    Z of N. F. Carnahan, K. E. Starling, J. Chem. Phys. 51 (1969) 635.
    """
    count, diameter, edge, speed = 600, 0.04, 2.0, 0.05
    group = {"shape": "sphere", "count": count, "size": diameter, "mass": 1.0}
    group["velocity"] = {"kind": "maxwell", "temperature": 25.0}
    piston = {"shape": {"kind": "plane", "normal": [-1, 0, 0]}, "position": [edge / 2, 0, 0]}
    piston["motion"] = {"kind": "translate", "velocity": [-speed, 0, 0], "until": 20.0}
    sim = ps.Simulation(among(group, obstacles=[piston], size=(edge, edge, edge), seed=3))
    begin = sim.ledger
    sim.run(duration=20.0)
    volumes = count * math.pi * diameter**3 / 6

    def growth(length):
        # What centres cannot reach at the walls is no volume of the gas.
        p = volumes / (length * edge**2)
        return 2.0 / 3.0 * (1 + p + p**2 - p**3) / (1 - p) ** 3 / (length - diameter)

    hotter = math.exp(quad(growth, edge / 2, edge)[0])
    assert hotter == pytest.approx(2 ** (2 / 3), rel=0.03)
    assert sim.ledger.kinetic / begin.kinetic == pytest.approx(hotter, rel=0.02)
    assert left_over(sim, begin.kinetic) < 1e-12
    volume_left = sim.particles.position[:, 0].max() + diameter / 2
    assert volume_left <= 1e-9
    faster = sim.ledger.kinetic
    sim.run(duration=1.0)
    assert sim.ledger.kinetic == pytest.approx(faster, rel=1e-12)


@pytest.mark.parametrize("step", [0.002, 0.02])
def test_a_ball_bounces_in_step_with_a_vibrated_plate(step):
    """One bounce a period T: it is met at g T / 2 and sent off as fast by a plate at V = g T / 2 (1 - e) / (1 + e).

    (N. B. Tufillaro, A. M. Albano, Am. J. Phys. 54 (1986) 939.) The plate gives in each bounce what restitution takes.
    """
    gravity, frequency, e, radius = 9.81, 5.0, 0.8, 0.01
    period = 1 / frequency
    plate_speed = 0.5 * gravity * period * (1 - e) / (1 + e)
    amplitude = 1.05 * plate_speed / (2 * math.pi * frequency)
    phase = math.acos(1 / 1.05)
    plate = {"shape": {"kind": "box", "edges": [1.0, 1.0, 0.2]}, "position": [0, 0, -0.1]}
    plate["motion"] = {"kind": "vibrate", "amplitude": amplitude, "frequency": frequency, "phase": math.degrees(phase)}
    ball = {**listed("sphere", {"position": (0, 0, radius + 1e-9), "velocity": (0, 0, 0.5 * gravity * period)})}
    ball |= {"size": 2 * radius}
    what = among(
        ball, obstacles=[plate], size=(4, 4, 4), boundary="open", gravity=(0, 0, -gravity), restitution=e, step=step
    )
    sim = ps.Simulation(what)
    start = sim.ledger.energy
    for bounce in range(1, 31):
        sim.run_until((bounce + 0.5) * period)
        assert sim.ledger.impacts == bounce
        top = radius + gravity * period**2 / 8
        assert sim.particles.position[0, 2] == pytest.approx(top, abs=1e-4)
    assert left_over(sim, start) < 1e-11
    taken = 0.5 * sim.particles.mass[0] * (0.5 * gravity * period + plate_speed) ** 2 * (1 - e**2)
    assert sim.ledger.dissipated[0] / 30 == pytest.approx(taken, rel=2e-3)


@pytest.mark.parametrize("friction", [0.05, 2.0])
def test_a_ball_that_falls_on_a_conveyor_is_carried_along(friction):
    """Its surface runs at u: sliding, the ball gets mu (1 + e) v of it; sticking, two sevenths (a solid sphere)."""
    u, v, e = 0.7, 3.0, 0.5
    ball = listed("sphere", {"position": (0, 0, 1.0), "velocity": (0, 0, -v)})
    belt = {"shape": {"kind": "box", "edges": [8, 8, 1]}, "position": [0, 0, -0.5], "surface_velocity": [u, 0, 0]}
    sim = ps.Simulation(among(ball, obstacles=[belt], boundary="open", restitution=e, friction=friction))
    start = sim.ledger.kinetic
    sim.run(duration=1.0)
    along = min(friction * (1 + e) * v, 2 / 7 * u)
    assert sim.ledger.impacts == 1
    assert np.allclose(sim.particles.velocity[0], [along, 0, e * v], rtol=0, atol=1e-12)
    assert sim.ledger.work == pytest.approx(along * sim.particles.mass[0] * u, rel=1e-12)
    assert left_over(sim, start) < 1e-14


def test_the_ledger_closes_amid_moving_obstacles_with_friction():
    """What they work, less what restitution, friction and rolling take, is what the particles gain."""
    stirrer = {"shape": {"kind": "box", "edges": [1.2, 0.2, 0.4]}, "position": [0.3, 0, 0]}
    stirrer["motion"] = {"kind": "spin", "axis": [0, 1, 3], "rate": 5.0, "centre": [0, 0, 0], "until": 0.7}
    ram = {"shape": "sphere", "size": 0.3, "position": [0, 0.8, 0.8], "surface_velocity": [0, 0, 2]}
    ram["motion"] = {"kind": "vibrate", "direction": [1, 0, 0], "amplitude": 0.2, "frequency": 1.5, "from": 0.2}
    floor = {"shape": {"kind": "plane", "normal": [0, 0.1, 1]}, "position": [0, 0, -1.1], "name": "floor"}
    what = gas(12, obstacles=[stirrer, ram, floor], friction=0.3, restitution=0.9, rolling_friction=0.01)
    sim = ps.Simulation(what)
    start = sim.ledger.kinetic
    sim.run(duration=1.5)
    assert abs(sim.ledger.work) > 0.01 * start
    assert left_over(sim, start) < 1e-11


def test_the_run_does_not_depend_on_broad_phase_or_threads_or_interruption(tmp_path):
    stirrer = {"shape": {"kind": "box", "edges": [1.2, 0.2, 0.4]}, "position": [0.3, 0, 0]}
    stirrer["motion"] = {"kind": "spin", "axis": [0, 1, 3], "rate": 5.0, "from": 0.05, "until": 0.2}
    sims = [
        ps.Simulation(gas(8, obstacles=[stirrer]), *choice) for choice in (("octree", 1), ("grid", 2), ("naive", 4))
    ]
    for sim in sims:
        sim.run(steps=20)
    sims[0].save(tmp_path / "run.ckpt")
    resumed = ps.Simulation.load(tmp_path / "run.ckpt")
    hashes = set()
    for sim in (*sims, resumed):
        sim.run(steps=60)
        hashes.add(sim.state_hash())
    assert len(hashes) == 1
    assert sims[0].time > 0.2


# ---- where particles start -------------------------------------------------------------------------------------------


def test_particles_are_put_beside_obstacles_at_random():
    block = {"shape": {"kind": "box", "edges": [1, 1, 1]}, "orientation": {"axis": [1, 1, 0], "angle": 30}}
    slope = {"shape": {"kind": "plane", "normal": [1, 0, 1]}, "position": [0, 0, -0.5]}
    crowd = {"shape": "cube", "count": 60, "size": 0.15}
    model = build(among(crowd, obstacles=[block, slope], size=(2, 2, 2)))
    assert len(model.particles) == 60
    height = (model.particles["position"] - [0, 0, -0.5]) @ [1, 0, 1] / math.sqrt(2)
    assert height.min() >= 0.075


@pytest.mark.parametrize("kind", ["sphere", "mesh", "plane"])
def test_a_trajectory_keeps_what_its_obstacles_look_like(kind, tmp_path):
    """It is drawn as the scene is, though the file of a mesh may be gone."""
    corners = np.random.default_rng(3).normal(size=(12, 3))
    mesh = trimesh.convex.convex_hull(corners)
    mesh.export(tmp_path / "rock.stl")
    shape = {"kind": "mesh", "file": tmp_path / "rock.stl"} if kind == "mesh" else kind
    rock = {"shape": shape, "opacity": 0.5, "motion": {"kind": "spin", "axis": [1, 2, 3], "rate": 1.0}}
    floor = {"shape": {"kind": "plane", "normal": [0, 1, 2]}, "position": [0, 0, -4], "colour": "tan"}
    ball = listed("sphere", {"position": (3, 0, 1)}, {"position": (-3, 1, 1)})
    world = {"size": (10, 10, 10), "duration": 0.1, "movie": {"resolution": [160, 96]}, "show": {"readout": False}}
    what = among(ball, obstacles=[rock, floor], **world)
    ps.still(what, tmp_path / "a.png", time=0.1)
    ps.simulate(what, tmp_path / "run.gsd")
    (tmp_path / "rock.stl").unlink()
    ps.still(tmp_path / "run.gsd", tmp_path / "b.png", time=0.1)
    a, b = (np.asarray(Image.open(tmp_path / name)).astype(int) for name in ("a.png", "b.png"))
    # Positions are in single precision there.
    assert (np.abs(a - b).max(axis=2) > 8).mean() < 0.01
    plain = ps.Scene(**{**dict(what), "obstacles": []})
    ps.still(plain, tmp_path / "c.png", time=0.1)
    assert (np.abs(a - np.asarray(Image.open(tmp_path / "c.png"))).max(axis=2) > 8).mean() > 0.05


def test_what_is_seen_through_is_mixed_with_what_is_behind():
    """A ball behind a pane of an opacity: between the picture without it and that of the pane as a wall."""
    ball = listed("sphere", {"position": (-2, 0, 0)}, colour="red")
    pane = {"shape": {"kind": "box", "edges": [0.1, 8, 8]}, "position": [2, 0, 0], "colour": "white"}
    camera = {"kind": "look-at", "position": [12, 0, 1]}
    pictures = []
    for opacity in (0.0, 0.4, 0.8):
        what = among(
            ball,
            obstacles=[{**pane, "opacity": opacity}],
            boundary="open",
            camera=camera,
            movie={"resolution": [96, 64], "quality": "draft"},
            show={"readout": False},
        )
        sim = ps.Simulation(what)
        with Renderer(look_of(what, sim.header, sim.frame())) as renderer:
            pictures.append(renderer.draw(sim.frame())[32, 48].astype(float))
    nothing, some, more = pictures
    assert nothing[0] > 2 * nothing[1]
    assert np.allclose(some, 0.5 * (nothing + more), rtol=0, atol=1.0)
    assert more.min() > 140


def test_a_contact_may_name_an_obstacle():
    ball = {**listed("sphere", {"position": (0, 0, 1), "velocity": (0, 0, -1)}), "name": "ball"}
    table = {"shape": "plane", "name": "table", "restitution": 0.9}
    contact = [{"between": ["ball", "table"], "restitution": 0.3}]
    sim = ps.Simulation(among(ball, obstacles=[table], contact=contact, boundary="open"))
    sim.run(duration=1.0)
    assert sim.particles.velocity[0, 2] == pytest.approx(0.3, abs=1e-14)
