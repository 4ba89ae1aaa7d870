"""The options of ``render``: which frames, how they are drawn, and how a wrong value is answered."""

import imageio.v3 as iio
import numpy as np
import pytest
from typer.testing import CliRunner

import particlesim as ps
from particlesim.cli import main as cli
from particlesim.scene.overrides import scaled, with_colour, with_look, with_movie
from tests.worlds import gas, listed, scene

SCENE = """
duration = 1.0
[world]
size = [4.0, 4.0, 4.0]
[[particles]]
shape = "sphere"
count = 5
size = 0.8
velocity = { kind = "maxwell", temperature = 300.0 }
[movie]
resolution = [64, 64]
fps = 10
[show]
readout = false
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.toml").write_text(SCENE)
    return tmp_path


def run(*arguments):
    return CliRunner().invoke(cli.app, ["render", *arguments])


def made(*arguments):
    result = run(*arguments, "-q")
    assert (result.exit_code, result.output) == (0, ""), result.output


def movie(path):
    return np.array(list(iio.imiter(path, plugin="FFMPEG"))).astype(int)


WRONG = [
    (["--frames", "3"], "--frames 3: must be A:B, from frame A up to but without frame B; either may be left out"),
    (["--frames", "a:b"], "--frames a:b: must be A:B, from frame A up to but without frame B; either may be left out"),
    (["--frames", "11:"], "--frames 11:: there are none; the frames are 0 to 10"),
    (["--every", "0"], "--every 0: must be a whole number of 1 or more"),
    (["--every", "x"], "--every x: must be a whole number of 1 or more"),
    (["--still", "1.5"], "--still 1.5: must be a time from 0 to 1 s"),
    (["--still", "now"], "--still now: must be a time from 0 to 1 s"),
    (["--still", "1", "--every", "2"], "--every: of a movie, not of the one picture that --still asks for"),
    (["--still", "1", "-o", "a.mp4"], "a.mp4: the output must end in .png"),
    (["--size", "12"], "--size 12: must be WIDTHxHEIGHT in pixels, such as 1280x720"),
    (
        ["--size", "321x64"],
        "--size 321x64: must be [width, height] in pixels, two even whole numbers from 64 to 7680; "
        "the nearest are 322 and 64",
    ),
    (["--size", "9x64"], "--size 9x64: must be [width, height] in pixels, two even whole numbers from 64 to 7680"),
    (["--quality", "hihg"], "--quality hihg: must be 'draft', 'normal', 'high' or 'best'; did you mean 'high'?"),
    (["--camera", "orbital"], "--camera: camera = \"orbital\": unknown kind; did you mean 'orbit'?"),
    (["--camera", "{kind = 'look-at'}"], "--camera: camera: the key 'position' is missing"),
    (["--camera", "{kind ="], "--camera: not valid TOML: Invalid value (at end of document)"),
    (["--scale", "0"], "--scale 0: must be a number above 0"),
    (["--scale", "1e-3x"], "--scale 1e-3x: must be a number above 0"),
    (["--scale", "1e9"], "--scale 1e9: would be 5,000,000,000; there may be up to 100,000,000"),
    (["--shard", "1/2"], "--shard: only of a trajectory, such as 'particlesim simulate' makes of a scene"),
    (["--look", "none.toml"], "none.toml: no such file"),
]  # fmt: skip


@pytest.mark.parametrize(("arguments", "line"), WRONG, ids=[" ".join(arguments) for arguments, _ in WRONG])
def test_a_wrong_value_gets_one_line(arguments, line, folder):
    result = run("scene.toml", *arguments)
    assert (result.exit_code, result.stderr, result.stdout) == (2, line + "\n", "")
    assert not (folder / "renders").exists()


def test_a_colour_that_is_none_gets_a_line(folder):
    result = run("scene.toml", "--colour", "bleu")
    assert result.exit_code == 2 and result.stderr.count("\n") == 1
    assert result.stderr.startswith("--colour bleu: must be 'by_shape', ") and "did you mean 'blue'?" in result.stderr


def test_some_frames_are_those_of_the_whole_movie(folder):
    made("scene.toml", "-o", "all.mp4", "--size", "128x96")
    made("scene.toml", "-o", "some.mp4", "--size", "128x96", "--frames", "2:9", "--every", "3")
    ps.simulate(ps.load_scene("scene.toml"), "run.gsd")
    made("run.gsd", "-o", "read.mp4", "--size", "128x96", "--frames", "-9:9", "--every", "3")
    every, some, read = movie("all.mp4"), movie("some.mp4"), movie("read.mp4")
    assert every.shape == (11, 96, 128, 3) and some.shape == read.shape == (3, 96, 128, 3)
    for picture, also, k in zip(some, read, (2, 5, 8), strict=True):
        apart = [np.abs(picture - other).mean() for other in every]
        # What is left are traces of the encoding.
        assert np.argmin(apart) == k and apart[k] < 2.0 < sorted(apart)[1]
        assert np.abs(also - picture).mean() < 2.0


def test_frames_that_are_drawn_and_simulated_are_told_apart(folder):
    assert "3 drawn, of 9" in run("scene.toml", "--frames", "2:9", "--every", "3").stdout
    (folder / "renders" / "scene.mp4").unlink()


def test_a_still_is_the_frame_of_its_time(folder):
    ps.simulate(ps.load_scene("scene.toml"), "run.gsd")
    made("scene.toml", "--still", "0.5", "--size", "128x96")
    made("run.gsd", "--still", "0.54", "--size", "128x96", "-o", "read")
    made("scene.toml", "--still", "0.54", "--size", "128x96", "-o", "between.png")
    made("scene.toml", "--frames", "5:6", "--size", "128x96", "-o", "one.mp4")
    direct, read, between, poster = (
        iio.imread(name).astype(int) for name in ("renders/scene.png", "read.png", "between.png", "one.png")
    )
    assert direct.shape == (96, 128, 3)
    assert np.array_equal(direct, poster)
    assert np.abs(direct - read).mean() < 0.1 < np.abs(direct - between).mean()


def test_the_look_of_another_scene_is_taken(folder):
    ps.simulate(ps.load_scene("scene.toml"), "run.gsd")
    look = SCENE.replace("[show]", 'background = "#102030"\n[show]\nbox = false').replace("[64, 64]", "[96, 80]")
    (folder / "look.toml").write_text(look.replace('shape = "sphere"', 'shape = "cube"\ncolour = "red"'))
    made("run.gsd", "--look", "look.toml", "--still", "0", "--camera", "{kind='look-at', position=[9, 0, 0]}")
    picture = iio.imread("renders/run.png").astype(int)
    assert picture.shape == (80, 96, 3)
    # Neither floor nor particles are in the upper corners.
    assert np.array_equal(picture[0, 0], (0x10, 0x20, 0x30))
    red = (picture[..., 0] > 2 * picture[..., 1]) & (picture[..., 0] > 80)
    assert red.sum() > 100
    made("run.gsd", "--look", "look.toml", "--still", "0", "--colour", "lime", "--quality", "draft")
    picture = iio.imread("renders/run.png").astype(int)
    assert picture.shape == (360, 640, 3)
    assert ((picture[..., 1] > 2 * picture[..., 0]) & (picture[..., 1] > 80)).sum() > 100


def test_a_scale_is_forgotten_with_the_field_that_it_was_given_for():
    one = scene({"shape": "sphere", "count": 3, "colour": {"field": "speed", "map": "magma", "range": (0.0, 2.0)}})
    assert with_colour(one, "by_speed").particles[0].colour == one.particles[0].colour
    assert with_colour(one, "by_height").particles[0].colour.range is None
    assert with_colour(one, {"field": "speed"}).particles[0].colour.range is None


def test_what_stays_is_neither_copied_nor_checked_again():
    one = scene(listed("cube", {"position": (0, 0, 0)}), {"shape": "sphere", "count": 8}, size=(4, 4, 4))
    for other in (with_movie(one, quality="draft", resolution=None), with_colour(one, "red"), scaled(one, 2.0)):
        assert other.world is one.world and other.solver is one.solver
        assert other.particles[0].placement is one.particles[0].placement
    with pytest.raises(ps.SceneError, match=r'^particles\[0\].colour = "odd": must be'):
        with_colour(one, "odd")
    with pytest.raises(ps.SceneError, match=r"^movie.crf = 99: must be a whole number from 0"):
        with_movie(one, crf=99)


def test_a_twin_fills_as_much_and_has_the_same_density_energy_and_speeds():
    large = gas(1000, seed=3, size=(8.0, 8.0, 8.0))
    small = scaled(large, 0.125)
    assert small.number == 500
    whole, twin = (ps.Simulation(s) for s in (large, small))
    for name in ("mass", "inradius"):
        total = [getattr(sim.particles, name) ** (1 if name == "mass" else 3) for sim in (whole, twin)]
        assert total[0].sum() == pytest.approx(total[1].sum(), rel=1e-9)
    # 3 N degrees of freedom each: the energy is known to a few hundredths.
    assert twin.ledger.kinetic_translational == pytest.approx(whole.ledger.kinetic_translational, rel=0.1)
    assert twin.ledger.kinetic_rotational == pytest.approx(whole.ledger.kinetic_rotational, rel=0.1)


def test_a_twin_scales_every_length_mass_and_range():
    spaced = {"kind": "lattice", "spacing": 0.5}
    sizes = {"kind": "uniform", "low": 0.1, "high": 0.2}
    twin = scaled(
        scene(
            {"shape": "sphere", "count": 80, "size": 0.2, "mass": 3.0, "placement": spaced},
            {"shape": "cube", "count": 3, "size": sizes, "velocity": {"kind": "maxwell", "temperature": 2.0}},
            {"shape": "cube", "count": 0},
            listed("cube", {"position": (9, 9, 9)}, size=0.3),
        ),
        0.125,
    )
    lattice, drawn, none, alone = twin.particles
    assert (lattice.count, lattice.size.value, lattice.mass) == (10, pytest.approx(0.4), pytest.approx(24.0))
    assert lattice.placement.spacing == pytest.approx(1.0)
    assert (drawn.count, drawn.size.low, drawn.size.high) == (1, pytest.approx(0.2), pytest.approx(0.4))
    assert drawn.velocity.temperature == pytest.approx(16.0)
    assert (none.count, alone.number, alone.size.value) == (0, 1, 0.3)


def test_a_twin_scales_rolling_friction():
    rough = {"shape": "sphere", "size": 0.2, "rolling_friction": 0.002}
    groups = {**rough, "count": 80, "name": "a"}, {**listed("sphere", {"position": (1, 1, 1)}), **rough}
    contact = [{"between": ["a", "walls"], "rolling_friction": 0.003}]
    twin = scaled(scene(*groups, rolling_friction=0.001, contact=contact), 0.125)
    tables = twin.world, *twin.particles, *twin.contact
    assert [table.rolling_friction for table in tables] == pytest.approx([0.002, 0.004, 0.002, 0.006])


def test_a_scene_of_lists_has_no_twin():
    with pytest.raises(ps.SceneError, match="particles: all of them are placed by lists or rows, which"):
        scaled(scene(listed("cube", {"position": (0, 0, 0)})), 0.5)


def test_a_trajectory_cannot_be_scaled(folder):
    ps.simulate(ps.load_scene("scene.toml"), "run.gsd")
    result = run("run.gsd", "--scale", "2")
    assert (result.exit_code, result.stderr) == (
        2,
        "--scale: only of a scene, whose particles are yet to be placed\n",
    )


def test_a_look_of_other_groups_keeps_the_colours():
    one = scene({"shape": "sphere", "count": 3, "colour": "red"})
    two = scene({"shape": "cube", "count": 9}, {"shape": "cube", "count": 9}, camera="orbit")
    two.movie.background = "black"
    both = with_look(one, two)
    assert (both.camera, both.movie.background, both.particles) == (two.camera, "black", one.particles)


def test_a_look_leaves_the_physics_alone():
    one = scene({"shape": "sphere", "count": 3, "colour": "red"}, gravity=(0, 0, -1))
    other = scene({"shape": "cube", "count": 9, "colour": "by_speed"}, camera="orbit", movie={"fps": 5})
    both = with_look(one, other)
    assert (both.world, both.particles[0].count, both.particles[0].shape.kind) == (one.world, 3, "sphere")
    assert (both.camera, both.movie, both.show) == (other.camera, other.movie, other.show)
    assert both.particles[0].colour.field == "speed"
