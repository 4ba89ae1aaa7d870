"""Bodies on prescribed paths, and numbers of bodies that change: against closed forms."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from particlesim.geometry.shapes import CATALOGUE, half_space
from particlesim.model.materials import Material
from particlesim.setup.build import build
from particlesim.setup.obstacles import Obstacle, Piece
from particlesim.simulation.simulation import Simulation
from tests.worlds import gas, listed, off_a_blade, scene


def obstructed(what, *obstacles, **options):
    return Simulation.of_model(what, build(what, obstacles), **options)


def moving(shape, position, orientation=(1.0, 0.0, 0.0, 0.0), **motion):
    """An obstacle on a path of one piece."""
    return Obstacle(shape, position, orientation, pieces=(Piece(0.0, position, orientation, **motion),))


@pytest.mark.parametrize("step", [0.01, 0.3, 2.0])
@pytest.mark.parametrize("shape", ["sphere", "cube"])
def test_a_ball_and_a_moving_wall(shape, step):
    """A wall at speed u that meets a body at speed v sends it off at 2 u - v; it does not see the time step."""
    ball = listed(shape, {"position": (0, 0, 0), "velocity": (-3, 0, 0)})
    wall = moving(half_space((1.0, 0.0, 0.0)), (-4.0, 0.0, 0.0), velocity=(2.0, 0.0, 0.0))
    sim = obstructed(scene(ball, boundary="open", step=step), wall)
    sim.run(duration=2.0)
    met = (4.0 - 0.5) / (3.0 + 2.0)
    assert sim.ledger.impacts == 1
    assert np.allclose(sim.particles.velocity[0], (7, 0, 0), rtol=0, atol=1e-12)
    assert sim.particles.position[0, 0] == pytest.approx(-3 * met + 7 * (2.0 - met), abs=1e-10)
    assert np.allclose(sim.particles.angular_velocity, 0.0, atol=1e-12)


@pytest.mark.parametrize("step", [0.005, 0.05, 0.5])
def test_a_ball_and_a_wall_that_swings(step):
    """x = A sin(w t): the first touch is the first root of a transcendental equation."""
    amplitude, frequency = 0.3, 7.0
    ball = listed("sphere", {"position": (2.0, 0, 0), "velocity": (-1.5, 0, 0)})
    wall = moving(half_space((1.0, 0.0, 0.0)), (0, 0, 0), amplitude=(amplitude, 0, 0), angular_frequency=frequency)

    def gap(t):
        return 2.0 - 1.5 * t - 0.5 - amplitude * math.sin(frequency * t)

    times = np.linspace(0.0, 2.0, 20001)
    first = int(np.argmax(np.array([gap(t) for t in times]) < 0.0))
    met = brentq(gap, times[first - 1], times[first], xtol=1e-14)
    speed = 2.0 * amplitude * frequency * math.cos(frequency * met) + 1.5
    sim = obstructed(scene(ball, boundary="open", step=step), wall)
    sim.run(duration=met + 0.01)
    assert sim.ledger.impacts == 1
    assert sim.particles.velocity[0, 0] == pytest.approx(speed, abs=1e-8)
    assert sim.particles.position[0, 0] == pytest.approx(2.0 - 1.5 * met + speed * 0.01, abs=1e-9)


@pytest.mark.parametrize("step", [0.001, 0.01, 0.1])
@pytest.mark.parametrize("boundary", ["open", "wall"])
def test_a_ball_and_a_paddle_that_turns(step, boundary):
    """A long thin paddle turns about z and strikes a ball at rest: at the time, and as fast, as the angle says."""
    omega, distance, radius, thick = 3.0, 2.0, 0.25, 0.1
    ball = {**listed("sphere", {"position": (distance, 0, 0)}), "size": 2 * radius}
    paddle = CATALOGUE["box"]((6.0, 2 * thick, 1.0))
    # It starts 0.6 rad short of pointing at the ball, and turns towards it.
    start = -0.6
    blade = moving(
        paddle,
        (0, 0, 0),
        orientation=(math.cos(start / 2), 0.0, 0.0, math.sin(start / 2)),
        angular_velocity=(0, 0, omega),
    )
    met, velocity = off_a_blade(omega, distance, radius + thick, start)
    sim = obstructed(scene(ball, size=(40, 40, 40), boundary=boundary, step=step), blade)
    sim.run(duration=met + 0.1)
    assert sim.ledger.impacts == 1
    assert np.allclose(sim.particles.velocity[0], velocity, rtol=0, atol=1e-8)
    assert np.allclose(sim.particles.position[0], [distance, 0, 0] + 0.1 * velocity, rtol=0, atol=1e-8)
    assert np.allclose(sim.particles.angular_velocity, 0.0, atol=1e-9)


@pytest.mark.parametrize("step", [0.002, 0.05])
def test_a_floor_that_tips_over_meets_a_ball(step):
    """A half-space turns about an axis in its plane: the plane comes within a radius when d sin(angle) = r."""
    omega, distance, radius = 2.0, 3.0, 0.5
    ball = listed("sphere", {"position": (distance, 0, 3.0)})
    start = -0.2
    floor = moving(
        half_space((0.0, 0.0, 1.0)),
        (0, 0, 0),
        orientation=(math.cos(start / 2), 0.0, -math.sin(start / 2), 0.0),
        angular_velocity=(0, -omega, 0),
    )

    def gap(t):
        angle = start + omega * t
        return 3.0 * math.cos(angle) - distance * math.sin(angle) - radius

    met = brentq(gap, 0.0, 1.0, xtol=1e-14)
    angle = start + omega * met
    normal = np.array([-math.sin(angle), 0.0, math.cos(angle)])
    reach = np.array([distance, 0.0, 3.0]) - radius * normal
    at_contact = np.cross((0, -omega, 0), reach) @ normal
    sim = obstructed(scene(ball, boundary="open", step=step), floor)
    sim.run(duration=met + 0.01)
    assert sim.ledger.impacts == 1
    assert np.allclose(sim.particles.velocity[0], 2.0 * at_contact * normal, rtol=0, atol=1e-8)


def test_a_static_obstacle_is_as_hard_as_a_wall():
    """A ball between two slabs bounces for ever; the momentum that it gives them comes back."""
    ball = {**listed("sphere", {"position": (0, 0, 0), "velocity": (1, 0, 0)}), "size": 0.5}
    slab = CATALOGUE["box"]((1.0, 8.0, 8.0))
    slabs = [Obstacle(slab, (side * 2.0, 0, 0), material=Material(1.0)) for side in (-1, 1)]
    sim = obstructed(scene(ball, boundary="open"), *slabs)
    sim.run(duration=50.0)
    assert sim.ledger.impacts == 20  # 1.25 m to the first, then 2.5 m from one to the other
    assert sim.ledger.kinetic == pytest.approx(0.5 * sim.particles.mass[0], rel=1e-13)


def test_the_result_does_not_depend_on_broad_phase_or_threads_with_moving_obstacles():
    hashes = set()
    for method, threads in [("octree", 1), ("grid", 2), ("naive", 4)]:
        # Short enough that nothing is wedged between it and the walls.
        paddle = CATALOGUE["box"]((1.2, 0.2, 0.4))
        blade = moving(paddle, (0, 0, -1.6), velocity=(0, 0, 1.0), angular_velocity=(0, 0, 8.0))
        sim = obstructed(gas(15), blade, broad_phase=method, threads=threads)
        sim.run(duration=1.5)
        hashes.add(sim.state_hash())
    assert len(hashes) == 1
    assert sim.ledger.kinetic > 1.05 * Simulation(gas(15)).ledger.kinetic


def test_particles_may_come_and_go_between_steps():
    """Two groups that never meet: the second is taken out, and comes back; the first goes on as if alone."""
    near = listed("cube", {"position": (-5, 0, 0), "velocity": (1, 0.3, 0)}, {"position": (-2, 0.2, 0)})
    far = listed("sphere", {"position": (7, 7, 7)}, {"position": (5, 7, 7), "velocity": (1, 0, 0)})
    alone, both = (Simulation(scene(*groups, step=0.05)) for groups in ((near,), (near, far)))
    alone.run(steps=60)
    both.run(steps=20)
    everything = both.model.particles.copy()
    both._solver.change_particles(everything[:2].copy(), np.array([0, 1]))
    both.run(steps=20)
    assert len(both.particles.mass) == 2
    impacts = both.particles.impacts.copy()
    back = np.concatenate([both.model.particles, everything[2:]])
    both._solver.change_particles(back, np.array([0, 1, -1, -1]))
    assert both.particles.impacts.tolist() == [*impacts.tolist(), 0, 0]
    both.run(steps=20)
    for name in ("position", "velocity", "orientation", "angular_momentum"):
        assert np.allclose(getattr(both.particles, name)[:2], getattr(alone.particles, name), rtol=0, atol=1e-12), name
    assert both.time == alone.time
