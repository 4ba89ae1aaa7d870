"""Stacks and heaps: what stands on each other, leans on each other or falls on what lies comes to rest."""

import numpy as np
import pytest

from particlesim.core.constants import MAX_MANIFOLD
from particlesim.core.math3d import quat_to_matrix
from particlesim.dynamics.contact.contact_records import CONTACT_POINT, CONTACT_TERMS
from particlesim.dynamics.contact.island_step import Islands
from particlesim.dynamics.contact.lasting_islands import warm_start
from particlesim.dynamics.solver_state import FORCE
from particlesim.geometry import shapes
from particlesim.geometry.narrow_phase.contact_manifold import contact_manifold
from particlesim.geometry.shape_table import stack_shapes
from particlesim.simulation.simulation import Simulation
from tests.kernels import callable_from_python
from tests.worlds import listed, scene

call_contact_manifold = callable_from_python(contact_manifold)
call_quat_to_matrix = callable_from_python(quat_to_matrix)

GRAVITY = (0.0, 0.0, -9.81)
SHAPES = ("sphere", "cube", "pyramid")


def followed(what, duration, pieces):
    """The simulation after ``duration``, the ledgers at the start and after each piece, and the largest overlap."""
    sim = Simulation(what)
    ledgers, overlaps = [sim.ledger], [sim.largest_overlap()]
    for _ in range(pieces):
        sim.run(duration=duration / pieces)
        ledgers.append(sim.ledger)
        overlaps.append(sim.largest_overlap())
    return sim, ledgers, max(overlaps)


def only_falls(ledgers):
    """Whether no energy is gained, but for what is left where the impulses are no longer made better (settling.py)."""
    energies = np.array([ledger.energy for ledger in ledgers])
    return (np.diff(energies) <= 1e-11 * energies[0]).all()


def energy_unaccounted(ledgers):
    """What the energies at the start and in the end, and what was dissipated, do not add up to, as a fraction."""
    first, last = ledgers[0], ledgers[-1]
    return abs(last.energy + last.dissipated.sum() - first.energy) / first.energy


def momentum_unaccounted(sim, ledgers):
    """What momentum, gravity and walls do not add up to, as a fraction of what gravity gave."""
    first, last = ledgers[0], ledgers[-1]
    walls = last.wall_impulse.reshape(3, 2)
    weight = sim.particles.mass.sum() * np.array(GRAVITY)
    given = last.momentum - first.momentum + walls[:, 1] - walls[:, 0]
    return np.abs(given - weight * last.time).max() / np.abs(weight * last.time).max()


def heap(count, *, seed=1, size=(0.8, 0.8, 2.0), **settings):
    """Spheres, cubes and pyramids poured into a narrow box."""
    groups = [{"shape": shape, "count": count, "size": 0.2, "restitution": 0.5} for shape in SHAPES]
    return scene(*groups, size=size, gravity=GRAVITY, restitution=0.5, seed=seed, **settings)


@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_a_tower_of_cubes_stands(restitution):
    poses = [{"position": (0, 0, -4.4 + 1.05 * k)} for k in range(6)]
    tower = scene(listed("cube", *poses), size=(10, 10, 10), gravity=GRAVITY, restitution=restitution)
    sim, ledgers, overlap = followed(tower, 2, 20)
    assert only_falls(ledgers)
    assert overlap < 1e-4
    assert sim.ledger.kinetic < 1e-6 * ledgers[0].energy
    assert np.allclose(sim.particles.position[:, 2], -4.5 + np.arange(6), rtol=0, atol=1e-3)
    assert momentum_unaccounted(sim, ledgers) < 1e-12
    assert sim.ledger.unresolved == 0


def test_cubes_laid_as_bricks_carry_each_other():
    poses = [
        {"position": (1.1 * (k - 0.5 * (2 - level)), 0, -4.5 + level)} for level in range(3) for k in range(3 - level)
    ]
    wall = scene(listed("cube", *poses), size=(10, 10, 10), gravity=GRAVITY, restitution=0.5)
    sim, ledgers, _ = followed(wall, 1, 5)
    start = np.array([pose["position"] for pose in poses])
    assert only_falls(ledgers)
    assert np.allclose(sim.particles.position, start, rtol=0, atol=1e-6)
    assert momentum_unaccounted(sim, ledgers) < 1e-12


def test_what_lands_without_rebound_is_not_lifted_again():
    dropped = {"position": (0, 0, 0.2), "orientation": {"axis": (1, 2, 0.5), "angle": 40}}
    for shape in SHAPES:
        sim, ledgers, overlap = followed(
            scene(listed(shape, dropped), size=(4, 4, 4), gravity=GRAVITY, restitution=0.0), 4, 40
        )
        assert only_falls(ledgers)
        assert overlap < 1e-4
        assert sim.ledger.kinetic < 1e-12 * ledgers[0].energy
        assert momentum_unaccounted(sim, ledgers) < 1e-12


def test_a_heap_of_all_shapes_calms_down():
    sim, ledgers, overlap = followed(heap(10), 3, 30)
    assert only_falls(ledgers)
    assert sim.ledger.kinetic < 0.02 * max(ledger.kinetic for ledger in ledgers)
    # What still moves may be held back in what it would have sunk into; what lies may not.
    assert overlap < 1e-3 * 0.2
    assert sim.largest_overlap() < 1e-4 * 0.2
    assert momentum_unaccounted(sim, ledgers) < 1e-12
    assert energy_unaccounted(ledgers) < 1e-6


def test_a_heap_thrown_together_is_worked_through():
    """Nothing sinks into anything, at whatever moment one looks; the bound on the work is reached in few of them."""
    sim, ledgers, overlap = followed(heap(6, size=(0.6, 0.6, 2.0)), 2, 1600)
    assert only_falls(ledgers)
    assert overlap < 1e-4 * 0.2
    assert sim.ledger.unresolved < 0.01 * sim.steps


@pytest.mark.parametrize("step", [1 / 1000, 1 / 240, 1 / 60])
@pytest.mark.parametrize(("speed", "gravity", "seed"), [(0.0, 9.81, 1), (10.0, 9.81, 5), (10.0, 98.1, 3)])
def test_nothing_sinks_in_farther_whatever_the_time_step(step, speed, gravity, seed):
    """Shocks go through heaps that are dropped or thrown into a corner, and deflect more than was expected."""
    size = 0.08
    groups = [
        {"shape": shape, "count": 20, "size": size, "velocity": (0.3 * speed, 0.0, -speed)}
        for shape in ("sphere", "cube", "tetrahedron")
    ]
    box, pull = (0.4, 0.4, 0.8), (0, 0, -gravity)
    sim = Simulation(scene(*groups, size=box, gravity=pull, restitution=0.3, friction=0.5, seed=seed, step=step))
    for _ in range(36):
        sim.run(duration=1 / 60)
        assert sim.largest_overlap() < 1e-3 * size


def test_forces_go_to_the_nearest_points_of_the_same_contact():
    """The corners of a patch come in any order, and may be fewer or more than before; no force is lost."""
    points, terms = np.zeros(4, dtype=CONTACT_POINT), np.zeros(4, dtype=CONTACT_TERMS)
    points["a"], points["b"] = [0, 0, 1, 2], [3, 3, 7, 9]
    points["arm_a"][:, 0] = 1.0, 2.0, 5.0, 1.1
    before = np.zeros(5, dtype=FORCE)
    before["contact"] = np.array([3, 3, 3, 8, 17])
    before["arm"][:, 0] = 2.1, 1.2, 0.8, 5.0, -4.0
    before["force"][:, 2] = before["torque"][:, 1] = 10.0, 20.0, 30.0, 40.0, 50.0
    bounds = np.array([0, 4])
    warm_start(Islands(bounds, points, terms, bounds, np.arange(4), np.zeros((1, 4)), np.zeros(1)), before, 10)
    assert terms["force"][:, 2].tolist() == [50.0, 10.0, 50.0, 0.0]
    assert terms["torque"][:, 1].tolist() == [50.0, 10.0, 50.0, 0.0]


def test_a_heap_is_the_same_for_every_broad_phase_and_number_of_threads():
    hashes = set()
    for method, threads in [("octree", 1), ("grid", 2), ("naive", 3)]:
        sim = Simulation(heap(5, size=(0.6, 0.6, 2.0)), broad_phase=method, threads=threads)
        sim.run(duration=0.6)
        hashes.add(sim.state_hash())
    assert len(hashes) == 1
    assert sim.ledger.impacts > 0


def test_a_ball_keeps_its_speed_along_what_it_rests_on():
    """There is no friction: what slides on the floor, and on a body that lies there, goes on sliding."""
    slab = listed({"kind": "box", "edges": [4.0, 4.0, 0.5]}, {"position": (0, 0, -1.75)})
    ball = listed("sphere", {"position": (-1, 0, -1.25), "velocity": (0.5, 0, 0)}, size=0.5)
    sim, ledgers, _ = followed(scene(slab, ball, size=(4, 4, 4), gravity=GRAVITY, restitution=0.5), 2, 10)
    assert only_falls(ledgers)
    assert np.allclose(sim.particles.velocity[1], (0.5, 0, 0), rtol=0, atol=1e-6)
    assert sim.particles.position[1, 0] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("first", [0, 1])
def test_an_inclined_face_over_another_comes_nowhere_nearer_than_it_is(first):
    """A cube that leans over the flat top of another: the nearest of its points is one of its own, not beyond them."""
    lean, lift = np.array([np.cos(0.05), 0.0, np.sin(0.05), 0.0]), 1e-3
    orientations = [(1.0, 0.0, 0.0, 0.0), tuple((lean / np.linalg.norm(lean)).tolist())]
    lowest = float(np.min(shapes.cube().vertices @ np.reshape(call_quat_to_matrix(orientations[1]), (3, 3))[2]))
    offset, normal = np.array([-0.2, 0.0, 0.5 + lift - lowest]), np.array([0.0, 0.0, 1.0])
    if first:
        orientations, offset, normal = orientations[::-1], -offset, -normal
    points, gaps = np.empty((MAX_MANIFOLD, 3)), np.empty(MAX_MANIFOLD)
    a, b = ((0, 1.0, orientation) for orientation in orientations)
    contact = tuple(offset.tolist()), tuple(normal.tolist()), lift, (0.0, 0.0, 0.0)
    count = call_contact_manifold(stack_shapes([shapes.cube()]), a, b, contact, (0.2, 0.02), points, gaps)
    assert count == 4
    assert gaps[:count].min() == pytest.approx(lift, abs=1e-12)
