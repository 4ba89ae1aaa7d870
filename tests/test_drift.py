"""``--max-drift``: when it speaks, and what it leaves behind."""

import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from typer.testing import CliRunner

from particlesim.cli import main as cli
from particlesim.cli.tables import print_summary
from particlesim.jobs.summary import Summary
from tests.worlds import ledger

SCENE = """
duration = 0.4
[world]
size = [2.0, 2.0, 2.0]
restitution = {restitution}
[[particles]]
shape = "sphere"
count = 5
size = 0.5
velocity = {{ kind = "uniform", speed = 5.0 }}
[movie]
resolution = [64, 64]
"""


def run(*arguments):
    return CliRunner().invoke(cli.app, arguments)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, restitution in (("elastic", 1.0), ("soft", 0.5)):
        (tmp_path / f"{name}.toml").write_text(SCENE.format(restitution=restitution))
    return tmp_path


def frame(time, energy, **left):
    """What a summary looks at of a frame."""
    return SimpleNamespace(time=time, ledger=ledger(time=time, kinetic_translational=energy, **left))


def summary(energies, *, elastic):
    """Of frames with these energies, nothing else of which changes."""
    made = Summary(1.0, (0.0, 0.0, 0.0), elastic)
    for k, energy in enumerate(energies):
        made.add(frame(float(k), energy))
    return made


def test_elastic_energy_may_neither_fall_nor_rise():
    assert summary([4.0, 4.0, 4.0], elastic=True).forbidden_energy_drift == 0.0
    assert summary([4.0, 3.0, 4.0], elastic=True).forbidden_energy_drift == pytest.approx(0.25)
    assert summary([4.0, 5.0], elastic=True).forbidden_energy_drift == pytest.approx(0.2)


def test_energy_that_impacts_may_take_must_not_come_back():
    assert summary([4.0, 3.0, 1.0], elastic=False).forbidden_energy_drift == 0.0
    assert summary([4.0, 2.0, 3.0, 1.0], elastic=False).forbidden_energy_drift == pytest.approx(0.25)
    assert summary([4.0, 2.0, 3.0, 1.0], elastic=False).worst_energy_drift == pytest.approx(0.75)
    assert Summary(1.0, np.zeros(3), elastic=False).forbidden_energy_drift == 0.0


@pytest.mark.parametrize("name", ["elastic", "soft"])
def test_a_run_without_drift_passes(folder, name):
    result = run("simulate", f"{name}.toml", "-o", "run.gsd", "--max-drift", "1e-12")
    assert result.exit_code == 0
    change = re.search(r"worst energy change\W+([-+.e\d]+) of all", result.stdout)
    assert (float(change[1]) > 0.01) == (name == "soft")


@pytest.mark.parametrize(("name", "words"), [("elastic", "drifted by"), ("soft", "rose by")])
@pytest.mark.parametrize(
    ("drift", "said"), [(2e-3, "2.0e-03"), (float("nan"), "nan")], ids=["too much", "not a number"]
)
def test_too_much_drift_is_one_line_and_the_output_stays(folder, monkeypatch, name, words, drift, said):
    monkeypatch.setattr(Summary, "forbidden_energy_drift", property(lambda _: drift))
    result = run("simulate", f"{name}.toml", "-o", "run.gsd", "-q", "--max-drift", "1e-3")
    line = f"run.gsd: written, but its energy {words} {said} of all of it, more than 0.001\n"
    assert (result.exit_code, result.output) == (3, line)
    assert sorted(path.name for path in folder.iterdir()) == ["elastic.toml", "run.gsd", "soft.toml"]
    assert run("check", f"{name}.toml").exit_code == 0


def test_a_movie_of_a_trajectory_is_judged_by_its_ledger(folder, monkeypatch):
    assert run("simulate", "elastic.toml", "-o", "run.gsd", "-q").exit_code == 0
    monkeypatch.setattr(Summary, "forbidden_energy_drift", property(lambda _: 1.0))
    result = run("render", "run.gsd", "-o", "run.mp4", "-q", "--max-drift", "1e-12")
    assert result.exit_code == 3
    assert result.output.startswith("run.mp4: written, but its energy drifted by 1.0e+00")
    assert (folder / "run.mp4").exists()
    assert (folder / "run.png").exists()


@pytest.mark.parametrize("value", ["-1", "nan", "much"])
def test_a_limit_that_is_none_is_refused(folder, value):
    assert run("simulate", "elastic.toml", "--max-drift", value).exit_code == 2
    assert not (folder / "renders").exists()


def test_what_was_left_over_is_told(capsys):
    made = Summary(1.0, np.zeros(3))
    made.add(frame(0.0, 1.0))
    print_summary(made, Path("run.gsd"))
    assert "left over" not in capsys.readouterr().out
    made.add(frame(1.0, 1.0, unresolved=7))
    print_summary(made, Path("run.gsd"))
    assert re.search(r"steps with impacts left over\W+7\b", capsys.readouterr().out)
