"""Faces are a little darker along the edges of their body, and not along the seams between parts of a compound."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from particlesim.geometry import shapes
from particlesim.geometry.compounds import Part, compound
from particlesim.geometry.shape_table import stack_shapes
from particlesim.rendering.visibility.rims import rims_of
from tests.test_render_picture import EYE, HEIGHT, SLOPE, WIDTH, draw, make_frame, make_scene

BAR = (1.0, 0.4, 0.5), (0.0, 0.0, 0.0)
TURN = np.roll(Rotation.from_euler("xyz", (0.4, 0.5, 0.3)).as_quat(), 1)[None]


def boxes(*edges_and_positions):
    """A compound of boxes, each given by its edges and the place of its middle."""
    return compound(
        [Part(shapes.box(edges), np.array(at), np.array([1.0, 0, 0, 0]), 1.0) for edges, at in edges_and_positions]
    )


def picture(shape):
    return draw(make_scene("#ddaa33"), [shape], [2.5], make_frame([(0.0, 0.0, 0.0)], TURN)).astype(int)


@pytest.mark.parametrize("gap", [0.0, 0.004, -0.1])
def test_a_block_of_parts_looks_like_the_block(gap):
    """Whether its halves touch, or leave a gap as those of a decomposition do, or overlap."""
    half = 0.5 - 0.5 * gap
    parts = boxes(((half, 0.8, 0.6), (0.25 + 0.25 * gap, 0, 0)), ((half, 0.8, 0.6), (-0.25 - 0.25 * gap, 0, 0)))
    whole, split = picture(shapes.box((1.0, 0.8, 0.6))), picture(parts)
    rim = np.abs(whole - 255).max(axis=2) > 40
    assert rim.sum() > 5000
    # A rim is darker by a fifth, 40 of 255; parts that are farther away have a little more haze.
    assert (np.abs(whole - split).max(axis=2)[rim] > 12).mean() < 0.002


@pytest.mark.parametrize(("across", "seams"), [(-0.3, 2.6), (0.0, 1.6)])
def test_only_seams_are_left_out(across, seams):
    """Of an L and a T of two boxes whose edges are on two faces each: 4 (a + b + c) of each box.

    On their two sides post and bar have a seam of 0.4 each, and that of the L has another of 0.5 at the end of the bar.
    """
    shape = boxes(BAR, ((0.4, 0.6, 0.5), (across, 0.5, 0.0)))
    rims = rims_of([shape], stack_shapes([shape], drawn=True))
    length = np.linalg.norm(rims.line[:, 3] - rims.line[:, 2], axis=1).sum()
    assert length == pytest.approx(2.0 * 4.0 * (1.9 + 1.5) - seams, abs=1e-9)
    assert (~rims.whole).sum() == (4 if across == 0.0 else 2)


def test_all_edges_of_single_shapes_are_seen():
    cube = shapes.cube()
    rims = rims_of([cube], stack_shapes([cube]))
    assert rims.whole.all() and np.array_equal(rims.first, 4 * np.arange(7)) and not rims.middle.any()


def test_a_seam_may_end_amid_an_edge():
    """A face of a T has one colour from bar to post, and on both sides of the post the rim of the bar."""
    size, middle = 3.0, 0.24 * 0.5 / 0.64  # of the post's area and place, across the bar
    shape = boxes(BAR, ((0.4, 0.6, 0.5), (0.0, 0.5, 0.0)))
    assert shape.orientation == pytest.approx([1.0, 0.0, 0.0, 0.0])
    towards_eye = [[np.sqrt(0.5), 0.0, np.sqrt(0.5), 0.0]]  # z to x, x to -z
    image = draw(make_scene("#ddaa33"), [shape], [size], make_frame([(0.0, 0.0, 0.0)], towards_eye)).astype(int)

    def seen_at(x, y):
        depth = EYE[0] - 0.25 * size
        right, up = size * (y - middle) / depth / SLOPE, -size * x / depth / SLOPE
        return image[int(0.5 * HEIGHT * (1.0 - up)), int(0.5 * (WIDTH + HEIGHT * right))]

    inside = seen_at(0.0, 0.0)
    for y in (0.18, 0.19, 0.2, 0.21, 0.22):
        for x in (-0.15, 0.0, 0.15):
            assert np.abs(seen_at(x, y) - inside).max() <= 5
    for x in (-0.4, -0.3, 0.3, 0.4):
        assert max((inside - seen_at(x, y)).max() for y in (0.185, 0.19, 0.195)) > 15
