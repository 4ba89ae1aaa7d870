"""Runs that are killed go on as if they had never been; what is left of one is never lost in silence."""

import errno
import os
import resource
import shutil
import signal

import numpy as np
import pytest
from typer.testing import CliRunner

import particlesim as ps
from particlesim.cli import main as cli
from particlesim.core.interrupts import Interrupted
from particlesim.core.output_path import partial_folder
from particlesim.jobs import partial_run
from particlesim.jobs.partial_run import PartialRunError
from particlesim.rendering import RenderError
from particlesim.rendering.video import segments
from tests import killed
from tests.worlds import gas


@pytest.fixture
def always(monkeypatch):
    """Keep what is done after every step, and do not wait for the disk each time: no power fails here."""
    monkeypatch.setattr(partial_run, "_sync", lambda path: None)
    monkeypatch.setattr(partial_run, "INTERVAL", 0.0)
    monkeypatch.setattr(partial_run, "_SPARE", 0.0)


def stopped(frames, error=KeyboardInterrupt):
    """A progress that interrupts a run after so many frames."""

    def progress(phase, done, total):
        if done >= frames:
            raise error

    return progress


def some(**settings):
    return gas(3, **{"title": "Left", "duration": 2.5, "movie": {"resolution": [64, 64], "fps": 30}, **settings})


@pytest.mark.parametrize("name", ["run.gsd", "movie.mp4", "movie.webm", "movie.gif"])
def test_left_again_and_again_it_has_the_same_bytes(tmp_path, always, name):
    make = ps.simulate if name == "run.gsd" else ps.render
    make(some(), tmp_path / f"straight_{name}")
    for frames in (5, 20, 59, 60, 61, 74):
        with pytest.raises(KeyboardInterrupt) as stop:
            make(some(), tmp_path / name, resume=True, progress=stopped(frames))
        assert "of 76 frames are kept in" in stop.value.__notes__[0]
    summary = make(some(), tmp_path / name, resume=True)
    assert summary.frames == 76 and summary.drawn == (0 if name == "run.gsd" else 76)
    assert killed.content(tmp_path / name) == killed.content(tmp_path / f"straight_{name}")


def test_some_frames_of_a_trajectory_go_on_too(tmp_path, always):
    ps.simulate(some(), tmp_path / "run.gsd")
    for name, stops in (("straight.mp4", ()), ("left.mp4", (5, 31))):
        for frames in stops:
            with pytest.raises(KeyboardInterrupt):
                ps.render(
                    tmp_path / "run.gsd", tmp_path / name, frames=range(3, 70, 2), resume=True, progress=stopped(frames)
                )
        ps.render(tmp_path / "run.gsd", tmp_path / name, frames=range(3, 70, 2), resume=True)
    assert (tmp_path / "straight.mp4").read_bytes() == (tmp_path / "left.mp4").read_bytes()


def left(path, frames=10, **settings):
    """Leave a partial run."""
    with pytest.raises(KeyboardInterrupt):
        ps.simulate(some(**settings), path, progress=stopped(frames))
    return partial_folder(path)


def test_what_is_there_is_neither_overwritten_nor_gone_on_with_in_silence(tmp_path, always):
    path = tmp_path / "run.gsd"
    folder = left(path)
    before = {file.name: file.read_bytes() for file in folder.iterdir()}
    with pytest.raises(PartialRunError, match=r"of 76 frames, in .*--resume goes on .*clean --remove .*run.gsd"):
        ps.simulate(some(), path)
    assert {file.name: file.read_bytes() for file in folder.iterdir()} == before


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"seed": 2}, "seed was 1 and is 2"),
        ({"duration": 2.0}, "duration was 2.5 and is 2.0"),
        ({"size": (2.5, 2.5, 2.6)}, r"world.size\[2\] was 2.5 and is 2.6"),
    ],
)
def test_another_scene_is_refused_by_the_key_that_differs(tmp_path, always, change, key):
    left(tmp_path / "run.gsd")
    with pytest.raises(PartialRunError, match=key):
        ps.simulate(some(**change), tmp_path / "run.gsd", resume=True)
    ps.simulate(some(), tmp_path / "run.gsd", resume=True)


def test_who_goes_on_builds_nothing_again(tmp_path, always, monkeypatch):
    ps.render(some(), tmp_path / "straight.mp4")
    with pytest.raises(KeyboardInterrupt):
        ps.render(some(), tmp_path / "a.mp4", progress=stopped(30))
    monkeypatch.delattr("particlesim.jobs.frame_source.start")
    ps.render(some(), tmp_path / "a.mp4", resume=True)
    assert (tmp_path / "a.mp4").read_bytes() == (tmp_path / "straight.mp4").read_bytes()


def test_what_ended_before_anything_was_kept_leaves_nothing(tmp_path):
    with pytest.raises(KeyboardInterrupt):
        ps.simulate(some(), tmp_path / "run.gsd", progress=stopped(3))
    assert not list(tmp_path.iterdir())
    partial_folder(tmp_path / "run.gsd").mkdir()
    (partial_folder(tmp_path / "run.gsd") / "trajectory.gsd").write_text("torn")
    ps.simulate(some(), tmp_path / "run.gsd")
    assert [file.name for file in tmp_path.iterdir()] == ["run.gsd"]


@pytest.mark.parametrize("name", ["run.gsd", "movie.mp4"])
def test_killed_while_its_folder_goes_it_leaves_nothing_that_counts(tmp_path, always, monkeypatch, name):
    def killed_amid_this(folder):
        next(folder.glob("*.ckpt")).unlink()
        raise KeyboardInterrupt

    make = ps.simulate if name == "run.gsd" else ps.render
    with monkeypatch.context() as patched, pytest.raises(KeyboardInterrupt):
        patched.setattr(partial_run.shutil, "rmtree", killed_amid_this)
        make(some(), tmp_path / name)
    whole = killed.content(tmp_path / name)
    assert partial_folder(tmp_path / name).is_dir()
    make(some(), tmp_path / name, resume=True)
    assert killed.content(tmp_path / name) == whole and not list(tmp_path.glob(".*"))


def test_killed_as_its_trajectory_has_just_appeared_it_begins_anew(tmp_path, always):
    folder = left(tmp_path / "run.gsd", 76)
    (folder / "trajectory.gsd").rename(tmp_path / "run.gsd")
    whole = killed.content(tmp_path / "run.gsd")
    ps.simulate(some(), tmp_path / "run.gsd", resume=True)
    assert killed.content(tmp_path / "run.gsd") == whole and not folder.exists()


def test_a_folder_that_is_gone_is_not_said_to_be_kept(tmp_path, always):
    def take_away(phase, done, total):
        if done == 9:
            shutil.rmtree(partial_folder(tmp_path / "run.gsd"))

    with pytest.raises(FileNotFoundError, match=r"run.gsd: what was done of it is gone, with ") as error:
        ps.simulate(some(), tmp_path / "run.gsd", progress=take_away)
    assert not hasattr(error.value, "__notes__") and not list(tmp_path.iterdir())


@pytest.mark.parametrize("room", [500, 5_000, 20_000, 40_000])
def test_a_disk_that_is_full_is_told_of_the_output_and_gone_on_from(tmp_path, always, room):
    ps.simulate(some(), tmp_path / "straight.gsd")
    unlimited = resource.getrlimit(resource.RLIMIT_FSIZE)

    def limit(phase, done, total):
        if done == 9:
            largest = max(file.stat().st_size for file in partial_folder(tmp_path / "run.gsd").iterdir())
            resource.setrlimit(resource.RLIMIT_FSIZE, (largest + room, unlimited[1]))

    try:
        with pytest.raises(OSError, match="File too large") as error:
            ps.simulate(some(), tmp_path / "run.gsd", progress=limit)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, unlimited)
    assert error.value.filename == str(tmp_path / "run.gsd") and "are kept in" in error.value.__notes__[0]
    ps.simulate(some(), tmp_path / "run.gsd", resume=True)
    assert killed.content(tmp_path / "run.gsd") == killed.content(tmp_path / "straight.gsd")


def test_an_error_of_another_file_keeps_its_name(tmp_path):
    with pytest.raises(OSError, match="else"):
        ps.simulate(some(), tmp_path / "run.gsd", progress=stopped(3, OSError(errno.ENOSPC, "full", "/else")))


def test_a_second_run_of_the_same_output_is_refused(tmp_path):
    def second(phase, done, total):
        with pytest.raises(PartialRunError, match="another run is at work on it"):
            ps.simulate(some(), tmp_path / "run.gsd", resume=True)

    ps.simulate(some(duration=0.1), tmp_path / "run.gsd", progress=second)


def test_clean_shows_and_removes(tmp_path, always, monkeypatch):
    monkeypatch.chdir(tmp_path)
    invoke = CliRunner().invoke
    assert invoke(cli.app, ["clean"]).output == "no partial runs\n"
    folder = left(tmp_path / "run.gsd")
    assert "of 76 frames" in invoke(cli.app, ["clean"]).output and folder.exists()
    assert "removed" in invoke(cli.app, ["clean", "--remove", "run.gsd"]).output and not folder.exists()


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_an_interrupted_command_says_what_is_kept(tmp_path, always, monkeypatch, number, code):
    (tmp_path / "a.toml").write_text(killed.SCENE)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("particlesim.cli.progress._Lines.__call__", lambda *a: stopped(9, Interrupted(number))(*a[1:]))
    result = CliRunner().invoke(cli.app, ["simulate", "a.toml"])
    assert result.exit_code == code
    assert result.output.endswith("of 76 frames are kept in renders/.a.gsd.partial; --resume goes on with them\n")


def test_a_killed_ffmpeg_is_named_and_gone_on_from(tmp_path, always):
    def kill(phase, done, total):
        if done == 30:
            for child in os.listdir("/proc"):
                if child.isdigit() and is_ffmpeg_of_ours(child):
                    os.kill(int(child), signal.SIGKILL)

    ps.render(some(), tmp_path / "straight.mp4")
    with pytest.raises(RenderError, match="ffmpeg was ended by SIGKILL") as error:
        ps.render(some(), tmp_path / "a.mp4", progress=kill)
    assert "kept" in error.value.__notes__[0]
    ps.render(some(), tmp_path / "a.mp4", resume=True)
    assert (tmp_path / "a.mp4").read_bytes() == (tmp_path / "straight.mp4").read_bytes()


def is_ffmpeg_of_ours(process):
    try:
        with open(f"/proc/{process}/stat") as file:
            name, rest = file.read().rsplit(")", 1)
        return "ffmpeg" in name and int(rest.split()[1]) == os.getpid()
    except OSError:
        return False


def test_what_killed_runs_left_of_a_segment_goes(tmp_path):
    (tmp_path / "000000.1.part").write_text("torn")
    with segments.Segments(tmp_path, 30.0, (32, 32), 18):
        assert not list(tmp_path.iterdir())


def test_segments_are_as_long_as_pictures_say_not_the_clock(tmp_path):
    assert segments.SEGMENT == 60
    rng = np.random.default_rng(3)
    with segments.Segments(tmp_path, 30.0, (32, 32), 18) as movie:
        for _ in range(130):
            movie.send(rng.integers(0, 255, (32, 32, 3), dtype=np.uint8))
        assert sorted(file.name for file in tmp_path.glob("*.mp4")) == ["000000.mp4", "000001.mp4"]
