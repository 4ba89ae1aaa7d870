"""Pictures without a background: laid over white they are those that are drawn for white."""

import subprocess

import imageio.v3 as iio
import numpy as np
import pytest
from PIL import Image

import particlesim as ps
from particlesim.core.output_path import OutputError
from particlesim.geometry import shapes
from particlesim.rendering import Renderer
from particlesim.rendering.gl.platform import ffmpeg
from particlesim.rendering.look import look_of
from particlesim.rendering.transparency import straight
from particlesim.scene import Scene
from tests.test_render_picture import make_frame, make_header

SIZE = 320, 240


def scene_of(background, quality="normal", **more):
    return Scene(
        world={"size": (6.0, 6.0, 6.0)},
        duration=0.2,
        particles=[{"shape": "sphere", "count": 6, "size": 1.2, "colour": "steelblue"}],
        movie={"resolution": SIZE, "background": background, "quality": quality, "fps": 20, **more},
        camera={"kind": "look-at", "position": (12.0, 3.0, 6.0)},
    )


def drawn(scene):
    frame = make_frame([(0.0, 0.0, -2.4), (1.0, 2.0, 1.0)])
    with Renderer(look_of(scene, make_header([shapes.sphere()], np.zeros(2, int), [1.2, 1.2]), frame)) as renderer:
        return renderer.draw(frame)


@pytest.mark.parametrize("quality", ["draft", "normal", "high"])
def test_over_white_it_is_as_drawn_for_white(quality):
    clear = Image.fromarray(straight(drawn(scene_of("transparent", quality))))
    over = Image.new("RGBA", SIZE, "white")
    over.alpha_composite(clear)
    plain = drawn(scene_of("white", quality)).astype(float)
    off = np.abs(np.asarray(over)[..., :3] - plain).max(axis=2)
    # Without the haze of the distance and the shade that a floor has against a white background.
    assert np.median(off) <= 1.0 and (off < 16.0).mean() > 0.97


def test_bodies_hide_all_shadows_a_part_and_air_nothing():
    clear = straight(drawn(scene_of("transparent")))
    hides = clear[..., 3]
    assert hides[:5, -5:].max() == 0  # a corner
    blue = (clear[..., 2] > 1.5 * clear[..., 0]) & (clear[..., 2] > 90)
    assert blue.sum() > 500 and np.median(hides[blue]) == 255
    shade = (hides > 10) & (hides < 120) & (clear[..., :3].max(axis=2) == 0)
    assert shade.sum() > 200


def test_movies_and_stills_have_a_fourth_channel(tmp_path):
    scene = scene_of("transparent", fade=0.05)
    ps.render(scene, tmp_path / "x.webm")
    ps.render(scene, tmp_path / "x_%05d.png")
    ps.still(scene, tmp_path / "still.png", 0.1)
    pictures = [np.asarray(Image.open(tmp_path / f"x_{k:05}.png")) for k in range(5)]
    assert all(picture.shape == (240, 320, 4) for picture in pictures)
    assert pictures[0].max() == 0  # faded out of nothing
    assert iio.imread(tmp_path / "still.png").shape == iio.imread(tmp_path / "x.png").shape == (240, 320, 4)
    command = [ffmpeg(), "-v", "error", "-c:v", "libvpx-vp9", "-i", tmp_path / "x.webm", "-f", "rawvideo"]
    raw = subprocess.run([*command, "-pix_fmt", "rgba", "-"], capture_output=True, check=True).stdout
    movie = np.frombuffer(raw, np.uint8).reshape(-1, 240, 320, 4)
    assert len(movie) == 5
    for picture, frame in zip(pictures[1:4], movie[1:4], strict=True):
        assert np.abs(picture[..., 3].astype(int) - frame[..., 3]).mean() < 2.0
        opaque = picture[..., 3] == 255
        assert np.abs(picture[..., :3].astype(int) - frame[..., :3])[opaque].mean() < 8.0


@pytest.mark.parametrize("ending", [".mp4", ".gif"])
def test_formats_without_transparency_are_refused(ending, tmp_path):
    with pytest.raises(OutputError, match=rf"x{ending}: {ending} has no transparent background; .webm and .png have$"):
        ps.render(scene_of("transparent"), tmp_path / f"x{ending}")
    assert not list(tmp_path.glob("*"))


def test_half_a_colour_is_whole_in_a_file():
    image = np.array([[[50, 20, 0, 100], [0, 0, 0, 0], [7, 8, 9, 255]]], dtype=np.uint8)
    assert straight(image).tolist() == [[[128, 51, 0, 100], [0, 0, 0, 0], [7, 8, 9, 255]]]
