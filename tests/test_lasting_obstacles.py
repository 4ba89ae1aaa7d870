"""What rests on obstacles that move, and under fields: against closed forms, with the work that they do."""

import math

import numpy as np
import pytest

import particlesim as ps
from tests.worlds import listed, scene

G = 9.81
MASS = 2.0
FLOOR = {"shape": {"kind": "box", "edges": [40.0, 8.0, 1.0]}, "position": [0, 0, -0.5]}


def block(**pose):
    """A cube of 1 m that lies on what is below 0."""
    return listed("cube", {"position": (0, 0, 0.5), **pose}, mass=MASS)


def standing(*bodies, gravity=(0, 0, -G), **settings):
    """A simulation of bodies on obstacles in an open world, and its energy at the start."""
    sim = ps.Simulation(scene(*bodies, boundary="open", gravity=gravity, **{"restitution": 0.0, **settings}))
    return sim, sim.ledger.energy


def left_over(sim, begin):
    """What energy, what was dissipated and what was worked do not add up to [J]."""
    ledger = sim.ledger
    return ledger.energy + ledger.dissipated.sum() - ledger.work - begin


def test_a_block_comes_to_the_speed_of_a_belt():
    """It slides for v / (mu g), and friction takes as much of the belt's work as it gets: m v^2 / 2."""
    friction, speed = 0.3, 2.0
    until = speed / (friction * G)
    sim, begin = standing(block(), obstacles=[{**FLOOR, "surface_velocity": [speed, 0, 0]}], friction=friction)
    sim.run(duration=0.6 * until)
    assert sim.particles.velocity[0] == pytest.approx((0.6 * speed, 0, 0), abs=1e-9)
    assert sim.ledger.work == pytest.approx(friction * MASS * G * speed * 0.6 * until, rel=1e-9)
    sim.run(duration=1.4 * until)
    assert sim.particles.velocity[0] == pytest.approx((speed, 0, 0), abs=1e-9)
    assert sim.particles.position[0] == pytest.approx((1.5 * speed * until, 0, 0.5), abs=1e-4)
    assert sim.ledger.work == pytest.approx(MASS * speed**2, rel=1e-9)
    assert sim.ledger.dissipated == pytest.approx([0, 0.5 * MASS * speed**2, 0, 0], abs=1e-9)
    assert abs(left_over(sim, begin)) < 1e-12


def test_a_ball_on_a_belt_begins_to_roll():
    """It takes on 2/7 of the belt's speed (the mirror image of a ball thrown onto a floor that stays)."""
    sim, begin = standing(
        listed("sphere", {"position": (0, 0, 0.5)}, mass=MASS),
        obstacles=[{**FLOOR, "surface_velocity": [0, 2.8, 0]}],
        friction=0.4,
    )
    sim.run(duration=1.0)
    assert sim.particles.velocity[0] == pytest.approx((0, 0.8, 0), abs=1e-9)
    assert sim.particles.angular_velocity[0] == pytest.approx((2.0 / 0.5, 0, 0), abs=1e-9)
    assert abs(left_over(sim, begin)) < 1e-12


@pytest.mark.parametrize("shape", [FLOOR["shape"], {"kind": "plane", "normal": [0, 0, 1]}])
def test_a_block_on_a_lift_at_constant_speed(shape):
    """It is struck as the lift sets off; then the lift works m g v."""
    speed = 1.5
    at = [0, 0, -0.5] if shape["kind"] == "box" else [0, 0, 0]
    lift = {"shape": shape, "position": at, "motion": {"kind": "translate", "velocity": [0, 0, speed], "from": 0.5}}
    sim, begin = standing(block(), obstacles=[lift], friction=0.5)
    sim.run(duration=0.6)
    height, work = sim.particles.position[0, 2], sim.ledger.work
    assert height == pytest.approx(0.5 + 0.1 * speed, abs=1e-4)
    sim.run(duration=1.0)
    assert sim.particles.velocity[0] == pytest.approx((0, 0, speed), abs=1e-9)
    assert sim.particles.position[0] == pytest.approx((0, 0, height + speed), abs=1e-9)
    assert sim.ledger.work - work == pytest.approx(MASS * G * speed, rel=1e-9)
    assert sim.ledger.dissipated.sum() == pytest.approx(0.5 * MASS * speed**2, rel=1e-3)
    assert abs(left_over(sim, begin)) < 1e-12


@pytest.mark.parametrize("direction", [(0, 0, 1), (1, 0, 0), (1, 2, 2)])
def test_a_block_rides_on_what_swings_gently(direction):
    """It goes along, and friction and rest take nothing; it works m a . v, and lifts the block."""
    amplitude, frequency = 0.1, 0.4
    tray = {**FLOOR, "motion": {"kind": "vibrate", "direction": direction, "amplitude": amplitude}}
    tray["motion"] |= {"frequency": frequency, "phase": 90.0}
    way = amplitude * np.array(direction) / np.linalg.norm(direction)
    sim, begin = standing(block(position=(0, 0, 0.5)), obstacles=[tray], friction=0.9)
    start = sim.particles.position[0].copy()
    for time in (0.7, 2.5, 4.4):
        sim.run(duration=time - sim.time)
        angle = 2.0 * math.pi * frequency * time
        assert sim.particles.position[0] - start == pytest.approx(way * (math.cos(angle) - 1.0), abs=2e-5)
        velocity = -2.0 * math.pi * frequency * math.sin(angle) * way
        assert sim.particles.velocity[0] == pytest.approx(velocity, abs=1e-5)
        worked = 0.5 * MASS * velocity @ velocity + MASS * G * way[2] * (math.cos(angle) - 1.0)
        assert sim.ledger.work == pytest.approx(worked, abs=1e-3)
    assert np.abs(sim.ledger.dissipated).max() < 1e-3
    assert abs(left_over(sim, begin)) < 1e-12


@pytest.mark.parametrize("shape", [FLOOR["shape"], {"kind": "plane", "normal": [0, 0, 1]}])
def test_a_block_on_a_plate_that_tilts_slides_at_the_angle_of_friction(shape):
    friction, rate = 0.4, 0.1
    at = [0, 0, -0.5] if shape["kind"] == "box" else [0, 0, 0]
    plate = {
        "shape": shape,
        "position": at,
        "motion": {"kind": "spin", "axis": [0, 1, 0], "rate": rate, "centre": [0, 0, 0]},
    }
    sim, begin = standing(block(), obstacles=[plate], friction=friction)
    angle = math.atan(friction)
    slid = []
    for turned in (0.97 * angle, 1.06 * angle):
        sim.run(duration=turned / rate - sim.time)
        along = np.array([math.cos(turned), 0.0, -math.sin(turned)])
        slid.append(sim.particles.position[0] @ along)
    assert abs(slid[0]) < 2e-3
    # From the angle of friction on: g (sin - mu cos) grows by g rate / cos, and its way as the third power of time.
    time = 0.06 * angle / rate
    assert slid[1] - slid[0] == pytest.approx(G * rate * time**3 / (6.0 * math.cos(angle)), rel=0.1)
    assert abs(left_over(sim, begin)) < 1e-6 * MASS * G


def test_a_block_stays_where_it_is_on_a_turntable_that_can_hold_it():
    """Up to w^2 r = mu g; it goes round as a whole, and nothing is dissipated."""
    radius, friction, turns = 2.0, 0.5, 0.9
    rate = turns * math.sqrt(friction * G / radius)
    table = {**FLOOR, "shape": {"kind": "box", "edges": [8.0, 8.0, 1.0]}}
    table["motion"] = {"kind": "spin", "axis": [0, 0, 1], "rate": rate}
    moving = {"position": (radius, 0, 0.5), "velocity": (0, rate * radius, 0), "spin": (0, 0, rate)}
    sim, begin = standing(block(**moving), obstacles=[table], friction=friction)
    sim.run(duration=10.0)
    x, y, _ = sim.particles.position[0]
    assert math.hypot(x, y) == pytest.approx(radius, rel=1e-3)
    assert abs(math.remainder(math.atan2(y, x) - 10.0 * rate, 2.0 * math.pi)) < 1e-3
    assert sim.particles.angular_velocity[0] == pytest.approx((0, 0, rate), abs=1e-3)
    assert abs(left_over(sim, begin)) < 1e-9


# ---- fields ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("restitution", [0.0, 0.5])
@pytest.mark.parametrize("by_force", [False, True])
def test_a_field_holds_a_body_on_the_floor_as_gravity_does(restitution, by_force):
    """It lies still, and begins to slide as one under gravity would: friction is mu m a."""
    friction, along = 0.3, 4.0
    acceleration = np.array([along, 0.0, -G])
    what = scene(
        block(),
        fields=[] if by_force else [{"kind": "uniform", "acceleration": acceleration.tolist()}],
        obstacles=[FLOOR],
        boundary="open",
        restitution=restitution,
        friction=friction,
        step=1e-3,
    )
    sim = ps.Simulation(what)
    if by_force:
        sim.add_force(lambda particles: particles.mass[:, None] * acceleration)
    sim.run(duration=1.0)
    slides = along - friction * G
    assert sim.particles.velocity[0] == pytest.approx((slides, 0, 0), abs=2e-2)
    speed, at = sim.particles.velocity[0, 0], sim.particles.position[0, 0]
    sim.run(duration=1.0)
    assert sim.particles.velocity[0] == pytest.approx((speed + slides, 0, 0), abs=1e-9)
    assert sim.particles.position[0, 0] - at == pytest.approx(speed + 0.5 * slides, rel=1e-6)
    assert sim.particles.position[0, 2] == pytest.approx(0.5, abs=1e-4)
    assert abs(left_over(sim, 0.0)) < 1e-9


def test_a_body_lies_still_under_gravity_and_a_wind_that_cannot_move_it():
    wind = {"kind": "drag", "coefficient": 3.0, "velocity": [0.9 * 0.3 * MASS * G / 3.0, 0, 0]}
    sim, _ = standing(block(), obstacles=[FLOOR], fields=[wind], friction=0.3)
    sim.run(duration=5.0)
    assert np.abs(sim.particles.position[0] - (0, 0, 0.5)).max() < 1e-4
    assert np.abs(sim.particles.velocity[0]).max() < 1e-3


def test_drag_slows_a_sliding_block_down():
    """m v' = -c v - mu m g: it stands still after (m / c) log(1 + c v / (mu m g))."""
    drag, friction, speed = 1.0, 0.2, 4.0
    sim, begin = standing(
        block(velocity=(speed, 0, 0)),
        obstacles=[FLOOR],
        fields=[{"kind": "drag", "coefficient": drag, "velocity": [0, 0, 0]}],
        friction=friction,
    )
    last = friction * MASS * G / drag
    until = MASS / drag * math.log(1.0 + speed / last)
    sim.run(duration=0.5 * until)
    slower = (speed + last) * math.exp(-drag / MASS * 0.5 * until) - last
    assert sim.particles.velocity[0, 0] == pytest.approx(slower, rel=1e-5)
    sim.run(duration=0.6 * until)
    assert np.abs(sim.particles.velocity[0]).max() < 1e-9
    way = MASS / drag * (speed - last * math.log(1.0 + speed / last))
    assert sim.particles.position[0, 0] == pytest.approx(way, rel=1e-5)
    assert abs(left_over(sim, begin)) < 1e-9
