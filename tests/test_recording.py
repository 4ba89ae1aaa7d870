"""What a trajectory keeps: which frames and quantities of particles, in which precision, and what is then missing."""

import gsd.hoomd
import imageio.v3 as iio
import numpy as np
import pytest
from typer.testing import CliRunner

import particlesim as ps
from particlesim.cli import main as cli
from particlesim.jobs.provenance import replayed
from particlesim.scene.recording import QUANTITIES
from particlesim.simulation.needs import trajectory_bytes
from particlesim.simulation.simulation import Simulation
from particlesim.trajectory.gsd_file import Trajectory
from tests import killed
from tests.worlds import gas, scene

SMALL = {"duration": 0.5, "movie": {"fps": 20, "resolution": [96, 64]}}


def balls(**settings):
    group = {"shape": "sphere", "count": 30, "size": 0.3, "velocity": {"kind": "maxwell", "temperature": 20.0}}
    return scene({**group, **settings.pop("group", {})}, **{"size": (3, 3, 3), "seed": 2, **SMALL, **settings})


def stored(scene_, path):
    ps.simulate(scene_, path)
    return Trajectory(path)


def test_one_frame_in_so_many_is_kept(tmp_path):
    whole = stored(gas(2, **SMALL), tmp_path / "whole.gsd")
    some = stored(gas(2, **SMALL, trajectory={"every": 3}), tmp_path / "some.gsd")
    assert (len(whole), len(some)) == (11, 4)
    for k, frame in enumerate(some):
        assert frame.time == whole[3 * k].time
        for name in QUANTITIES:
            assert np.array_equal(getattr(frame, name), getattr(whole[3 * k], name)), name
    one, again = replayed(some, 3, None, None)
    assert one == again


def test_a_run_of_which_some_frames_are_kept_goes_on_to_the_same_bytes(tmp_path, monkeypatch):
    monkeypatch.setattr("particlesim.jobs.partial_run.INTERVAL", 0.0)
    monkeypatch.setattr("particlesim.jobs.partial_run._SPARE", 0.0)
    monkeypatch.setattr("particlesim.jobs.partial_run._sync", lambda path: None)
    run = gas(2, **SMALL, trajectory={"every": 3, "fields": ["position"]})
    ps.simulate(run, tmp_path / "straight.gsd")

    def stop(at):
        def progress(phase, done, total):
            if done == at:
                raise KeyboardInterrupt

        return progress

    for frame in range(1, 11):
        path = tmp_path / "run.gsd"
        with pytest.raises(KeyboardInterrupt):
            ps.simulate(run, path, progress=stop(frame))
        ps.simulate(run, path, resume=True)
        assert killed.content(path) == killed.content(tmp_path / "straight.gsd")
        path.unlink()


def test_double_precision_keeps_every_bit_and_other_programs_read_single(tmp_path):
    settings = {"boundary": "periodic", "size": (3, 3, 3), **SMALL, "trajectory": {"precision": "double"}}
    run = gas(5, **settings)
    simulation = Simulation(run)
    with stored(run, tmp_path / "run.gsd") as trajectory, gsd.hoomd.open(str(tmp_path / "run.gsd")) as file:
        for k, frame in enumerate(trajectory):
            simulation.run_until(run.time_of(k))
            there = simulation.frame()
            for name in QUANTITIES:
                assert np.array_equal(getattr(frame, name), getattr(there, name)), name
            assert np.array_equal(file[k].particles.position, there.position.astype(np.float32))


def test_what_is_not_kept_is_not_a_number(tmp_path):
    fields = ["velocity", "position"]
    with stored(gas(2, **SMALL, trajectory={"fields": fields}), tmp_path / "run.gsd") as run:
        assert run.fields == ["position", "velocity"]
        frame = run[5]
        assert np.isfinite(frame.velocity).all()
        assert np.isnan(frame.angular_momentum).all()
        assert np.isnan(frame.impacts).all()
        assert (frame.orientation == [1, 0, 0, 0]).all()
        assert (frame.image == 0).all()
        assert frame.ledger.impacts > 0
    periodic = gas(2, **SMALL, boundary="periodic", trajectory={"fields": fields})
    with stored(periodic, tmp_path / "run.gsd") as run:
        assert np.isnan(run[5].image).all()
        assert np.isnan(run.table()["mean_square_displacement"]).all()
    with stored(balls(trajectory={"fields": ["position"]}), tmp_path / "run.gsd") as run:
        table = run.table()
        assert np.isnan(table["mean_speed"]).all()
        assert (table["mean_square_displacement"][1:] > 0.0).all()
        assert len(run.table("speeds")) == 0
        with pytest.raises(ValueError, match="of speeds, nothing is known here"):
            run.plot("speeds")


@pytest.mark.parametrize(
    ("settings", "rate"),
    [
        ({}, 44),
        ({"trajectory": {"fields": ["position"]}}, 12),
        ({"trajectory": {"fields": ["position", "velocity"], "every": 2}}, 24),
        ({"trajectory": {"fields": ["position", "velocity"], "precision": "double"}}, 72),
        ({"boundary": "periodic"}, 56),
        ({"group": {"shape": "cube", "spin": {"kind": "uniform", "speed": 3.0}}}, 60),
    ],
)
def test_a_frame_takes_as_many_bytes_as_is_said(tmp_path, settings, rate):
    run = balls(**{"size": (12, 12, 12), **settings, "group": {"count": 4000, **settings.get("group", {})}})
    with stored(run, tmp_path / "run.gsd") as trajectory:
        frames = len(trajectory)
    assert trajectory_bytes(run) == pytest.approx(frames * (2400 + 4000 * rate))
    assert (tmp_path / "run.gsd").stat().st_size == pytest.approx(trajectory_bytes(run), rel=0.3)


def test_pictures_of_positions_alone_are_those_of_all(tmp_path):
    group = {"colour": "#d05030"}
    ps.simulate(balls(group=group, trajectory={"fields": ["position"]}), tmp_path / "few.gsd")
    ps.simulate(balls(group=group), tmp_path / "all.gsd")
    few, whole = (ps.render(tmp_path / f"{name}.gsd", tmp_path / f"{name}.mp4") for name in ("few", "all"))
    assert few.frames == whole.frames == 11
    pictures = [list(iio.imiter(tmp_path / f"{name}.mp4", plugin="FFMPEG")) for name in ("few", "all")]
    assert np.array_equal(*pictures)


CUBES = {"group": {"shape": "cube"}}
OPEN = {"boundary": "open", "camera": "orbit"}


@pytest.mark.parametrize(
    ("settings", "kept", "arguments", "line"),
    [
        (CUBES, ["velocity"], ["render"], "keeps no orientation, which a shape that turns needs"),
        ({"group": {"colour": "by_speed"}}, ["impacts"], ["render"], "keeps no velocity, which colour by_speed needs"),
        ({"group": {"colour": "by_impacts"}}, [], ["render"], "keeps no impacts, which colour by_impacts needs"),
        ({}, [], ["render", "--colour", "by_speed"], "keeps no velocity, which colour by_speed needs"),
        ({"show": {"readout": ["speed"]}}, [], ["render"], "which the readout of the speed needs"),
        (OPEN, [], ["render"], "which a camera that follows where particles will fly needs"),
        ({}, [], ["render", "--still", "0.1", "--colour", "by_speed"], "keeps no velocity"),
        ({}, ["velocity"], ["view"], "keeps no orientation, which a page needs"),
        (CUBES, [], ["export", "-o", "run.xyz"], "keeps no orientation, which a shape that turns needs"),
        ({}, ["orientation"], ["export", "-o", "run.usda"], "keeps no velocity, which USD needs"),
        ({"boundary": "periodic"}, [], ["export", "-o", "run.glb"], "keeps no image, which glTF of a periodic world"),
        ({}, [], ["plot", "--what", "speeds", "--quiet"], "of speeds, nothing is known here"),
    ],
)
def test_what_cannot_be_done_with_it_is_said_in_a_line(tmp_path, monkeypatch, settings, kept, arguments, line):
    monkeypatch.chdir(tmp_path)
    ps.simulate(balls(**settings, trajectory={"fields": ["position", *kept]}), "run.gsd")
    command, *options = arguments
    result = CliRunner().invoke(cli.app, [command, "run.gsd", *options])
    assert result.exit_code == 2
    assert line in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1
    assert [p.name for p in tmp_path.iterdir() if p.is_file()] == ["run.gsd"]


def test_what_of_it_can_be_exported_is(tmp_path):
    ps.simulate(balls(trajectory={"fields": ["position"]}), tmp_path / "run.gsd")
    for ending in ("pvd", "glb", "xyz"):
        ps.export(tmp_path / "run.gsd", tmp_path / f"run.{ending}")
    last = (tmp_path / "run.xyz").read_text().splitlines()[-1]
    assert last.split()[9:12] == ["nan"] * 3
