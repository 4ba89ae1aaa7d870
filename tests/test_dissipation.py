"""The ledger closes: what energy was lost by which cause, and momentum with all that walls bear."""

import dataclasses

import numpy as np
import pytest

from particlesim.core.constants import DISSIPATION
from particlesim.geometry.shapes import half_space
from particlesim.jobs.summary import Summary
from particlesim.model.materials import Material
from particlesim.rendering.hud.history import History
from particlesim.rendering.hud.readout import readout_rows
from particlesim.rendering.look import look_of
from particlesim.setup.build import build
from particlesim.setup.obstacles import Obstacle, Piece
from particlesim.simulation.simulation import Simulation
from particlesim.trajectory.gsd_file import Trajectory, TrajectoryWriter
from tests.gases import spheres
from tests.worlds import gas, listed, scene

ROUGH = {"friction": 0.4, "tangential_restitution": 0.3}


def unaccounted(sim, start):
    """Energy that no cause took, over that at the start; and momentum that neither walls nor gravity account for."""
    now, mass = sim.ledger, sim.particles.mass.sum()
    energy = now.energy + now.dissipated.sum() - start.energy
    fallen = mass * np.array(sim.scene.world.gravity) * (now.time - start.time)
    momentum = now.momentum + now.given_to_walls - start.momentum - fallen
    return energy / start.energy, np.abs(momentum).max() / np.sqrt(2.0 * mass * start.energy)


@pytest.mark.parametrize("boundary", ["wall", "open", "periodic"])
@pytest.mark.parametrize(
    ("surface", "causes"),
    [
        ({}, ()),
        ({"restitution": 0.8}, ("restitution",)),
        ({"friction": 0.3}, ("friction",)),
        ({"restitution": 0.9, "tangential_restitution": -0.4, "friction": 0.6}, ("restitution", "friction")),
        ({"restitution": 0.9, "rolling_friction": 0.01, **ROUGH}, ("restitution", "friction", "rolling")),
    ],
)
def test_the_ledger_of_a_gas_of_all_shapes_closes(boundary, surface, causes):
    size = (3.2, 3.2, 3.2) if boundary == "periodic" else (2.5, 2.5, 2.5)
    sim = Simulation(gas(size=size, boundary=boundary, **surface))
    start = last = sim.ledger
    for _ in range(15):
        sim.run(steps=10)
        now = sim.ledger
        assert now.energy <= last.energy * (1 + 1e-14)
        assert (now.dissipated >= last.dissipated - 1e-14 * start.energy).all()
        last = now
    assert last.impacts > 40
    energy, momentum = unaccounted(sim, start)
    assert abs(energy) < 1e-13
    assert momentum < 1e-14
    if boundary == "open":
        scale = np.sqrt(2.0 * sim.particles.mass.sum() * start.energy)
        assert np.allclose(last.angular_momentum, start.angular_momentum, rtol=0, atol=1e-13 * scale)
    for cause, lost in zip(DISSIPATION, last.dissipated, strict=True):
        assert lost > 1e-3 * start.energy if cause in causes else abs(lost) < 1e-14 * start.energy
    assert (np.abs(last.wall_shear).max() > 0.0) == (boundary == "wall" and "friction" in surface)


def test_the_ledger_closes_under_gravity_while_nothing_rests():
    sim = Simulation(gas(gravity=(0, 0, -9.81), friction=0.3))
    start = sim.ledger
    sim.run(duration=2.0)
    assert sim.ledger.impacts > 300
    energy, momentum = unaccounted(sim, start)
    assert abs(energy) < 1e-12
    assert momentum < 1e-12
    assert sim.ledger.dissipated[1] > 0.1 * start.energy


def test_rough_elastic_spheres_keep_their_energy():
    """As smooth ones do, over tens of thousands of impacts, and share it equally among translation and rotation."""
    sim = spheres(200, 0.2, boundary="wall", friction=1e30, tangential_restitution=1.0)
    start = sim.ledger
    shares = []
    while sim.ledger.impacts < 20000:
        sim.step(0.1)
        if sim.ledger.impacts > 4000:
            shares.append(sim.ledger.kinetic_rotational / sim.ledger.kinetic)
    energy, momentum = unaccounted(sim, start)
    assert sim.ledger.energy == pytest.approx(start.energy, rel=1e-12)
    assert np.abs(sim.ledger.dissipated).max() < 1e-12 * start.energy
    assert abs(energy) < 1e-12
    assert momentum < 1e-12
    assert np.mean(shares) == pytest.approx(0.5, abs=0.02)


def test_what_meets_at_once_shares_what_is_lost():
    """A ball between two that touch, symmetric to it: what comes out is, and the ledger closes."""
    x, z = 0.5, np.sqrt(0.75)
    pair = listed("sphere", {"position": (-x, 0, 0)}, {"position": (x, 0, 0)})
    ball = listed("sphere", {"position": (0, 0, z + 1.0), "velocity": (0, 0.7, -2)})
    sim = Simulation(scene(pair, ball, boundary="open", restitution=0.7, friction=0.2))
    start = sim.ledger
    sim.run(duration=2.0)
    velocity, spin = sim.particles.velocity, sim.particles.angular_velocity
    assert sim.ledger.impacts >= 2
    assert np.allclose(velocity[0] * [-1, 1, 1], velocity[1], rtol=0, atol=1e-13)
    assert np.allclose(spin[0] * [1, -1, -1], spin[1], rtol=0, atol=1e-12)
    assert np.allclose([velocity[2, 0], spin[2, 1], spin[2, 2]], 0.0, rtol=0, atol=1e-13)
    energy, momentum = unaccounted(sim, start)
    assert abs(energy) < 1e-14
    assert momentum < 1e-14
    assert (sim.ledger.dissipated[:2] > 0.01 * start.energy).all()


def test_a_moving_wall_drags_what_strikes_it():
    """A belt that runs along x at u: a ball that falls on it takes 2/7 of its speed if it sticks, mu (1 + e) v else."""
    for friction, expected in ((5.0, 2.0 / 7.0 * 3.0), (0.1, 0.1 * 1.5 * 2.0)):
        running = Piece(0.0, (0, 0, -2), velocity=(3.0, 0, 0))
        surface = Material(0.5, friction=friction)
        belt = Obstacle(half_space((0.0, 0.0, 1.0)), running.origin, material=surface, pieces=(running,))
        falling = scene(
            listed("sphere", {"position": (0, 0, 0), "velocity": (0, 0, -2)}), boundary="open", friction=9.0
        )
        sim = Simulation.of_model(falling, build(falling, [belt]))
        sim.run(duration=1.0)
        assert sim.ledger.impacts == 1
        assert np.allclose(sim.particles.velocity[0], [expected, 0, 1.0], rtol=0, atol=1e-12)


@pytest.mark.parametrize("boundary", ["wall", "periodic"])
def test_threads_and_broad_phases_change_no_bit_with_friction(boundary):
    rough = {"boundary": boundary, "size": (3.2, 3.2, 3.2), "restitution": 0.9, "rolling_friction": 0.001, **ROUGH}
    hashes, ledgers = set(), set()
    for threads, method in ((1, "octree"), (2, "grid"), (4, "naive")):
        sim = Simulation(gas(**rough), broad_phase=method, threads=threads)
        sim.run(steps=60)
        hashes.add(sim.state_hash())
        ledgers.add((sim.ledger.dissipated.tobytes(), sim.ledger.wall_shear.tobytes()))
    assert len(hashes) == len(ledgers) == 1
    assert sim.ledger.impacts > 25


def test_a_checkpoint_keeps_what_was_dissipated(tmp_path):
    sim = Simulation(gas(4, size=(1.6, 1.6, 1.6), **ROUGH))
    sim.run(steps=30)
    sim.save(tmp_path / "run.ckpt")
    other = Simulation.load(tmp_path / "run.ckpt")
    for one in (sim, other):
        one.run(steps=30)
    assert other.state_hash() == sim.state_hash()
    assert np.array_equal(other.ledger.dissipated, sim.ledger.dissipated)
    assert np.array_equal(other.ledger.wall_shear, sim.ledger.wall_shear)
    assert sim.ledger.dissipated[1] > 0.0


# ---- where it can be seen ------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def cooled():
    """Two frames of a gas with friction, and its header and scene."""
    sim = Simulation(gas(4, size=(1.6, 1.6, 1.6), restitution=0.8, rolling_friction=0.01, **ROUGH))
    first = sim.frame()
    sim.run(steps=60)
    return sim, first, sim.frame()


def test_older_trajectories_do_not_say_what_was_dissipated(cooled, tmp_path):
    sim, _, last = cooled
    older = dataclasses.replace(last.ledger, dissipated=None, wall_shear=None)
    for name, ledger in (("new", last.ledger), ("old", older)):
        with TrajectoryWriter(tmp_path / f"{name}.gsd", sim.header) as writer:
            writer.append(dataclasses.replace(last, ledger=ledger))
    with Trajectory(tmp_path / "new.gsd") as trajectory:
        assert np.array_equal(trajectory[0].ledger.dissipated, last.ledger.dissipated)
        assert np.array_equal(trajectory[0].ledger.wall_shear, last.ledger.wall_shear)
    with Trajectory(tmp_path / "old.gsd") as trajectory:
        unknown = trajectory[0].ledger
    assert unknown.dissipated is None
    assert unknown.wall_shear is None
    pressed = last.ledger.wall_impulse[1::2] - last.ledger.wall_impulse[::2]
    assert np.array_equal(unknown.given_to_walls, pressed)


def test_the_summary_says_what_each_cause_took(cooled):
    sim, first, last = cooled
    summary = Summary(float(sim.particles.mass.sum()), (0.0, 0.0, 0.0), elastic=False)
    summary.add(first)
    summary.add(last)
    shares = summary.dissipated
    assert list(shares) == ["restitution", "friction", "rolling", "rest"]
    assert sum(shares.values()) == pytest.approx(1.0 - last.ledger.energy / first.ledger.energy, abs=1e-13)
    assert shares["rest"] == 0.0
    assert summary.momentum_error < 1e-13
    older = Summary(1.0, (0.0, 0.0, 0.0))
    older.add(dataclasses.replace(first, ledger=dataclasses.replace(first.ledger, dissipated=None)))
    assert older.dissipated == {}


def test_the_readout_says_what_each_cause_took_that_there_can_be(cooled):
    sim, first, last = cooled
    shown = sim.scene.model_copy(update={"show": sim.scene.show.model_copy(update={"readout": ["dissipation"]})})
    rows = readout_rows(look_of(shown, sim.header, first), last, History())
    assert [row.name for row in rows] == ["lost by restitution", "lost by friction", "lost by rolling"]
    shares = 100.0 * last.ledger.dissipated / first.ledger.kinetic
    assert [row.value for row in rows] == [f"{share:.1f} %" for share in shares[:3]]
    smooth = Simulation(gas(2, size=(1.6, 1.6, 1.6)))
    plain = smooth.scene.model_copy(update={"show": shown.show})
    assert readout_rows(look_of(plain, smooth.header, smooth.frame()), smooth.frame(), History()) == []
