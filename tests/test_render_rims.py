"""Faces are a little darker along the edges of their body, and not along the seams between parts of a compound."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from particlesim.geometry import shapes
from particlesim.geometry.compounds import Part, compound
from particlesim.geometry.shape_table import stack_shapes
from particlesim.rendering.visibility.rims import rims_of
from tests.test_render_picture import draw, make_frame, make_scene

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
    # How far a face is turned to the eye is asked at the middle of its part; a rim is darker by a fifth, 40 of 255.
    assert (np.abs(whole - split).max(axis=2)[rim] > 20).mean() < 0.002


def test_only_seams_are_left_out():
    """Of an L the edges that are to be seen are those of the body, as the shape of its outline says."""
    bar, post = ((1.0, 0.4, 0.5), (0.0, 0.0, 0.0)), ((0.4, 0.6, 0.5), (-0.3, 0.5, 0.0))
    shape = boxes(bar, post)
    table = stack_shapes([shape], drawn=True)
    rim = rims_of([shape], table)
    for number, part in enumerate(shape.parts, int(table.shape["first_part"][0])):
        for f in range(table.shape["first_face"][number], table.shape["last_face"][number]):
            corners = slice(table.face["first"][f], table.face["last"][f])
            assert corners.stop - corners.start == 4
            seams = 4 - rim[corners].sum()
            assert seams <= 1, part.name
    # Two faces and the end of the post go on in the bar; of the bar the end does, and of the two the smaller part.
    assert (~rim).sum() == 4


def test_all_edges_of_single_shapes_are_seen():
    cube = shapes.cube()
    assert rims_of([cube], stack_shapes([cube])).all()
