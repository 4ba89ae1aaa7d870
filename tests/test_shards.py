"""A movie drawn in parts and joined is the movie drawn at once, and what is no part of it is named."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

import particlesim as ps
from particlesim.cli import main as cli
from particlesim.jobs import partial_run
from particlesim.jobs.provenance import ProvenanceError, read_provenance
from particlesim.jobs.shards import Shard, ShardError
from particlesim.rendering.video.segments import SEGMENT
from tests.killed import content
from tests.worlds import gas

# Readouts over time, a title, fades and a scale that is settled by the run: what a part must know of the whole.
SHOWN = ["time", "pressure", "energy change"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A run of 190 frames, its movie drawn at once, and its movie's three parts: 60, 60 and 70 pictures."""
    folder = tmp_path_factory.mktemp("shards")
    movie = {"resolution": [64, 64], "fps": 20, "fade": 1.0}
    some = gas(2, title="Parts", duration=9.45, movie=movie, show={"readout": SHOWN})
    coloured = some.model_copy(update={"particles": [g.model_copy(update={"colour": "by_speed"}) for g in some.groups]})
    ps.simulate(coloured, folder / "run.gsd")
    ps.render(folder / "run.gsd", folder / "movie.mp4")
    for k in (3, 1, 2):
        ps.render(folder / "run.gsd", folder / f"part{k}.mp4", shard=(k, 3))
    return folder


def parts(folder, *numbers):
    return [folder / f"part{k}.mp4" for k in numbers]


def test_joined_it_is_the_movie_drawn_at_once(folder, tmp_path):
    origin = ps.join(parts(folder, 2, 3, 1), tmp_path / "joined.mp4")
    assert content(tmp_path / "joined.mp4") == content(folder / "movie.mp4")
    for suffix in (".mp4", ".png"):
        assert (tmp_path / f"joined{suffix}").read_bytes() == (folder / f"movie{suffix}").read_bytes()
    assert origin == read_provenance(folder / "movie.mp4") == read_provenance(tmp_path / "joined.mp4")


@pytest.mark.parametrize("pictures", [121, 122, 123])
def test_a_last_segment_of_few_pictures_is_as_long_as_they_are(folder, tmp_path, pictures):
    """Too few for pictures out of order: seams within and between parts are the same."""
    frames = range(pictures)
    ps.render(folder / "run.gsd", tmp_path / "movie.mp4", frames=frames)
    for k in (1, 2):
        ps.render(folder / "run.gsd", tmp_path / f"part{k}.mp4", frames=frames, shard=(k, 2))
    ps.join([tmp_path / "part1.mp4", tmp_path / "part2.mp4"], tmp_path / "joined.mp4")
    assert (tmp_path / "joined.mp4").read_bytes() == (tmp_path / "movie.mp4").read_bytes()


def test_parts_say_what_they_are_of(folder):
    found = [read_provenance(part) for part in parts(folder, 1, 2, 3)]
    assert [values["frames"] for values in found] == [[0, 60, 1], [60, 120, 1], [120, 190, 1]]
    assert [values["shard"]["number"] for values in found] == [1, 2, 3]
    for values in found:
        assert values["shard"] | {"number": 1} == found[0]["shard"]
        assert values["energy_drift"] == read_provenance(folder / "movie.mp4")["energy_drift"]
    assert found[0]["shard"]["of"] == 3 and found[0]["shard"]["frames"] == [0, 190, 1]
    assert [part.with_suffix(".png").exists() for part in parts(folder, 1, 2, 3)] == [False, True, False]


def test_a_part_of_some_frames_that_was_left_is_the_same(folder, tmp_path, monkeypatch):
    monkeypatch.setattr(partial_run, "INTERVAL", 0.0)
    monkeypatch.setattr(partial_run, "_SPARE", 0.0)
    ps.render(folder / "run.gsd", tmp_path / "straight.mp4", frames=range(10, 190, 2))

    def leave(phase, done, total):
        assert total <= SEGMENT
        if done == 7:
            raise KeyboardInterrupt

    for k in (1, 2):
        made = {"frames": range(10, 190, 2), "shard": (k, 2), "resume": True}
        with pytest.raises(KeyboardInterrupt):
            ps.render(folder / "run.gsd", tmp_path / f"{k}.mp4", progress=leave, **made)
        with pytest.raises(partial_run.PartialRunError, match=r"shard\[0\] was"):
            ps.render(folder / "run.gsd", tmp_path / f"{k}.mp4", **made | {"shard": (3 - k, 2)})
        ps.render(folder / "run.gsd", tmp_path / f"{k}.mp4", **made)
    ps.join([tmp_path / "1.mp4", tmp_path / "2.mp4"], tmp_path / "joined.mp4")
    assert (tmp_path / "joined.mp4").read_bytes() == (tmp_path / "straight.mp4").read_bytes()


@pytest.mark.parametrize("pictures", [1, 59, 60, 61, 119, 120, 121, 599, 601])
def test_each_picture_is_in_one_part(pictures):
    most = -(-pictures // SEGMENT)
    for of in range(1, most + 1):
        places = [Shard(k, of).places(pictures) for k in range(1, of + 1)]
        assert [place for part in places for place in part] == list(range(pictures))
        assert all(part.start % SEGMENT == 0 for part in places)
    with pytest.raises(ShardError, match=f"make at most {most:,} parts, of 60 pictures each"):
        Shard(1, most + 1).places(pictures)
    for number in (0, 2):
        with pytest.raises(ShardError, match=f"shard {number}/1: must be 1/1 to 1/1"):
            Shard(number, 1).places(pictures)


def copied(folder, tmp_path, *numbers):
    for part in parts(folder, *numbers):
        for suffix in (".mp4", ".png"):
            if part.with_suffix(suffix).exists():
                shutil.copy(part.with_suffix(suffix), tmp_path)
    return parts(tmp_path, *numbers)


@pytest.mark.parametrize(
    ("numbers", "line"),
    [
        ((1, 3), "part 2 of 3 is missing"),
        ((2,), "parts 1, 3 of 3 are missing"),
    ],
)
def test_missing_parts_are_named(folder, tmp_path, numbers, line):
    with pytest.raises(ShardError, match=f"^{line}$"):
        ps.join(parts(folder, *numbers), tmp_path / "joined.mp4")
    assert not list(tmp_path.iterdir())


def test_a_part_that_is_doubled_is_named(folder, tmp_path):
    copied(folder, tmp_path, 2)
    with pytest.raises(ShardError, match=r"[^/]*/part2.mp4: is part 2 of 3, as .*/part2.mp4 is$"):
        ps.join([*parts(folder, 1, 2, 3), tmp_path / "part2.mp4"], tmp_path / "joined.mp4")


@pytest.mark.parametrize(
    ("change", "differs"),
    [
        ({"frames": range(0, 180)}, r"frames is \[0, 180, 1\], not \[0, 190, 1\]"),
        ({"shard": (2, 2)}, "of is 2, not 3"),
        ({"look": {"quality": "draft", "resolution": [64, 64]}}, "quality is draft, not normal"),
        ({"look": {"background": "white"}}, "look is "),
    ],
)
def test_a_part_of_another_movie_is_named_by_what_differs(folder, tmp_path, change, differs):
    with ps.Trajectory(folder / "run.gsd") as trajectory:
        movie = trajectory.scene.movie.model_dump() | change.get("look", {})
        look = ps.Scene(**{**dict(trajectory.scene), "movie": movie})
    ps.render(folder / "run.gsd", tmp_path / "part2.mp4", **{"shard": (2, 3), **change, "look": look})
    with pytest.raises(ShardError, match=f"part2.mp4: is of another movie than .*part1.mp4: its {differs}"):
        ps.join([*parts(folder, 1, 3), tmp_path / "part2.mp4"], tmp_path / "joined.mp4")


def test_what_is_damaged_or_no_part_is_named(folder, tmp_path):
    one, two, three = copied(folder, tmp_path, 1, 2, 3)
    with pytest.raises(ProvenanceError, match=r"movie.mp4: is not a part of a movie"):
        ps.join([one, folder / "movie.mp4"], tmp_path / "joined.mp4")
    with pytest.raises(ShardError, match=r"part3.mp4: is one of the parts, which the movie would take the place of"):
        ps.join([one, two, three], three)
    whole = three.read_bytes()
    three.write_bytes(whole[: len(whole) * 2 // 3])
    with pytest.raises(ShardError, match=r"part3.mp4: damaged: \d+ of its 70 pictures can be read"):
        ps.join([one, two, three], tmp_path / "joined.mp4")
    three.write_bytes(whole)
    shutil.copy(folder / "movie.png", two.with_suffix(".png"))
    with pytest.raises(ShardError, match=r"part2.png: is not the poster that was written beside .*part2.mp4"):
        ps.join([one, two, three], tmp_path / "joined.mp4")
    two.with_suffix(".png").unlink()
    with pytest.raises(ShardError, match=r"part2.png: is missing: the poster, which was written beside .*part2.mp4"):
        ps.join([one, two, three], tmp_path / "joined.mp4")
    assert not (tmp_path / "joined.mp4").exists()


def test_a_scene_has_no_parts(tmp_path):
    with pytest.raises(ShardError, match="must be of a trajectory"):
        ps.render(gas(1), tmp_path / "a.mp4", shard=(1, 2))
    assert not list(tmp_path.iterdir())


def test_the_shell_loop_of_the_docs(folder, tmp_path):
    text = (Path(__file__).parents[1] / "docs" / "MACHINES.md").read_text()
    loop = re.search(r"```sh\n(for .*?)```", text, re.DOTALL).group(1)
    shutil.copy(folder / "run.gsd", tmp_path)
    tools = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    done = subprocess.run(
        ["sh", "-ec", loop], cwd=tmp_path, env=os.environ | {"PATH": tools}, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "movie.mp4").read_bytes() == (folder / "movie.mp4").read_bytes()


def test_the_command_names_parts_after_the_run(folder, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(cli.app, ["render", str(folder / "run.gsd"), "--shard", "2/3"])
    assert result.exit_code == 0 and "60 drawn, of 190" in result.output
    assert (tmp_path / "renders" / "run_2_of_3.mp4").read_bytes() == (folder / "part2.mp4").read_bytes()
    result = CliRunner().invoke(cli.app, ["join", "renders/run_2_of_3.mp4", "-o", "a.mp4"])
    assert (result.exit_code, result.output) == (2, "parts 1, 3 of 3 are missing\n")
    joined = CliRunner().invoke(cli.app, ["join", *map(str, parts(folder, 1, 2, 3)), "-o", "a"])
    assert joined.exit_code == 0 and "parts" in joined.output and (tmp_path / "a.mp4").exists()


@pytest.mark.parametrize(
    ("shard", "line"),
    [
        ("2", "--shard 2: must be K/N, part K of N, such as 1/8"),
        ("0/3", "shard 0/3: must be 1/3 to 3/3"),
        ("1/5", "shard 1/5: 190 pictures make at most 4 parts, of 60 pictures each"),
    ],
)
def test_a_wrong_part_gets_one_line(folder, tmp_path, monkeypatch, shard, line):
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(cli.app, ["render", str(folder / "run.gsd"), "--shard", shard])
    assert (result.exit_code, result.output) == (2, line + "\n")
    assert not list(tmp_path.iterdir())
