"""The benchmark of meshes: what it runs, prints and writes. How fast it is, no test can say."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from particlesim.benchmarks import obstacles as bench
from particlesim.cli import main as cli


def test_fields_are_the_same_hills_in_more_and_more_triangles():
    for squares in bench.SQUARES[:3]:
        field = bench.field(squares)
        assert len(field.triangles) == 2 * squares * squares
        x, y, z = field.vertices.T
        np.testing.assert_allclose(z, 0.05 * np.sin(9 * x) * np.cos(7 * y) + 0.3 * (x * x + y * y), atol=1e-12)


def test_what_is_measured_lies_on_the_field():
    (measured,) = bench.run([7])
    assert measured.triangles == 98 and measured.overlap < 1e-2
    assert min(measured.building, measured.falling, measured.lying) > 0.0


@pytest.mark.parametrize("quiet", [False, True])
def test_the_command_prints_a_table_and_writes_the_figures(tmp_path, monkeypatch, quiet):
    monkeypatch.setattr(bench, "run", lambda *_: iter([bench.OnField(98, 0.5, 0.001, 0.0125, 3e-5)]))
    options = ["--quiet"] if quiet else []
    told = CliRunner().invoke(cli.app, ["bench", "--obstacles", "--json", str(tmp_path / "fields.json"), *options])
    assert told.exit_code == 0
    row = "98 1.00 12.50 3.0e-05 0.50 s"
    assert (row in " ".join(told.output.split())) == (not quiet)
    figures = json.loads((tmp_path / "fields.json").read_text())
    assert figures["bodies"] == bench.COUNT
    assert figures["fields"] == [{"triangles": 98, "building": 0.5, "falling": 0.001, "lying": 0.0125, "overlap": 3e-5}]
