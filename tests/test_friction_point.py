"""The impact of one point with friction: against closed forms, and Keller's equations solved by other means."""

import math

import numpy as np
import pytest
from scipy.linalg import expm

from particlesim.dynamics.contact.point_impact import coulomb_impulse, point_impulse, sphere_impulse
from tests.friction import energy_of, keller, law, planar
from tests.kernels import callable_from_python

_coulomb_impulse = callable_from_python(coulomb_impulse)
_point_impulse = callable_from_python(point_impulse)
_sphere_impulse = callable_from_python(sphere_impulse)

RESTITUTIONS = 0.0, 0.3, 0.7, 1.0
FRICTIONS = 0.05, 0.3, 0.8, 2.0, 10.0


def coulomb(inverse_mass, velocity, restitution, friction, static_friction=None):
    """(impulse, what friction took, whether it stuck)"""
    static = friction if static_friction is None else static_friction
    found = _coulomb_impulse(tuple(inverse_mass.ravel()), tuple(velocity), restitution, friction, static)
    return np.array(found[0]), found[1], found[2]


def rough(inverse_mass, velocity, restitution, **surface):
    """(impulse, what friction took) with a whole contact law."""
    impulse, rubbed = _point_impulse(tuple(inverse_mass.ravel()), tuple(velocity), restitution, law(**surface))
    return np.array(impulse), rubbed


def draw(rng):
    """An inverse mass that couples everything, and a velocity that approaches."""
    root = rng.normal(size=(3, 3))
    inverse_mass = root @ root.T + rng.choice([0.001, 0.02, 0.1]) * np.eye(3)
    velocity = rng.normal(size=3)
    return inverse_mass, np.array([-abs(velocity[0]), *velocity[1:]])


def in_a_plane(inverse_mass):
    """A planar inverse mass with a third direction that takes no part, and has another one."""
    whole = np.diag([0.0, 0.0, 1.7])
    whole[:2, :2] = inverse_mass
    return whole


# ---- against Keller's equations and by hand ------------------------------------------------------------------------


@pytest.mark.parametrize("restitution", RESTITUTIONS)
@pytest.mark.parametrize("friction", FRICTIONS)
def test_impacts_follow_kellers_equations(restitution, friction):
    rng = np.random.default_rng([7, round(100 * restitution), round(100 * friction)])
    for k in range(8):
        inverse_mass, velocity = draw(rng)
        if k == 0:
            velocity[1:] = 0.0
        expected = keller(inverse_mass, velocity, restitution, friction)
        impulse, rubbed, stuck = coulomb(inverse_mass, velocity, restitution, friction)
        size = np.abs(expected.impulse).max()
        assert np.allclose(impulse, expected.impulse, rtol=0, atol=3e-9 * size)
        assert rubbed == pytest.approx(expected.rubbed, abs=3e-9 * abs(velocity @ expected.impulse))
        assert stuck == (expected.mode == "stick")


@pytest.mark.parametrize("restitution", RESTITUTIONS)
@pytest.mark.parametrize("friction", FRICTIONS)
def test_a_rod_at_all_angles(restitution, friction):
    """A thin rod whose end strikes a wall, sliding either way or not at all: slip, stick, reversal, and jam.

    Of length 2 and mass 1, at an angle to the wall: moment of inertia 1/3, arm (-cos, -sin).
    """
    modes = set()
    for angle in np.radians(np.arange(5.0, 90.0, 5.0)):
        x, z = -math.cos(angle), -math.sin(angle)
        inverse_mass = np.array([[1.0 + 3.0 * x * x, -3.0 * x * z], [-3.0 * x * z, 1.0 + 3.0 * z * z]])
        for sliding in (-2.0, -0.5, -0.1, 0.0, 0.2, 1.0, 3.0):
            start = np.array([-1.0, sliding])
            expected = planar(inverse_mass, start, restitution, friction)
            impulse, _, _ = coulomb(in_a_plane(inverse_mass), np.array([*start, 0.0]), restitution, friction)
            assert np.allclose(impulse, [*expected, 0.0], rtol=0, atol=1e-11 * np.abs(expected).max())
            after = start + inverse_mass @ expected
            modes.add("stick" if abs(after[1]) < 1e-12 else "back" if after[1] * sliding < 0.0 else "slip")
    assert modes >= ({"slip", "stick"} if friction >= 0.8 else {"slip", "back"})


def test_painleves_rod_jams():
    """So rough and so inclined that sliding on presses the end into the wall: it stops by an impulse of its own.

    However slowly it approaches. While it slides the normal velocity falls by mu c - n for each unit of the impulse,
    until after u / (mu t - c) it has stopped; then it sticks (F. Genot, B. Brogliato, European Journal of Mechanics A
    18 (1999) 653-677).
    """
    angle, friction, sliding = math.radians(60.0), 3.0, -1.0
    x, z = -math.cos(angle), -math.sin(angle)
    along, coupling, across = 1.0 + 3.0 * x * x, -3.0 * x * z, 1.0 + 3.0 * z * z
    assert along + friction * coupling < 0.0
    inverse_mass = in_a_plane(np.array([[along, coupling], [coupling, across]]))
    stopped = -sliding / (coupling + friction * across)
    deepest = (along + friction * coupling) * stopped
    sticking = along - coupling**2 / across
    for approach in (1e-3, 1e-6, 1e-9):
        for restitution in RESTITUTIONS:
            impulse, _, stuck = coulomb(inverse_mass, np.array([-approach, sliding, 0.0]), restitution, friction)
            taken = 0.5 * -deepest * stopped + 0.5 * deepest**2 / sticking
            whole = stopped - deepest / sticking + math.sqrt(2.0 * restitution**2 * taken / sticking)
            assert stuck
            assert impulse[0] == pytest.approx(whole, abs=5.0 * approach)


def test_kanes_and_levinsons_pendulum_gains_nothing():
    """Two rods of length 1 and mass 1 on end, whose tip strikes a rough floor: Newton's restitution makes energy.

    (T. R. Kane, D. A. Levinson, Dynamics: Theory and Applications, 1985, p. 348; W. J. Stronge, Proceedings of the
    Royal Society A 431 (1990) 169-181.) Angles 20 and 30 degrees, angular velocities -0.1 and -0.2 rad/s, e = mu = 1/2.
    """
    one, two = np.radians([20.0, 30.0])
    c = 0.5 * math.cos(two - one)
    mass = np.array([[4.0 / 3.0, c], [c, 1.0 / 3.0]])
    jacobian = np.array([[math.sin(one), math.sin(two)], [math.cos(one), math.cos(two)]])
    inverse_mass = jacobian @ np.linalg.solve(mass, jacobian.T)
    start = jacobian @ np.array([-0.1, -0.2])
    friction = restitution = 0.5
    # Newton: the normal velocity becomes -e of what it was, and friction suffices to leave no sliding.
    by_newton = np.linalg.solve(inverse_mass, [-(1.0 + restitution) * start[0], -start[1]])
    assert abs(by_newton[1]) < friction * by_newton[0]
    before = 0.5 * np.array([-0.1, -0.2]) @ mass @ np.array([-0.1, -0.2])
    assert energy_of(inverse_mass, start, by_newton) > 0.5 * before
    impulse, rubbed, _ = coulomb(in_a_plane(inverse_mass), np.array([*start, 0.0]), restitution, friction)
    expected = planar(inverse_mass, start, restitution, friction)
    assert np.allclose(impulse[:2], expected, rtol=0, atol=1e-10 * np.abs(expected).max())
    gained = energy_of(inverse_mass, start, impulse[:2])
    assert gained < -rubbed < 0.0


def test_what_is_at_rest_across_needs_static_friction_to_stay_so():
    inverse_mass = in_a_plane(np.array([[2.0, 0.9], [0.9, 1.5]]))
    start = np.array([-1.0, 0.0, 0.0])
    needed = 0.9 / 1.5
    held, rubbed, stuck = coulomb(inverse_mass, start, 0.5, 0.4, static_friction=needed + 1e-9)
    assert stuck
    assert rubbed == 0.0
    assert held[1] == pytest.approx(-needed * held[0], rel=1e-12)
    slipping, rubbed, stuck = coulomb(inverse_mass, start, 0.5, 0.4, static_friction=needed - 1e-9)
    assert not stuck
    assert rubbed > 0.0
    assert slipping[1] == pytest.approx(-0.4 * slipping[0], rel=1e-12)


# ---- what holds for all ----------------------------------------------------------------------------------------------


def test_no_point_gains_energy_leaves_its_cone_or_goes_on_approaching():
    rng = np.random.default_rng(11)
    for _ in range(5000):
        inverse_mass, velocity = draw(rng)
        if rng.random() < 0.1:
            inverse_mass = np.diag(np.diag(inverse_mass))
        velocity[1:] *= rng.choice([0.0, 1e-9, 1e-3, 1.0, 1e3])
        velocity[0] *= rng.choice([1e-6, 1.0])
        restitution, friction = rng.choice([0.0, rng.random(), 1.0]), 10.0 ** rng.uniform(-6, 6)
        beta = rng.choice([-1.0, rng.uniform(-1, 1), 0.0, 1.0])
        static = friction * rng.choice([1.0, 1.5])
        impulse, rubbed = rough(
            inverse_mass, velocity, restitution, friction=friction, static_friction=static, tangential_restitution=beta
        )
        scale = abs(velocity) @ abs(impulse) + abs(impulse) @ abs(inverse_mass) @ abs(impulse)
        gained = energy_of(inverse_mass, velocity, impulse)
        assert gained <= 1e-15 * scale
        assert -1e-15 * scale <= rubbed <= -gained + 1e-14 * scale
        assert impulse[0] >= 0.0
        assert math.hypot(*impulse[1:]) <= static * impulse[0] * (1 + 1e-12) + 1e-11 * np.abs(impulse).max()
        rounding = 1e-14 * (np.abs(velocity).sum() + np.abs(inverse_mass) @ np.abs(impulse)).max()
        assert (velocity + inverse_mass @ impulse)[0] >= -rounding


@pytest.mark.parametrize("restitution", RESTITUTIONS)
def test_little_friction_is_nearly_none(restitution):
    rng = np.random.default_rng(3)
    for _ in range(50):
        inverse_mass, velocity = draw(rng)
        smooth = -(1.0 + restitution) * velocity[0] / inverse_mass[0, 0]
        impulse, _, _ = coulomb(inverse_mass, velocity, restitution, 1e-9)
        assert np.allclose(impulse, [smooth, 0.0, 0.0], rtol=0, atol=1e-5 * smooth)


def test_no_direction_is_preferred():
    """The same impact turned about the normal."""
    rng = np.random.default_rng(4)
    for _ in range(50):
        inverse_mass, velocity = draw(rng)
        angle = rng.uniform(0, 2 * math.pi)
        turn = np.eye(3)
        turn[1:, 1:] = [[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]]
        surface = {"friction": 0.5, "tangential_restitution": rng.choice([-0.5, 0.0, 0.5])}
        one, _ = rough(inverse_mass, velocity, 0.6, **surface)
        other, _ = rough(turn @ inverse_mass @ turn.T, turn @ velocity, 0.6, **surface)
        assert np.allclose(other, turn @ one, rtol=0, atol=1e-11 * np.abs(one).max())


# ---- tangential restitution ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("beta", [-1.0, -0.4, 0.0, 0.3, 1.0])
@pytest.mark.parametrize("sliding", [0.0, 0.3, 0.7, 1.3, 2.0, 7.0])
def test_a_sphere_follows_waltons_model(beta, sliding):
    """A homogeneous sphere on a wall: across it the inverse mass is 7/2 of that along the normal.

    It sticks, and then keeps minus beta of its sliding velocity, or takes mu (1 + e) m times the normal velocity.
    """
    restitution, friction = 0.8, 0.25
    velocity = np.array([-1.0, 0.6 * sliding, -0.8 * sliding])
    pressed = 1.0 + restitution
    across = min((1.0 + beta) * sliding / 3.5, friction * pressed)
    expected = [pressed, -0.6 * across, 0.8 * across]
    surface = law(friction=friction, tangential_restitution=beta)
    impulse, rubbed = _sphere_impulse((1.0, 3.5), tuple(velocity), restitution, surface)
    assert np.allclose(impulse, expected, rtol=0, atol=1e-15)
    assert rubbed == pytest.approx(across * sliding - 0.5 * 3.5 * across**2, abs=1e-15)
    # And what is worked out for all shapes agrees.
    general, rubbed_so = rough(
        np.diag([1.0, 3.5, 3.5]), velocity, restitution, friction=friction, tangential_restitution=beta
    )
    assert np.allclose(general, expected, rtol=0, atol=1e-11)
    assert rubbed_so == pytest.approx(rubbed, abs=1e-11)


def test_perfectly_rough_elastic_points_turn_their_velocity_round():
    """With friction enough, whatever the coupling: the relative velocity is reversed, and energy kept."""
    rng = np.random.default_rng(5)
    reversed_ones = 0
    for _ in range(200):
        inverse_mass, velocity = draw(rng)
        expected = -2.0 * np.linalg.solve(inverse_mass, velocity)
        # Friction stops the sliding at once, u exp(-A s); it must not part the bodies meanwhile.
        sliding = np.array([expm(-s * inverse_mass[1:, 1:]) @ velocity[1:] for s in np.geomspace(1e-4, 1e5, 400)])
        ended = np.linalg.solve(inverse_mass[1:, 1:], (velocity[1:] - sliding).T).T
        if (velocity[0] - ended @ inverse_mass[1:, 0]).max() > -1e-3:
            continue
        impulse, _ = rough(inverse_mass, velocity, 1.0, friction=1e12, tangential_restitution=1.0)
        assert np.allclose(impulse, expected, rtol=0, atol=1e-8 * np.abs(expected).max())
        assert abs(energy_of(inverse_mass, velocity, impulse)) <= 1e-8 * abs(velocity @ impulse)
        reversed_ones += 1
    assert reversed_ones > 100
