"""Figures of runs and the numbers in them, against closed forms."""

import csv
import math
import sys

import gsd.hoomd
import numpy as np
import pyarrow.parquet
import pytest
import scipy.stats
from typer.testing import CliRunner

import particlesim as ps
from particlesim.cli import main as cli
from particlesim.simulation.simulation import Simulation
from particlesim.trajectory.analysis.measurements import COLUMNS, TABLES, measured
from particlesim.trajectory.analysis.panels import PANELS, PlotError, draw_panels
from particlesim.trajectory.analysis.radial import RadialDistribution, _share_of_pairs
from particlesim.trajectory.analysis.speeds import maxwell_density, speed_table
from tests.worlds import gas, scene

TEXT = """
title = "A gas"
duration = 0.2
[world]
size = [2.0, 2.0, 2.0]
[[particles]]
shape = "sphere"
count = 30
size = 0.2
velocity = { kind = "maxwell", temperature = 4.0 }
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.toml").write_text(TEXT)
    return tmp_path


def measure(simulated, frames, duration):
    """What a simulation amounts to, looked at so often, and the ledgers."""
    sim, seen = Simulation(simulated), []
    for _ in range(frames):
        seen.append(sim.frame())
        sim.run(duration / (frames - 1))
    return measured(simulated, sim.header, seen, frames), [frame.ledger for frame in seen]


class TestOverTime:
    def test_free_flight_goes_with_the_square_of_the_time(self):
        """Through the faces of a periodic world, many times: <r^2> = <v^2> t^2."""
        motion = {"kind": "maxwell", "temperature": 1e-9}
        free = scene(
            {"shape": "sphere", "count": 40, "size": 0.001, "velocity": motion}, size=(0.5, 1, 2), boundary="periodic"
        )
        run, ledgers = measure(free, 6, 20.0)
        assert ledgers[-1].impacts == 0
        table = run.table()
        expected = table["mean_square_speed"] * table["time"] ** 2
        np.testing.assert_allclose(table["mean_square_displacement"], expected, rtol=1e-12, atol=1e-15)
        assert expected[-1] > 1.0

    def test_the_numbers_are_those_of_the_ledger(self):
        run, ledgers = measure(gas(5), 5, 0.1)
        table = run.table()
        assert table.dtype.names == COLUMNS
        assert table["time"].tolist() == [ledger.time for ledger in ledgers]
        assert table["energy"].tolist() == [ledger.energy for ledger in ledgers]
        assert table["impacts"].tolist() == [ledger.impacts for ledger in ledgers]
        assert table["momentum_y"].tolist() == [ledger.momentum[1] for ledger in ledgers]
        temperature = [2.0 / 3.0 * ledger.kinetic_translational / 20 for ledger in ledgers]
        np.testing.assert_allclose(table["temperature"], temperature)

    def test_the_pressure_is_the_momentum_given_to_walls_over_area_and_time(self):
        run, ledgers = measure(gas(5), 5, 0.1)
        pressed = [ledger.wall_impulse.sum() / (6 * 2.5**2 * ledger.time) for ledger in ledgers[1:]]
        assert math.isnan(run.table()["pressure"][0])
        np.testing.assert_allclose(run.table()["pressure"][1:], pressed)

    def test_what_impacts_take_is_no_drift(self):
        run, ledgers = measure(gas(10, restitution=0.7), 5, 0.3)
        assert ledgers[-1].energy < 0.9 * ledgers[0].energy
        assert np.abs(run.table()["energy_drift"]).max() < 1e-12

    def test_energy_that_comes_from_nowhere_is_drift(self):
        sim = Simulation(gas(5))
        first = sim.frame()
        sim.particles.velocity[:] *= 2.0
        table = measured(sim.scene, sim.header, [first, sim.frame()], 2).table()
        assert table["energy_drift"][1] == pytest.approx(3.0 * first.ledger.kinetic_translational / first.ledger.energy)

    def test_particles_that_come_later_have_not_come_far(self):
        rain = scene(
            {"shape": "sphere", "count": 1, "size": 0.1, "velocity": [1, 0, 0]},
            emitters=[
                {
                    "shape": "sphere",
                    "size": 0.1,
                    "count": 5,
                    "rate": 100.0,
                    "velocity": [0, 0, 50],
                    "region": {"lower": [3, 3, 0], "upper": [5, 5, 1]},
                }
            ],
        )
        run, _ = measure(rain, 3, 0.1)
        assert run.table()["particles"][[0, -1]].tolist() == [1.0, 6.0]
        assert run.table()["mean_square_displacement"][-1] == pytest.approx(0.1**2)


class TestRadialDistribution:
    @pytest.mark.parametrize("period", [(1.0, 2.0, 1.5), (0.0, 0.0, 0.0), (0.0, 2.0, 0.0), (1.0, 0.0, 1.5)])
    def test_random_points_have_no_structure(self, period):
        """Whatever axes wrap, and near the faces of those that do not."""
        random, radial = np.random.default_rng(5), RadialDistribution(np.array(period), 0.08)
        for _ in range(10):
            radial.add(random.uniform((0, 0, 0), (1.0, 2.0, 1.5), (2000, 3)))
        table = radial.table()
        pairs = 10 * 2000**2 / 2 * _share_of_pairs(np.array([0.4]), np.array([1.0, 2.0, 1.5]), np.array(period) > 0)
        weight = table["distance"] ** 2 / np.sum(table["distance"] ** 2)
        assert abs(weight @ table["density"] - 1.0) < 4.0 / np.sqrt(pairs[0])
        assert table["distance"][-1] == pytest.approx(0.4, rel=0.01)

    def test_pairs_in_a_cube(self):
        """Distances of two random points in the unit cube: the integral of r^2 (4 pi - 6 pi r + 8 r^2 - r^3).

        J. Philip, The probability distribution of the distance between two random points in a box, 2007.
        """
        r = np.linspace(0.0, 1.0, 11)
        known = 4 * np.pi / 3 * r**3 - 1.5 * np.pi * r**4 + 1.6 * r**5 - r**6 / 6
        np.testing.assert_allclose(_share_of_pairs(r, np.ones(3), np.zeros(3, bool)), known, rtol=1e-14)

    def test_a_lattice_has_six_neighbours_and_then_twelve(self):
        """Of the simple cubic lattice: 6 at 1, 12 at the square root of 2, none in between."""
        place = np.stack(np.meshgrid(*[np.arange(8.0)] * 3), -1).reshape(-1, 3)
        radial = RadialDistribution(np.full(3, 8.0), 0.5)
        radial.add(place)
        table = radial.table()
        width = table["distance"][1] - table["distance"][0]
        shell = 4 * np.pi / 3 * ((table["distance"] + width / 2) ** 3 - (table["distance"] - width / 2) ** 3)
        around = np.cumsum(table["density"] * shell * (len(place) - 1) / 8.0**3)
        for distance, expected in ((0.95, 0), (1.05, 6), (1.38, 6), (1.46, 18), (1.77, 26)):
            assert around[np.searchsorted(table["distance"], distance)] == pytest.approx(expected)

    def test_what_is_in_a_plane_has_none(self):
        radial = RadialDistribution(np.zeros(3), 0.1)
        radial.add(np.random.default_rng(0).random((50, 3)) * [1, 1, 0])
        radial.add(np.zeros((1, 3)))
        assert len(radial.table()) == 0


class TestSpeeds:
    def test_maxwell_of_one_mass(self):
        speed = np.linspace(0.0, 6.0, 50)
        known = scipy.stats.maxwell.pdf(speed, scale=np.sqrt(1.5 / 2.0))
        np.testing.assert_allclose(maxwell_density(speed, np.array([2.0]), 1.5), known, rtol=1e-12)

    def test_a_mixture_drawn_from_maxwell_agrees_with_it(self):
        random = np.random.default_rng(1)
        mass = np.repeat([1.0, 9.0], 100_000)
        velocity = random.normal(size=(len(mass), 3)) * np.sqrt(2.0 / mass)[:, None]
        table = speed_table(np.linalg.norm(velocity, axis=1), mass)
        width = table["speed"][1] - table["speed"][0]
        assert np.sum(table["density"]) * width == pytest.approx(1.0)
        assert np.sum(table["maxwell"]) * width == pytest.approx(1.0, abs=2e-3)
        expected = 0.5 * sum(np.sqrt(8.0 * 2.0 / (np.pi * m)) for m in (1.0, 9.0))
        assert np.sum(table["maxwell"] * table["speed"]) * width == pytest.approx(expected, rel=2e-3)
        # Statistics of a bin, and how much the curve bends within it.
        error = np.sqrt(table["maxwell"] / (len(mass) * width))
        assert np.abs(table["density"] - table["maxwell"]).max() < 5.0 * error.max()

    def test_what_rests_has_none(self):
        assert len(speed_table(np.zeros(5), np.ones(5))) == 0


class TestFigures:
    @pytest.mark.parametrize("what", PANELS)
    def test_each_panel_alone(self, what):
        run, _ = measure(gas(5), 6, 0.1)
        (axes,) = draw_panels(run, what).axes
        assert axes.get_title() and axes.get_xlabel() and axes.get_ylabel()
        assert axes.lines or axes.patches

    def test_a_page_of_all(self):
        run, _ = measure(gas(5), 6, 0.1)
        assert [bool(axes.get_title()) for axes in draw_panels(run).axes] == [True] * len(PANELS)

    def test_what_is_not_known_is_left_out(self, tmp_path):
        """Other programs know nothing of our ledger."""
        random = np.random.default_rng(3)
        with gsd.hoomd.open(str(tmp_path / "x.gsd"), "w") as file:
            for _ in range(3):
                frame = gsd.hoomd.Frame()
                frame.configuration.box = [8, 8, 8, 0, 0, 0]
                frame.particles.N = 40
                frame.particles.position = random.uniform(-4, 4, (40, 3))
                frame.particles.velocity = random.normal(size=(40, 3))
                file.append(frame)
        with ps.open(tmp_path / "x.gsd") as run:
            titles = [axes.get_title() for axes in run.plot().axes if axes.get_title()]
            assert titles == ["Mean square displacement", "Radial distribution, second half", "Speeds, second half"]
            with pytest.raises(PlotError, match="what: of energy, nothing is known here"):
                run.plot("energy")

    def test_from_python(self, folder):
        ps.simulate(ps.load_scene("scene.toml"), "run.gsd")
        with ps.open("run.gsd") as run:
            assert run.plot("energy").axes[0].get_title() == "Energy"
            assert run.plot("energy")._repr_png_().startswith(b"\x89PNG")  # as notebooks ask, with pyplot or without
            assert [run.table(which).dtype.names[0] for which in TABLES] == ["time", "distance", "speed"]
            assert len(run.table()) == len(run)
            with pytest.raises(ValueError, match="which: must be one of time, radial, speeds, not 'colour'"):
                run.table("colour")


class TestCommand:
    def run(self, *arguments):
        return CliRunner().invoke(cli.app, ["plot", *arguments])

    def test_a_scene_and_its_trajectory_have_the_same_numbers(self, folder):
        result = self.run("scene.toml", "--csv", "a.csv", "--parquet", "a.parquet")
        assert result.exit_code == 0, result.output
        assert result.stdout.split() == ["renders/scene_plot.svg", "renders/scene_plot.png", "a.csv", "a.parquet"]
        assert "Mean square displacement" in (folder / "renders/scene_plot.svg").read_text()
        ps.simulate(ps.load_scene("scene.toml"), "run.gsd")
        assert self.run("run.gsd", "--csv", "b.csv", "-q").stdout == ""
        a, b = ([dict(row) for row in csv.DictReader((folder / name).open())] for name in ("a.csv", "b.csv"))
        assert len(a) == 7 and list(a[0]) == list(COLUMNS)
        for name in ("time", "energy", "impacts", "momentum_z", "pressure"):
            assert [row[name] for row in a] == [row[name] for row in b]
        columns = pyarrow.parquet.read_table(folder / "a.parquet")
        assert columns.column_names == list(COLUMNS)
        assert columns["energy"].to_pylist() == [float(row["energy"]) for row in a]

    @pytest.mark.parametrize("movie", ["a.mp4", "a.webm", "a.gif"])
    def test_a_movie_gives_the_numbers_of_its_scene(self, folder, movie):
        made = ps.load_scene("scene.toml")
        made.movie.resolution = 64, 64
        ps.render(made, movie, frames=range(2))
        (folder / "scene.toml").rename("moved.toml")
        for source in (movie, "moved.toml"):
            result = self.run(source, "--csv", f"{source}.csv", "-q")
            assert result.exit_code == 0, result.output
        assert (folder / f"{movie}.csv").read_bytes() == (folder / "moved.toml.csv").read_bytes()

    def test_a_movie_without_its_scene_has_no_numbers(self, folder):
        (folder / "a.mp4").touch()
        with gsd.hoomd.open("foreign.gsd", "w") as file:
            frame = gsd.hoomd.Frame()
            frame.configuration.box = [8, 8, 8, 0, 0, 0]
            frame.particles.N = 1
            file.append(frame)
        look = ps.load_scene("scene.toml")
        look.movie.resolution = 64, 64
        ps.render("foreign.gsd", "b.mp4", look=look)
        hint = "does not hold its scene: give that (.toml), or a trajectory (.gsd)"
        for name, what in (("a.mp4", "does not say where it comes from"), ("b.mp4", hint)):
            found = self.run(name)
            assert (found.exit_code, found.stderr) == (2, f"{name}: {what}\n")

    def test_one_panel_and_its_numbers(self, folder):
        result = self.run("scene.toml", "--what", "radial", "-o", "g.png", "--csv", "g.csv", "-q")
        assert result.exit_code == 0, result.output
        assert (folder / "g.csv").read_text().startswith("distance,density\n")
        assert (folder / "g.svg").exists() and (folder / "g.png").read_bytes().startswith(b"\x89PNG")

    @pytest.mark.parametrize(
        ("arguments", "line"),
        [
            (["scene.toml", "--what", "colour"], f"what: must be one of {', '.join(PANELS)}, not 'colour'"),
            (["scene.toml", "-o", "a.pdf"], "a.pdf: the output must end in .svg or .png"),
            (["scene.toml", "--csv", "a.txt"], "a.txt: the output must end in .csv"),
            (["scene.toml", "--parquet", "none/a.parquet"], "none/a.parquet: there is no folder none"),
            (["none.gsd"], "none.gsd: no such file"),
        ],
    )
    def test_wrong_input_has_one_line_and_nothing_is_left(self, folder, arguments, line):
        result = self.run(*arguments)
        assert (result.stdout, result.stderr) == ("", line + "\n")
        assert result.exit_code == 2
        assert [path.name for path in folder.iterdir()] == ["scene.toml"]

    def test_without_pyarrow_it_is_said_how_to_get_it(self, folder, monkeypatch):
        monkeypatch.setitem(sys.modules, "pyarrow", None)
        result = self.run("scene.toml", "--parquet", "a.parquet")
        assert result.stderr == "pyarrow is not installed; pip install 'particlesim[parquet]' does it\n"
        assert result.exit_code == 1
        assert [path.name for path in folder.iterdir()] == ["scene.toml"]
