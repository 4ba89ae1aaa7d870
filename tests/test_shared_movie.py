"""Movies whose segments are drawn by workers have the bytes of those drawn by one process, whatever happens to some."""

import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import distributed
import pytest
from typer.testing import CliRunner

import particlesim as ps
from particlesim.cli import main as cli
from particlesim.core.output_path import partial_folder
from particlesim.jobs import segment_task, shared_movie, workers
from particlesim.jobs.provenance import read_provenance
from particlesim.rendering.video.segments import segment_file
from particlesim.trajectory.gsd_excerpt import excerpt
from particlesim.trajectory.gsd_file import Trajectory
from tests.worlds import gas

# 181 frames: three whole segments, and one of a single picture. Scales are settled by the run, readouts by what passed.
SETTINGS = {
    "title": "Shared",
    "duration": 6.0,
    "boundary": "periodic",
    "movie": {"resolution": [96, 64], "fps": 30, "fade": 0.3},
    "show": {"plot": "impacts", "readout": ["time", "impacts", "pressure"]},
}


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A trajectory, and the movie of it that one process drew."""
    folder = tmp_path_factory.mktemp("run")
    scene = gas(3, **SETTINGS)
    for group in scene.particles:
        group.colour = "by_speed"
    ps.simulate(scene, folder / "run.gsd")
    ps.render(folder / "run.gsd", folder / "alone.mp4")
    return folder / "run.gsd"


@pytest.fixture(scope="module")
def scheduler():
    """The address of a scheduler with two workers, each a process that runs in a folder of its own."""
    with distributed.LocalCluster(n_workers=0, dashboard_address=":0") as cluster:
        address = cluster.scheduler_address
        command = [sys.executable, "-m", "distributed.cli.dask_worker", address, "--nthreads", "1", "--no-dashboard"]
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        started = [subprocess.Popen(command, cwd=Path(__file__).parents[1], **quiet) for _ in range(2)]
        yield address
        for process in started:
            process.terminate()
            process.wait()


def same(path, run):
    """Whether a movie and its poster are those that one process drew."""
    alone = run.with_name("alone.mp4")
    return all(path.with_suffix(s).read_bytes() == alone.with_suffix(s).read_bytes() for s in (".mp4", ".png"))


def test_one_worker_draws_the_same_movie(run, tmp_path):
    told = []
    summary = ps.render(run, tmp_path / "movie.mp4", workers=1, progress=lambda *call: told.append(call))
    assert same(tmp_path / "movie.mp4", run)
    assert (summary.frames, summary.drawn, summary.path) == (181, 181, tmp_path / "movie.mp4")
    assert [done for phase, done, total in told if phase == "rendering"] == [0, 60, 120, 180, 181]
    assert sorted(p.name for p in tmp_path.iterdir()) == ["movie.mp4", "movie.png"]


def test_workers_of_a_scheduler_draw_the_same_movie(run, scheduler, tmp_path):
    ps.render(run, tmp_path / "movie.mp4", scheduler=scheduler)
    assert same(tmp_path / "movie.mp4", run)


def test_workers_that_do_not_see_the_file_are_sent_its_frames(run, scheduler, tmp_path, monkeypatch):
    monkeypatch.setattr(workers, "_told_apart", lambda path: (0, os.getpid()))  # differs from process to process
    sent = []
    monkeypatch.setattr(shared_movie, "excerpt", lambda *of: sent.append(of) or excerpt(*of))
    ps.render(run, tmp_path / "movie.mp4", scheduler=scheduler)
    assert same(tmp_path / "movie.mp4", run)
    assert [len(numbers) for _, numbers in sent] == [60, 60, 60, 1]


def test_an_excerpt_has_the_very_frames(run, tmp_path):
    (tmp_path / "part.gsd").write_bytes(excerpt(run, range(7, 20, 3)))
    with Trajectory(run) as whole, Trajectory(tmp_path / "part.gsd") as part:
        assert len(part) == 6
        for k, number in enumerate([0, 7, 10, 13, 16, 19]):
            assert part.time(k) == whole.time(number)
            assert (part[k].position == whole[number].position).all()
            assert (part[k].orientation == whole[number].orientation).all()
            assert part.ledger(k).impacts == whole.ledger(number).impacts


def test_frames_and_formats_are_shared_as_well(run, tmp_path):
    for name, frames in (("some.mp4", range(5, 150, 2)), ("movie.webm", range(0, 70)), ("movie.gif", range(50, 130))):
        ps.render(run, tmp_path / f"alone_{name}", frames=frames)
        ps.render(run, tmp_path / name, frames=frames, workers=1)
        assert (tmp_path / name).read_bytes() == (tmp_path / f"alone_{name}").read_bytes()
    assert read_provenance(tmp_path / "some.mp4")["frames"] == [5, 150, 2]


def dies_once(task):
    """As ``draw_segment``, but the worker that has the second segment dies of it the first time, half way."""
    marker = Path(os.environ["PARTICLESIM_TEST_MARKER"]) if "PARTICLESIM_TEST_MARKER" in os.environ else None
    if marker is not None and task.places.start == 60 and not marker.exists():
        marker.touch()
        segment_task.draw_segment(task)
        os.kill(os.getpid(), signal.SIGKILL)
    return segment_task.draw_segment(task)


def test_a_worker_that_dies_in_the_middle_loses_nothing(run, tmp_path, monkeypatch):
    monkeypatch.setenv("PARTICLESIM_TEST_MARKER", str(tmp_path / "died"))
    monkeypatch.setattr(shared_movie, "draw_segment", dies_once)
    ps.render(run, tmp_path / "movie.mp4", workers=2)
    assert (tmp_path / "died").exists()
    assert same(tmp_path / "movie.mp4", run)


def test_a_client_that_is_stopped_goes_on_with_what_is_missing(run, tmp_path, monkeypatch):
    path = tmp_path / "movie.mp4"

    def stop(phase, done, total):
        if done >= 120:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as stopped:
        ps.render(run, path, workers=1, progress=stop)
    assert "120 of 181 frames are kept" in stopped.value.__notes__[0]
    drawn = []

    def counted(task):
        drawn.append(task.places)
        return segment_task.draw_segment(task)

    monkeypatch.setattr(shared_movie, "draw_segment", counted)
    segment_file(partial_folder(path), 0).unlink()  # as if it had been handed out and not come back
    ps.render(run, path, workers=1, resume=True)
    assert [places.start for places in drawn] == [0, 120, 180]
    assert same(path, run)


@pytest.mark.parametrize("first", ["alone", "shared"])
def test_what_one_process_began_workers_go_on_with_and_the_other_way_round(run, tmp_path, monkeypatch, first):
    monkeypatch.setattr("particlesim.jobs.partial_run.INTERVAL", 0.0)
    path = tmp_path / "movie.mp4"

    def stop(phase, done, total):
        if done >= 125:
            raise KeyboardInterrupt

    options = [{}, {"workers": 1}] if first == "alone" else [{"workers": 1}, {}]
    with pytest.raises(KeyboardInterrupt):
        ps.render(run, path, **options[0], progress=stop)
    ps.render(run, path, **options[1], resume=True)
    assert same(path, run)


def test_a_client_that_is_killed_goes_on_with_what_is_missing(run, tmp_path):
    shutil.copy(run, tmp_path / "run.gsd")
    program = (
        "import os, signal, particlesim as ps\n"
        "from particlesim.jobs import partial_run\n"
        "partial_run.INTERVAL = partial_run._SPARE = 0.0\n"
        "def stop(phase, done, total):\n"
        "    if done >= 120: os.kill(os.getpid(), signal.SIGKILL)\n"
        "ps.render('run.gsd', 'movie.mp4', workers=1, progress=stop)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, check=False, capture_output=True)
    assert done.returncode == -signal.SIGKILL, done.stderr
    kept = sorted(p.name for p in partial_folder(tmp_path / "movie.mp4").glob("*.mp4"))
    assert kept == ["000000.mp4", "000001.mp4"]
    ps.render(tmp_path / "run.gsd", tmp_path / "movie.mp4", workers=1, resume=True)
    assert same(tmp_path / "movie.mp4", run)


@pytest.mark.parametrize(
    ("source", "options", "line"),
    [
        ("scene.toml", ["--workers", "2"], "workers share the movie of a trajectory only"),
        ("run.gsd", ["--workers", "2", "--shard", "1/2"], "workers share a whole movie, not the part"),
        ("run.gsd", ["--workers", "2", "-o", "x_%03d.png"], "x_%03d.png: workers share a movie, not numbered pictures"),
        ("run.gsd", ["--workers", "2", "--still", "0"], "--workers: of a movie, not of the one picture"),
        ("run.gsd", ["--scheduler", "tcp://127.0.0.1:9"], "tcp://127.0.0.1:9: no scheduler answers there"),
    ],
)
def test_what_cannot_be_shared_is_refused_in_a_line(run, tmp_path, monkeypatch, source, options, line):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(workers, "_PATIENCE", 0.5)
    shutil.copy(run, "run.gsd")
    Path("scene.toml").write_text('[world]\nsize = [2, 2, 2]\n[[particles]]\nshape = "sphere"\ncount = 1\n')
    result = CliRunner().invoke(cli.app, ["render", source, "--quiet", *options])
    assert result.exit_code == (1 if "tcp" in line else 2)
    assert line in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1
    assert not list(tmp_path.glob("*.mp4"))
