"""Signals that ask to end arrive as one exception, whatever is running."""

import gc
import os
import signal
import subprocess
import sys

import pytest
from typer.testing import CliRunner

from particlesim.cli import main as cli
from particlesim.core.interrupts import Interrupted, interruption, raise_signals

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


# A signal arrives as a module is read, the first of the program's own or one of those that commands need.
EARLY = """
import os, sys
from particlesim.__main__ import main

_, module, number, *sys.argv[1:] = sys.argv

class Finder:
    def find_spec(self, name, *_):
        if name == module:
            sys.meta_path.remove(self)
            os.kill(os.getpid(), int(number))

sys.meta_path.insert(0, Finder())
main()
"""

# All is done, and a signal comes as Python takes leave.
LATE = """
import atexit, os, signal, sys
from particlesim.__main__ import main

atexit.register(lambda: os.kill(os.getpid(), signal.SIGTERM))
sys.argv = ["particlesim", "schema"]
main()
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


@pytest.mark.parametrize("module", ["particlesim.cli.main", "typer.main", "particlesim.scene.groups", "numba"])
@pytest.mark.parametrize("command", ["check", "export"])
@pytest.mark.parametrize(
    ("number", "line"),
    [(signal.SIGINT, "interrupted; nothing was written\n"), (signal.SIGTERM, "terminated; nothing was written\n")],
)
def test_an_early_interruption_is_said_in_one_line(tmp_path, module, command, number, line):
    (tmp_path / "a.toml").write_text(
        '[world]\nsize = [1, 1, 1]\n[[particles]]\nshape = "cube"\ncount = 1\nsize = 0.1\n'
    )
    call = [sys.executable, "-c", EARLY, module, str(int(number)), command, "a.toml"]
    call += ["-o", "a.xyz"] if command == "export" else []
    # A shell that runs tests in the background ignores Ctrl-C, and children inherit that.
    told = {"preexec_fn": lambda: signal.signal(number, signal.SIG_DFL)}
    done = subprocess.run(call, capture_output=True, text=True, check=False, timeout=60, cwd=tmp_path, **told)
    assert (done.returncode, done.stdout, done.stderr.splitlines(True)[-1:]) == (128 + number, "", [line])
    assert "Traceback" not in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["a.toml"]


def test_an_interruption_that_another_error_takes_the_place_of_is_none_the_less_one(signals):
    class Struck:
        def __set_name__(self, owner, name):
            os.kill(os.getpid(), signal.SIGTERM)

    raise_signals()
    with pytest.raises(BaseException) as caught:  # a RuntimeError before Python 3.12
        type("Owner", (), {"value": Struck()})
    assert interruption(caught.value).number == signal.SIGTERM
    assert interruption(ValueError("of it")).number == signal.SIGTERM


def test_errors_without_an_interruption_are_none(signals):
    assert interruption(ValueError("of a user")) is None
    raise_signals()
    assert interruption(ValueError("of a user")) is None


def test_a_signal_after_the_work_says_nothing():
    done = subprocess.run([sys.executable, "-c", LATE], capture_output=True, text=True, check=False, timeout=60)
    assert (done.returncode, done.stderr) == (-signal.SIGTERM, "")
    assert done.stdout.startswith("{")


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
