"""Impacts with friction of whole bodies: against closed forms and Keller's equations, and what must hold for all."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from particlesim.dynamics.contact.booking import columns_needed
from particlesim.dynamics.contact.impact import new_moment, resolve_contacts
from particlesim.model.overlap import separation_of
from particlesim.simulation.simulation import Simulation
from tests.friction import keller, law, planar
from tests.kernels import callable_from_python
from tests.worlds import listed, scene

_new_moment = callable_from_python(new_moment)
_resolve_contacts = callable_from_python(resolve_contacts)

SHAPES = (
    "sphere",
    "cube",
    "tetrahedron",
    {"kind": "box", "edges": [1.0, 0.6, 0.2]},
    {"kind": "capsule", "length": 1.0},
    {"kind": "pyramid", "height": 0.8, "rounding": 0.1},
)


def turned(axis, degrees):
    return {"orientation": {"axis": axis, "angle": degrees}}


def struck(shape, *, size=(20.0, 20.0, 4.0), **settings):
    """A body of mass 1 in the middle of a box after its first impact; ``settings`` of the pose go there."""
    pose = {key: settings.pop(key) for key in ("position", "orientation", "velocity", "spin") if key in settings}
    sim = Simulation(scene(listed(shape, {"position": (0, 0, 0), **pose}, mass=1.0), size=size, **settings))
    while sim.ledger.impacts == 0:
        sim.step(0.01)
    assert sim.ledger.impacts == 1
    return sim


# ---- spheres -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("beta", [-0.5, 0.0, 0.45, 1.0])
@pytest.mark.parametrize("spin", [(0.0, 0.0, 0.0), (3.0, -4.0, 2.0), (0.0, 8.0, 0.0)])
@pytest.mark.parametrize("sideways", [0.0, 0.4, 1.5, 6.0])
def test_a_sphere_on_a_wall_sticks_or_slides(sideways, spin, beta):
    """By the tangent of the angle of impact at the point, psi = v_t / v_n; what parts is min(mu (1 + e), 2/7 (1 + beta)

    psi) of friction (S. F. Foerster, M. Y. Louge, H. Chang, K. Allia, Physics of Fluids 6 (1994) 1108-1115).
    """
    restitution, friction, fall = 0.8, 0.15, 2.0
    surface = {"restitution": restitution, "friction": friction, "tangential_restitution": beta}
    sim = struck("sphere", velocity=(sideways, 0.3 * sideways, -fall), spin=spin, **surface)
    arm, inertia = np.array([0.0, 0.0, -0.5]), 0.1
    sliding = (np.array([sideways, 0.3 * sideways, 0.0]) + np.cross(spin, arm)) * [1, 1, 0]
    speed = np.linalg.norm(sliding)
    pushed = np.array([0.0, 0.0, (1.0 + restitution) * fall])
    if speed > 0.0:
        pushed -= min(friction * pushed[2], 2.0 / 7.0 * (1.0 + beta) * speed) * sliding / speed
    velocity, turning = sim.particles.velocity[0], sim.particles.angular_velocity[0]
    assert np.allclose(velocity, np.array([sideways, 0.3 * sideways, -fall]) + pushed, rtol=0, atol=1e-13)
    assert np.allclose(turning, np.array(spin) + np.cross(arm, pushed) / inertia, rtol=0, atol=1e-12)


def test_a_rough_elastic_ball_bounces_to_and_fro_below_a_table():
    """R. L. Garwin's superball (American Journal of Physics 37 (1969) 88-92): thrown below a table it comes back.

    Perfectly rough and elastic between floor and ceiling, from v = (1, 0) and no spin: each impact turns the velocity
    of the point round, so that v_x and r w go to (3 v_x + 4 r w) / 7 and (10 v_x - 3 r w) / 7.
    """
    rough = {"friction": 1e6, "tangential_restitution": 1.0}
    ball = listed("sphere", {"position": (0, 0, 0), "velocity": (1, 0, -2)})
    sim = Simulation(scene(ball, size=(400, 20, 4), boundary="wall", **rough))
    along, around, side = 1.0, 0.0, 1.0
    start = sim.ledger.energy
    for bounce in range(1, 30):
        while sim.ledger.impacts < bounce:
            sim.step(0.05)
        # On the floor a spin about y that rolls to +x is positive; at the ceiling it is the other way round.
        around *= side
        along, around = (3.0 * along + 4.0 * 0.5 * around) / 7.0, (10.0 * along - 3.0 * 0.5 * around) / 7.0 / 0.5
        around *= side
        side = -side
        assert sim.particles.velocity[0, 0] == pytest.approx(along, abs=1e-13)
        assert sim.particles.angular_velocity[0, 1] == pytest.approx(around, abs=1e-12)
        assert sim.ledger.energy == pytest.approx(start, rel=1e-15 * bounce)
        if bounce == 3:
            assert sim.particles.velocity[0, 0] < 0.0


@pytest.mark.parametrize(("size", "ratio"), [(1.0, 1.0), (0.3, 1.0), (1.0, 1e-6), (1.0, 1e6)])
@pytest.mark.parametrize("beta", [0.0, 0.7])
def test_two_spheres_follow_waltons_model(size, ratio, beta):
    restitution, friction, centre = 0.6, 0.2, np.array([1.7, 0.0, 0.0])
    surface = {"restitution": restitution, "friction": friction, "tangential_restitution": beta}
    one = {"position": (0, 0, 0), "velocity": (1.0, 0.5, 0.0), "spin": (2.0, -1.0, 3.0)}
    two = {"position": tuple(centre), "velocity": (-1.0, 0.0, 0.3), "spin": (0.0, 5.0, 1.0)}
    groups = listed("sphere", one, mass=1.0), listed("sphere", two, mass=ratio, size=size)
    sim = Simulation(scene(*groups, boundary="open", **surface))
    reach = 0.5 + 0.5 * size
    apart, closing = centre, np.array([-2.0, -0.5, 0.3])
    half = apart @ closing
    time = (-half - math.sqrt(half**2 - closing @ closing * (apart @ apart - reach**2))) / (closing @ closing)
    normal = (apart + time * closing) / reach
    arms = 0.5 * normal, -0.5 * size * normal
    masses, inertias = np.array([1.0, ratio]), np.array([0.1, 0.1 * ratio * size**2])
    velocities = np.array([one["velocity"], two["velocity"]])
    spins = np.array([one["spin"], two["spin"]])
    points = velocities + np.array([np.cross(w, r) for w, r in zip(spins, arms, strict=True)])
    between = points[1] - points[0]
    normally = between @ normal
    sliding = between - normally * normal
    pressed = -(1.0 + restitution) * normally / (1.0 / masses).sum()
    across = (1.0 / masses).sum() + sum(r @ r / i for r, i in zip(arms, inertias, strict=True))
    speed = np.linalg.norm(sliding)
    pushed = pressed * normal - min(friction * pressed, (1.0 + beta) * speed / across) * sliding / speed
    sim.run(duration=time + 0.01)
    assert sim.ledger.impacts == 1
    for k, sign in enumerate((-1.0, 1.0)):
        after = velocities[k] + sign * pushed / masses[k]
        turning = spins[k] + np.cross(arms[k], sign * pushed) / inertias[k]
        scale = abs(pressed) / masses[k]
        assert np.allclose(sim.particles.velocity[k], after, rtol=1e-12, atol=1e-11 * scale)
        assert np.allclose(sim.particles.angular_velocity[k], turning, rtol=1e-12, atol=1e-10 * scale / size)


# ---- polyhedra and rods on a wall ----------------------------------------------------------------------------------


@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("friction", [0.1, 0.6, 2.0])
@pytest.mark.parametrize("degrees", [5.0, 30.0, 45.0, 60.0, 80.0])
def test_a_capsule_comes_down_on_an_end(degrees, friction, restitution):
    """Its axis in the plane of motion, at all angles: impulses by hand."""
    angle, sideways = math.radians(degrees), -1.2
    sim = struck(
        {"kind": "capsule", "length": 2.0},
        velocity=(sideways, 0, -2),
        size=(20, 20, 6),
        restitution=restitution,
        friction=friction,
        **turned((0, 1, 0), 90.0 - degrees),
    )
    inertia = sim.particles.inertia[0, 0]
    arm = np.array([-math.cos(angle), 0.0, -math.sin(angle) - 0.5])
    inverse_mass = np.eye(2) + np.outer([arm[0], -arm[2]], [arm[0], -arm[2]]) / inertia
    pushed = planar(inverse_mass, np.array([-2.0, sideways]), restitution, friction)
    impulse = np.array([pushed[1], 0.0, pushed[0]])
    assert np.allclose(sim.particles.velocity[0], np.array([sideways, 0.0, -2.0]) + impulse, rtol=0, atol=1e-10)
    turning = np.cross(arm, impulse) / inertia
    assert np.allclose(sim.particles.angular_velocity[0], turning, rtol=0, atol=1e-10)


@pytest.mark.parametrize("seed", range(6))
def test_a_box_comes_down_on_a_corner(seed):
    """Turned at random: impulses by Keller's equations in three dimensions."""
    rng = np.random.default_rng(seed)
    edges = np.array([1.0, 0.7, 0.4])
    turn = Rotation.random(random_state=seed)
    x, y, z, w = turn.as_quat()
    velocity, restitution, friction = np.array([*rng.normal(size=2), -1.5]), rng.random(), rng.choice([0.2, 0.6, 1.5])
    sim = struck(
        {"kind": "box", "edges": edges.tolist()},
        orientation=[w, x, y, z],
        velocity=tuple(velocity),
        restitution=restitution,
        friction=friction,
    )
    corners = 0.5 * edges * np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
    reach = turn.apply(corners)
    arm = reach[np.argmin(reach[:, 2])]
    inertia = turn.as_matrix() @ np.diag([12.0 / (e @ e - e[k] ** 2) for k, e in enumerate([edges] * 3)])
    inverse_inertia = inertia @ turn.as_matrix().T
    lever = np.array([[0, -arm[2], arm[1]], [arm[2], 0, -arm[0]], [-arm[1], arm[0], 0]])
    inverse_mass = np.eye(3) - lever @ inverse_inertia @ lever
    order = [2, 0, 1]
    expected = keller(inverse_mass[np.ix_(order, order)], velocity[order], restitution, friction).impulse[[1, 2, 0]]
    size = np.abs(expected).max()
    assert np.allclose(sim.particles.velocity[0], velocity + expected, rtol=0, atol=1e-8 * size)
    assert np.allclose(sim.particles.angular_momentum[0], np.cross(arm, expected), rtol=0, atol=1e-8 * size)


@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("friction", [0.05, 0.3])
def test_a_cube_comes_down_on_an_edge(friction, restitution):
    """Its middle above the edge: across it the inverse mass is 1 + d^2 / I = 4, and nothing is coupled."""
    settings = {"restitution": restitution, "friction": friction, **turned((0, 1, 0), 45.0)}
    sim = struck("cube", velocity=(1.0, 0, -2), **settings)
    pressed = 2.0 * (1.0 + restitution)
    rubbed = min(friction * pressed, 1.0 / 4.0)
    assert np.allclose(sim.particles.velocity[0], [1.0 - rubbed, 0, -2.0 + pressed], rtol=0, atol=1e-11)
    turning = math.sqrt(0.5) * rubbed * 6.0
    assert np.allclose(sim.particles.angular_velocity[0], [0, turning, 0], rtol=0, atol=1e-11)


@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("friction", [0.02, 0.1])
def test_a_cube_that_lands_flat_slides_on_without_tipping(friction, restitution):
    """The pressure moves forward by mu h until it bears the torque of friction: the cube loses mu (1 + e) v_z."""
    sim = struck("cube", velocity=(1.0, 0.5, -2), restitution=restitution, friction=friction)
    pressed = 2.0 * (1.0 + restitution)
    sliding = np.array([1.0, 0.5, 0.0])
    after = sliding - friction * pressed * sliding / np.linalg.norm(sliding)
    assert np.allclose(sim.particles.velocity[0], [*after[:2], -2.0 + pressed], rtol=0, atol=1e-11)
    assert np.allclose(sim.particles.angular_velocity[0], 0.0, rtol=0, atol=1e-10)


def test_a_cube_that_lands_flat_and_can_stick_stops():
    sim = struck("cube", velocity=(0.5, 0.2, -2), restitution=0.0, friction=0.6)
    assert np.allclose(sim.particles.velocity[0], 0.0, rtol=0, atol=1e-9)
    assert np.allclose(sim.particles.angular_velocity[0], 0.0, rtol=0, atol=1e-9)


@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
def test_a_spinning_cube_that_lands_flat_is_braked_at_its_corners(restitution):
    """By mu m v_z (1 + e) sqrt(1/2), with I = m / 6."""
    friction, spin = 0.05, 2.0
    sim = struck("cube", velocity=(0, 0, -2), spin=(0, 0, spin), restitution=restitution, friction=friction)
    pressed = 2.0 * (1.0 + restitution)
    braked = friction * pressed * math.sqrt(0.5) * 6.0
    assert np.allclose(sim.particles.velocity[0], [0, 0, -2.0 + pressed], rtol=0, atol=1e-11)
    assert np.allclose(sim.particles.angular_velocity[0], [0, 0, spin - braked], rtol=0, atol=1e-10)


@pytest.mark.parametrize("rolling", [0.01, 0.3])
def test_rolling_friction_brakes_what_rolls_by_its_torque_at_most(rolling):
    """A ball that rolls without sliding: only the couple acts, rho m v_z (1 + e), or it ends the rolling."""
    spin, fall, restitution = 4.0, 1.0, 0.5
    surface = {"restitution": restitution, "friction": 0.5, "rolling_friction": rolling}
    sim = struck("sphere", velocity=(0.5 * spin, 0, -fall), spin=(0, spin, 0.7), **surface)
    couple = rolling * (1.0 + restitution) * fall
    left = max(spin - couple / 0.1, 0.0)
    assert np.allclose(sim.particles.velocity[0], [0.5 * spin, 0, restitution * fall], rtol=0, atol=1e-13)
    assert np.allclose(sim.particles.angular_velocity[0], [0, left, 0.7], rtol=0, atol=1e-13)
    assert sim.ledger.dissipated[2] == pytest.approx(0.05 * (spin**2 - left**2), rel=1e-12)


def test_corners_do_not_roll():
    sims = [
        struck("cube", velocity=(1, 0, -2), friction=0.5, rolling_friction=rolling, **turned((1, 2, 3), 40.0))
        for rolling in (0.0, 0.1)
    ]
    assert np.array_equal(*(sim.particles.angular_velocity for sim in sims))


# ---- what holds for all --------------------------------------------------------------------------------------------


def _place(sim, rng, i, j):
    """Bring particle ``i`` near body ``j``, at random or with faces and axes parallel; whether they meet."""
    body, system = sim.model.system.body, sim.model.system
    flat = rng.random() < 0.5
    for k in (i, j):
        if k < system.particles:
            about = Rotation.from_rotvec([0, 0, rng.choice([0.0, rng.uniform(0, 6)])])
            over = Rotation.from_euler("xyz", rng.integers(0, 4, size=3) * 90, degrees=True)
            x, y, z, w = (about * over if flat else Rotation.random(random_state=rng.integers(2**31))).as_quat()
            body["orientation"][k] = w, x, y, z
    direction = np.array([0.0, 0.0, -1.0]) if flat or j >= system.particles else rng.normal(size=3)
    direction /= np.linalg.norm(direction)
    aside = np.cross(direction, rng.normal(size=3)) * rng.choice([0.0, 0.3]) * body["radius"][i]
    body["position"][i] = -3.0 * direction + aside
    if j < system.particles:
        body["position"][j] = 0.0
    for _ in range(100):
        gap = separation_of(system, i, j)
        if gap <= 1e-7:
            return True
        body["position"][i] += 0.999 * gap * direction
    return False


def _weigh(body, ratio):
    """Let a body weigh ``ratio`` as much as with its density."""
    for name, factor in (("mass", ratio), ("inverse_mass", 1 / ratio), ("isotropic_inertia", ratio)):
        body[name] *= factor
    body["principal_inertia"] *= ratio
    body["inverse_inertia"] /= ratio


def _inertia(b):
    x, y, z = b["orientation"][1:]
    turn = Rotation.from_quat([x, y, z, b["orientation"][0]]).as_matrix()
    return turn @ np.diag(1.0 / b["principal_inertia"]) @ turn.T


def _kinetic(b):
    return (
        0.5 * b["mass"] * b["velocity"] @ b["velocity"]
        + 0.5 * b["angular_momentum"] @ _inertia(b) @ b["angular_momentum"]
    )


@pytest.fixture(scope="module")
def crowd():
    """One particle of each shape, of size about 1, in a box whose walls are far away."""
    groups = [listed(shape, {"position": (8.0 * k - 20.0, 5, 5)}, mass=1.0) for k, shape in enumerate(SHAPES)]
    return Simulation(scene(*groups, size=(60, 60, 60), friction=1.0, restitution=0.5))


@pytest.mark.parametrize("seed", range(8))
def test_pairs_of_all_shapes_keep_what_they_must(crowd, seed):
    """Momentum, angular momentum, and energy with all that was dissipated, each cause taking some or nothing."""
    rng = np.random.default_rng(seed)
    system, original = crowd.model.system, crowd.model.system.body.copy()
    moment = _new_moment(system.law)
    patches = 0
    for _ in range(400):
        system.body[:] = original
        i, j = sorted(rng.choice(len(SHAPES), 2, replace=False))
        if rng.random() < 0.3:
            j = system.bounded + 4  # the floor
        if not _place(crowd, rng, i, j):
            continue
        body = system.body
        for k in (i, j) if j < system.particles else (i,):
            _weigh(body[k], 10.0 ** rng.uniform(-3, 3))
            body["velocity"][k] = rng.normal(size=3) * rng.choice([0.01, 1.0])
            body["angular_momentum"][k] = (
                rng.normal(size=3) * body["principal_inertia"][k].mean() * rng.choice([0, 1, 5])
            )
        towards = body["position"][i] - body["position"][j] if j < system.particles else np.array([0, 0, 1.0])
        body["velocity"][i] -= towards / np.linalg.norm(towards) * rng.choice([0.0, 1.0])
        system.law[:] = law(
            restitution=rng.choice([0.0, rng.random(), 1.0]),
            friction=10.0 ** rng.uniform(-3, 3),
            rolling_friction=rng.choice([0.0, 0.1]),
            tangential_restitution=rng.choice([-1.0, rng.uniform(-1, 1), 0.0, 1.0]),
        )
        moment.pair[0] = moment.indices[:2] = i, j
        moment.actor[0], moment.actor[1] = body[i], body[j]
        moment.contact["a"][0], moment.contact["b"][0] = 0, 1
        total = np.zeros(columns_needed(system))
        before = moment.actor[:2].copy()
        _resolve_contacts(system, moment, 1, 2, False, total)
        after = moment.actor[:2]
        patches += moment.contact["count"][0] > 1
        moving = [k for k in (0, 1) if before["mass"][k] < np.inf]
        energies = [[_kinetic(b[k]) for k in moving] for b in (before, after)]
        lost = total[8:11]
        scale = sum(energies[0])
        assert sum(energies[0]) - sum(energies[1]) == pytest.approx(lost.sum(), abs=1e-12 * scale)
        assert lost.min() >= -1e-13 * scale
        if len(moving) == 2:
            mass = before["mass"][:, None]
            pushed = mass * (after["velocity"] - before["velocity"])
            turned = after["angular_momentum"] - before["angular_momentum"]
            rounding = 1e-14 * (np.abs(mass * before["velocity"]) + np.abs(pushed)).sum()
            assert np.allclose(pushed.sum(axis=0), 0.0, rtol=0, atol=rounding)
            about = (np.cross(before["position"], pushed) + turned).sum(axis=0)
            rounding = 5.0 * rounding + 1e-14 * np.abs(before["angular_momentum"]).sum()
            assert np.allclose(about, 0.0, rtol=0, atol=rounding)
        else:
            pushed = before["mass"][0] * (after["velocity"][0] - before["velocity"][0])
            given = total[11 + 12 : 11 + 15] + np.array([0.0, 0.0, -total[2 + 4]])
            rounding = 1e-14 * (before["mass"][0] * np.abs(before["velocity"][0]) + np.abs(given)).sum()
            assert np.allclose(pushed, -given, rtol=0, atol=rounding)
            cone = system.law["friction"][0, 0] * -given[2] * 1.0
            assert math.hypot(*given[:2]) <= cone * (1 + 1e-9) + 1e-11 * np.abs(given).max()
    system.body[:] = original
    assert patches > 50
