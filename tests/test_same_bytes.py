"""The same scene gives the same bytes, however it is computed: state, trajectory, movie, decoded frames and poster."""

import subprocess
import sys
from typing import NamedTuple

import imageio_ffmpeg
import pytest

import particlesim as ps
from particlesim.broad_phase import METHODS
from particlesim.core import parallel
from particlesim.core.constants import SEGMENT
from particlesim.jobs import partial_run
from tests import killed
from tests.compounds import L
from tests.worlds import gas
from tests.worlds import scene as world_of

FRAMES = 10


def scene(broad_phase="octree"):
    """A gas of all shapes, whose curve and readout need what passed before, in a movie of a few pictures."""
    return gas(
        6,
        title="The same",
        duration=(FRAMES - 1) / 30,
        friction=0.3,
        movie={"resolution": [96, 64], "fps": 30},
        show={"readout": True, "plot": "energy"},
        broad_phase=broad_phase,
    )


def flow(broad_phase="octree"):
    """What comes in above and goes out below, past an obstacle that rests and one that turns, in two segments."""
    above = {"lower": [-1, -1, 0.8], "upper": [1, 1, 1.4]}
    pieces = [{"shape": shape, "count": 6, "size": 0.3, "velocity": "rest"} for shape in (L, "cube", "sphere")]
    coming = [{"shape": shape, "count": 9, "size": 0.12, "rate": 12.0, "region": above} for shape in ("sphere", L)]
    bar = {"kind": "box", "edges": [2.0, 0.2, 0.4]}
    turning = {"kind": "spin", "axis": [0, 0.6, 0.8], "rate": 8.0}
    return world_of(
        *pieces,
        size=(3.0, 3.0, 3.0),
        seed=5,
        gravity=(0, 0, -9.81),
        restitution=0.5,
        friction=0.4,
        duration=(SEGMENT + 3) / 60,
        movie={"resolution": [64, 64], "fps": 60},
        emitters=[{**one, "velocity": [0, 0, -1], "spin": [1, 2, 3]} for one in coming],
        sinks=[{"region": {"lower": [-1.5, -1.5, -1.5], "upper": [0, 1.5, -1.2]}}],
        obstacles=[
            {"shape": bar, "position": [0, 0, -0.4], "motion": turning},
            {"shape": "cube", "position": [1, 1, -1]},
        ],
        broad_phase=broad_phase,
    )


class Bytes(NamedTuple):
    """What comes of a run."""

    state: str  # the hash of the last state
    trajectory: str  # what is in the GSD file
    movie: bytes
    decoded: str  # all frames of the movie
    poster: bytes


def made(path, this=None, threads=None, make=None):
    """What comes of a scene; ``make(job, path)`` carries out a job."""
    this = this or scene()
    make = make or (lambda job, output: job(this, output, threads=threads))
    path.mkdir()
    make(ps.simulate, path / "run.gsd")
    make(ps.render, path / "movie.mp4")
    simulation = ps.Simulation(this, threads=threads)
    for frame in range(this.frames):
        simulation.run_until(this.time_of(frame))
    return _read(path, simulation.state_hash())


def _read(path, state):
    movie = path / "movie.mp4"
    poster = movie.with_suffix(".png").read_bytes()
    return Bytes(state, killed.content(path / "run.gsd"), movie.read_bytes(), killed.content(movie), poster)


def pictures_as_encoded(path):
    """The packets of a movie, without what it is of: a scene that names another broad phase is another scene."""
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-v", "error", "-i", path, "-c", "copy", "-f", "framemd5", "-"]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


@pytest.fixture(scope="module")
def straight(tmp_path_factory):
    """Of one run, with the usual number of threads; and the folder that it is in."""
    folder = tmp_path_factory.mktemp("same") / "straight"
    return made(folder), folder


@pytest.fixture
def few_are_many(monkeypatch):
    """Let threads share even a few items."""
    monkeypatch.setattr(parallel, "ALONE", 4)


def test_twice_in_a_row(tmp_path, straight):
    assert made(tmp_path / "again") == straight[0]


@pytest.mark.parametrize("threads", [1, 2, 4])
def test_on_any_number_of_threads(tmp_path, straight, few_are_many, threads):
    assert made(tmp_path / "run", threads=threads) == straight[0]


@pytest.mark.parametrize("broad_phase", METHODS)
def test_with_each_broad_phase(tmp_path, straight, broad_phase):
    found = made(tmp_path / "run", scene(broad_phase))
    assert (found.state, found.decoded) == (straight[0].state, straight[0].decoded)
    encoded = [pictures_as_encoded(folder / "movie.mp4") for folder in (tmp_path / "run", straight[1])]
    assert encoded[0] == encoded[1] and encoded[0].count("\n0,") == FRAMES


def test_left_at_every_frame_and_gone_on_with(tmp_path, straight, monkeypatch):
    monkeypatch.setattr(partial_run, "_sync", lambda path: None)
    monkeypatch.setattr(partial_run, "INTERVAL", 0.0)
    monkeypatch.setattr(partial_run, "_SPARE", 0.0)

    def leave_and_go_on(job, path):
        for last in range(2, FRAMES):

            def stop(phase, done, total, last=last):
                if done >= last:
                    raise KeyboardInterrupt

            with pytest.raises(KeyboardInterrupt):
                job(scene(), path, resume=True, progress=stop)
        job(scene(), path, resume=True)

    assert made(tmp_path / "left", make=leave_and_go_on) == straight[0]


def test_with_a_checkpoint_at_every_frame(tmp_path, straight):
    simulation = ps.Simulation(scene())
    for frame in range(FRAMES):
        simulation.run_until(scene().time_of(frame))
        simulation.save(tmp_path / "state")
        simulation = ps.Simulation.load(tmp_path / "state")
    assert simulation.state_hash() == straight[0].state


ELSEWHERE = """
import pathlib, sys
from particlesim.scene import Scene
from tests import test_same_bytes as here
this = Scene.model_validate_json(sys.stdin.read())
print(here.made(pathlib.Path(sys.argv[1]), this).state)
"""


def test_in_several_processes_at_once(tmp_path, straight):
    folders = [tmp_path / "one", tmp_path / "other"]
    pipe = subprocess.PIPE
    started = [
        subprocess.Popen([sys.executable, "-c", ELSEWHERE, folder], stdin=pipe, stdout=pipe, text=True)
        for folder in folders
    ]
    states = [process.communicate(scene().model_dump_json(), timeout=300)[0].strip() for process in started]
    assert [_read(folder, state) for folder, state in zip(folders, states, strict=True)] == [straight[0]] * 2


@pytest.fixture(scope="module")
def straight_flow(tmp_path_factory):
    """Of one run of a flow, and the folder that it is in."""
    folder = tmp_path_factory.mktemp("flow") / "straight"
    return made(folder, flow()), folder


@pytest.mark.slow
@pytest.mark.parametrize("threads", [1, 2, 4])
def test_a_flow_on_any_number_of_threads(tmp_path, straight_flow, few_are_many, threads):
    assert made(tmp_path / "run", flow(), threads=threads) == straight_flow[0]


@pytest.mark.slow
@pytest.mark.parametrize("broad_phase", METHODS)
def test_a_flow_with_each_broad_phase(tmp_path, straight_flow, broad_phase):
    found = made(tmp_path / "run", flow(broad_phase))
    assert (found.state, found.decoded) == (straight_flow[0].state, straight_flow[0].decoded)


@pytest.mark.slow
def test_a_flow_left_amid_and_gone_on_with(tmp_path, straight_flow, monkeypatch):
    monkeypatch.setattr(partial_run, "_sync", lambda path: None)
    monkeypatch.setattr(partial_run, "INTERVAL", 0.0)
    monkeypatch.setattr(partial_run, "_SPARE", 0.0)

    def stop(phase, done, total):
        if done >= total // 2:
            raise KeyboardInterrupt

    def leave_and_go_on(job, path):
        with pytest.raises(KeyboardInterrupt):
            job(flow(), path, progress=stop)
        job(flow(), path, resume=True)

    assert made(tmp_path / "left", flow(), make=leave_and_go_on) == straight_flow[0]


@pytest.mark.slow
def test_a_flow_drawn_in_parts_and_by_workers(tmp_path, straight_flow):
    run = straight_flow[1] / "run.gsd"
    parts = [tmp_path / f"part{k}.mp4" for k in (1, 2)]
    for k, part in enumerate(parts, 1):
        ps.render(run, part, shard=(k, 2))
    ps.join(parts, tmp_path / "joined.mp4")
    ps.render(run, tmp_path / "shared.mp4", workers=2)
    ps.render(run, tmp_path / "alone.mp4")
    alone = killed.bytes_of(tmp_path / "alone.mp4")
    assert killed.bytes_of(tmp_path / "joined.mp4") == killed.bytes_of(tmp_path / "shared.mp4") == alone


@pytest.mark.slow
def test_a_flow_comes_goes_and_collides(straight_flow):
    with ps.open(straight_flow[1] / "run.gsd") as run:
        last = run.ledger(len(run) - 1)
    assert last.impacts > 100
    assert last.released > 9 and last.removed > 0
