"""Tasks shared among workers: all are done, whoever dies of them, and never too many are handed out."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import dask
import distributed
import pytest

import particlesim as ps
from particlesim.jobs import workers
from particlesim.jobs.workers import WorkersError, shared_among

ONE = """
duration = 0.2
[world]
size = [2, 2, 2]
[movie]
fps = 10
[[particles]]
shape = "sphere"
count = 20
size = 0.3
velocity = { kind = "maxwell", temperature = 10 }
"""


def square(number):
    return number * number


def dies_once(marker):
    """Kills the worker that it is given to first."""
    marker = Path(marker)
    if marker.suffix == ".dies" and not marker.exists():
        marker.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return marker.name


def always_dies(number):
    os.kill(os.getpid(), signal.SIGKILL)


def counted(items, taken):
    for item in items:
        taken.append(item)
        yield item


@pytest.fixture(scope="module")
def two():
    with shared_among(2, None, None) as found:
        yield found


def test_all_is_done_and_never_more_than_a_few_ahead(two):
    taken, done = [], []
    for number, result in two.each(square, counted(range(200), taken)):
        assert result == number**2
        done.append(number)
        assert len(taken) - len(done) <= 4
    assert sorted(done) == list(range(200))
    assert list(two.each(square, [])) == []


def test_a_worker_that_dies_in_the_middle_loses_nothing(two, tmp_path):
    markers = [str(tmp_path / name) for name in ("a", "b.dies", "c", "d", "e.dies", "f")]
    found = dict(two.each(dies_once, markers))
    assert [found[k] for k in range(6)] == [Path(marker).name for marker in markers]
    assert len(list(tmp_path.iterdir())) == 2


def test_what_kills_every_worker_is_given_up(two):
    with pytest.raises(WorkersError, match=r"^task 1: one worker after the other died of it"):
        list(two.each(always_dies, [1]))
    assert dict(two.each(square, [3])) == {0: 9}


def test_workers_that_are_long_in_coming_back_are_waited_for():
    # By itself the cluster would give up each of them at once, and what is left to do would never be done.
    with dask.config.set({"distributed.deploy.lost-worker-timeout": "1 ms"}), shared_among(2, None, None) as found:
        with pytest.raises(WorkersError, match=r"^task 1: one worker after the other died of it"):
            list(found.each(always_dies, [1]))
        assert dict(found.each(square, [3])) == {0: 9}


def test_one_alone_needs_no_library(monkeypatch):
    monkeypatch.setattr(workers, "require", None)
    with shared_among(1, None, None) as alone:
        assert list(alone.each(square, [2, 3])) == [(0, 4), (1, 9)]


def test_without_the_library_one_after_the_other_or_it_is_said(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    monkeypatch.setattr(workers.importlib.util, "find_spec", lambda name: None)
    with shared_among(None, None, None) as alone:
        assert list(alone.each(square, [2])) == [(0, 4)]
    with (
        pytest.raises(RuntimeError, match=r"^distributed is not installed; pip install 'particlesim\[dask\]' does it$"),
        shared_among(2, None, None),
    ):
        pass


def test_a_scheduler_that_is_not_there_is_named(monkeypatch):
    monkeypatch.setattr(workers, "_PATIENCE", 0.5)
    with (
        pytest.raises(WorkersError, match=r"^tcp://127.0.0.1:9: no scheduler answers there"),
        shared_among(None, "tcp://127.0.0.1:9", None),
    ):
        pass


@pytest.fixture(scope="module")
def scheduler():
    """The address of a scheduler with two workers, each a process started as its documentation says."""
    with distributed.LocalCluster(n_workers=0, dashboard_address=":0") as cluster:
        address = cluster.scheduler_address
        command = [sys.executable, "-m", "distributed.cli.dask_worker", address, "--nthreads", "1", "--no-dashboard"]
        started = [subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) for _ in range(2)]
        yield address
        for process in started:
            process.terminate()
            process.wait()


def test_a_sweep_has_the_same_rows_whoever_runs_it(two, scheduler, tmp_path):
    (tmp_path / "one.toml").write_text(ONE)
    (tmp_path / "sweep.toml").write_text('[sweep]\nscene = "one.toml"\n[sweep.axes]\nseed = { from = 1, count = 4 }\n')
    made = {
        "alone": ps.sweep(tmp_path / "sweep.toml", tmp_path / "alone.csv", workers=1),
        "far": ps.sweep(tmp_path / "sweep.toml", tmp_path / "far.csv", scheduler=scheduler),
    }
    rows = {name: [{**row, "seconds": None} for row in result.rows] for name, result in made.items()}
    assert rows["far"] == rows["alone"] and made["far"].ran == 4 and not made["far"].failed


def test_workers_of_another_version_are_refused(scheduler, monkeypatch):
    monkeypatch.setattr(workers, "_version", lambda: "9.9.9")
    with (
        pytest.raises(WorkersError, match=r"a worker with particlesim .*, while this is 9.9.9"),
        shared_among(None, scheduler, None),
    ):
        pass
