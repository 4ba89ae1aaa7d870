"""Movies in other formats: read by others, as good, with the same bytes, and they say what they are of."""

import imageio.v3 as iio
import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

import particlesim as ps
from particlesim.cli import main as cli
from particlesim.core.output_path import OutputError, picture_path
from particlesim.jobs import partial_run
from particlesim.jobs.frame_source import frame_source
from particlesim.jobs.pictures import Pictures
from particlesim.jobs.provenance import read_provenance
from particlesim.rendering.video.picture_files import PictureFiles
from tests.worlds import gas

LONG = "A title of more letters than go into one part of a comment, and an ü, and a backslash \\ = ; # " * 4


def some(**settings):
    return gas(2, **{"duration": 2.2, "title": LONG, "movie": {"resolution": [96, 64], "fps": 30}, **settings})


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A run of 67 frames and its movie in all formats; 60 pictures make a segment."""
    folder = tmp_path_factory.mktemp("formats")
    ps.simulate(some(), folder / "run.gsd")
    for name in ("a.mp4", "a.webm", "a.gif", "p_%03d.png"):
        ps.render(folder / "run.gsd", folder / name)
    return folder


@pytest.fixture(scope="module")
def drawn(folder):
    """The pictures that went in."""
    with ps.open(folder / "run.gsd") as run, Pictures(frame_source(run, None, None, None), run.scene, None) as pictures:
        return np.array(list(pictures.images()))


def test_webm_has_the_pictures_that_went_in(folder, drawn):
    meta = iio.immeta(folder / "a.webm", plugin="FFMPEG")
    assert meta["codec"] == "vp9" and meta["fps"] == 30.0 and meta["duration"] == pytest.approx(67 / 30, abs=0.02)
    assert "bt709" in meta["pix_fmt"]
    read = np.array(list(iio.imiter(folder / "a.webm", plugin="FFMPEG")))
    assert read.shape == drawn.shape
    for got, sent in zip(read, drawn, strict=True):
        assert np.abs(got.astype(int) - sent).mean() < 4.0


def test_gif_has_the_pictures_that_went_in(folder, drawn):
    with Image.open(folder / "a.gif") as image:
        assert image.n_frames == 67 and image.info["loop"] == 0
        lasting = 0
        for k, sent in enumerate(drawn):
            image.seek(k)
            lasting += image.info["duration"]
            assert np.abs(np.asarray(image.convert("RGB")).astype(int) - sent).mean() < 4.0
    assert lasting == pytest.approx(1000 * 67 / 30, abs=20)


def test_numbered_pictures_are_those_that_went_in(folder, drawn):
    assert len(list(folder.glob("p_*.png"))) == 67  # and no poster
    for k, sent in enumerate(drawn):
        assert (iio.imread(folder / f"p_{k:03}.png") == sent).all()


@pytest.mark.parametrize("name", ["a.webm", "a.gif"])
def test_the_same_pictures_give_the_same_bytes(folder, tmp_path, name):
    ps.render(folder / "run.gsd", tmp_path / name)
    assert (tmp_path / name).read_bytes() == (folder / name).read_bytes()
    assert (tmp_path / "a.png").exists()


def test_all_say_what_they_are_of(folder):
    expected = read_provenance(folder / "a.mp4")
    assert expected["title"] == LONG and expected["frames"] == [0, 67, 1]
    assert read_provenance(folder / "a.webm") == read_provenance(folder / "a.gif") == expected
    picture = read_provenance(folder / "p_011.png")
    of_all = {k: v for k, v in expected.items() if k not in ("energy_drift", "keys")}
    assert picture == of_all | {"frames": [11, 12, 1]}


@pytest.mark.parametrize(("ending", "tag"), [("webm", "<video"), ("gif", "<img")])
def test_they_show_themselves(folder, tmp_path, ending, tag):
    made = ps.render(folder / "run.gsd", tmp_path / f"a.{ending}", frames=range(3))
    assert tag in made._repr_html_() and f"/{ending};base64," in made._repr_html_()


def test_a_gif_is_never_faster_than_viewers_show(tmp_path):
    ps.render(gas(1, duration=1.0, movie={"resolution": [64, 64], "fps": 120}), tmp_path / "a.gif")
    with Image.open(tmp_path / "a.gif") as image:
        lasting = []
        for k in range(image.n_frames):
            image.seek(k)
            lasting.append(image.info["duration"])
    assert min(lasting) >= 20 and sum(lasting) == pytest.approx(1000, abs=40)


def test_pictures_of_some_frames_are_numbered_through_and_name_their_frames(folder, tmp_path):
    ps.render(folder / "run.gsd", tmp_path / "%d.png", frames=range(10, 60, 20))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["0.png", "1.png", "2.png"]
    assert [read_provenance(tmp_path / f"{k}.png")["frames"][0] for k in range(3)] == [10, 30, 50]


def test_pictures_that_are_left_go_on(tmp_path, monkeypatch):
    for name, value in (("INTERVAL", 0.0), ("_SPARE", 0.0), ("_sync", lambda path: None)):
        monkeypatch.setattr(partial_run, name, value)

    def stop(phase, done, total):
        if done == 31:
            raise KeyboardInterrupt

    ps.render(some(), tmp_path / "straight_%d.png")
    with pytest.raises(KeyboardInterrupt):
        ps.render(some(), tmp_path / "left_%d.png", progress=stop)
    assert not list(tmp_path.glob("left_*.png"))
    ps.render(some(), tmp_path / "left_%d.png", resume=True)
    for k in range(67):
        assert (tmp_path / f"left_{k}.png").read_bytes() == (tmp_path / f"straight_{k}.png").read_bytes()
    assert not list(tmp_path.glob(".*"))


def test_pictures_that_were_on_their_way_arrive(tmp_path):
    """A run that was left while its pictures went to their places: those that are there stay."""
    (tmp_path / "in").mkdir()
    image = np.zeros((4, 4, 3), np.uint8)
    with PictureFiles(tmp_path / "in", lambda k: {}) as files:
        for _ in range(3):
            files.send(image)
        files.join({})
        (tmp_path / "in/00000000.png").rename(tmp_path / "a0.png")
        files.appear(tmp_path / "a%d.png")
    assert sorted(path.name for path in tmp_path.glob("*.png")) == ["a0.png", "a1.png", "a2.png"]


def test_a_picture_that_cannot_be_written_is_an_error(tmp_path):
    with PictureFiles(tmp_path / "none", lambda k: {}) as files:
        files.send(np.zeros((4, 4, 3), np.uint8))
        with pytest.raises(FileNotFoundError, match="there is no folder"):
            files.flush()


def test_older_pictures_do_not_go_on(folder, tmp_path):
    (tmp_path / "p5.png").touch()
    line = r"p5\.png: of a longer sequence: it would seem to go on with these 5; remove it$"
    with pytest.raises(OutputError, match=line):
        ps.render(folder / "run.gsd", tmp_path / "p%d.png", frames=range(5))
    found = CliRunner().invoke(
        cli.app, ["render", str(folder / "run.gsd"), "--frames", ":5", "-o", str(tmp_path / "p%d.png")]
    )
    assert found.exit_code == 2 and "longer sequence" in found.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["p5.png"]


def test_names_of_pictures(tmp_path):
    assert picture_path(tmp_path / "a_%05d.png", 7) == tmp_path / "a_00007.png"
    assert picture_path(tmp_path / "%d_100%.png", 123) == tmp_path / "123_100%.png"
    assert picture_path(tmp_path / "%02d.png", 123) == tmp_path / "123.png"
