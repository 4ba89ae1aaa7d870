"""The presets of quality show the same things, each smoother than the one before."""

import numpy as np
import pytest

from particlesim.core.parallel import use_threads
from particlesim.geometry import shapes
from particlesim.rendering import Renderer
from particlesim.rendering.look import look_of
from particlesim.rendering.quality import PRESETS
from particlesim.scene import Scene
from tests.test_render_picture import edge, make_frame, make_header

KINDS = [shapes.sphere(), shapes.cube(), shapes.pyramid()]
SIZE = 160, 120


def picture(quality, count=40, background="#ffffff"):
    """Some particles of all kinds above a floor, (120, 160, 3) int."""
    random = np.random.default_rng(4)
    scene = Scene(
        world={"size": (6.0, 6.0, 6.0)},
        particles=[{"shape": "sphere", "count": 1, "colour": colour} for colour in ("red", "green", "blue")],
        movie={"resolution": SIZE, "background": background, "quality": quality},
        camera={"kind": "look-at", "position": (9.0, 3.0, 5.0)},
        show={"box": False, "readout": False},
    )
    turn = random.normal(size=(count, 4))
    turn /= np.linalg.norm(turn, axis=1, keepdims=True)
    frame = make_frame(random.uniform(-2.2, 2.2, (count, 3)), turn)
    header = make_header(KINDS, np.arange(count) % 3, random.uniform(0.5, 1.2, count))
    with Renderer(look_of(scene, header, frame)) as renderer:
        return renderer.draw(frame).astype(int)


def busy(image, step):
    """Pixels beside which colour steps by more than ``step``."""
    wide = np.pad(image, ((1, 1), (1, 1), (0, 0)), mode="edge")
    height, width = image.shape[:2]
    around = [wide[1 + y : 1 + y + height, 1 + x : 1 + x + width] for x in (-1, 0, 1) for y in (-1, 0, 1)]
    return (np.max(around, axis=0) - np.min(around, axis=0)).max(axis=2) > step


def test_all_presets_show_the_same():
    assert list(PRESETS) == ["draft", "normal", "high"]
    draft, normal, high = (picture(quality) for quality in PRESETS)
    assert draft.shape == normal.shape == high.shape == (120, 160, 3)
    for one, other, most in ((draft, normal, 10.0), (normal, high, 3.0), (draft, high, 10.0)):
        assert not np.array_equal(one, other)
        assert np.abs(one - other).mean() < most
        # As bright in all, but for the sky that particles hide from one another.
        assert np.abs(one.mean(axis=(0, 1)) - other.mean(axis=(0, 1))).max() < 0.7 * most
        # Each particle has its colour.
        assert (one.argmax(axis=2) == other.argmax(axis=2))[~busy(one, 20)].mean() > 0.97


def test_high_differs_from_normal_at_edges_and_shadows_alone():
    normal, high = picture("normal"), picture("high")
    different = np.abs(normal - high).max(axis=2) > 8
    calm = ~busy(normal, 12) & ~busy(high, 12)
    assert calm.mean() > 0.3
    assert not different[calm].any()
    assert different.any()


@pytest.mark.parametrize("quality", PRESETS)
def test_the_number_of_threads_changes_no_pixel(quality):
    pictures = []
    try:
        for count in (1, 2, 4):
            use_threads(count)
            pictures.append(picture(quality, 200))
    finally:
        use_threads(None)
    assert np.array_equal(pictures[0], pictures[1]) and np.array_equal(pictures[0], pictures[2])


def silhouette(quality):
    """How much of each pixel a black ball covers before a white background."""
    scene = Scene(
        world={"size": (6.0, 6.0, 6.0), "boundary": "open"},
        particles=[{"shape": "sphere", "count": 1, "colour": "black"}],
        movie={"resolution": SIZE, "background": "#ffffff", "quality": quality},
        camera={"kind": "look-at", "position": (60.0, 0.0, 0.0), "field_of_view": 6.0},
        show={"box": False, "readout": False},
    )
    header, frame = make_header([shapes.sphere()], np.array([0]), [4.0]), make_frame([(0.0, 0.0, 0.0)])
    with Renderer(look_of(scene, header, frame)) as renderer:
        return 1.0 - renderer.draw(frame)[..., 2] / 255.0


def test_edges_are_sharp_in_a_draft_and_soft_above():
    covered = {quality: silhouette(quality) for quality in PRESETS}
    # A ball of radius 2 seen from 60 m.
    radius = np.tan(np.arcsin(2.0 / 60.0)) / np.tan(np.radians(3.0)) * 60.0
    fine = 16
    x, y = ((np.arange(n * fine) + 0.5) / fine - 0.5 * n for n in SIZE)
    ball = (x[None, :] ** 2 + y[:, None] ** 2 < radius**2).astype(float)
    exact = ball.reshape(SIZE[1], fine, SIZE[0], fine).mean(axis=(1, 3))
    rim = edge(exact > 0.5)
    # The ball is not all black: it shines, and is pale with distance. What is as dark as the darkest third is covered.
    dark = np.quantile(covered["draft"][exact == 1.0], 0.3)
    off = {quality: np.abs(np.minimum(found / dark, 1.0) - exact)[rim].mean() for quality, found in covered.items()}
    assert off["normal"] < 0.75 * off["draft"]
    assert off["high"] < 0.75 * off["draft"]
    between = {quality: ((found > 0.05) & (found < 0.6 * dark))[rim].mean() for quality, found in covered.items()}
    assert between["draft"] == 0.0
    assert between["normal"] > 0.1 and between["high"] > 0.1
