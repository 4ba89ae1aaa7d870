"""The benchmark of drawing: what it draws, runs, prints and writes. How fast it is, no test can say."""

import json
import os

import numpy as np
import pytest
from scipy.spatial import cKDTree
from typer.testing import CliRunner

from particlesim.benchmarks import drawing as drawing_bench
from particlesim.cli import main as cli
from particlesim.geometry.shapes import CATALOGUE


def run(*arguments):
    return CliRunner().invoke(cli.app, ["bench", "--drawing", *arguments])


def dies(*_):
    os._exit(3)


@pytest.mark.parametrize("kind", drawing_bench.KINDS)
@pytest.mark.parametrize("count", [1, 50, 1000])
def test_a_crowd_is_what_it_says(kind, count):
    crowd = drawing_bench.crowd(kind, count)
    assert len(crowd.number) == len(crowd.size) == len(crowd.position) == len(crowd.orientation) == count
    assert crowd.shapes == drawing_bench.KINDS[kind]
    assert np.ptp(np.bincount(crowd.number, minlength=len(crowd.shapes))) <= 1
    # A fifth of each one's cell, a cubic metre, is full.
    volume = np.array([CATALOGUE[shape]().volume for shape in crowd.shapes])[crowd.number] * crowd.size**3
    assert volume == pytest.approx(0.2, rel=1e-12)
    assert (crowd.edge - 1.0) ** 3 < count <= crowd.edge**3
    assert (np.abs(crowd.position) < 0.5 * crowd.edge - 0.3).all()
    assert np.linalg.norm(crowd.orientation, axis=1) == pytest.approx(1.0)
    if count > 1:
        distance, _ = cKDTree(crowd.position).query(crowd.position, k=2)
        assert distance[:, 1].min() > 0.7 - 1e-12  # a cell, less the jitter of two


def test_a_crowd_is_the_same_for_the_same_seed():
    one, again, other = (drawing_bench.crowd("mixed", 100, seed) for seed in (1, 1, 2))
    assert all(np.array_equal(a, b) for a, b in zip(one[2:], again[2:], strict=True))
    assert not np.array_equal(one.position, other.position)


def test_particles_go_to_and_fro_by_little():
    crowd = drawing_bench.crowd("spheres", 100)
    places = np.array([drawing_bench._moved(crowd, k) for k in range(20)])
    assert np.array_equal(places[0], crowd.position)
    way = np.linalg.norm(places - crowd.position, axis=2)
    assert way.max() < crowd.size.min() and way[1:].max(axis=1).min() > 0.0


@pytest.mark.parametrize("kind", ["spheres", "mixed"])
def test_a_measurement_has_its_figures(kind, monkeypatch):
    monkeypatch.setattr(drawing_bench, "SIZE", (128, 96))
    drawn = drawing_bench.measured(kind, 50, "particlesim")
    assert (drawn.kind, drawn.particles, drawn.drawer) == (kind, 50, "particlesim")
    assert len(drawn.seconds) == 9 and min(drawn.seconds) > 0.0
    assert drawn.median == sorted(drawn.seconds)[4]


def test_the_pictures_that_are_measured_show_the_crowd(monkeypatch):
    monkeypatch.setattr(drawing_bench, "SIZE", (128, 96))
    pictures = drawing_bench.own_pictures(drawing_bench.crowd("mixed", 50))
    first, second = next(pictures), next(pictures)
    assert first.shape == second.shape == (96, 128, 3)
    assert (first.min(axis=2) < 200).mean() > 0.1
    assert not np.array_equal(first, second)
    pictures.close()


def test_vtk_draws_too_where_it_is_installed(monkeypatch):
    asked = []
    monkeypatch.setattr(drawing_bench.importlib.util, "find_spec", asked.append)
    assert drawing_bench.available_drawers() == ["particlesim"]
    assert asked == ["vtkmodules"]
    monkeypatch.setattr(drawing_bench.importlib.util, "find_spec", lambda name: name)
    assert drawing_bench.available_drawers() == ["particlesim", "VTK"]


def test_every_crowd_is_drawn_by_everyone_in_turn(monkeypatch):
    monkeypatch.setattr(drawing_bench, "_measured_apart", lambda *task: task)
    calls = []
    done = list(drawing_bench.run((10, 20), lambda *call: calls.append(call), ("one", "two")))
    assert done == [(kind, n, name) for kind in drawing_bench.KINDS for n in (10, 20) for name in ("one", "two")]
    assert calls[0] == ("10 spheres by one", 0, 16) and calls[-1] == ("20 mixed by two", 15, 16)


def test_the_command_prints_a_table_and_writes_the_figures(tmp_path, monkeypatch):
    measured = [
        drawing_bench.Drawn("spheres", 1000, "particlesim", [0.3, 0.1, 0.2]),
        drawing_bench.Drawn("spheres", 1000, "VTK", [0.4]),
        drawing_bench.Drawn("cubes", 1000, "particlesim", [0.02]),
        drawing_bench.Drawn("cubes", 1000, "VTK", [0.05]),
    ]
    asked = []

    def measure(counts, progress):
        asked.append(counts)
        if progress is not None:
            progress("1,000 spheres by VTK", 0, 4)
        return iter(measured)

    monkeypatch.setattr(drawing_bench, "run", measure)
    result = run("--json", str(tmp_path / "drawing.json"))
    assert result.exit_code == 0
    assert result.stderr == "1,000 spheres by VTK 4 measurements\n"
    assert [line.split() for line in result.stdout.splitlines()[:4]] == [
        ["Seconds", "a", "picture", "of", "1280x720"],
        ["particles", "particlesim", "VTK"],
        ["spheres", "1,000", "0.200", "0.400"],
        ["cubes", "1,000", "0.020", "0.050"],
    ]
    written = json.loads((tmp_path / "drawing.json").read_text())
    assert written["size"] == [1280, 720]
    assert [drawn["median"] for drawn in written["pictures"]] == [0.2, 0.4, 0.02, 0.05]
    assert written["pictures"][0]["seconds"] == [0.3, 0.1, 0.2]
    assert [path.name for path in tmp_path.iterdir()] == ["drawing.json"]
    assert run("--large", "--quiet").output == ""
    assert asked == [(1_000, 10_000, 100_000), (1_000, 10_000, 100_000, 1_000_000)]


def test_a_process_that_dies_is_one_line(monkeypatch):
    monkeypatch.setattr(drawing_bench, "measured", dies)
    result = run("--quiet")
    assert result.exit_code == 1
    assert result.output == "drawing 1,000 spheres by particlesim has failed\n"
