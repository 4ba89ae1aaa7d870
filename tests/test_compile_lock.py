"""Processes that compile beside each other: one at a time is at a function, and none waits without end."""

import subprocess
import sys
import time

import pytest

from particlesim.core import compile_lock
from particlesim.core.compile_lock import compiled_here

HOLD = """
import sys
from pathlib import Path
from particlesim.core.compile_lock import compiled_here
from tests.test_compile_lock import one

with compiled_here(Path(sys.argv[1]), one):
    print("held", flush=True)
    sys.stdin.read()
"""


def one():
    """A function that is compiled."""


def other():
    """Another."""


@pytest.fixture
def file(tmp_path):
    yield tmp_path / "locks"
    compile_lock._opened.cache_clear()


@pytest.fixture
def holder(file):
    """Another process, which holds the lock of ``one``."""
    with subprocess.Popen(
        [sys.executable, "-c", HOLD, str(file)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout.readline() == "held\n"
        yield process
        process.kill()


@pytest.mark.parametrize("end", ["done", "killed"])
def test_what_another_process_compiles_is_waited_for(holder, file, monkeypatch, end):
    waits = []

    def sleep(seconds):
        waits.append(seconds)
        if len(waits) == 3:
            holder.kill() if end == "killed" else holder.stdin.close()
            holder.wait()

    monkeypatch.setattr(time, "sleep", sleep)
    with compiled_here(file, one):
        assert len(waits) == 3


def test_another_function_is_not_waited_for(holder, file, monkeypatch):
    monkeypatch.setattr(time, "sleep", None)
    with compiled_here(file, other):
        pass


def test_patience_ends(holder, file, monkeypatch):
    monkeypatch.setattr(compile_lock, "_PATIENCE", 0.05)
    with compiled_here(file, one):
        assert holder.poll() is None


def test_a_process_may_ask_for_a_lock_that_it_has(file, monkeypatch):
    monkeypatch.setattr(time, "sleep", None)
    with compiled_here(file, one), compiled_here(file, one):
        pass


def test_where_there_can_be_no_locks_there_are_none(tmp_path):
    with compiled_here(tmp_path / "no folder" / "locks", one):
        pass
