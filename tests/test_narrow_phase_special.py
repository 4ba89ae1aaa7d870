"""Special positions whose answers are known: faces on faces, edges on edges, one in another, spheres everywhere."""

from math import pi, sqrt

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import particlesim as ps
from particlesim.core.constants import MAX_MANIFOLD, POLYHEDRON
from particlesim.geometry import shapes
from tests import oracles
from tests.oracles import direction, unit_quaternion
from tests.positions import GAPS, TILTS, UPRIGHT, about, check, meet


@pytest.mark.parametrize("tilt", TILTS)
@pytest.mark.parametrize("gap", GAPS)
class TestFacesOnFaces:
    def test_cube_on_cube(self, tilt, gap):
        z = 0.5 + gap / 2
        corners = [(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5)]
        check(meet("cube", "cube", (0, 0, 1 + gap), tilt=tilt), gap, (0, 0, 1), corners)

    def test_offset(self, tilt, gap):
        z = 0.5 + gap / 2
        corners = [(x, y, z) for x in (-0.2, 0.5) for y in (0.1, 0.5)]
        check(meet("cube", "cube", (0.3, 0.6, 1 + gap), tilt=tilt), gap, (0, 0, 1), corners)

    def test_turned_by_45_degrees_they_share_an_octagon(self, tilt, gap):
        z, c = 0.5 + gap / 2, sqrt(0.5) - 0.5
        corners = [p for s in (-0.5, 0.5) for t in (-c, c) for p in ((s, t, z), (t, s, z))]
        check(meet("cube", "cube", (0, 0, 1 + gap), turn_b=about((0, 0, 1), 45), tilt=tilt), gap, (0, 0, 1), corners)

    def test_small_on_large(self, tilt, gap):
        z = 0.5 + gap / 2
        corners = [(0.2 + x, y, z) for x in (-0.1, 0.1) for y in (-0.1, 0.1)]
        check(meet("cube", "cube", (0.2, 0, 0.6 + gap), size_b=0.2, tilt=tilt), gap, (0, 0, 1), corners)

    def test_base_of_a_pyramid_on_a_cube(self, tilt, gap):
        z = 0.5 + gap / 2
        corners = [(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5)]
        check(meet("cube", "pyramid", (0, 0, 0.75 + gap), tilt=tilt), gap, (0, 0, 1), corners)

    def test_face_of_a_tetrahedron_on_a_cube(self, tilt, gap):
        body = ps.CATALOGUE["tetrahedron"]()
        turn, _ = Rotation.align_vectors([[0.0, 0.0, -1.0]], [body.face_normals[0]])
        turn = np.roll(turn.as_quat(), 1)
        scaled = 0.5 * oracles.corners(body, 1.0, turn)
        base = scaled[list(body.faces[0])] + (0, 0, 0.5 + gap + 0.5 * body.inradius)
        base[:, 2] = 0.5 + gap / 2
        offset = (0, 0, 0.5 + gap + 0.5 * body.inradius)
        check(meet("cube", body, offset, turn_b=turn, size_b=0.5, tilt=tilt), gap, (0, 0, 1), base)

    def test_plates(self, tilt, gap):
        plate = shapes.box((1.0, 1.0, 0.001))
        if gap < -1e-4:
            return
        z = 0.0005 + gap / 2
        corners = [(x, y, z) for x in (-0.3, 0.5) for y in (-0.5, 0.5)]
        check(meet(plate, plate, (0.2, 0, 0.001 + gap), tilt=tilt), gap, (0, 0, 1), corners)


@pytest.mark.parametrize("tilt", TILTS)
@pytest.mark.parametrize("gap", GAPS)
class TestEdgesAndCorners:
    def test_edge_on_face(self, tilt, gap):
        z = 0.5 + gap / 2
        found = meet("cube", "cube", (0, 0.1, 0.5 + sqrt(0.5) + gap), turn_b=about((1, 0, 0), 45), tilt=tilt)
        check(found, gap, (0, 0, 1), [(-0.5, 0.1, z), (0.5, 0.1, z)])

    def test_corner_on_face(self, tilt, gap):
        turn = about((1, -1, 0), np.degrees(np.arctan(sqrt(2.0))))
        found = meet("cube", "cube", (0.1, 0.2, 0.5 + sqrt(0.75) + gap), turn_b=turn, tilt=tilt)
        check(found, gap, (0, 0, 1), [(0.1, 0.2, 0.5 + gap / 2)])

    def test_crossed_edges(self, tilt, gap):
        turns = about((1, 0, 0), 45), about((0, 1, 0), 45)
        found = meet("cube", "cube", (0.1, 0.2, sqrt(2.0) + gap), *turns, tilt=tilt)
        check(found, gap, (0, 0, 1), [(0.1, 0.0, sqrt(0.5) + gap / 2)])

    def test_parallel_edges(self, tilt, gap):
        turns = about((1, 0, 0), 45), about((1, 0, 0), 45)
        found = meet("cube", "cube", (0.3, 0.0, sqrt(2.0) + gap), *turns, tilt=tilt)
        z = sqrt(0.5) + gap / 2
        ends = [(-0.2, 0.0, z), (0.5, 0.0, z)]
        if gap >= 1e-9:
            check(found, gap, (0, 0, 1), ends, uncertain=1e-15 / gap)
        elif gap >= 0.0:
            # So near, any direction between those of the faces is as good to rounding.
            assert found[0] == pytest.approx(gap, abs=1e-12)
        else:
            # Out along the normal of a face is shorter than straight back.
            assert found[0] == pytest.approx(gap * sqrt(0.5), abs=1e-14)

    def test_corner_on_corner(self, tilt, gap):
        top = sqrt(0.75)
        up, down = about((1, -1, 0), np.degrees(np.arctan(sqrt(2.0)))), about((1, -1, 0), 180 + 54.735610317245346)
        distance, normal, points = meet("cube", "cube", (0, 0, 2 * top + gap), up, down, tilt=tilt)
        if gap >= 0.0:
            assert distance == pytest.approx(gap, abs=1e-13)
            np.testing.assert_allclose(points[0], (0, 0, top + gap / 2), atol=2e-9)
        else:
            # Out along the normal of a face or of crossed edges, which lies as steep as the corner is sharp.
            assert gap <= distance <= gap / 4
            assert np.linalg.norm(normal) == pytest.approx(1.0)

    def test_edges_end_to_end(self, tilt, gap):
        rod = shapes.box((1.0, 0.001, 0.001))
        if gap < -1e-4:
            return
        ends = [(0.5 + gap / 2, y, z) for y in (-0.0005, 0.0005) for z in (-0.0005, 0.0005)]
        check(meet(rod, rod, (1 + gap, 0, 0), tilt=tilt), gap, (1, 0, 0), ends)

    def test_plates_edge_to_edge(self, tilt, gap):
        plate = shapes.box((1.0, 1.0, 0.001))
        if gap < -1e-4:
            return
        side = [(0.5 + gap / 2, y, z) for y in (-0.5, 0.5) for z in (-0.0005, 0.0005)]
        check(meet(plate, plate, (1 + gap, 0, 0), tilt=tilt), gap, (1, 0, 0), side)


@pytest.mark.parametrize("tilt", TILTS)
class TestWhatHasAFanOfNormals:
    """Where edges or corners touch exactly, many directions part them: the one in the middle is as they are."""

    def expect(self, found, normal):
        assert found[0] == pytest.approx(0.0, abs=1e-14)
        np.testing.assert_allclose(found[1], np.asarray(normal) / np.linalg.norm(normal), atol=1e-14)

    def test_an_edge_along_an_edge(self, tilt):
        self.expect(meet("cube", "cube", (1.0, 0.2, 1.0), tilt=tilt), (1, 0, 1))

    def test_one_cube_upright_on_the_edge_of_another(self, tilt):
        on_edge = about((0, 1, 0), 45)
        self.expect(meet("cube", "cube", (0, 0, sqrt(2.0)), turn_a=on_edge, turn_b=on_edge, tilt=tilt), (0, 0, 1))

    def test_a_corner_on_a_corner(self, tilt):
        self.expect(meet("cube", "cube", (1.0, 1.0, 1.0), tilt=tilt), (1, 1, 1))

    def test_a_tip_on_a_tip(self, tilt):
        self.expect(meet("pyramid", "pyramid", (0, 0, 1.5), turn_b=about((0, 1, 0), 180), tilt=tilt), (0, 0, 1))

    def test_a_tip_on_an_edge(self, tilt):
        corner = np.array([0.5, 0.1, 0.5])
        tip = corner + 0.75 * np.array([0.6, 0.0, 0.8])
        turn = about((0, 1, 0), 180 + np.degrees(np.arctan2(0.6, 0.8)))
        self.expect(meet("cube", "pyramid", tip, turn_b=turn, tilt=tilt), (1, 0, 1))


def test_a_short_edge_that_is_tilted_touches_with_its_end_alone():
    # The end of a rod, 0.001 wide and tilted by 1e-4: its corners differ in height by a ten-millionth of its length.
    turn = oracles.product(about((0, 1, 0), 90 + np.degrees(1e-4)), about((1, 0, 0), 20))
    _, _, points = meet("cube", shapes.box((1.0, 0.001, 0.001)), (0, 0, 1.001), turn_b=turn)
    assert len(points) == 1


def test_identical_shapes_in_the_same_place():
    random = np.random.default_rng(3)
    for name, shape in oracles.zoo().items():
        for _ in range(20):
            turn = unit_quaternion(random)
            found = ps.separation(shape, ((1.0, 2.0, 3.0), turn), shape, ((1.0, 2.0, 3.0), turn))
            # The depth is the least width over all directions: for a body in its own place, between two supports.
            axes = direction(random), found.normal
            vertices = oracles.corners(shape, 1.0, oracles.product(turn, shape.orientation))
            widths = [np.ptp(vertices @ axis) + 2.0 * shape.rounding for axis in axes]
            assert -found.distance == pytest.approx(widths[1], abs=1e-13 * shape.radius), name
            assert -found.distance <= widths[0] + 1e-13
            if shape.kind == POLYHEDRON and len(vertices) < 30:
                expected = oracles.difference_distance(vertices, vertices)
                expected -= 2.0 * shape.rounding
                assert found.distance == pytest.approx(expected, abs=1e-13 * shape.radius), name


def test_a_small_one_inside_a_large_one_leaves_by_the_nearest_face():
    for tilt in TILTS:
        found = meet("cube", "cube", (0.1, 0.2, -0.3), size_b=0.1, tilt=tilt)
        assert found[0] == pytest.approx(-(0.2 + 0.05), abs=1e-14)
        np.testing.assert_allclose(found[1], (0, 0, -1), atol=1e-14)


@pytest.mark.parametrize("tilt", TILTS)
@pytest.mark.parametrize("gap", (*GAPS, 1.0, -0.2))
def test_a_sphere_at_a_face_an_edge_and_a_corner_of_a_cube(gap, tilt):
    for towards, start in (((0, 0, 1), (0.1, 0.2, 0.5)), ((0, 1, 1), (0.1, 0.5, 0.5)), ((1, 1, 1), (0.5, 0.5, 0.5))):
        normal = np.array(towards) / np.linalg.norm(towards)
        point = np.array(start) + 0.5 * gap * normal
        check(meet("cube", "sphere", start + (0.5 + gap) * normal, tilt=tilt), gap, normal, [point])
        back = meet("sphere", "cube", -(start + (0.5 + gap) * normal), tilt=tilt)
        check(back, gap, -normal, [point - (start + (0.5 + gap) * normal)])


@pytest.mark.parametrize("tilt", TILTS)
def test_a_sphere_with_its_centre_in_or_on_a_cube(tilt):
    small = 0.1
    for centre, distance, normals in (
        ((0.1, 0.2, 0.4), -0.1 - 0.05, [(0, 0, 1)]),
        ((0.1, 0.2, 0.5), -0.05, [(0, 0, 1)]),
        ((0.1, 0.5, 0.5), -0.05, [(0, 1, 0), (0, 0, 1)]),
        ((0.5, 0.5, 0.5), -0.05, np.eye(3)),
        ((0.0, 0.0, 0.0), -0.5 - 0.05, [*np.eye(3), *-np.eye(3)]),
    ):
        found, normal, points = meet("cube", "sphere", centre, size_b=small, tilt=tilt)
        assert found == pytest.approx(distance, abs=1e-14)
        assert min(np.abs(normal - n).max() for n in np.asarray(normals)) < 1e-13
        np.testing.assert_allclose(points[0], np.array(centre) + normal * (-found / 2 - 0.05), atol=1e-13)


def test_spheres():
    found = ps.separation("sphere", ((0, 0, 0),), "sphere", ((3.0, 4.0, 0.0), UPRIGHT, 2.0))
    assert found.distance == 5.0 - 1.5
    np.testing.assert_allclose(found.normal, (0.6, 0.8, 0.0), rtol=1e-15)
    np.testing.assert_allclose(found.points, [np.array((0.6, 0.8, 0.0)) * (0.5 + 1.75)], rtol=1e-15)
    same = ps.separation("sphere", ((0, 0, 0),), "sphere", ((0, 0, 0), UPRIGHT, 2.0))
    assert same.distance == -1.5 and same.normal.tolist() == [1.0, 0.0, 0.0]


def test_a_patch_of_many_corners_keeps_as_many_as_a_contact_holds():
    angle = np.arange(48) * 2.0 * pi / 48
    prism = shapes.hull("prism", [(np.cos(t), np.sin(t), z) for t in angle for z in (-0.5, 0.5)])
    for tilt in TILTS:
        distance, normal, points = meet(prism, prism, (0.0, 0.0, 1.0), tilt=tilt)
        assert distance == pytest.approx(0.0, abs=1e-14)
        np.testing.assert_allclose(normal, (0, 0, 1), atol=1e-12)
        assert len(points) == MAX_MANIFOLD
        np.testing.assert_allclose(np.hypot(*points.T[:2]), 1.0, atol=1e-9)
        np.testing.assert_allclose(points[:, 2], 0.5, atol=1e-12)
        np.testing.assert_allclose(points.mean(axis=0), (0, 0, 0.5), atol=1e-9)
