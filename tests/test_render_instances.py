"""What a picture of a periodic world shows: what reaches through a face is there on its other side as well."""

from itertools import product

import numpy as np

from particlesim.geometry import shapes
from particlesim.rendering.visibility.geometry_tables import geometry_tables
from particlesim.rendering.visibility.instances import images_of, instances_of
from tests.test_render_picture import covered, draw, edge, make_frame, make_header, make_scene, seen


def test_images_are_those_that_reach_into_the_world():
    random = np.random.default_rng(1)
    size, periodic = np.array([2.0, 3.0, 1.0]), np.array([True, False, True])
    centre, half = (random.random((500, 3)) - 0.5) * size, random.uniform(0.02, 0.2, (500, 3))
    lower, upper = centre - half, centre + half
    which, shift = images_of(lower, upper, size, periodic)
    turns = np.rint(shift / size).astype(int)
    assert np.allclose(shift, turns * size)
    found = {(int(i), *map(int, turn)) for i, turn in zip(which, turns, strict=True)}
    assert len(found) == len(which)
    # By trying all of the neighbouring worlds.
    expected = {
        (i, x, 0, z)
        for i, x, z in product(range(500), (-1, 0, 1), (-1, 0, 1))
        if (x or z)
        and all(np.abs(centre[i] + np.array([x, 0, z]) * size)[[0, 2]] - half[i, [0, 2]] < 0.5 * size[[0, 2]])
    }
    assert found == expected
    assert len(found) > 100


def test_what_sticks_out_of_a_periodic_world_comes_in_on_the_other_side():
    position = [(0.0, 2.8, 0.5)]
    around = make_scene("#000000", world={"boundary": "periodic"})
    image = covered(draw(around, [shapes.sphere()], [1.0], make_frame(position)))
    expected = seen((0.0, 2.8, 0.5), 0.5) | seen((0.0, -3.2, 0.5), 0.5)
    assert not (image ^ expected)[~edge(expected)].any()
    alone = covered(draw(make_scene("#000000"), [shapes.sphere()], [1.0], make_frame(position)))
    assert not (alone ^ seen((0.0, 2.8, 0.5), 0.5))[~edge(expected)].any()


def test_an_image_is_the_particle_s_in_shape_and_colour():
    turn = [[np.cos(0.3), 0.0, 0.0, np.sin(0.3)], [1.0, 0.0, 0.0, 0.0]]
    frame = make_frame([(0.0, 2.9, 0.0), (0.0, 0.0, 2.9)], turn)
    around = make_scene("#ff0000", "#0000ff", world={"boundary": ["open", "periodic", "periodic"]})
    picture = draw(around, [shapes.cube(), shapes.sphere()], [1.0, 1.0], frame)
    for centre, radius, channel in (((0, 2.9, 0), 0.45, 0), ((0, -3.1, 0), 0.45, 0), ((0, 0, -3.1), 0.45, 2)):
        inside = picture[seen(centre, radius)].astype(int)
        others = [c for c in range(3) if c != channel]
        assert len(inside) > 300
        assert (inside[:, channel] > inside[:, others].max(axis=1) + 30).all()


def test_hulls_that_do_not_reach_through_a_face_have_no_image():
    """A cube flat against a face, whose bounding sphere is through it; turned by half a right angle its edge is.

    So is its face where rounding moves it out.
    """
    flat, turned = [1.0, 0.0, 0.0, 0.0], [np.cos(np.pi / 8), np.sin(np.pi / 8), 0.0, 0.0]
    world = make_scene("#000000", world={"boundary": "periodic"})
    for turn, rounding, count in ((flat, 0.0, 1), (turned, 0.0, 2), (flat, 0.09, 1), (flat, 0.11, 2)):
        header = make_header([shapes.cube(rounding=rounding)], np.zeros(1, int), [1.0])
        frame = make_frame([(0.0, 2.4, 0.0)], [turn])
        instances = instances_of(world, header, frame, geometry_tables(header))
        assert len(instances.position) == count
        assert instances.bodies(np.arange(count)).tolist() == [0] * count
