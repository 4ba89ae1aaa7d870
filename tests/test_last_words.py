"""Programs that end without a word are spoken for: how they ended, and what they told last."""

import signal
import subprocess
import sys

import pytest
from typer.testing import CliRunner

from particlesim.cli import main as cli
from tests import killed

PROGRAM = """
import ctypes, os, resource, signal, sys
from particlesim.core.last_words import last_words, watched

resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
with watched():
    last_words("nothing was kept")
    last_words("3 of 9 frames are kept")
    exec(sys.argv[1])
"""

# The driver crashes, for real, as it gives the thirtieth picture; until then all is kept.
RENDER = """
import ctypes, itertools, resource, sys
from particlesim.cli.main import main
from particlesim.jobs import partial_run
from particlesim.rendering.gl import platform

resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
partial_run.INTERVAL = partial_run._SPARE = 0.0
partial_run._sync = lambda path: None
gl, pictures = platform.open_bridge(platform.choose()).gl, itertools.count(1)
read = gl.glReadPixels
gl.glReadPixels = lambda *args: ctypes.string_at(0) if next(pictures) == 30 else read(*args)
main()
"""


def ended(code, *arguments, **options):
    """How a program ends, and what is said then."""
    command = [sys.executable, "-c", code, *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=600, **options)
    return done.returncode, done.stderr


@pytest.mark.parametrize(
    ("end", "status", "said"),
    [
        ("pass", 0, ""),
        ("sys.exit(3)", 3, ""),
        ("last_words(''); os.kill(os.getpid(), signal.SIGKILL)", -signal.SIGKILL, ""),
        ("os.kill(os.getpid(), signal.SIGKILL)", -signal.SIGKILL, "killed, or out of memory; 3 of 9 frames are kept\n"),
        ("ctypes.string_at(0)", -signal.SIGSEGV, "the program crashed (Segmentation fault); 3 of 9 frames are kept\n"),
        ("os.abort()", -signal.SIGABRT, "the program crashed (Aborted); 3 of 9 frames are kept\n"),
    ],
)
def test_what_is_said_last(end, status, said):
    assert ended(PROGRAM, end) == (status, said)


def test_whoever_has_told_more_than_a_pipe_holds_does_not_wait():
    stop = "import psutil; [child.suspend() for child in psutil.Process().children()]; "
    tell = "[last_words('x' * 4000) for _ in range(100)]; [child.resume() for child in psutil.Process().children()]"
    assert ended(PROGRAM, stop + tell)[0] == 0


def test_a_driver_that_crashes_is_named_and_gone_on_from(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.toml").write_text(killed.SCENE)
    render = ["render", "a.toml", "-q", "-o"]
    status, said = ended(RENDER, *render, "a.mp4", cwd=tmp_path)
    assert status == -signal.SIGSEGV
    assert said.startswith("OpenGL crashed (Segmentation fault); ") and said.count("\n") == 1
    assert said.endswith(" of 76 frames are kept in .a.mp4.partial; --resume goes on with them\n")
    assert CliRunner().invoke(cli.app, [*render, "a.mp4", "--resume"]).exit_code == 0
    assert CliRunner().invoke(cli.app, [*render, "straight.mp4"]).exit_code == 0
    assert (tmp_path / "a.mp4").read_bytes() == (tmp_path / "straight.mp4").read_bytes()
