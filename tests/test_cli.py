"""The commands: what they print, what they leave behind, and with which exit code they end."""

import os
import re
import signal
import subprocess
import sys
import threading
import time

import pytest
from typer.testing import CliRunner

import particlesim as ps
from particlesim.cli import main as cli
from particlesim.cli.doctor import Finding
from particlesim.cli.progress import shown_progress
from particlesim.scene.file import SceneError

SCENE = """
duration = 0.1
[world]
size = [4.0, 4.0, 4.0]
[[particles]]
name = "[red]balls[/red]"
shape = "sphere"
count = 5
size = 0.3
velocity = { kind = "maxwell", temperature = 6.0 }
[movie]
resolution = [64, 64]
"""

TOO_LARGE = "particles[0].size = 5.0: too large: particles are 5 m thick, between walls 4 m apart"
NUMBERED = "pictures of a movie need a place for their number"
NO_FILE = "is not a file to write to; movies and trajectories need one"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.toml").write_text(SCENE)
    return tmp_path


def run(*arguments):
    return CliRunner().invoke(cli.app, arguments)


def program(*arguments, **options):
    return subprocess.run(
        [sys.executable, "-m", "particlesim", *arguments], capture_output=True, text=True, check=False, **options
    )


def files(folder):
    return sorted(path.name for path in folder.iterdir())


def test_help_loads_nothing_heavy():
    heavy = "{'numba', 'scipy', 'numpy', 'pydantic', 'rich', 'PIL', 'gsd', 'trimesh'}"
    code = f"import sys, particlesim.cli.main; print(sorted({heavy} & set(sys.modules)))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"


def test_without_arguments_there_is_help():
    for result in (run(), run("--help")):
        assert "Usage: " in result.output
        for command in ("render", "simulate", "check", "compare", "doctor", "schema"):
            assert command in result.output


def test_the_module_runs_as_the_command_does():
    result = program("--version")
    assert re.fullmatch(r"particlesim \d+\.\d+\.\d+\n", result.stdout)
    assert (result.returncode, result.stderr) == (0, "")


def test_check_says_what_a_scene_amounts_to(folder):
    result = run("check", "scene.toml")
    assert result.exit_code == 0
    for words in ("[red]balls[/red]", "5 x sphere, size 0.3", "4 x 4 x 4 m", "0.0011", "octree", "4 of 64 x 64 at 30"):
        assert words in result.stdout
    assert files(folder) == ["scene.toml"]


def test_the_schema_is_json(folder):
    assert '"particles"' in run("schema").stdout


def test_simulate_writes_a_trajectory_and_says_so(folder):
    result = run("simulate", "scene.toml")
    assert (result.exit_code, files(folder / "renders")) == (0, ["scene.gsd"])
    assert "renders/scene.gsd" in result.stdout
    assert result.stderr.splitlines()[0] == "preparing 4 frames"
    assert result.stderr.splitlines()[-1] == "simulating: frame 4 of 4"


def test_quiet_prints_nothing_and_a_missing_ending_is_added(folder):
    result = run("simulate", "scene.toml", "--quiet", "-o", "run")
    assert (result.exit_code, result.output) == (0, "")
    assert files(folder) == ["run.gsd", "scene.toml"]


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["check", "none.toml"], "none.toml: no such file"),
        (["check", "scen.toml"], "scen.toml: no such file; did you mean 'scene.toml'?"),
        (["check", "."], ".: is a folder, not a scene file"),
        (["check", "run.gsd"], "run.gsd: must be a scene file (TOML)"),
        (["simulate", "scene.toml", "-o", "none/run.gsd"], "none/run.gsd: there is no folder none"),
        (["simulate", "scene.toml", "-o", "run.txt"], "run.txt: the output must end in .gsd"),
        (["render", "scene.toml", "-o", "movie.avi"], "movie.avi: the output must end in .mp4, .webm, .gif or .png"),
        (["render", "scene.toml", "-o", "."], ".: is a folder, not a file to write to"),
        (["render", "scene.toml", "-o", "z.png"], f"z.png: {NUMBERED}, such as z_%05d.png"),
        (["render", "scene.toml", "-o", "-"], f"-: {NO_FILE}"),
        (["render", "scene.toml", "-o", "/dev/null"], f"/dev/null: {NO_FILE}"),
        (["simulate", "scene.toml", "-o", "/dev/stdout"], f"/dev/stdout: {NO_FILE}"),
        (["simulate", "scene.toml", "-o", "/dev/none.gsd"], f"/dev/none.gsd: {NO_FILE}"),
        (["render", "none.gsd"], "none.gsd: no such file"),
        (["simulate", "full.toml"], f"full.toml: {TOO_LARGE}"),
        (["render", "full.toml"], f"full.toml: {TOO_LARGE}"),
    ],
)  # fmt: skip
def test_wrong_input_gets_one_line_and_leaves_nothing(arguments, line, folder):
    (folder / "full.toml").write_text(SCENE.replace("size = 0.3", "size = 5"))
    before = files(folder)
    result = run(*arguments, "-q") if arguments[0] != "check" else run(*arguments)
    assert (result.exit_code, result.stderr, result.stdout) == (2, line + "\n", "")
    assert files(folder) == before


@pytest.mark.parametrize("content", [b"", b"garbage", bytes(range(256)) * 16])
def test_a_file_that_is_no_trajectory_gets_one_line(content, folder):
    (folder / "run.gsd").write_bytes(content)
    result = run("render", "run.gsd", "-q")
    assert (result.exit_code, result.stdout, result.stderr.count("\n")) == (2, "", 1)
    assert result.stderr.startswith("run.gsd: ")
    assert files(folder) == ["run.gsd", "scene.toml"]


def test_an_output_that_was_there_survives_a_failure(folder):
    (folder / "run.gsd").write_text("of yesterday")
    (folder / "scene.toml").write_text(SCENE.replace("size = 0.3", "size = 5"))
    assert run("simulate", "scene.toml", "-o", "run.gsd").exit_code == 2
    assert (folder / "run.gsd").read_text() == "of yesterday"


def failing(error):
    def fail(*_, **__):
        raise error

    return fail


def test_bugs_are_not_hidden(folder, monkeypatch):
    for error in (ValueError("a bug"), RuntimeError("a bug"), KeyError("a bug")):
        monkeypatch.setattr("particlesim.jobs.movie.simulate", failing(error))
        result = run("simulate", "scene.toml")
        assert (result.exit_code, result.exception) == (1, error)


def test_failures_of_the_machine_are_one_line(folder, monkeypatch):
    monkeypatch.setattr("particlesim.jobs.movie.simulate", failing(OSError(28, "No space left on device", "run.gsd")))
    result = run("simulate", "scene.toml", "-q")
    assert (result.exit_code, result.output) == (1, "run.gsd: No space left on device\n")
    monkeypatch.setattr("particlesim.jobs.movie.simulate", failing(MemoryError("Unable to allocate 8 GiB")))
    assert run("simulate", "scene.toml", "-q").output == "out of memory: Unable to allocate 8 GiB\n"
    monkeypatch.setattr("particlesim.jobs.movie.simulate", failing(SceneError("is odd", "world", 3)))
    assert run("simulate", "scene.toml", "-q").output == "scene.toml: world = 3: is odd\n"
    assert files(folder) == ["scene.toml"]


def test_the_doctor_ends_with_the_fix_on_a_line_of_its_own(monkeypatch):
    fix = "OpenGL is missing: install it with: apt-get install -y --no-install-recommends libegl1 libgl1"
    monkeypatch.setattr("particlesim.cli.doctor.diagnose", lambda: [Finding("OpenGL", False, fix)])
    result = run("doctor")
    assert (result.exit_code, result.stderr) == (1, f"OpenGL: {fix}\n")
    assert "missing, see below" in result.stdout
    monkeypatch.setattr("particlesim.cli.doctor.diagnose", lambda: [Finding("OpenGL", True, "there")])
    assert run("doctor").exit_code == 0


@pytest.mark.parametrize(
    ("number", "code", "word"),
    [(signal.SIGINT, 130, "interrupted"), (signal.SIGTERM, 143, "terminated"), (signal.SIGHUP, 129, "hung up")],
)
@pytest.mark.parametrize(("command", "phase"), [("simulate", "simulating"), ("render", "rendering")])
def test_a_signal_ends_with_one_line_and_nothing_half_written(folder, command, phase, number, code, word):
    (folder / "scene.toml").write_text(SCENE.replace("duration = 0.1", "duration = 1e4"))
    child = subprocess.Popen(
        [sys.executable, "-m", "particlesim", command, "scene.toml"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # A shell that runs tests in the background ignores Ctrl-C, nohup a hang-up, and children inherit that.
        preexec_fn=lambda: signal.signal(number, signal.SIG_DFL),  # noqa: PLW1509
    )
    lines = []
    for line in child.stderr:
        lines.append(line)
        if line.startswith(phase):
            # ffmpeg may not have begun to write.
            assert command == "render" or any(name.startswith(".scene.") for name in os.listdir("renders"))
            child.send_signal(number)
            break
    rest, errors = child.communicate(timeout=60)
    assert (child.returncode, rest) == (code, "")
    assert errors.splitlines()[-1] == f"{word}; nothing was written"
    assert "Traceback" not in errors
    assert files(folder) == ["scene.toml"]


def test_a_reader_that_leaves_is_no_error(folder):
    child = subprocess.Popen(
        [sys.executable, "-m", "particlesim", "schema"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    child.stdout.close()
    assert child.stderr.read() == ""
    child.stderr.close()
    child.wait(timeout=60)


@pytest.mark.parametrize("arguments", [["--version"], ["schema"], ["check", "scene.toml"]])
def test_what_cannot_be_printed_is_one_line(folder, arguments):
    for unbuffered in ("", "1"):
        with open("/dev/full", "w") as full:
            command = [sys.executable, "-m", "particlesim", *arguments]
            environment = {**os.environ, "PYTHONUNBUFFERED": unbuffered}
            result = subprocess.run(
                command, stdout=full, stderr=subprocess.PIPE, text=True, check=False, env=environment
            )
        assert (result.returncode, result.stderr) == (1, "standard output: No space left on device\n")


def test_progress_that_nobody_reads_ends_no_run(folder):
    reading, writing = os.pipe()
    os.close(reading)
    command = [sys.executable, "-m", "particlesim", "simulate", "scene.toml", "-o", "run.gsd"]
    with os.fdopen(writing, "w") as closed:
        assert subprocess.run(command, stdout=subprocess.DEVNULL, stderr=closed, check=False).returncode == 0
    assert files(folder) == ["run.gsd", "scene.toml"]


def test_no_file_takes_the_place_of_a_closed_stream(tmp_path):
    code = (
        "import os, sys; from particlesim.cli.streams import open_streams; open_streams()\n"
        f"with open({str(tmp_path / 'x')!r}, 'w') as file: print(file.fileno(), file=file)\n"
        "print('out'); print('error', file=sys.stderr)"
    )
    subprocess.run(["sh", "-c", 'exec "$@" <&- >&- 2>&-', "sh", sys.executable, "-c", code], check=True)
    assert int((tmp_path / "x").read_text()) > 2


def test_plain_progress_lines_carry_an_estimate(capsys, monkeypatch):
    clock = iter(range(0, 10_000, 10))
    monkeypatch.setattr(time, "monotonic", lambda: next(clock))
    with shown_progress(quiet=False) as progress:
        progress("preparing", 0, 100)
        for done in range(1, 101):
            progress("simulating", done, 100)
    lines = capsys.readouterr().err.splitlines()
    assert lines[:3] == [
        "preparing 100 frames",
        "simulating: frame 1 of 100",
        "simulating: frame 2 of 100, 33 min left",
    ]
    assert lines[3] == "simulating: frame 3 of 100, 32 min left"
    assert lines[-2:] == ["simulating: frame 99 of 100, 20 s left", "simulating: frame 100 of 100"]


def test_a_terminal_gets_a_bar(folder):
    pty = pytest.importorskip("pty")
    leader, follower = pty.openpty()
    seen = []

    def read():
        with os.fdopen(leader, "rb", buffering=0) as stream:
            try:
                while data := stream.read(4096):
                    seen.append(data)
            except OSError:  # the other end is closed
                pass

    reader = threading.Thread(target=read)
    reader.start()
    environment = {**os.environ, "TERM": "xterm", "COLUMNS": "100"}
    result = subprocess.run(
        [sys.executable, "-m", "particlesim", "simulate", "scene.toml"],
        stdout=subprocess.DEVNULL,
        stderr=follower,
        env=environment,
        check=False,
    )
    os.close(follower)
    reader.join(timeout=60)
    text = b"".join(seen).decode()
    assert result.returncode == 0
    assert "preparing" in text
    assert "frame 4 of 4" in text


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["rendr", "x"], "No such command 'rendr'. Did you mean 'render'?; see particlesim --help"),
        (["check"], "Missing argument 'SCENE'; see particlesim check --help"),
        (["check", "x", "--foo"], "No such option: --foo; see particlesim check --help"),
        (["--foo"], "No such option: --foo; see particlesim --help"),
        (["simulate", "x", "--threads", "0"], "Invalid value for '--threads': must be 1 to 4,096; see particlesim"),
        (["simulate", "x", "--threads", f"{2**62}"], "Invalid value for '--threads': must be 1 to 4,096; see part"),
    ],
)
def test_a_wrong_command_line_gets_one_line(arguments, line):
    result = program(*arguments)
    assert (result.returncode, result.stdout, result.stderr.count("\n")) == (2, "", 1)
    assert result.stderr.replace("python -m ", "").startswith(line)


def test_check_tells_title_mass_and_computing_time(folder):
    scene = 'title = "Five balls"\n' + SCENE.replace("name =", "mass = 2.0\nname =")
    (folder / "scene.toml").write_text(scene)
    run("simulate", "scene.toml")
    output = " ".join(run("check", "scene.toml").stdout.replace("\u2502", " ").split())
    assert "title Five balls" in output and "mass 10 kg in all" in output
    assert "computing less than a second to simulate" in output or "computing a step" in output


def test_steps_without_end_are_refused(folder):
    (folder / "scene.toml").write_text(SCENE + "[solver]\ntime_step = 1e-30\n")
    for command in ("check", "simulate"):
        result = run(command, "scene.toml")
        assert result.exit_code == 2 and result.stderr.splitlines()[-1] == (
            "scene.toml: solver.time_step = 1e-30: takes about 1e+29 time steps; there may be up to 1e+12"
        )
    assert not (folder / "renders").exists()


def test_a_trajectory_is_readable_as_a_movie_is_and_says_its_times(folder):
    os.umask(before := os.umask(0o022))
    assert run("simulate", "scene.toml", "-q").exit_code == 0
    path = folder / "renders/scene.gsd"
    assert path.stat().st_mode & 0o777 == 0o666 & ~before
    output = " ".join(run("render", str(path), "--still", "0.1", "-o", "x.png").stdout.split())
    assert "time \u2502 0.1 s" in output and "simulated" not in output


def test_what_the_library_shows_of_itself(folder):
    assert [name for name in dir(ps) if not name.startswith("__")] == sorted(ps.__all__)
    summary = ps.simulate(ps.load_scene("scene.toml"), "x.gsd")
    assert repr(summary).startswith("<Summary of x.gsd: 4 frames, 0 drawn, 0 to 0.1 s, ")
