"""Movies and images as files: what is in them, and that none is left half written."""

import re
import tempfile
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image

from particlesim.core.atomic_write import atomic_write
from particlesim.rendering import RenderError, write_image
from particlesim.rendering.video import encoder, segments
from particlesim.rendering.video.fade import faded, strength

SIZE = (130, 98)  # even, but no multiples of the 16 pixels that encoders like


def images(count):
    for number in range(count):
        image = np.full((SIZE[1], SIZE[0], 3), 200, dtype=np.uint8)
        image[20:60, 2 * number : 2 * number + 40] = (180, 40, 30)
        yield image


def write_movie(path, pictures, fps, size, crf=18):
    """Make a movie of pictures, in a folder that does not stay."""
    with (
        atomic_write(path) as hidden,
        tempfile.TemporaryDirectory(dir=hidden.parent) as folder,
        segments.Segments(Path(folder), fps, size, crf) as movie,
    ):
        for picture in pictures:
            movie.send(picture)
        movie.join({})
        movie.appear(hidden)
    return movie


def decoded(path):
    reader = imageio_ffmpeg.read_frames(str(path))
    meta = next(reader)
    width, height = meta["size"]
    return meta, [np.frombuffer(frame, np.uint8).reshape(height, width, 3) for frame in reader]


def test_movie_has_the_frames_size_rate_and_colours_that_went_in(tmp_path):
    path = tmp_path / "a.mp4"
    movie = write_movie(path, images(25), 25.0, SIZE)
    meta, frames = decoded(path)
    assert meta["size"] == SIZE and meta["codec"] == "h264" and meta["pix_fmt"].startswith("yuv420p")
    assert "bt709" in meta["pix_fmt"] and meta["fps"] == 25.0 and len(frames) == 25
    for got, sent in zip(frames, images(25), strict=True):
        assert np.abs(got.astype(int) - sent).mean() < 3.0
    assert np.abs(frames[0][30, 20].astype(int) - (180, 40, 30)).max() < 12
    assert movie.sent == 25 and movie.seconds > 0.0
    assert [p.name for p in tmp_path.iterdir()] == ["a.mp4"]
    # Faststart: the index stands before the data.
    data = path.read_bytes()
    assert 0 < data.find(b"moov") < data.find(b"mdat")


def test_same_images_give_the_same_bytes(tmp_path):
    for name in ("a.mp4", "b.mp4"):
        write_movie(tmp_path / name, images(12), 29.97, SIZE)
    assert (tmp_path / "a.mp4").read_bytes() == (tmp_path / "b.mp4").read_bytes()
    # Nor do they tell the versions of the encoder.
    assert not re.search(rb"x264 - core|Lav[cf][0-9]", (tmp_path / "a.mp4").read_bytes())


def test_a_higher_rate_factor_makes_a_smaller_file(tmp_path):
    rng = np.random.default_rng(1)
    noise = list(rng.integers(0, 255, (5, SIZE[1], SIZE[0], 3), dtype=np.uint8))
    sizes = []
    for crf in (10, 18, 40):
        write_movie(tmp_path / "a.mp4", noise, 30.0, SIZE, crf)
        sizes.append((tmp_path / "a.mp4").stat().st_size)
    assert sizes[0] > 1.2 * sizes[1] > 2.0 * sizes[2]


def test_a_fade_takes_its_time_at_both_ends():
    seen = [strength(number, 31, 10.0) for number in range(31)]
    assert seen[0] == seen[-1] == 0.0 and seen[5] == 0.5 and seen[10:21] == [1.0] * 11
    assert seen == seen[::-1] and np.all(np.diff(seen[:11]) > 0.0)
    # Two fades that meet in the middle of a short movie.
    assert max(strength(number, 11, 10.0) for number in range(11)) == 0.5
    assert strength(0, 1, 0.0) == 1.0


def test_what_is_faded_lies_between_the_picture_and_the_background():
    image = next(images(1))
    white = np.ones(3)
    assert faded(image, 1.0, white) is image
    assert np.all(faded(image, 0.0, white) == 255)
    half = faded(image, 0.5, white)
    assert half.dtype == np.uint8 and np.abs(half - (image / 2.0 + 127.5)).max() <= 0.5


@pytest.mark.parametrize("stop", [KeyboardInterrupt, ZeroDivisionError])
def test_nothing_is_left_when_drawing_stops(tmp_path, stop):
    path = tmp_path / "a.mp4"
    path.write_bytes(b"the movie of last time")

    def stopping():
        yield from images(5)
        raise stop

    with pytest.raises(stop):
        write_movie(path, stopping(), 30.0, SIZE)
    assert path.read_bytes() == b"the movie of last time"
    assert [p.name for p in tmp_path.iterdir()] == ["a.mp4"]


def test_images_of_another_size_or_none_are_refused(tmp_path):
    with pytest.raises(ValueError, match="shape"):
        write_movie(tmp_path / "a.mp4", [np.zeros((10, 10, 3), np.uint8)], 30.0, SIZE)
    with pytest.raises(RenderError, match="no frames"):
        write_movie(tmp_path / "a.mp4", [], 30.0, SIZE)
    assert not list(tmp_path.iterdir())


def test_failing_ffmpeg_says_why_in_one_line(tmp_path, monkeypatch):
    fake = tmp_path / "ffmpeg"
    fake.write_text("#!/bin/sh\necho first >&2\necho no space left on device >&2\nexit 3\n")
    fake.chmod(0o755)
    monkeypatch.setattr(encoder, "ffmpeg", lambda: str(fake))
    with pytest.raises(RenderError) as error:
        write_movie(tmp_path / "a.mp4", images(200), 30.0, SIZE)
    assert str(error.value) == "ffmpeg failed with exit status 3: no space left on device"
    assert [p.name for p in tmp_path.iterdir()] == ["ffmpeg"]


def test_an_ffmpeg_that_is_killed_names_the_signal(tmp_path, monkeypatch):
    fake = tmp_path / "ffmpeg"
    fake.write_text("#!/bin/sh\nkill -9 $$\n")
    fake.chmod(0o755)
    monkeypatch.setattr(encoder, "ffmpeg", lambda: str(fake))
    with pytest.raises(RenderError, match=r"^ffmpeg was ended by SIGKILL: no message$"):
        write_movie(tmp_path / "a.mp4", images(200), 30.0, SIZE)


@pytest.mark.parametrize("name", ["12:30.mp4", "http:a.mp4", "-a.mp4", "a b%03d.mp4", "Zeit \u00fc.mp4"])
def test_any_name_is_a_path(tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    write_movie(name, images(3), 30.0, SIZE)
    assert [p.name for p in tmp_path.iterdir()] == [name]
    assert len(decoded(f"file:{name}")[1]) == 3


def test_missing_folder_is_named(tmp_path):
    with pytest.raises(FileNotFoundError, match="no folder"):
        write_movie(tmp_path / "none" / "a.mp4", images(1), 30.0, SIZE)
    with pytest.raises(FileNotFoundError, match="no folder"):
        write_image(tmp_path / "none" / "a.png", next(images(1)))


def test_image_comes_back_as_it_was(tmp_path):
    image = next(images(1))
    write_image(tmp_path / "a.png", image)
    assert np.array_equal(np.asarray(Image.open(tmp_path / "a.png")), image)
    with pytest.raises(RenderError, match="unknown"):
        write_image(tmp_path / "a.nonsense", image)
    assert [p.name for p in tmp_path.iterdir()] == ["a.png"]
