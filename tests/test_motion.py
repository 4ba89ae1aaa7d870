"""Free motion against closed forms: the parabola, and Euler's equations."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation
from scipy.special import ellipj, ellipk

from particlesim.model.bodies import angular_velocity_of
from particlesim.model.free_motion import free_rotation
from particlesim.simulation.simulation import Simulation
from tests.kernels import callable_from_python
from tests.worlds import listed, scene

STILL = (1.0, 0.0, 0.0, 0.0)

angular_velocity = callable_from_python(angular_velocity_of)
turned = callable_from_python(free_rotation)


def rotation(q):
    return Rotation.from_quat(np.roll(q, -1))


def body_spin(turn, momentum, moments):
    return rotation(turn).inv().apply(angular_velocity(turn, momentum, moments))


def test_a_thrown_ball_follows_the_parabola():
    thrown = {"position": (1.0, 2.0, 3.0), "velocity": (0.5, -1.0, 4.0)}
    s = scene(listed("sphere", thrown), gravity=(0.1, 0.0, -9.81), boundary="open")
    sim = Simulation(s)
    sim.run(duration=1.3)
    expected = np.array([1.0, 2.0, 3.0]) + 1.3 * np.array([0.5, -1.0, 4.0]) + 0.5 * 1.3**2 * np.array([0.1, 0, -9.81])
    assert sim.time == 1.3
    assert np.allclose(sim.particles.position[0], expected, rtol=0, atol=1e-12)
    assert np.allclose(sim.particles.velocity[0], [0.63, -1.0, 4.0 - 9.81 * 1.3], rtol=0, atol=1e-12)


def test_a_tossed_racket_flips_as_jacobis_functions_say():
    """Torque-free rotation near the middle axis (L. D. Landau, E. M. Lifshitz, Mechanics, 3rd ed., section 37)."""
    moments, momentum = np.array([1.0, 2.0, 3.0]), np.array([0.02, 4.0, 0.0])
    i1, i2, i3 = moments
    energy2, length2 = (momentum**2 / moments).sum(), (momentum**2).sum()
    # Here L^2 < 2 E I_2, where the book's first and third axis change places.
    assert length2 < energy2 * i2
    rate = np.sqrt((i2 - i1) * (energy2 * i3 - length2) / (i1 * i2 * i3))
    parameter = (i3 - i2) * (length2 - energy2 * i1) / ((i2 - i1) * (energy2 * i3 - length2))
    towards_1 = np.sqrt((energy2 * i3 - length2) / (i1 * (i3 - i1)))
    towards_2 = np.sqrt((length2 - energy2 * i1) / (i2 * (i2 - i1)))
    towards_3 = np.sqrt((length2 - energy2 * i1) / (i3 * (i3 - i1)))
    times = 0.01 * np.arange(1, 2001)
    # All of the spin is about the middle axis at the start: a quarter of a period on.
    sn, cn, dn, _ = ellipj(rate * times + ellipk(parameter), parameter)
    expected = np.column_stack([towards_1 * dn, towards_2 * sn, towards_3 * cn])
    turn, seen = STILL, []
    for _ in times:
        turn = turned(turn, tuple(momentum), tuple(moments), 0.01)
        seen.append(body_spin(turn, tuple(momentum), tuple(moments)))
    assert np.allclose(seen, expected, rtol=0, atol=1e-9)
    assert min(spin[1] for spin in seen) < -1.99


@pytest.mark.parametrize(
    "moments", [(1.0, 2.0, 3.0), (2.0, 2.0, 3.0), (3.0, 2.0, 2.0), (2.0, 3.0, 2.0), (1.0, 1.0, 1.0)]
)
def test_rotation_agrees_with_an_integration_of_eulers_equations(moments):
    random = np.random.default_rng(7)
    q = random.normal(size=4)
    q /= np.linalg.norm(q)
    spin = random.normal(size=3)
    inertia = np.array(moments)
    momentum = rotation(q).apply(inertia * rotation(q).inv().apply(spin))

    def rates(_, y):
        w, x, y_, z = y[:4]
        a, b, c = y[4:]
        dq = [-x * a - y_ * b - z * c, w * a + y_ * c - z * b, w * b + z * a - x * c, w * c + x * b - y_ * a]
        return np.concatenate([0.5 * np.array(dq), np.cross(inertia * y[4:], y[4:]) / inertia])

    start = np.concatenate([q, rotation(q).inv().apply(spin)])
    reference = solve_ivp(rates, (0.0, 5.0), start, method="DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
    turn = tuple(q)
    for _ in range(50):
        turn = turned(turn, tuple(momentum), moments, 0.1)
    assert np.allclose(turn, reference[:4], rtol=0, atol=1e-11)
    assert np.allclose(body_spin(turn, tuple(momentum), moments), reference[4:], rtol=0, atol=1e-11)


def test_a_spinning_pyramid_precesses_at_the_closed_form_rate():
    """The axis of a symmetric top circles its angular momentum at L / I_across."""
    sim = Simulation(scene(listed("pyramid", {"position": (0, 0, 0), "spin": (1.0, 0.0, 6.0)}), boundary="open"))
    along, across = sim.particles.inertia[0, 2], sim.particles.inertia[0, 0]
    momentum = sim.particles.angular_momentum[0].copy()
    direction = momentum / np.linalg.norm(momentum)
    axis = np.array([0.0, 0.0, 1.0])
    sim.run(duration=0.7)
    turned = Rotation.from_rotvec(direction * np.linalg.norm(momentum) / across * 0.7).apply(axis)
    assert np.allclose(rotation(sim.particles.orientation[0]).apply(axis), turned, rtol=0, atol=1e-12)
    assert along / across == pytest.approx(0.1 / (0.05 + 3 / 80), rel=1e-12)


@pytest.mark.parametrize("edges", [[1.0, 2.0, 3.0], [1.0, 1.0, 3.0], [1.0, 2.0, 1.0], [0.001, 1.0, 2.0]])
def test_energy_momentum_and_length_are_kept_over_many_steps(edges):
    s = scene(
        listed({"kind": "box", "edges": edges}, {"position": (0, 0, 0), "spin": (0.3, 5.0, 0.2)}), boundary="open"
    )
    sim = Simulation(s)
    before = sim.ledger
    for _ in range(2000):
        sim.step(0.004)
    after = sim.ledger
    assert after.kinetic_rotational == pytest.approx(before.kinetic_rotational, rel=1e-13)
    assert np.array_equal(after.angular_momentum, before.angular_momentum)
    assert np.linalg.norm(sim.particles.orientation[0]) == pytest.approx(1.0, abs=4e-16)


def test_motion_runs_backwards_to_where_it_came_from():
    moments, momentum = (1.0, 2.5, 3.0), (0.4, 3.0, 1.0)
    turn = turned(STILL, momentum, moments, 0.8)
    assert np.allclose(turned(turn, momentum, moments, -0.8), STILL, rtol=0, atol=1e-13)
