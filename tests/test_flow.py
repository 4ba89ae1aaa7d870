"""Emitters and sinks: who comes and goes, where, and what the ledger and the files say of it."""

import gsd.hoomd
import numpy as np
import pytest
from PIL import Image

import particlesim as ps
from particlesim.rendering.regions import region_lines
from particlesim.trajectory import gsd_file
from particlesim.trajectory.gsd_file import Trajectory
from tests.worlds import listed, scene

DOWN = (0, 0, -9.81)
ABOVE = {"lower": [-0.5, -0.5, 1], "upper": [0.5, 0.5, 1.5]}


def emitter(**keys):
    usual = {"shape": "sphere", "size": 0.1, "count": 40, "rate": 50.0, "region": ABOVE, "velocity": [0, 0, -1]}
    return {**usual, **keys}


def fountain(**settings):
    """Spheres and cubes that come in above and go out below, beside one that is there from the start."""
    groups = {
        "emitters": [emitter(), emitter(shape="cube", rate=30.0, count=25, spin=[1, 2, 3])],
        "sinks": [{"region": {"lower": [-9, -9, -2], "upper": [9, 9, -1]}}],
    }
    ball = {"shape": "sphere", "size": 0.3, "placement": {"kind": "list", "poses": [{"position": [0, 0.7, 0]}]}}
    usual = {"size": (4, 4, 4), "boundary": "open", "gravity": DOWN, "seed": 4, "duration": 0.8}
    return scene(ball, **{**usual, **groups, **settings})


def test_particles_come_at_their_rate_between_two_times():
    what = scene(emitters=[emitter(**{"from": 0.2, "until": 0.6}, velocity="rest")], size=(4, 4, 4), boundary="open")
    sim = ps.Simulation(what)
    for time, count in ((0.1, 0), (0.21, 0), (0.3, 5), (0.5, 15), (0.6, 20), (0.9, 20)):
        sim.run_until(time)
        assert len(sim.particles.mass) == count, time
    assert sim.ledger.released == 20
    assert sim.largest_overlap() == 0.0
    position = sim.particles.position
    assert (np.abs(position[:, :2]) <= 0.45).all()
    assert (np.abs(position[:, 2] - 1.25) <= 0.2).all()


def test_count_is_the_total():
    sim = ps.Simulation(scene(emitters=[emitter(count=7)], size=(4, 4, 4), boundary="open"))
    sim.run(duration=0.5)
    assert sim.ledger.released == len(sim.particles.mass) == 7


def test_what_comes_in_waits_for_room():
    """A region that holds one particle at a time, which falls out of it: the next comes when it has gone its size."""
    tight = {"lower": [-0.101, -0.101, 1], "upper": [0.101, 0.101, 1.202]}
    what = scene(emitters=[emitter(region=tight, size=0.2, rate=1000.0)], size=(6, 6, 6), boundary="open", step=0.01)
    sim = ps.Simulation(what)
    sim.run(duration=1.0)
    # At 1 m/s a particle has gone 0.2 m after 20 steps or, for rounding, one more.
    assert 1.0 / 0.21 <= len(sim.particles.mass) <= 1.0 / 0.2 + 1
    assert sim.ledger.waiting == 40 - sim.ledger.released
    assert sim.largest_overlap() == 0.0


def test_a_sink_takes_out_what_enters_it_and_counts_by_group():
    slow = listed("sphere", {"position": (0, 0, 2), "velocity": (0, 0, -1)}, {"position": (2, 0, 2)}, size=0.2)
    fast = listed("cube", {"position": (1, 0, 2), "velocity": (0, 0, -2)}, size=0.2)
    round_ = {"region": {"lower": [0.5, -1, -1], "upper": [1.5, 1, 1], "form": "ellipsoid"}}
    flat = {"region": {"lower": [-1, -1, -1], "upper": [0.4, 1, 1]}}
    sim = ps.Simulation(scene(slow, fast, sinks=[round_, flat], boundary="open", step=0.01))
    sim.run_until(0.4)
    assert len(sim.particles.mass) == 3
    sim.run_until(0.6)
    assert sim.removed.tolist() == [0, 1]
    assert sim.model.particles["id"].tolist() == [0, 1]
    sim.run_until(1.1)
    assert sim.removed.tolist() == [1, 1]
    assert sim.model.particles["id"].tolist() == [1]


def test_mass_and_energy_that_come_and_go_are_booked():
    sim = ps.Simulation(fountain())
    mass, energy = sim.particles.mass.sum(), sim.ledger.energy
    sim.run(duration=1.5)
    ledger = sim.ledger
    assert ledger.removed > 20 and ledger.released == 65
    came, went = ledger.flow_mass
    assert sim.particles.mass.sum() == pytest.approx(mass + came - went, rel=1e-12)
    came, went = ledger.flow_energy
    assert ledger.own_energy == pytest.approx(energy, abs=1e-11 * came)
    assert sim.removed.sum() == ledger.removed
    assert len(sim.particles.mass) == 1 + ledger.released - ledger.removed


def test_ids_stay_and_rows_are_in_their_order():
    sim = ps.Simulation(fountain())
    seen = {}
    for _ in range(40):
        sim.run(duration=0.02)
        b = sim.model.particles
        assert (np.diff(b["id"]) > 0).all()
        for number, mass, group in zip(b["id"].tolist(), b["mass"].tolist(), b["group"].tolist(), strict=True):
            assert seen.setdefault(number, (mass, group)) == (mass, group)
    assert len(seen) > 50


@pytest.mark.parametrize("choice", [("grid", 1), ("naive", 4)])
def test_the_run_is_the_same_to_the_bit(choice, tmp_path):
    """Over broad phases and threads, and interrupted while particles are yet to come."""
    whole = ps.Simulation(fountain())
    whole.run(duration=0.3)
    whole.save(tmp_path / "run.ckpt")
    resumed = ps.Simulation.load(tmp_path / "run.ckpt")
    other = ps.Simulation(fountain(), *choice)
    other.run(duration=0.3)
    hashes = set()
    for sim in (whole, resumed, other):
        sim.run(duration=0.5)
        hashes.add((sim.state_hash(), sim.ledger.released, sim.ledger.removed))
    assert len(hashes) == 1
    assert resumed.header.size.tolist() == whole.header.size.tolist()


def test_files_have_as_many_particles_as_there_are(tmp_path):
    what = fountain()
    ps.simulate(what, tmp_path / "run.gsd")
    sim = ps.Simulation(what)
    with Trajectory(tmp_path / "run.gsd") as trajectory, gsd.hoomd.open(str(tmp_path / "run.gsd")) as file:
        assert trajectory.scene.number == len(trajectory.header.mass) == 66
        numbers = set()
        for k, (frame, schema) in enumerate(zip(trajectory, file, strict=True)):
            sim.run_until(what.time_of(k))
            b = sim.model.particles
            # OVITO takes this for its property of that name, and follows particles by it.
            ids = schema.log["particles/Particle Identifier"]
            assert frame.present.tolist() == b["id"].tolist() == ids.tolist() and ids.shape == (schema.particles.N,)
            assert np.allclose(frame.position, b["position"], rtol=1e-6, atol=1e-6)
            assert len(b) == schema.particles.N
            assert np.allclose(schema.particles.mass, b["mass"], rtol=1e-6)
            kinds = [schema.particles.type_shapes[t]["type"] for t in schema.particles.typeid]
            assert kinds == np.where(b["group"] == 2, "ConvexPolyhedron", "Sphere").tolist()
            assert frame.ledger.released == sim.ledger.released
            numbers.add(len(b))
    assert len(numbers) > 10


def test_ids_of_version_0_1_are_read(tmp_path, monkeypatch):
    """Which had them under another name."""
    ps.simulate(fountain(), tmp_path / "new.gsd")
    monkeypatch.setattr(gsd_file, "_IDS", "log/particles/id")
    ps.simulate(fountain(), tmp_path / "old.gsd")
    monkeypatch.undo()
    with gsd.hoomd.open(str(tmp_path / "old.gsd")) as file:
        assert "particles/id" in file[1].log and "particles/Particle Identifier" not in file[1].log
    with Trajectory(tmp_path / "new.gsd") as new, Trajectory(tmp_path / "old.gsd") as old:
        assert [frame.ids.tolist() for frame in old] == [frame.ids.tolist() for frame in new]


def test_a_movie_shows_those_that_are_there(tmp_path):
    """The first frame is of one ball, the last of many; drawn from a file as from the scene."""
    what = fountain(movie={"resolution": [160, 96]}, show={"readout": False})
    ps.simulate(what, tmp_path / "run.gsd")
    ps.still(what, tmp_path / "a.png", time=0.7)
    ps.still(tmp_path / "run.gsd", tmp_path / "b.png", time=0.7)
    ps.still(what, tmp_path / "c.png", time=0.0)
    a, b, c = (np.asarray(Image.open(tmp_path / f"{name}.png")).astype(int) for name in "abc")
    assert (np.abs(a - b).max(axis=2) > 8).mean() < 0.01
    assert (np.abs(a - c).max(axis=2) > 8).mean() > 0.01


def test_drafts_show_regions_within_the_world():
    lines = region_lines(fountain(), 1.0)
    assert lines.shape == (3 * 12, 11)
    ends = np.concatenate([lines[:, :3], lines[:, 4:7]])
    assert np.abs(ends).max() == 2.0
    assert (ends[:, 2].min(), ends[:, 2].max()) == (-2.0, 1.5)


def test_a_scene_of_emitters_alone_begins_empty():
    sim = ps.Simulation(scene(emitters=[emitter(colour="by_speed")], size=(4, 4, 4), gravity=DOWN, restitution=0.5))
    assert len(sim.frame().position) == 0
    sim.run(duration=1.0)
    assert len(sim.frame().position) == 40
