"""Sweeps: every case is what its scene gives, is run once, and is a row of the table."""

import csv
import itertools
import json
from pathlib import Path

import numpy as np
import pyarrow.parquet
import pytest
from typer.testing import CliRunner

import particlesim as ps
from particlesim.cli import main as cli
from particlesim.jobs.sweep import row as rows_of
from particlesim.jobs.sweep import run as runs
from particlesim.jobs.sweep.figure import FigureError, curves
from particlesim.scene.errors import SceneError
from particlesim.scene.key_paths import put
from particlesim.scene.sweep import load_sweep

# A ball of 2 kg that falls 1 m and bounces once: what an impact takes is (1 - e^2) m g h.
SCENE = """
duration = 0.6
[world]
size = [2.0, 2.0, 2.2]
gravity = [0, 0, -9.81]
[movie]
fps = 10
[[particles]]
shape = "sphere"
size = 0.2
mass = 2.0
placement = { kind = "list", poses = [{ position = [0, 0, 0] }] }
"""
SWEEP = """
[sweep]
scene = "ball.toml"
[sweep.axes]
"world.restitution" = [1.0, 0.5, 0.8]
seed = { from = 7, count = 2 }
"""
FALL = 2.0 * 9.81 * 1.0


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "ball.toml").write_text(SCENE)
    (tmp_path / "sweep.toml").write_text(SWEEP)
    return tmp_path


def table(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def alone(*arguments, **settings):
    return ps.sweep(*arguments, workers=1, **settings)


def test_rows_are_what_the_scenes_give(folder):
    result = alone("sweep.toml", "a.csv")
    found = table(folder / "a.csv")
    assert result.ran == len(found) == 6 and not result.failed
    cases = [(float(row["world.restitution"]), int(row["seed"])) for row in found]
    assert cases == list(itertools.product([1.0, 0.5, 0.8], [7, 8]))
    for (restitution, _), row in zip(cases, found, strict=True):
        taken = (1.0 - restitution**2) * FALL
        assert float(row["dissipated_restitution"]) == pytest.approx(taken, rel=1e-12, abs=1e-12)
        assert float(row["dissipated"]) == pytest.approx(taken, rel=1e-12, abs=1e-12)
        # The potential is 0 at the floor of the world.
        energy = float(row["kinetic_translational"]) + float(row["potential"])
        assert energy == pytest.approx(2.0 * 9.81 * 1.1 - taken, rel=1e-12)
        assert (row["particles"], row["impacts"], row["error"]) == ("1", "1", "")
    # A restitution changes where the ball is; a seed does not, where nothing is placed at random.
    assert len({row["state"] for row in found}) == 3 and len({row["hash"] for row in found}) == 6


def test_what_is_done_is_not_run_again(folder, monkeypatch):
    alone("sweep.toml", "a.csv")
    before = (folder / "a.csv").read_bytes()
    monkeypatch.setattr(runs, "run_case", None)
    monkeypatch.setattr(runs, "compile_kernels", None)
    assert alone("sweep.toml", "a.csv").ran == 0
    assert (folder / "a.csv").read_bytes() == before
    # As long as scenes and version are the same, whatever the table: some cases, in another order.
    (folder / "sweep.toml").write_text(SWEEP.replace("[1.0, 0.5, 0.8]", "[0.8, 1.0]"))
    assert alone("sweep.toml", "a.csv").ran == 0
    assert [row["world.restitution"] for row in table(folder / "a.csv")] == ["0.8", "0.8", "1.0", "1.0"]


@pytest.mark.parametrize("change", ["scene", "version"])
def test_what_changed_is_run_again(folder, monkeypatch, change):
    alone("sweep.toml", "a.csv")
    if change == "scene":
        (folder / "ball.toml").write_text(SCENE.replace("0.6", "0.7"))
    else:
        monkeypatch.setattr(rows_of.importlib.metadata, "version", lambda name: "9.9.9")
    assert alone("sweep.toml", "a.csv").ran == 6


def test_what_was_interrupted_goes_on(folder):
    def stop(phase, done, total):
        if done == 4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as error:
        alone("sweep.toml", "a.csv", progress=stop)
    assert error.value.__notes__ == ["4 of 6 cases are kept in a.cases; the same command goes on with them"]
    assert not (folder / "a.csv").exists()
    assert alone("sweep.toml", "a.csv").ran == 2


def test_cases_of_a_table(folder):
    (folder / "cases.csv").write_text('world.restitution,title,"world.gravity[2]"\n0.5,half,\n\n1,"a, b",-19.62\n')
    (folder / "sweep.toml").write_text('[sweep]\nscene = "ball.toml"\ncases = "cases.csv"\n')
    alone("sweep.toml", "a.csv")
    first, second = table(folder / "a.csv")
    assert (first["title"], first["world.gravity[2]"], second["title"]) == ("half", "", "a, b")
    assert float(first["dissipated"]) == pytest.approx(0.75 * FALL, rel=1e-12)
    assert float(second["energy"]) == pytest.approx(2.0 * 19.62 * 1.1, rel=1e-12)


def test_parquet_says_the_same(folder):
    alone("sweep.toml", "a.csv")
    alone("sweep.toml", "a.parquet")
    columns = pyarrow.parquet.read_table("a.parquet").to_pydict()
    found = table(folder / "a.csv")
    assert list(columns) == list(found[0])
    for key, values in columns.items():
        assert ["" if value is None else str(value) for value in values] == [row[key] for row in found], key
    assert {type(value) for value in columns["dissipated"]} == {float}


def test_a_case_that_fails_is_said_and_tried_again(folder):
    (folder / "ball.toml").write_text(
        SCENE.replace('placement = { kind = "list", poses = [{ position = [0, 0, 0] }] }', "count = 1")
    )
    (folder / "sweep.toml").write_text('[sweep]\nscene = "ball.toml"\n[sweep.axes]\n"particles[0].size" = [0.2, 5.0]\n')
    result = CliRunner().invoke(cli.app, ["sweep", "sweep.toml", "-o", "a.csv", "--workers", "1", "-q"])
    assert result.exit_code == 1
    (line,) = result.stderr.strip().split("\n")[-1:]
    assert line.startswith("a.csv: written, but 1 of 2 cases failed; case 2 (particles[0].size = 5.0): ")
    good, bad = table(folder / "a.csv")
    assert good["error"] == "" and bad["error"] and bad["energy"] == "" and len(bad["hash"]) == 64
    assert alone("sweep.toml", "a.csv").ran == 1


def test_figures_have_means_and_spreads():
    rows = [
        {"e": e, "kind": kind, "seed": seed, "y": value}
        for (e, kind), pair in {(0.5, "a"): (1.0, 3.0), (0.2, "a"): (4.0, None), (0.5, "b"): (0.0, 0.5)}.items()
        for seed, value in enumerate(pair)
    ]
    first, second = curves(rows, ["e", "kind", "seed"], "e", "y")
    assert (first.label, first.places, first.mean, first.cases) == ('kind = "a"', [0.2, 0.5], [4.0, 2.0], 3)
    assert np.allclose(first.spread, [0.0, np.sqrt(2.0)]) and second.mean == [0.25]
    with pytest.raises(FigureError, match="--figure y=kind: must be a column of numbers"):
        curves(rows, ["e", "kind", "seed"], "e", "kind")
    with pytest.raises(FigureError, match="there are no cases of which both are known"):
        curves(rows[3:4], ["e", "kind", "seed"], "e", "y")


def test_the_command_writes_a_table_and_a_figure(folder):
    invoke = CliRunner().invoke
    arguments = ["sweep", "sweep.toml", "--workers", "1", "--figure", "y=dissipated", "x=world.restitution"]
    result = invoke(cli.app, arguments)
    assert result.exit_code == 0 and "renders/sweep.svg" in result.stdout
    assert sorted(file.name for file in (folder / "renders").iterdir()) == [
        "sweep.cases", "sweep.csv", "sweep.png", "sweep.svg",
    ]  # fmt: skip
    drawn = (folder / "renders" / "sweep.svg").read_text()
    assert "6 cases, mean and standard deviation" in drawn and "dissipated [J]" in drawn
    wrong = invoke(cli.app, [*arguments[:4], "--figure", "x=world.restitutoin", "y=energy"])
    assert wrong.exit_code == 2
    assert wrong.output == "--figure x=world.restitutoin: there is no such column; did you mean 'world.restitution'?\n"
    wrong = invoke(cli.app, [*arguments[:4], "--figure", "energy", "y=energy"])
    assert (wrong.exit_code, wrong.output) == (2, "--figure energy y=energy: must be x=KEY y=COLUMN\n")


def test_the_sweep_beside_the_scenes_has_its_cases():
    cases = load_sweep(Path(__file__).parents[1] / "scenes" / "sweeps" / "cooling.toml")
    assert len(cases) == 60 and cases[-1].values == {"world.restitution": 1.0, "seed": 10}
    assert [case.scene.seed for case in cases[:3]] == [1, 2, 3] and cases[0].scene.world.restitution == 0.5


AXES = '[sweep]\nscene = "ball.toml"\n[sweep.axes]\n'
BROKEN = {
    "": "sweep.toml: the file is empty",
    "[sweep]": "sweep.toml: sweep: the key 'scene' is missing",
    "[sweeps]": "sweep.toml: sweeps: unknown key; did you mean 'sweep'?",
    '[sweep]\nscene = "ball.toml"': "sweep.toml: sweep: must have either [sweep.axes] or cases, the path of a CSV file",
    '[sweep]\nscene = "bal.toml"\n[sweep.axes]\nseed = [1]': "bal.toml: no such file; did you mean 'ball.toml'?",
    '[sweep]\nscene = "ball.toml"\ncases = "c.csv"': "c.csv: cannot be read: No such file or directory",
    AXES + "seed = []": "sweep.toml: sweep.axes.seed = []: has no values",
    AXES + "seed = { from = 1 }": "sweep.toml: sweep.axes.seed: must have either values, or from and count",
    AXES + "seed = { form = 1 }": "sweep.toml: sweep.axes.seed.form = 1: unknown key; did you mean 'from'?",
    AXES + "seed = { from = 1, count = 0 }": (
        "sweep.toml: sweep.axes.seed.count = 0: must be a whole number from 1 to 100,000"
    ),
    AXES + "seed = 3": "sweep.toml: sweep.axes.seed = 3: must be a list of values, or { from = 1, count = 10 }",
    AXES + "seed = { from = 1, count = 1000 }\ntitle = { from = 1, count = 101 }": (
        "sweep.toml: sweep: 101,000 combinations; there may be up to 100,000 cases"
    ),
    AXES + '"world.restitution" = [1, 1.5]': (
        "sweep.toml: case 2 of 2 (world.restitution = 1.5): world.restitution = 1.5: must be a number from 0 to 1"
    ),
    AXES + '"world.restitutoin" = [1]': (
        "sweep.toml: case 1 of 1 (world.restitutoin = 1): world.restitutoin = 1: "
        "unknown key; did you mean 'restitution'?"
    ),
    AXES + '"particles[1].size" = [1]': (
        "sweep.toml: case 1 of 1 (particles[1].size = 1): particles[1].size: particles has 1 entries, 0 the first"
    ),
    AXES + '"a b" = [1]': (
        "sweep.toml: case 1 of 1 (a b = 1): a b: "
        "must be the path of a key, such as world.gravity[2] or particles[0].size"
    ),
}


@pytest.mark.parametrize(("text", "line"), BROKEN.items())
def test_what_is_wrong_is_said_in_one_line(folder, text, line):
    (folder / "sweep.toml").write_text(text)
    with pytest.raises(SceneError) as error:
        load_sweep("sweep.toml")
    assert str(error.value) == line


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("seed", "c.csv: has 0 cases below its line of keys; there must be 1 to 100,000"),
        ("seed,title\n1", "c.csv: case 1 has 1 values for 2 keys"),
        (
            "seed\nmany",
            'sweep.toml: case 1 of 1 (seed = "many"): seed = "many": must be a whole number from 0 to 2^63 - 1',
        ),
    ],
)
def test_what_is_wrong_with_a_table_of_cases_too(folder, text, line):
    (folder / "sweep.toml").write_text('[sweep]\nscene = "ball.toml"\ncases = "c.csv"\n')
    (folder / "c.csv").write_text(text)
    with pytest.raises(SceneError) as error:
        load_sweep("sweep.toml")
    assert str(error.value) == line


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ('scene = "../ball.toml"\ncases = "c.csv"', 'sweep.scene = "../ball.toml"'),
        ('scene = "ball.toml"\ncases = "../c.csv"', 'sweep.cases = "../c.csv"'),
        ('scene = "ball.toml"\ncases = "/dev/stdin"', 'sweep.cases = "/dev/stdin"'),
    ],
)
def test_a_sweep_names_no_file_outside_its_folder(folder, monkeypatch, text, line):
    (folder / "c.csv").write_text("seed\n1")
    (folder / "in").mkdir()
    monkeypatch.chdir(folder / "in")
    (folder / "in/sweep.toml").write_text(f"[sweep]\n{text}\n")
    with pytest.raises(SceneError) as error:
        load_sweep("sweep.toml")
    assert str(error.value) == f"sweep.toml: {line}: is outside the folder of the file that names it"


def test_no_case_names_a_file_outside_the_folder_of_its_scene(folder):
    text = '[sweep]\nscene = "ball.toml"\n[sweep.axes]\n"particles[0].shape" = [{ kind = "mesh", file = "../b.stl" }]\n'
    (folder / "sweep.toml").write_text(text)
    line = r'particles\[0\]\.shape\.file = "\.\./b\.stl": is outside the folder of the file that names it$'
    with pytest.raises(SceneError, match=line):
        load_sweep("sweep.toml")


def test_values_are_put_where_paths_lead():
    scene = {"world": {"size": [1, 2, 3]}, "particles": [{"size": 1}]}
    for path, value in (("world.size[2]", 9), ("particles[0].velocity.kind", "rest"), ("solver.time_step", 0.1)):
        put(scene, path, value)
    assert json.loads(json.dumps(scene)) == {
        "world": {"size": [1, 2, 9]},
        "particles": [{"size": 1, "velocity": {"kind": "rest"}}],
        "solver": {"time_step": 0.1},
    }
    for path in ("world.size.x", "world[0]", "particles[0].size.value", "", "a..b", "[0]", "a[-1]", "a[0"):
        with pytest.raises(SceneError):
            put(scene, path, 1)
