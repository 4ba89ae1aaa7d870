"""One gate for output paths, for the commands and for the library, before any work."""

import os
import subprocess
import sys

import pytest

import particlesim as ps
from particlesim.core.output_path import OutputError, check_output
from tests.worlds import gas


def still(scene, path):
    return ps.still(scene, path, 0.0)


@pytest.fixture
def no_work(monkeypatch):
    """Nothing may be simulated, read or drawn."""

    def work(*_, **__):
        raise AssertionError("work was begun")

    for name in ("frame_source.start", "movie.opened", "drawers.Renderer"):
        monkeypatch.setattr(f"particlesim.jobs.{name}", work)


@pytest.mark.parametrize(
    ("make", "name", "words"),
    [
        (ps.render, "z.png", "must end in .mp4"),
        (ps.render, "z.gif", "must end in .mp4"),
        (ps.render, "z", "must end in .mp4"),
        (ps.simulate, "z.mp4", "must end in .gsd"),
        (still, "z.mp4", "must end in .png"),
        (ps.render, "none/z.mp4", "there is no folder"),
        (ps.render, "folder.mp4", "is a folder, not a file to write to"),
        (ps.render, "poster.mp4", "poster.png: is a folder, not a file to write to"),
        (ps.render, "pipe.mp4", "is not a file to write to"),
        (ps.simulate, "/dev/null", "is not a file to write to"),
        (ps.simulate, "/dev/z.gsd", "is not a file to write to"),
    ],
)
def test_a_wrong_path_is_refused_in_one_line(tmp_path, no_work, make, name, words):
    (tmp_path / "folder.mp4").mkdir()
    (tmp_path / "poster.png").mkdir()
    os.mkfifo(tmp_path / "pipe.mp4")
    before = sorted(tmp_path.iterdir())
    with pytest.raises(OutputError, match=words) as error:
        make(gas(1), tmp_path / name)
    assert "\n" not in str(error.value)
    assert sorted(tmp_path.iterdir()) == before


def test_a_folder_that_takes_no_files_is_named_before_the_work(no_work):
    with pytest.raises(OSError, match=r"^/proc/z\.mp4: the folder /proc cannot be written to$"):
        ps.render(gas(1), "/proc/z.mp4")


def test_a_good_path_is_let_through_and_nothing_is_left(tmp_path):
    (tmp_path / "old.mp4").write_text("of yesterday")
    for name in ("12:30.mp4", "A.MP4", "old.mp4"):
        check_output(tmp_path / name, ".mp4", beside=(".png",))
    assert [path.name for path in tmp_path.iterdir()] == ["old.mp4"]


def test_the_command_refuses_before_it_loads_what_the_work_needs(tmp_path):
    (tmp_path / "a.toml").write_text("")
    code = (
        "import sys\nfrom particlesim.cli.main import main\n"
        "sys.argv = ['particlesim', 'render', 'a.toml', '-o', 'z.gif']\n"
        "try:\n    main()\nfinally:\n    print(sorted({'numba', 'gsd', 'scipy', 'trimesh'} & set(sys.modules)))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (2, "[]\n", "z.gif: the output must end in .mp4\n")
