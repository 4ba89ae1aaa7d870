"""The presets of quality show the same things, each smoother than the one before."""

import numpy as np
import pytest

from particlesim.core.parallel import use_threads
from particlesim.geometry import shapes
from particlesim.rendering import Renderer
from particlesim.rendering.camera import Camera
from particlesim.rendering.look import look_of
from particlesim.rendering.passes import mean_of, passes_of
from particlesim.rendering.quality import PRESETS
from particlesim.rendering.shading.pixel_light import all_around, disc_of_lamps
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
    assert list(PRESETS) == ["draft", "normal", "high", "best"]
    draft, normal, high, best = (picture(quality) for quality in PRESETS)
    assert draft.shape == normal.shape == high.shape == best.shape == (120, 160, 3)
    for one, other, most in ((draft, normal, 10.0), (normal, high, 7.0), (draft, high, 10.0), (high, best, 3.0)):
        assert not np.array_equal(one, other)
        assert np.abs(one - other).mean() < most
        # As bright in all, but for the sky that particles hide from one another.
        assert np.abs(one.mean(axis=(0, 1)) - other.mean(axis=(0, 1))).max() < 0.7 * most
        # Each particle has its colour.
        assert (one.argmax(axis=2) == other.argmax(axis=2))[~busy(one, 20)].mean() > 0.97


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
    assert off["best"] < 0.75 * off["high"]
    between = {quality: ((found > 0.05) & (found < 0.6 * dark))[rim].mean() for quality, found in covered.items()}
    assert between["draft"] == 0.0
    assert min(between[quality] for quality in ("normal", "high", "best")) > 0.1


def floor_below(centres, quality):
    """How bright the floor is at the origin of a world 4 m high, 0 .. 1, below balls of radius 0.45 m."""
    scene = Scene(
        world={"size": (8.0, 8.0, 4.0)},
        particles=[{"shape": "sphere", "count": 1, "colour": "white"}],
        movie={"resolution": (640, 480), "background": "#ffffff", "quality": quality},
        camera={"kind": "look-at", "position": (9.0, 0.0, 0.0), "target": (0.0, 0.0, -2.0), "field_of_view": 20.0},
        show={"box": False, "readout": False},
    )
    header = make_header([shapes.sphere()], np.zeros(len(centres), dtype=int), np.full(len(centres), 0.9))
    frame = make_frame(np.array(centres))
    with Renderer(look_of(scene, header, frame)) as renderer:
        return renderer.draw(frame)[240, 320].mean() / 255.0


@pytest.mark.parametrize("quality", ["high", "best"])
def test_a_ball_hides_its_part_of_the_sky_from_the_floor_below_it(quality):
    """Of a plane element's light a sphere of radius r at height h above it hides (r / h)^2 (Howell's catalogue)."""
    far = (-3.0, 3.0, 1.5)
    ratio = floor_below([(0.0, 0.0, -1.0)], quality) / floor_below([far], quality)
    # The sky is 0.4 of the floor's light, and 0.7 of that can be hidden.
    assert ratio == pytest.approx(1.0 - 0.4 * 0.7 * 0.45**2, abs={"high": 0.03, "best": 0.015}[quality])


def test_directions_of_the_sky_are_spread_evenly():
    random = np.random.default_rng(5)
    normals = random.normal(size=(200, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    # The mean of the cosine over a sphere, where it is not below 0, is a quarter.
    for one in passes_of(12):
        directions = all_around(16, one.lift, one.turn)
        assert np.linalg.norm(directions, axis=1) == pytest.approx(np.ones(16))
        assert 4.0 * np.maximum(normals @ directions.T, 0.0).mean(axis=1) == pytest.approx(np.ones(200), abs=0.2)
    every = np.vstack([all_around(12, one.lift, one.turn) for one in passes_of(12)])
    assert 4.0 * np.maximum(normals @ every.T, 0.0).mean(axis=1) == pytest.approx(np.ones(200), abs=0.03)


def test_points_of_a_lamp_fill_its_disc():
    towards = np.array([0.6, 0.0, 0.8])
    points = disc_of_lamps(towards, 4000, 0.1, 0.3)
    aside = np.arccos(points @ towards)
    assert aside.max() <= 0.05 and points.mean(axis=0) == pytest.approx(towards, abs=2e-3)
    # Half of a disc's points are within its radius over the root of 2.
    assert (aside < 0.05 / np.sqrt(2.0)).mean() == pytest.approx(0.5, abs=0.01)


def test_passes_go_through_the_middle_in_the_mean():
    assert passes_of(1)[0][:2] == ((0.0, 0.0), (0.0, 0.0))
    shift, lens = (np.array([one[k] for one in passes_of(12)]) for k in (0, 1))
    assert np.abs(shift).max() <= 0.55 and shift.mean(axis=0) == pytest.approx([0.0, 0.0], abs=1e-12)
    assert np.linalg.norm(lens, axis=1).max() < 1.3 and lens.mean(axis=0) == pytest.approx([0.0, 0.0], abs=1e-12)


def test_the_mean_of_pictures_is_that_of_their_numbers():
    random = np.random.default_rng(6)
    pictures = random.integers(0, 256, (5, 3, 4, 4)).astype(np.uint8)
    assert np.abs(mean_of(iter(pictures)) - pictures.mean(axis=0)).max() <= 0.5
    assert mean_of(iter(pictures[:1])) is not None and np.array_equal(mean_of(iter(pictures[:1])), pictures[0])


def test_through_all_of_a_lens_what_is_in_focus_stays_and_the_rest_moves_aside():
    kind = {"kind": "look-at", "position": (10.0, 0.0, 0.0), "aperture": 0.4, "focus": 8.0}
    scene = Scene(world={"size": (6.0, 6.0, 6.0)}, particles=[{"shape": "sphere", "count": 1}], camera=kind)
    camera = Camera(scene, 1.0)
    view = camera.view(0.0)

    def seen(point, place):
        """Where a point is seen at distance 1 [m]."""
        one = camera.through_lens(view, place)
        x, y, z = one.pose[:3, :3].T @ (np.array(point) - one.pose[:3, 3])
        return np.array([x, y]) / -z + one.skew

    for place in ((1.0, 0.0), (0.0, -1.0), (0.3, 0.7)):
        sharp, far = (2.0, 0.5, -0.4), (-6.0, 0.5, -0.4)
        assert seen(sharp, place) == pytest.approx(seen(sharp, (0.0, 0.0)), abs=1e-12)
        # A circle of confusion: the lens's radius times (1 / focus - 1 / distance).
        moved = 0.2 * (1.0 / 8.0 - 1.0 / 16.0) * np.array(place)
        assert seen(far, place) - seen(far, (0.0, 0.0)) == pytest.approx(moved, abs=1e-12)
