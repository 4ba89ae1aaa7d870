"""Bodies that would be in each other at the end of a step are pushed apart there, and nothing else changes."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from particlesim.dynamics.contact.clearance import changes_ahead
from particlesim.dynamics.contact.cone_solver import MOVER
from particlesim.dynamics.contact.contact_records import CONTACT_POINT, CONTACT_TERMS
from particlesim.dynamics.contact.island_step import Islands
from particlesim.dynamics.contact.movers import write_mover
from particlesim.dynamics.contact.position_correction import correct_positions
from particlesim.dynamics.settings import CORRECTED_DEPTH, HELD_BACK_DEPTH
from particlesim.model.bodies import angular_velocities
from particlesim.setup.build import build
from particlesim.setup.obstacles import Obstacle
from tests.kernels import callable_from_python
from tests.meshes import ground
from tests.touching import contact_of, nearly_touching
from tests.worlds import listed, scene

correct = callable_from_python(correct_positions)
write = callable_from_python(write_mover)


def island(system):
    """The island of two bodies that are in contact somewhere."""
    points, terms = np.zeros(1, dtype=CONTACT_POINT), np.zeros(1, dtype=CONTACT_TERMS)
    points["b"], terms["inradius"] = 1, system.body["inradius"][:2].min()
    terms["separation"], contact, _ = contact_of(system, system.body)
    points["normal"] = contact["normal"]
    return Islands(np.array([0, 1]), points, terms, np.array([0, 2]), np.arange(2), np.zeros((1, 4)), np.zeros(1))


def corrected(sim, depth):
    """Two bodies that would be so deep in each other [inradii]: records ahead before and after, and if held back."""
    system = sim.model.system
    _, contact, _ = contact_of(system, system.body)
    ahead = system.body.copy()
    ahead["position"][1] -= depth * system.body["inradius"].min() * contact["normal"]
    mover, before = np.zeros(2, dtype=MOVER), ahead.copy()
    for k in range(2):
        write(mover[k], system.body[k], k)
    held = correct(system, island(system), mover, (0, 1), ahead, 2)
    return before, ahead, held


SHAPES = [("sphere", "sphere"), ("sphere", "cube"), ("pyramid", "sphere"), ("cube", "pyramid"), ("cube", "cube")]


@pytest.mark.parametrize("shapes", SHAPES)
def test_what_is_in_each_other_a_little_is_pushed_apart(shapes):
    for seed in range(20):
        sim = nearly_touching(seed, shapes)
        system, mass = sim.model.system, sim.particles.mass
        before, ahead, held = corrected(sim, 0.02)
        assert not held
        assert contact_of(system, ahead)[0] >= -CORRECTED_DEPTH * system.body["inradius"].min()
        for name in ("velocity", "angular_momentum"):
            assert np.array_equal(ahead[name], before[name])
        moved = mass @ (ahead["position"] - before["position"])
        assert np.abs(moved).max() < 1e-12 * mass.sum()
        for k, shape in enumerate(shapes):
            if shape == "sphere":
                assert np.allclose(ahead["orientation"][k], before["orientation"][k], rtol=0, atol=1e-9)


@pytest.mark.parametrize("shapes", SHAPES)
def test_what_is_deep_in_each_other_collides_and_is_held_back(shapes):
    for seed in range(20):
        sim = nearly_touching(seed, shapes)
        system, mass = sim.model.system, sim.particles.mass
        before, ahead, held = corrected(sim, 0.5)
        assert held
        assert contact_of(system, ahead)[0] >= -HELD_BACK_DEPTH * system.body["inradius"].min()
        given = mass @ (ahead["velocity"] - before["velocity"])
        assert np.abs(given).max() < 1e-12 * mass.sum()
        energies = [(mass * (b["velocity"] ** 2).sum(axis=1)).sum() for b in (before, ahead)]
        turned = [(b["angular_momentum"] ** 2 / b["principal_inertia"]).sum() for b in (before, ahead)]
        if all(shape in ("sphere", "cube") for shape in shapes):
            assert energies[1] + turned[1] <= (energies[0] + turned[0]) * (1.0 + 1e-12)


@pytest.mark.parametrize("shape", ["sphere", "cube"])
@pytest.mark.parametrize("way", [0.2, 0.6, 3.0])
def test_what_would_be_beyond_a_sheet_is_held_back_on_its_side(shape, way):
    """Its middle before the sheet, behind it, or all of it: there nothing touches, and it must not be pushed on."""
    lying = scene(listed(shape, {"position": (0.1, 0.2, 0.2501)}, size=0.5), boundary="open", restitution=0.0)
    system = build(lying, [Obstacle(ground(6, 2.0), (0, 0, 0))]).system
    points, terms = np.zeros(1, dtype=CONTACT_POINT), np.zeros(1, dtype=CONTACT_TERMS)
    points["b"], terms["inradius"], terms["separation"] = 1, 0.25, 1e-4
    islands = Islands(
        np.array([0, 1]), points, terms, np.array([0, 1]), np.zeros(1, np.int64), np.zeros((1, 4)), np.zeros(1)
    )
    ahead, mover = system.body.copy(), np.zeros(2, dtype=MOVER)
    ahead["position"][0, 2] -= way
    ahead["velocity"][0] = 0.0, 0.0, -240.0 * way
    for k, row in enumerate((0, -1)):
        write(mover[k], system.body[k], row)
    assert correct(system, islands, mover, (0, 1), ahead, 1)
    assert -HELD_BACK_DEPTH * 0.25 <= ahead["position"][0, 2] - 0.25 <= 1e-4
    assert ahead["velocity"][0] == pytest.approx(np.zeros(3), abs=1e-9 * 240.0 * way)


def test_what_does_not_go_as_its_velocity_says_is_seen_to_change():
    """Velocities and angular momenta ahead are those of before: only where bodies are tells that they are held back."""
    system, duration = nearly_touching(3, ("cube", "tetrahedron")).model.system, 1.0 / 240.0
    system.body["velocity"][:2] = (3.0, 0.0, 4.0), (0.0, -2.0, 0.0)
    system.body["angular_momentum"][:2] = (2e-4, 0.0, 1e-4), (0.0, 3e-4, 0.0)
    spin = angular_velocities(system.body, 2)
    held = changes_ahead(system, spin, duration, np.arange(2), system.body.copy())
    radius = system.body["radius"][:2]
    assert np.allclose(held[:2], (5.0, 2.0) + np.linalg.norm(spin, axis=1) * radius, rtol=1e-12)

    ahead = system.body.copy()
    ahead["position"][:2] += duration * system.body["velocity"][:2]
    for k in range(2):
        turn = Rotation.from_rotvec(duration * spin[k])
        ahead["orientation"][k] = (turn * orientation_of(system.body[k])).as_quat(scalar_first=True)
    free = changes_ahead(system, spin, duration, np.arange(2), ahead)
    assert (free[:2] < 1e-3 * held[:2]).all()


def orientation_of(body):
    """The orientation of a body's record, as scipy has it."""
    return Rotation.from_quat(body["orientation"], scalar_first=True)
