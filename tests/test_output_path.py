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
        (ps.render, "z.avi", "must end in .mp4, .webm, .gif or .png$"),
        (ps.render, "z", "must end in .mp4, .webm, .gif or .png$"),
        (ps.render, "z.png", r"pictures of a movie need a place for their number, such as .*z_%05d\.png$"),
        (ps.render, "z_%d_%d.png", "pictures of a movie need a place for their number"),
        (ps.render, "z_%s.png", "pictures of a movie need a place for their number"),
        (ps.render, "poster_%d.png", "poster_0.png: is a folder, not a file to write to"),
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
    (tmp_path / "poster_0.png").mkdir()
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


GROUP = "[world]\nsize = [4, 4, 4]\n[[particles]]\nshape = %s\ncount = %s\nsize = 0.01\n"
MESH = '{ kind = "mesh", file = "meshes/m.%s" }'
NUMBERED = "pictures of a movie need a place for their number"
TRILLION = "particles[0].count = 1000000000000: must be a whole number from 0 to 100,000,000"


@pytest.mark.parametrize(
    ("scene", "arguments", "line"),
    [
        ("", ["-o", "z.avi"], "z.avi: the output must end in .mp4, .webm, .gif or .png"),
        (GROUP % ('"sphere"', 1), ["-o", "z.png"], f"z.png: {NUMBERED}, such as z_%05d.png"),
        ("", ["-o", "z.gif", "--shard", "1/2"], "z.gif: the output must end in .mp4"),
        (GROUP % ('"sphere"', 10**12), [], f"a.toml: {TRILLION}"),
        (
            "duration = 100\n" + GROUP % ('"sphere"', 10**8),
            ["-o", "z.mp4"],
            "a.toml: particles: 100,000,000 particles need about 140 GB of memory; there are 1 GB",
        ),
        (
            "duration = 1e5\n[movie]\nresolution = [4000, 4000]\n" + GROUP % ('"sphere"', 1),
            ["-o", "z.mp4"],
            "z.mp4: takes 98.9 GB on the disk, of which 1.0 GB are free: "
            "fewer frames or particles, smaller pictures, or another folder",
        ),
        (
            GROUP % (MESH % "off", 1),
            [],
            'a.toml: particles[0].shape.file = "meshes/m.off": must be an STL, OBJ or PLY file',
        ),
        (
            GROUP % (MESH % "stl", 1),
            [],
            'a.toml: particles[0].shape.file = "meshes/m.stl": has 500 MB: a mesh file has 100 MB at most',
        ),
    ],
)
def test_the_command_refuses_before_it_loads_what_the_work_needs(tmp_path, scene, arguments, line):
    """On a machine with a gigabyte of each."""
    (tmp_path / "in/meshes").mkdir(parents=True)
    (tmp_path / "in/a.toml").write_text(scene)
    (tmp_path / "in/meshes/m.off").touch()
    with (tmp_path / "in/meshes/m.stl").open("wb") as file:
        file.truncate(500_000_000)
    code = f"""
import os, shutil, sys
from particlesim.cli.main import main
os.sysconf = lambda name: 31623
shutil.disk_usage = lambda path: shutil._ntuple_diskusage(10**12, 0, 10**9)
sys.argv = ["particlesim", "render", "a.toml", *{arguments}]
try:
    main()
finally:
    print(sorted({{"numba", "gsd", "scipy", "trimesh"}} & set(sys.modules)))
"""
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path / "in", check=False)
    assert (done.returncode, done.stdout, done.stderr) == (2, "[]\n", line + "\n")
    assert sorted(path.name for path in (tmp_path / "in").iterdir()) == ["a.toml", "meshes"]
