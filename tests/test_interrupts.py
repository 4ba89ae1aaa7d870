"""Signals that ask to end arrive as one exception, whatever is running."""

import gc
import os
import signal
import subprocess
import sys

import pytest
from typer.testing import CliRunner

from particlesim.cli import main as cli
from particlesim.core.interrupts import Interrupted, raise_signals

# A kernel that returns named tuples is interrupted most of the time while numba makes Python objects of them.
KERNEL = """
import random, signal; random.seed(1)
from typing import NamedTuple
import numpy as np
from particlesim.core import interrupts
from particlesim.core.jit import entry_kernel

class Found(NamedTuple):
    values: np.ndarray
    total: float

@entry_kernel
def find(count):
    total = 0.0
    for k in range(count):
        total += np.sin(k)
    return Found(np.empty(3), total), np.empty(2)

interrupts._GRACE, interrupts._SIGNALS = 0.0, (signal.SIGALRM,)
signal.signal(signal.SIGALRM, signal.SIG_DFL)
interrupts.raise_signals()
find(1)
for _ in range(200):
    try:
        signal.setitimer(signal.ITIMER_REAL, random.uniform(0.0005, 0.003))
        for _ in range(1000):
            find(100_000)
        print("missed")
    except interrupts.Interrupted:
        pass
print("done")
"""

# LLVM hands over what it has compiled, as the signal arrives: the code is kept all the same.
COMPILED = """
import os, signal
import numba
from numba.core.codegen import CPUCodeLibrary
from particlesim.core import interrupts

take, struck = CPUCodeLibrary._object_compiled_hook, []

def interrupted(*compiled):
    if not struck:
        struck.append(True)
        os.kill(os.getpid(), signal.SIGTERM)
    take(*compiled)

CPUCodeLibrary._object_compiled_hook = interrupted
interrupts.raise_signals()

@numba.njit(cache=True)
def add(a, b):
    return a + b

try:
    print(add(1, 2))
except interrupts.Interrupted:
    print("interrupted")
print(add(1, 2))
"""


@pytest.fixture
def signals():
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    hook = sys.unraisablehook
    for number in before:
        signal.signal(number, signal.SIG_DFL)
    yield
    for number, handler in before.items():
        signal.signal(number, handler)
    sys.unraisablehook = hook


def test_an_interruption_amid_kernels_is_one():
    done = subprocess.run([sys.executable, "-c", KERNEL], capture_output=True, text=True, check=False, timeout=60)
    assert (done.stdout, done.stderr, done.returncode) == ("done\n", "", 0)


def test_an_interruption_amid_compiling_is_one_and_loses_no_code(tmp_path):
    (tmp_path / "program.py").write_text(COMPILED)
    command = [sys.executable, str(tmp_path / "program.py")]
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=100, env=environment)
    assert (done.stdout, done.stderr, done.returncode) == ("interrupted\n3\n", "", 0)


def test_signals_that_follow_at_once_do_not_disturb_the_cleaning_up(signals):
    raise_signals()
    with pytest.raises(Interrupted) as caught:
        os.kill(os.getpid(), signal.SIGHUP)
    os.kill(os.getpid(), signal.SIGTERM)
    os.kill(os.getpid(), signal.SIGINT)
    assert caught.value.number == signal.SIGHUP


class Dying:
    """Gets a signal as it dies, where exceptions are not raised."""

    def __init__(self):
        self.itself = self

    def __del__(self):
        os.kill(os.getpid(), signal.SIGTERM)
        raise ValueError("of what is half made")


@pytest.mark.parametrize(
    "die", [lambda one: setattr(one, "itself", None), lambda one: None], ids=["counted", "collected"]
)
def test_an_interruption_where_exceptions_are_forgotten_is_none_the_less_one(signals, die, capfd):
    def work():
        one = Dying()
        die(one)
        del one
        gc.collect()
        return "lost"

    raise_signals()
    with pytest.raises(Interrupted) as caught:
        assert work() is None
    assert caught.value.number == signal.SIGTERM
    Dying().itself = None
    assert capfd.readouterr().err == ""


def test_what_is_ignored_stays_so(signals):
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    raise_signals()
    os.kill(os.getpid(), signal.SIGHUP)
    assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN


@pytest.mark.parametrize(
    ("error", "code", "line"),
    [
        (KeyboardInterrupt(), 130, "interrupted; nothing was written\n"),
        (Interrupted(signal.SIGTERM), 143, "terminated; nothing was written\n"),
        (Interrupted(signal.SIGHUP), 129, "hung up; nothing was written\n"),
    ],
)
def test_a_command_ends_with_one_line(monkeypatch, tmp_path, error, code, line):
    def stop(_):
        raise error

    monkeypatch.setattr("particlesim.simulation.estimate.estimate", stop)
    world = '[world]\nsize = [1, 1, 1]\n[[particles]]\nshape = "cube"\ncount = 1\nsize = 0.1\n'
    (tmp_path / "a.toml").write_text(world)
    result = CliRunner().invoke(cli.app, ["check", str(tmp_path / "a.toml")])
    assert (result.exit_code, result.output) == (code, line)
