"""The title over the opening of a movie: when it is seen, where it lies, and that it goes into its plate."""

import imageio.v3 as iio
import numpy as np
import pytest

import particlesim as ps
from particlesim.jobs.frame_source import frame_source
from particlesim.jobs.pictures import Pictures
from particlesim.rendering.hud.panel import Style
from particlesim.rendering.hud.title import Title, wrapped
from particlesim.rendering.video.fade import title_strength
from particlesim.trajectory.gsd_file import Trajectory
from tests.worlds import gas

SIZES = [(64, 64), (320, 180), (1280, 720), (720, 1280)]
LONG = "A title that has far more to say than goes on a line " * 12
NO_LETTER = "\U0010ffff"  # that no font has


def covered(text, size, dark=False, seen=1.0):
    """What a title changes in a grey picture, (h, w) bool."""
    grey = np.full((size[1], size[0], 3), 120, dtype=np.uint8)
    image = Title(text, size, dark).over(grey, seen)
    assert (grey == 120).all()
    return np.any(image != grey, axis=2)


def pictures_of(source, look):
    with Pictures(source, look, None) as pictures:
        return np.array(list(pictures.images())), pictures.poster


@pytest.mark.parametrize(("fps", "total", "gone"), [(30, 3000, 90), (30, 360, 90), (30, 200, 50), (60, 80, 20)])
def test_a_title_goes_within_three_seconds_or_the_first_quarter(fps, total, gone):
    seen = np.array([title_strength(k, total, fps) for k in range(total)])
    assert (seen[: 2 * gone // 3] == 1.0).all() and (seen[gone:] == 0.0).all()
    assert (np.diff(seen) <= 0.0).all() and 0.0 < seen[gone - 1] < 0.2


@pytest.mark.parametrize("total", [1, 2, 3])
def test_a_few_pictures_have_no_opening(total):
    assert not any(title_strength(k, total, 30.0) for k in range(total))


def test_the_opening_has_it_and_nothing_else(tmp_path):
    """Neither later pictures nor the poster nor stills, and none at all where the scene says so."""
    settings = {"duration": 1.0, "movie": {"fps": 20, "resolution": [64, 64]}}
    scene = gas(1, title="Gas", **settings)
    plain = gas(1, title="Gas", show={"title": False}, **settings)
    with_title, poster = pictures_of(frame_source(scene, None, None, None), scene)
    without, bare = pictures_of(frame_source(plain, None, None, None), plain)
    differs = (with_title != without).any(axis=(1, 2, 3))
    assert differs.tolist() == [k < 21 // 4 for k in range(21)]
    assert (poster == bare).all()
    ps.still(scene, tmp_path / "one.png", 0.0)
    ps.still(plain, tmp_path / "other.png", 0.0)
    assert (iio.imread(tmp_path / "one.png") == without[0]).all()
    assert (iio.imread(tmp_path / "other.png") == without[0]).all()


def test_a_trajectory_has_the_title_of_its_run_whatever_it_looks_like(tmp_path):
    settings = {"duration": 0.5, "movie": {"fps": 20, "resolution": [64, 64]}}
    ps.simulate(gas(1, title="Gas", **settings), tmp_path / "run.gsd")
    with Trajectory(tmp_path / "run.gsd") as run:
        own, _ = pictures_of(frame_source(run, None, None, None), run.scene)
        other, _ = pictures_of(frame_source(run, None, None, None), gas(1, title="", **settings))
    assert (own == other).all()


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("text", ["Gas", LONG, "W" * 900])
def test_it_stays_in_the_picture_and_in_its_middle(size, text):
    rows, columns = np.nonzero(covered(text, size))
    assert abs(columns.min() + columns.max() - size[0] + 1) <= 1 and columns.min() > 0
    assert rows.min() > 0.3 * size[1] and rows.max() < size[1] - 1


def test_as_it_fades_it_comes_closer_to_what_is_behind():
    grey = np.full((720, 1280, 3), 120, dtype=np.uint8)
    title = Title("Gas", (1280, 720), True)
    change = [np.abs(title.over(grey, seen).astype(int) - 120).sum() for seen in (0.0, 0.25, 0.5, 1.0)]
    assert change[0] == 0
    assert change[1:3] == pytest.approx([0.25 * change[3], 0.5 * change[3]], rel=0.02)


@pytest.mark.parametrize("text", ["", "  ", NO_LETTER, f" {NO_LETTER}\n"])
def test_without_letters_there_is_no_plate(text):
    assert not covered(text, (320, 180)).any()


def test_letters_that_no_font_has_are_left_out():
    size = 640, 360
    assert (covered(f"Gas{NO_LETTER}", size) == covered("Gas", size)).all()
    # With the marks that they bear.
    assert (covered(f"Gas{NO_LETTER}\u0301", size) == covered("Gas", size)).all()


def test_lines_hold_all_words_in_order_and_are_about_as_long():
    width = Style((1280, 720), False).width
    text = "one two three four five six seven eight nine ten"
    for room in (60, 100, 200, 400, 1000):
        lines = wrapped(text, room, width)
        assert " ".join(lines) == text and max(map(width, lines)) <= room
        assert len(lines) == 1 or min(map(width, lines)) > 0.4 * max(map(width, lines))
    broken = wrapped("x" * 50, 100, width)
    assert "".join(broken) == "x" * 50 and max(map(width, broken)) <= 100
