"""What a long run holds does not grow with it, and runs in one process do not disturb each other."""

import gc
import json
import os
import subprocess
import sys
import threading

import pytest

import particlesim as ps
from particlesim.core import parallel
from particlesim.core.constants import SEGMENT
from tests.worlds import gas

PICTURES, STEPS, SIZE = 840, 10, (128, 96)

# A movie of many pictures, with so many steps each. What the process holds is said now and then in the midst of a
# segment of 60 pictures, when ffmpeg is at work.
RUN = """
import gc, json, sys, tempfile
from pathlib import Path
import psutil
import particlesim as ps
from tests.test_long_runs import long_scene

process, said = psutil.Process(), []

def held():
    gc.collect()
    return {
        "bytes": process.memory_info().rss,
        "objects": len(gc.get_objects()),
        "threads": process.num_threads(),
        "handles": process.num_fds(),
        "children": len(process.children()),
        "shared": sum(each.path.startswith("/dev/shm") for each in process.memory_maps()),
        "temporary": len(list(Path(tempfile.gettempdir()).iterdir())),
    }

def progress(phase, done, total):
    if phase == "rendering" and done % 240 == 90:
        said.append(held())

ps.render(long_scene(), Path(sys.argv[1], "a.mp4"), progress=progress)
print(json.dumps(said))
"""


def long_scene():
    """A gas whose steps are a tenth of a frame."""
    movie = {"resolution": SIZE, "fps": 30}
    return gas(6, duration=(PICTURES - 1) / 30, movie=movie, show={"readout": True}, step=1.0 / (30 * STEPS))


@pytest.mark.slow
def test_what_a_long_run_holds_does_not_grow(tmp_path):
    (tmp_path / "temporary").mkdir()
    command = [sys.executable, "-c", RUN, str(tmp_path)]
    environment = {**os.environ, "TMPDIR": str(tmp_path / "temporary")}
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=400, env=environment)
    said = json.loads(done.stdout)
    assert len(said) == 4
    # At the first of these moments the pools of the allocator, one for each thread, are yet to fill.
    first, last = said[1], said[-1]
    pictures, particles = 240 * (len(said) - 2), 24
    # One more with each segment would be a leak; whether one begins just then is chance.
    for what in ("threads", "handles", "children", "shared", "temporary"):
        assert last[what] - first[what] < pictures // SEGMENT, (what, said)
    # One in ten of the pictures or of the states that have passed would be more.
    assert last["objects"] - first["objects"] < 0.01 * pictures * STEPS
    kept = min(pictures * 3 * SIZE[0] * SIZE[1], pictures * STEPS * particles * 256)
    assert last["bytes"] - first["bytes"] < 0.1 * kept, said


def simulated(threads, at_once=lambda: None):
    """The hashes of a gas at three times, on so many threads; ``at_once`` is called before each."""
    simulation, hashes = ps.Simulation(gas(40, friction=0.3), threads=threads), []
    for _ in range(3):
        at_once()
        simulation.run(steps=20)
        hashes.append(simulation.state_hash())
    return hashes


@pytest.fixture
def few_are_many(monkeypatch):
    """Let threads share even a few items."""
    monkeypatch.setattr(parallel, "ALONE", 4)


def test_simulations_in_turn_keep_their_own_threads(few_are_many):
    alone = simulated(1)
    one, other = (ps.Simulation(gas(40, friction=0.3), threads=threads) for threads in (1, 3))
    for expected in alone:
        for simulation in (one, other):
            simulation.run(steps=20)
            assert simulation.state_hash() == expected


def test_simulations_at_the_same_time_do_not_disturb_each_other(few_are_many):
    alone, usual, before = simulated(1), parallel.available_threads(), set(threading.enumerate())
    together, found = threading.Barrier(3), {}

    def run(threads):
        found[threads] = simulated(threads, together.wait)
        found[-threads] = parallel.available_threads()

    runs = [threading.Thread(target=run, args=(threads,)) for threads in (1, 2, 4)]
    for each in runs:
        each.start()
    for each in runs:
        each.join()
    assert [found[threads] for threads in (1, 2, 4)] == [alone] * 3
    assert [found[-threads] for threads in (1, 2, 4)] == [usual] * 3
    gc.collect()
    pooled = set(threading.enumerate()) - before
    for each in pooled:
        each.join(timeout=60)
    assert not any(each.is_alive() for each in pooled)
