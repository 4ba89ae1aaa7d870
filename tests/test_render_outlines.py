"""Outlines: dark lines on the rim of what is nearer, as wide as they should be, and none between parts of one body."""

import imageio.v3 as iio
import numpy as np
import pytest
from scipy import ndimage

import particlesim as ps
from particlesim.rendering.shading.outlines import draw_outlines
from particlesim.rendering.visibility.rasterise import VisibilityBuffer
from particlesim.scene import Scene


def lined(ids, depth, width, body=None, radius=1e6):
    """How much is left of white, 0 .. 1."""
    ids = np.asarray(ids, dtype=np.int32)
    buffer = VisibilityBuffer(np.where(ids < 0, -np.inf, depth).astype(np.float32), ids, np.zeros_like(ids))
    colours = np.full((*ids.shape, 4), 255, dtype=np.uint8)
    count = ids.max() + 1
    draw_outlines(colours, buffer, np.arange(count) if body is None else body, np.full(count, radius), width)
    assert (colours[..., 3] == 255).all()
    return colours[..., 0] / 255.0


LEFT = np.where(np.arange(12) < 6, 0, 1) * np.ones((5, 1), dtype=int)


@pytest.mark.parametrize(
    ("width", "dark"), [(1.0, [1.0]), (2.0, [1.0, 1.0]), (1.5, [1.0, 0.5]), (2.25, [1.0, 1.0, 0.25])]
)
def test_a_line_is_on_the_nearer_side_and_as_wide_as_asked(width, dark):
    left = lined(LEFT, np.where(LEFT == 0, 1.0, 0.5), width)
    assert np.ptp(left, axis=0).max() == 0.0
    wanted = np.zeros(12)
    wanted[6 - len(dark) : 6] = dark[::-1]
    assert left[0] == pytest.approx(1.0 - 0.85 * wanted, abs=0.003)


def test_there_is_a_line_before_nothing_and_none_within_a_body():
    assert lined(np.where(LEFT == 0, 0, -1), 1.0, 1.0)[0, 5] == pytest.approx(0.15, abs=0.003)
    assert lined(LEFT, np.where(LEFT == 0, 1.0, 0.5), 1.0, body=np.array([7, 7])).min() == 1.0


def test_lines_are_finer_on_small_bodies():
    assert lined(LEFT, np.where(LEFT == 0, 1.0, 0.5), 3.0, radius=2.0)[0].tolist().count(1.0) == 11
    assert lined(LEFT, np.where(LEFT == 0, 1.0, 0.5), 3.0, radius=2.0)[0, 5] == pytest.approx(
        1.0 - 0.85 * 0.3, abs=0.01
    )


def test_a_mesh_has_a_line_about_it_and_none_within(tmp_path):
    np.save(tmp_path / "hills.npy", np.random.default_rng(3).uniform(0.0, 1.0, (9, 9)))
    field = {"kind": "heightfield", "file": str(tmp_path / "hills.npy"), "size": (7, 7, 0.2)}
    images = []
    for outlines in (False, True):
        scene = Scene(
            world={"size": (8.0, 8.0, 4.0)},
            particles=[{"shape": "sphere", "placement": {"kind": "list", "poses": [{"position": (0, 0, 1)}]}}],
            obstacles=[{"shape": field, "position": (0, 0, -1)}],
            movie={"resolution": (320, 240), "background": "transparent"},
            camera={"kind": "look-at", "position": (0.1, 0.0, 12.0)},
            show={"box": False, "readout": False, "outlines": outlines},
        )
        ps.still(scene, tmp_path / "x.png", 0.0)
        images.append(iio.imread(tmp_path / "x.png").astype(int))
    darker = (images[0] - images[1])[..., :3].sum(axis=2) > 90
    there = images[0][..., 3] == 255
    rim = there & ~ndimage.binary_erosion(there, iterations=3)
    ball = ndimage.binary_dilation(np.ptp(images[0][..., :3], axis=2) > 60, iterations=4)
    # All around the field and the ball before it, and nowhere between two of its 128 triangles.
    assert darker[rim].mean() > 0.2 and darker[ball].sum() > 40
    assert not darker[there & ~rim & ~ball].any()
