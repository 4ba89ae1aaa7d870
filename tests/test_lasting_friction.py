"""Bodies that lie, slide and roll under gravity and friction, against the closed forms of mechanics."""

import numpy as np
import pytest

from particlesim.simulation.simulation import Simulation
from tests.worlds import listed, scene

G = 9.81

# A wide flat world; a slope is gravity that leans.
WIDE = (4000.0, 4000.0, 10.0)


def leaning(angle, azimuth=0.0):
    """Gravity on a floor that falls off at ``angle`` towards ``azimuth`` [rad]."""
    along = G * np.sin(angle)
    return along * np.cos(azimuth), along * np.sin(azimuth), -G * np.cos(angle)


def on_floor(shape, height, pose=None, **settings):
    """A simulation of one body that touches the floor."""
    body = listed(shape, {"position": (0, 0, -5.0 + height), **(pose or {})})
    return Simulation(scene(body, size=WIDE, restitution=0.0, **settings))


@pytest.mark.parametrize("friction", [0.2, 0.5])
def test_a_block_on_a_slope_stays_up_to_the_angle_of_friction(friction):
    angle = np.arctan(friction)
    still = on_floor("cube", 0.5, gravity=leaning(0.99 * angle, 0.7), friction=friction)
    still.run(duration=5.0)
    assert np.abs(still.particles.position[0] - (0, 0, -4.5)).max() < 1e-6
    slides = on_floor("cube", 0.5, gravity=leaning(1.05 * angle, 0.7), friction=friction)
    slides.run(duration=5.0)
    acceleration = G * (np.sin(1.05 * angle) - friction * np.cos(1.05 * angle))
    way = np.array([np.cos(0.7), np.sin(0.7), 0.0])
    assert slides.particles.position[0] + (0, 0, 4.5) == pytest.approx(12.5 * acceleration * way, rel=1e-6, abs=1e-6)
    assert slides.particles.velocity[0] == pytest.approx(5.0 * acceleration * way, rel=1e-6, abs=1e-6)


def test_what_slides_without_friction_falls_as_far_as_gravity_says():
    sim = on_floor("cube", 0.5, gravity=leaning(0.3))
    sim.run(duration=3.0)
    assert sim.particles.position[0, 0] == pytest.approx(4.5 * G * np.sin(0.3), rel=1e-6)
    assert sim.ledger.energy == pytest.approx(Simulation(sim.scene).ledger.energy, rel=1e-9)


@pytest.mark.parametrize("azimuth", [0.0, 0.4, 1.1])
def test_a_sphere_rolls_down_a_slope_if_friction_holds_it(azimuth):
    angle = 0.4
    way = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    rolls = on_floor("sphere", 0.5, gravity=leaning(angle, azimuth), friction=1.01 * 2.0 / 7.0 * np.tan(angle))
    rolls.run(duration=3.0)
    acceleration = 5.0 / 7.0 * G * np.sin(angle)
    assert rolls.particles.position[0] + (0, 0, 4.5) == pytest.approx(4.5 * acceleration * way, rel=1e-6, abs=1e-6)
    friction = 0.5 * 2.0 / 7.0 * np.tan(angle)
    slips = on_floor("sphere", 0.5, gravity=leaning(angle, azimuth), friction=friction)
    slips.run(duration=3.0)
    acceleration = G * (np.sin(angle) - friction * np.cos(angle))
    assert slips.particles.position[0] + (0, 0, 4.5) == pytest.approx(4.5 * acceleration * way, rel=1e-6, abs=1e-6)
    turning = 2.5 * friction * G * np.cos(angle) / 0.5 * 3.0
    assert slips.particles.angular_velocity[0] == pytest.approx(
        turning * np.array([-way[1], way[0], 0.0]), rel=1e-6, abs=1e-6
    )


def test_a_ball_that_slides_begins_to_roll():
    """At 5/7 of its speed, after 2 v / (7 mu g) (A. Sommerfeld, Mechanics, paragraph 27)."""
    speed, friction = 4.0, 0.3
    at = 2.0 * speed / (7.0 * friction * G)
    ball = on_floor("sphere", 0.5, {"velocity": (speed, 0, 0)}, gravity=(0, 0, -G), friction=friction)
    ball.run(duration=0.98 * at)
    assert ball.particles.velocity[0, 0] == pytest.approx(speed - friction * G * 0.98 * at, rel=1e-9)
    ball.run(duration=0.04 * at)
    assert ball.particles.velocity[0, 0] == pytest.approx(5.0 / 7.0 * speed, rel=1e-6)
    ball.run(duration=1.0)
    assert ball.particles.velocity[0, 0] == pytest.approx(5.0 / 7.0 * speed, rel=1e-6)
    assert ball.particles.angular_velocity[0, 1] == pytest.approx(5.0 / 7.0 * speed / 0.5, rel=1e-6)


def test_a_ball_with_backspin_comes_back():
    """It ends at (5 v - 2 w r) / 7: below 0 here."""
    ball = on_floor("sphere", 0.5, {"velocity": (2, 0, 0), "spin": (0, -20.0, 0)}, gravity=(0, 0, -G), friction=0.2)
    ball.run(duration=4.0)
    assert ball.particles.velocity[0] == pytest.approx(((5 * 2.0 - 2 * 20.0 * 0.5) / 7.0, 0, 0), rel=1e-6, abs=1e-9)


def test_rolling_friction_slows_a_ball_down_and_holds_it():
    lever = 0.01
    ball = on_floor(
        "sphere",
        0.5,
        {"velocity": (2, 0, 0), "spin": (0, 4.0, 0)},
        gravity=(0, 0, -G),
        friction=0.5,
        rolling_friction=lever,
    )
    ball.run(duration=5.0)
    slower = 5.0 / 7.0 * lever * G / 0.5
    assert ball.particles.velocity[0, 0] == pytest.approx(2.0 - 5.0 * slower, rel=1e-6)
    ball.run(duration=20.0)
    assert np.abs(ball.particles.velocity[0]).max() < 1e-12
    assert ball.particles.position[0, 0] == pytest.approx(0.5 * 2.0**2 / slower, rel=1e-3)


def test_static_friction_holds_more_than_what_slides_has():
    """A block stays below the static angle and, once it slides, has the kinetic coefficient."""
    angle = np.arctan(0.5)
    still = on_floor("cube", 0.5, gravity=leaning(angle), friction=0.3, static_friction=0.55)
    still.run(duration=2.0)
    assert np.abs(still.particles.position[0] - (0, 0, -4.5)).max() < 1e-6
    slides = on_floor("cube", 0.5, {"velocity": (1, 0, 0)}, gravity=leaning(angle), friction=0.3, static_friction=0.55)
    slides.run(duration=2.0)
    acceleration = G * (np.sin(angle) - 0.3 * np.cos(angle))
    assert slides.particles.velocity[0, 0] == pytest.approx(1.0 + 2.0 * acceleration, rel=1e-6)


@pytest.mark.parametrize("azimuth", [0.2, 0.9])
def test_friction_prefers_no_direction(azimuth):
    way = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    block = on_floor("cube", 0.5, {"velocity": tuple(3.0 * way)}, gravity=(0, 0, -G), friction=0.4)
    block.run(duration=0.5)
    assert block.particles.velocity[0] == pytest.approx((3.0 - 0.5 * 0.4 * G) * way, rel=1e-6, abs=1e-9)
