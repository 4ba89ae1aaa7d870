"""Checkpoints: what goes on from one is the same run, to the last bit; what is none is refused in one line."""

import zipfile

import numpy as np
import pytest
from numba import typeof

import particlesim as ps
from particlesim.simulation.simulation import Simulation
from tests.worlds import gas, scene


def heap():
    """Spheres, cubes and pyramids that come to rest."""
    groups = [
        {"shape": shape, "count": 6, "size": 0.2, "orientation": "random"} for shape in ("sphere", "cube", "pyramid")
    ]
    return scene(*groups, size=(0.7, 0.7, 2.0), gravity=(0, 0, -9.81), restitution=0.4, seed=5)


def periodic():
    """Spheres in a periodic domain."""
    group = {"shape": "sphere", "count": 60, "size": 0.3, "velocity": {"kind": "maxwell", "temperature": 20}}
    return scene(group, size=(3, 3, 3), boundary="periodic")


SCENES = {"gas": (lambda: gas(12), 5), "spheres": (periodic, 7), "heap": (heap, 400)}


@pytest.mark.parametrize("name", SCENES)
def test_a_resumed_run_is_the_same_run_to_the_last_bit(name, tmp_path):
    make, steps = SCENES[name]
    whole = Simulation(make())
    whole.run(steps=steps)
    whole.save(tmp_path / "run.ckpt")
    before = whole.state_hash()
    resumed = ps.Simulation.load(tmp_path / "run.ckpt", broad_phase="grid", threads=2)
    assert resumed.state_hash() == before
    for sim in (whole, resumed):
        sim.run(steps=steps)
    assert resumed.state_hash() == whole.state_hash() != before
    assert resumed.time == whole.time and resumed.steps == whole.steps
    ledgers = [{**vars(sim.ledger), "pairs_tested": 0} for sim in (whole, resumed)]
    for key, value in ledgers[0].items():
        np.testing.assert_array_equal(value, ledgers[1][key], err_msg=key)
    assert np.array_equal(resumed.particles.impacts, whole.particles.impacts)
    assert resumed.header.scene_json == whole.header.scene_json


def test_resting_bodies_rest_on(tmp_path):
    sim = Simulation(heap())
    sim.run(duration=1.5)
    sim.save(tmp_path / "run.ckpt")
    resumed = ps.Simulation.load(tmp_path / "run.ckpt")
    assert resumed.model.particles["resting"].any()
    assert len(resumed._solver.state.forces)


def test_what_is_loaded_is_of_the_types_that_kernels_are_compiled_for(tmp_path):
    sim = Simulation(heap())
    sim.run(duration=0.8)
    sim.save(tmp_path / "run.ckpt")
    resumed = ps.Simulation.load(tmp_path / "run.ckpt")
    for before, after in (
        (sim.model.system._asdict(), resumed.model.system._asdict()),
        (sim._solver.state.arrays(), resumed._solver.state.arrays()),
    ):
        for name, array in before.items():
            if isinstance(array, np.ndarray):
                assert typeof(array) == typeof(after[name]), name


def test_the_hash_covers_what_the_next_step_depends_on():
    sims = [Simulation(heap()), Simulation(heap())]
    for sim in sims:
        sim.run(duration=0.8)
    assert sims[0].state_hash() == sims[1].state_hash()
    sims[1]._solver.state.forces["force"] *= 1.0 + 1e-15
    assert sims[0].state_hash() != sims[1].state_hash()


def wrong_files(tmp_path):
    sim = Simulation(gas(2))
    sim.save(tmp_path / "good")
    good = (tmp_path / "good").read_bytes()
    (tmp_path / "empty").write_bytes(b"")
    (tmp_path / "text").write_text("not a checkpoint")
    (tmp_path / "short").write_bytes(good[: len(good) // 2])
    (tmp_path / "flipped").write_bytes(good[:2000] + bytes(255 - b for b in good[2000:2200]) + good[2200:])
    with open(tmp_path / "other", "wb") as file:
        np.savez(file, a=np.zeros(3))
    with zipfile.ZipFile(tmp_path / "zip", "w") as archive:
        archive.writestr("x.txt", "x")
    return ("empty", "text", "short", "flipped", "other", "zip")


def test_what_is_no_checkpoint_is_refused_in_one_line(tmp_path):
    for name in wrong_files(tmp_path):
        with pytest.raises(ps.CheckpointError) as refused:
            ps.Simulation.load(tmp_path / name)
        assert "\n" not in str(refused.value) and name in str(refused.value)
    with pytest.raises(FileNotFoundError):
        ps.Simulation.load(tmp_path / "nothing")


def test_a_checkpoint_appears_whole_or_not_at_all(tmp_path):
    sim = Simulation(gas(2))
    with pytest.raises(FileNotFoundError):
        sim.save(tmp_path / "no folder" / "run.ckpt")
    sim.save(tmp_path / "run.ckpt")
    assert [path.name for path in tmp_path.iterdir()] == ["run.ckpt"]
