"""What objects say of themselves: in a line, and in notebooks as the movie or the picture that they are."""

import base64
import re

import numpy as np
import pytest

import particlesim as ps
from particlesim.jobs import display
from tests.worlds import gas, listed, scene

SETTINGS = {"duration": 0.2, "movie": {"resolution": [64, 64], "fps": 20}}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("display")
    ps.simulate(gas(1, **SETTINGS), folder / "run.gsd")
    return folder


def test_a_movie_shows_itself_with_every_byte(folder):
    made = ps.render(folder / "run.gsd", folder / "movie.mp4")
    assert repr(made).startswith(f"<Summary of {folder / 'movie.mp4'}: 5 frames, 5 drawn, 0 to 0.2 s, ")
    found = re.search(r'src="data:video/mp4;base64,([^"]*)"', made._repr_html_())
    assert base64.b64decode(found[1]) == (folder / "movie.mp4").read_bytes()
    assert made._repr_png_() == (folder / "movie.png").read_bytes()


def test_a_movie_that_is_too_large_is_named(folder, monkeypatch):
    made = ps.render(folder / "run.gsd", folder / "large.mp4")
    monkeypatch.setattr(display, "EMBEDDED", 1000)
    text = made._repr_html_()
    assert "large.mp4: 0 MB, more than a notebook should hold" in text and "base64" not in text


def test_a_still_shows_itself_and_a_trajectory_is_a_line(folder):
    made = ps.still(folder / "run.gsd", folder / "still.png", 0.1)
    assert made._repr_png_() == (folder / "still.png").read_bytes() and made._repr_html_() is None
    made = ps.simulate(gas(1, **SETTINGS), folder / "other.gsd")
    assert made._repr_png_() is None and made._repr_html_() is None
    assert repr(made).startswith(f"<Summary of {folder / 'other.gsd'}: 5 frames, 0 drawn, ")


def test_what_is_gone_is_a_line(folder):
    made = ps.still(folder / "run.gsd", folder / "gone.png", 0.1)
    (folder / "gone.png").unlink()
    assert made._repr_png_() is None


def test_names_are_no_markup(tmp_path):
    path = tmp_path / "<b>.mp4"
    path.write_bytes(b"0")
    assert "<b>" not in display.html_of(path, "<b>").replace("&lt;b&gt;", "")


def test_a_scene_is_a_line_whatever_is_in_it():
    many = [{"position": [0, 0, 0.01 * k]} for k in range(500)]
    one = scene(listed("sphere", *many), title="Pearls", duration=2.0)
    assert repr(one) == str(one) == '<Scene "Pearls": 500 particles in 1 group, 20 x 20 x 20 m, 2 s, 61 frames>'
    assert repr(gas(3)) == "<Scene: 12 particles in 4 groups, 2.5 x 2.5 x 2.5 m, 10 s, 301 frames>"


def test_tables_of_a_scene_show_what_is_not_usual():
    some = gas(1, gravity=[0.0, 0.0, -9.81], movie={"fps": 25})
    assert repr(some.world) == "World(size=(2.5, 2.5, 2.5), gravity=(0.0, 0.0, -9.81))"
    assert repr(some.movie) == "Movie(fps=25.0)"
    assert repr(some.groups[1]).startswith("Group(shape=PolyhedronShape(kind='cube'), count=1, size=")
    assert repr(some.camera) == "FixedCamera(kind='fixed')"


def test_a_simulation_and_its_ledger_say_where_they_are():
    sim = ps.Simulation(scene(listed("sphere", {"position": [0, 0, 0], "velocity": [2, 0, 0]}), duration=3.0))
    sim.run(steps=2)
    assert repr(sim) == f"<Simulation: 1 particles, {sim.time:g} of 3 s, 2 steps, 0 impacts, octree>"
    mass = 1000.0 * np.pi / 6.0
    assert repr(sim.ledger) == (
        f"<Ledger at {sim.time:g} s: kinetic {2.0 * mass:.6g} J (0 of rotation), potential 0 J, "
        f"momentum [{2.0 * mass:.3g}, 0, 0] kg m/s, 0 impacts>"
    )
    assert repr(sim.frame()) == f"<Frame at {sim.time:g} s: 1 particles>"
    assert repr(sim.header) == f"<Header: 1 particles (sphere), {mass:.6g} kg>"


def test_a_trajectory_says_what_is_in_it_and_that_it_is_closed(folder):
    with ps.open(folder / "run.gsd") as run:
        assert repr(run) == f"<Trajectory {folder / 'run.gsd'}: 5 frames of 4 particles, 0 to 0.2 s>"
    assert repr(run).endswith("4 particles, closed>")
    for ask in (lambda: run[1], lambda: run.ledger(1), lambda: run.time(1)):
        with pytest.raises(ps.TrajectoryError, match=r"run.gsd: has been closed$"):
            ask()
