"""The public ``separation``: what it takes, what it refuses, and in which axes it speaks."""

import numpy as np
import pytest
import trimesh

import particlesim as ps
from particlesim.geometry import shapes
from tests import oracles
from tests.oracles import direction, unit_quaternion


def test_names_shapes_poses_and_tuples_are_the_same_thing():
    turn = (0.5, 0.5, -0.5, 0.5)
    answers = [
        ps.separation("cube", ((0, 0, 0),), "pyramid", ((0.2, 0.1, 2.0), turn, 0.5)),
        ps.separation(
            ps.CATALOGUE["cube"](), ps.Pose((0, 0, 0)), shapes.pyramid(), ps.Pose((0.2, 0.1, 2.0), turn, 0.5)
        ),
        ps.separation("box", [[0.0, 0.0, 0.0]], "pyramid", [np.array([0.2, 0.1, 2.0]), np.array(turn) * 7.0, 0.5]),
        ps.separation(
            "cube", ((0, 0, 0), (1e-200, 0, 0, 0)), "pyramid", ((0.2, 0.1, 2.0), np.array(turn) * 1e200, 0.5)
        ),
    ]
    for answer in answers:
        assert answer.distance == pytest.approx(answers[0].distance, rel=1e-15)
        np.testing.assert_allclose(answer.normal, answers[0].normal, rtol=1e-14, atol=1e-15)
        np.testing.assert_allclose(answer.points, answers[0].points, rtol=1e-14, atol=1e-15)
    assert isinstance(answers[0], ps.Separation) and isinstance(answers[0].distance, float)


def test_points_are_in_world_axes():
    found = ps.separation("sphere", ((10.0, 20.0, 30.0),), "sphere", ((10.0, 20.0, 32.0),))
    assert found.distance == 1.0
    np.testing.assert_array_equal(found.points, [(10.0, 20.0, 31.0)])


def test_a_pose_is_left_as_it_was():
    turn = np.array([0.0, 3.0, 0.0, 4.0])
    ps.separation("cube", (np.zeros(3), turn), "cube", (np.ones(3),))
    assert turn.tolist() == [0.0, 3.0, 0.0, 4.0]


@pytest.mark.parametrize(
    ("shape", "pose", "message"),
    [
        ("ball", ((0, 0, 0),), "unknown shape 'ball'"),
        ("mesh", ((0, 0, 0),), "'mesh' needs parameters"),
        ("cube", (), "a pose is"),
        ("cube", ((0, 0, 0), (1, 0, 0, 0), 1.0, 2.0), "a pose is"),
        ("cube", 3.0, "a pose is"),
        ("cube", (0.0, 0.0, 0.0), "a position must be 3 finite numbers"),
        ("cube", ((0.0, 0.0),), "a position must be 3 finite numbers"),
        ("cube", ((0.0, 0.0, np.nan),), "a position must be 3 finite numbers"),
        ("cube", (("a", "b", "c"),), "a position must be 3 finite numbers"),
        ("cube", ((0, 0, 0), (1.0, 0.0, 0.0)), "an orientation must be 4 finite numbers"),
        ("cube", ((0, 0, 0), (np.inf, 0.0, 0.0, 0.0)), "an orientation must be 4 finite numbers"),
        ("cube", ((0, 0, 0), (0.0, 0.0, 0.0, 0.0)), "an orientation must not be all zero"),
        ("cube", ((0, 0, 0), (1.0, 0.0, 0.0, 0.0), 0.0), "a size must be above 0"),
        ("cube", ((0, 0, 0), (1.0, 0.0, 0.0, 0.0), -1.0), "a size must be above 0"),
        ("cube", ((0, 0, 0), (1.0, 0.0, 0.0, 0.0), np.inf), "a size must be 1 finite number"),
        ("cube", ((0, 0, 0), (1.0, 0.0, 0.0, 0.0), "large"), "a size must be 1 finite number"),
    ],
)
def test_what_makes_no_sense_is_refused(shape, pose, message):
    with pytest.raises(ValueError, match=message):
        ps.separation(shape, pose, "sphere", ((5.0, 0.0, 0.0),))
    with pytest.raises(ValueError, match=message):
        ps.separation("sphere", ((5.0, 0.0, 0.0),), shape, pose)


def test_a_half_space_is_the_second_shape():
    wall, turn = shapes.half_space(), (np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5))  # its normal becomes +y
    found = ps.separation("sphere", ((5.0, 2.0, 0.0),), wall, ((0.0, 1.0, 0.0), turn))
    assert found.distance == pytest.approx(0.5, rel=1e-15)
    np.testing.assert_allclose(found.normal, (0.0, -1.0, 0.0), atol=1e-15)
    np.testing.assert_allclose(found.points, [(5.0, 1.5, 0.0)], atol=1e-15)
    with pytest.raises(ValueError, match="a half-space may be the second shape only"):
        ps.separation(wall, ((0, 0, 0),), "sphere", ((0, 0, 0),))


def test_the_pose_of_a_mesh_is_that_of_its_file(tmp_path):
    """A wedge whose principal axes are not those of the file: vertices turned and moved by hand give the answer."""
    random = np.random.default_rng(1)
    wedge = np.array([(0, 0, 0), (3, 0, 0), (0, 2, 0), (0, 0, 1), (3, 0, 0.5)], dtype=float)
    solid = trimesh.Trimesh(wedge, trimesh.convex.convex_hull(wedge).faces).convex_hull
    solid.export(tmp_path / "wedge.ply")
    shape = shapes.mesh(tmp_path / "wedge.ply")
    assert abs(shape.orientation[0]) < 0.999
    for _ in range(50):
        turn, where, size = unit_quaternion(random), 3.0 * direction(random), random.uniform(0.5, 2.0)
        vertices = size * (wedge - solid.center_mass) @ oracles.rotation(turn).T + where
        expected = oracles.difference_distance(oracles.corners(shapes.cube()), vertices)
        found = ps.separation("cube", ((0, 0, 0),), shape, (where, turn, size))
        assert found.distance == pytest.approx(expected, abs=1e-6)
        assert oracles.difference_distance(
            oracles.corners(shapes.cube()), vertices - found.distance * found.normal
        ) == (pytest.approx(0.0, abs=1e-6))
