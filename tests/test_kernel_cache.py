"""The cache of compiled kernels may be damaged or find no room: then there is more to compile, and nothing else."""

import os
import subprocess
import sys

import pytest

PROGRAM = """
import resource, signal, sys
import numba
from particlesim.core.kernel_cache import KernelCache

@numba.njit
def add(a, b):
    return a + b

@numba.njit
def subtract(a, b):
    return a - b

if "full" in sys.argv:
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10, 10))
for function in (add, subtract):
    function._cache = KernelCache(function.py_func)
print(add(1, 2), subtract(1, 2), sum(add.stats.cache_hits.values()), flush=True)
"""


@pytest.fixture
def program(tmp_path):
    """Runs the program, which says 3, -1 and how often it found what was kept."""
    (tmp_path / "program.py").write_text(PROGRAM)

    def run(*arguments):
        command = [sys.executable, str(tmp_path / "program.py"), *arguments]
        environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
        return subprocess.run(command, capture_output=True, text=True, check=False, timeout=100, env=environment)

    return run


@pytest.mark.parametrize("ending", [".nbi", ".nbc"])
@pytest.mark.parametrize("damage", [lambda data: b"", lambda data: data[:-9], lambda data: bytes(len(data))])
def test_what_is_damaged_is_compiled_anew(program, tmp_path, ending, damage):
    assert program().stdout == "3 -1 0\n"
    for file in tmp_path.rglob(f"*{ending}"):
        file.write_bytes(damage(file.read_bytes()))
    for hits in (0, 1):
        done = program()
        assert (done.stdout, done.stderr, done.returncode) == (f"3 -1 {hits}\n", "", 0)


def test_what_finds_no_room_is_told_once(program, tmp_path):
    done = program("full")
    assert (done.stdout, done.returncode) == ("3 -1 0\n", 0)
    assert done.stderr.count("compiled kernels cannot be kept (File too large): the next run compiles them again") == 1
    assert not [file for file in tmp_path.rglob("*") if file.suffix in (".nbi", ".nbc")]


def test_a_folder_that_cannot_be_written_to_is_told(tmp_path):
    (tmp_path / "file").touch()
    code = "from particlesim.cli import streams; streams.warn_in_one_line(); import particlesim.core.jit as jit"
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "file"), "TMPDIR": str(tmp_path)}
    done = subprocess.run(
        [sys.executable, "-c", f"{code}; print(jit.CACHE_FOLDER)"],
        capture_output=True,
        text=True,
        check=True,
        env=environment,
    )
    kept = f"{tmp_path}/particlesim-{os.getuid()}"
    assert done.stdout == f"{kept}\n"
    assert done.stderr.startswith(f"compiled kernels are kept in {kept}: ") and done.stderr.count("\n") == 1
