"""Capsules and rounded polyhedra in special positions whose answers are known."""

from math import sqrt

import numpy as np
import pytest

import particlesim as ps
from particlesim.core.constants import MAX_MANIFOLD
from particlesim.geometry import shapes
from particlesim.geometry.narrow_phase.pair import pair_manifold
from particlesim.geometry.shape_table import stack_shapes
from tests import oracles
from tests.kernels import callable_from_python
from tests.positions import GAPS, TILTS, about, check, meet

call_pair_manifold = callable_from_python(pair_manifold)

CUBE = shapes.CATALOGUE["cube"]
CAPSULE = shapes.capsule(1.0)
LONG = shapes.capsule(3.0)
ALONG_X, ALONG_Y = about((0, 1, 0), 90), about((1, 0, 0), 90)


@pytest.mark.parametrize("tilt", TILTS)
@pytest.mark.parametrize("gap", GAPS)
class TestCapsules:
    def test_lying_on_a_face(self, tilt, gap):
        points = [(-0.5, 0.1, 0.5 + gap / 2), (0.5, 0.1, 0.5 + gap / 2)]
        check(meet("cube", CAPSULE, (0, 0.1, 1 + gap), turn_b=ALONG_X, tilt=tilt), gap, (0, 0, 1), points)

    def test_lying_over_the_borders_of_a_face(self, tilt, gap):
        points = [(-0.5, 0.1, 0.5 + gap / 2), (0.5, 0.1, 0.5 + gap / 2)]
        check(meet("cube", LONG, (0.2, 0.1, 1 + gap), turn_b=ALONG_X, tilt=tilt), gap, (0, 0, 1), points)

    def test_standing_on_a_face(self, tilt, gap):
        check(meet("cube", CAPSULE, (0.1, 0.2, 1.5 + gap), tilt=tilt), gap, (0, 0, 1), [(0.1, 0.2, 0.5 + gap / 2)])

    def test_lying_across_an_edge(self, tilt, gap):
        found = meet("cube", LONG, (0.1, 0.2, sqrt(0.5) + 0.5 + gap), about((1, 0, 0), 45), ALONG_Y, tilt=tilt)
        check(found, gap, (0, 0, 1), [(0.1, 0.0, sqrt(0.5) + gap / 2)])

    def test_lying_along_an_edge(self, tilt, gap):
        found = meet("cube", CAPSULE, (0.2, 0.0, sqrt(0.5) + 0.5 + gap), about((1, 0, 0), 45), ALONG_X, tilt=tilt)
        check(found, gap, (0, 0, 1), [(x, 0.0, sqrt(0.5) + gap / 2) for x in (-0.3, 0.5)])

    def test_side_by_side(self, tilt, gap):
        points = [(0.5 + gap / 2, 0.0, z) for z in (-0.2, 0.5)]
        check(meet(CAPSULE, CAPSULE, (1 + gap, 0, 0.3), tilt=tilt), gap, (1, 0, 0), points)

    def test_crossed(self, tilt, gap):
        found = meet(CAPSULE, LONG, (0.2, 0.3, 1 + gap), ALONG_X, ALONG_Y, tilt=tilt)
        check(found, gap, (0, 0, 1), [(0.2, 0.0, 0.5 + gap / 2)])

    def test_end_to_end(self, tilt, gap):
        check(meet(CAPSULE, LONG, (0, 0, 3 + gap), tilt=tilt), gap, (0, 0, 1), [(0.0, 0.0, 1.0 + gap / 2)])

    def test_a_sphere_beside_and_above(self, tilt, gap):
        for centre, normal, point in (
            ((0.75 + gap, 0.0, 0.2), (1, 0, 0), (0.5 + gap / 2, 0.0, 0.2)),
            ((0.0, 0.0, 1.25 + gap), (0, 0, 1), (0.0, 0.0, 1.0 + gap / 2)),
        ):
            check(meet(CAPSULE, "sphere", centre, size_b=0.5, tilt=tilt), gap, normal, [point])


@pytest.mark.parametrize("tilt", TILTS)
class TestOverlappingCores:
    def test_axes_that_cross_leave_across_both(self, tilt):
        found = meet(CAPSULE, LONG, (0.2, 0.3, 0.0), ALONG_X, ALONG_Y, tilt=tilt)
        assert found[0] == pytest.approx(-1.0, abs=1e-14)
        np.testing.assert_allclose(np.abs(found[1]), (0, 0, 1), atol=1e-14)
        np.testing.assert_allclose(found[2], [(0.2, 0.0, 0.0)], atol=1e-14)

    def test_axes_on_one_line_leave_across_it(self, tilt):
        found = meet(CAPSULE, LONG, (0.0, 0.0, 0.4), tilt=tilt)
        assert found[0] == pytest.approx(-1.0, abs=1e-14)
        assert found[1][2] == pytest.approx(0.0, abs=1e-14) and np.linalg.norm(found[1]) == pytest.approx(1.0)
        np.testing.assert_allclose(sorted(found[2][:, 2]), (-0.5, 0.5), atol=1e-12)

    def test_a_sphere_centred_on_an_axis(self, tilt):
        found = meet(CAPSULE, "sphere", (0.0, 0.0, 0.4), size_b=0.5, tilt=tilt)
        assert found[0] == pytest.approx(-0.75, abs=1e-14)
        assert found[1][2] == pytest.approx(0.0, abs=1e-14) and np.linalg.norm(found[1]) == pytest.approx(1.0)

    def test_a_skewer_leaves_by_the_nearest_face(self, tilt):
        found = meet("cube", shapes.capsule(5.0), (0.3, 0.1, 0.0), tilt=tilt)
        assert found[0] == pytest.approx(-0.2 - 0.5, abs=1e-14)
        np.testing.assert_allclose(found[1], (1, 0, 0), atol=1e-14)
        ends = [(0.5 - 0.35, 0.1, z) for z in (-0.5, 0.5)]
        np.testing.assert_allclose(sorted(found[2].tolist(), key=lambda p: p[2]), ends, atol=1e-9)

    def test_a_skewer_leaves_across_itself_and_an_edge(self, tilt):
        pillar = shapes.box((1.0, 1.0, 10.0))
        turn = oracles.product(about((0, 0, 1), 45), ALONG_X)
        found = meet(pillar, shapes.capsule(9.0), (0.1, -0.1, 0.3), turn_b=turn, tilt=tilt)
        assert found[0] == pytest.approx(-(sqrt(0.5) - sqrt(0.02)) - 0.5, abs=1e-14)
        np.testing.assert_allclose(found[1], np.array((1, -1, 0)) * sqrt(0.5), atol=1e-14)

    def test_a_rounded_cube_in_a_rounded_cube(self, tilt):
        found = meet(CUBE(rounding=0.1), CUBE(rounding=0.3), (0.1, 0.2, -0.6), size_b=0.5, tilt=tilt)
        # Cores 0.5 and 0.25 from their centres, 0.6 apart; roundings 0.1 and 0.15.
        assert found[0] == pytest.approx(-0.15 - 0.25, abs=1e-14)
        np.testing.assert_allclose(found[1], (0, 0, -1), atol=1e-14)


@pytest.mark.parametrize("tilt", TILTS)
@pytest.mark.parametrize("gap", GAPS)
class TestRoundedPolyhedra:
    def test_face_on_face(self, tilt, gap):
        z = 0.6 + gap / 2
        found = meet(CUBE(rounding=0.1), CUBE(rounding=0.2), (0.3, 0.6, 1.3 + gap), tilt=tilt)
        check(found, gap, (0, 0, 1), [(x, y, z) for x in (-0.2, 0.5) for y in (0.1, 0.5)])

    def test_corner_on_face(self, tilt, gap):
        turn = about((1, -1, 0), np.degrees(np.arctan(sqrt(2.0))))
        found = meet("cube", CUBE(rounding=0.2), (0.1, 0.2, 0.7 + sqrt(0.75) + gap), turn_b=turn, tilt=tilt)
        check(found, gap, (0, 0, 1), [(0.1, 0.2, 0.5 + gap / 2)])

    def test_a_sphere_at_a_face_an_edge_and_a_corner(self, tilt, gap):
        for towards, start in (
            ((0, 0, 1), (0.1, 0.2, 0.5)),
            ((0, 1, 1), (0.1, 0.5, 0.5)),
            ((1, 1, 1), (0.5, 0.5, 0.5)),
        ):
            normal = np.array(towards) / np.linalg.norm(towards)
            point = np.array(start) + (0.2 + 0.5 * gap) * normal
            found = meet(CUBE(rounding=0.2), "sphere", start + (0.7 + gap) * normal, tilt=tilt)
            check(found, gap, normal, [point])


def test_the_answer_does_not_depend_on_the_run():
    """Axes that cross have two ways out, axes on one line a circle of them: always the same is taken."""
    for turn in (ALONG_X, (1.0, 0.0, 0.0, 0.0)):
        first, *others = (ps.separation(CAPSULE, ((0, 0, 0),), LONG, ((0, 0, 0), turn)) for _ in range(3))
        for other in others:
            assert other.distance == first.distance
            np.testing.assert_array_equal(other.normal, first.normal)


def test_a_sphere_is_a_polyhedron_that_shrank_to_a_point():
    """A cube of edge 1e-9 with rounding 0.5 answers as the sphere does."""
    random = np.random.default_rng(5)
    ball = shapes.hull("ball", 1e-9 * CUBE().vertices, rounding=0.5)
    for _ in range(200):
        turns = [oracles.unit_quaternion(random) for _ in range(2)]
        offset = 1.5 * random.random() * oracles.direction(random)
        for shape in (CUBE(), CAPSULE, "sphere", ball):
            expected, found = (
                ps.separation(shape, ((0, 0, 0), turns[0]), other, (offset, turns[1])) for other in ("sphere", ball)
            )
            assert found.distance == pytest.approx(expected.distance, abs=1e-8)


def manifold(shape_a, shape_b, offset, turn_b, limits):
    """Separation, points and gaps of two shapes of size 1 within (reach, tilt, margin)."""
    points, gaps = np.empty((MAX_MANIFOLD, 3)), np.empty(MAX_MANIFOLD)
    bodies = (0, 1.0, (1.0, 0.0, 0.0, 0.0)), (1, 1.0, tuple(turn_b))
    found = call_pair_manifold(stack_shapes([shape_a, shape_b]), *bodies, tuple(offset), limits, points, gaps)
    return found[0], points[: found[3]], gaps[: found[3]]


@pytest.mark.parametrize("rounding", [0.0, 0.1, 0.4])
def test_the_ends_of_a_capsule_that_leans_over_a_face_have_their_own_gaps(rounding):
    lean, lift = 0.01, 1e-3
    turn = about((0, 1, 0), 90 + np.degrees(lean))
    height = 0.5 + rounding + 0.5 + lift + 0.5 * np.sin(lean)
    found, points, gaps = manifold(CUBE(rounding=rounding), CAPSULE, (0, 0, height), turn, (0.1, 0.02, 0.0))
    assert found == pytest.approx(lift, abs=1e-14)
    np.testing.assert_allclose(np.sort(gaps), (lift, lift + np.sin(lean)), atol=1e-14)
    assert sorted(np.round(points[:, 0], 3)) == [-0.5, 0.5]


@pytest.mark.parametrize("rounding", [0.0, 0.2])
def test_an_inclined_rounded_face_over_another_has_the_gaps_of_its_corners(rounding):
    """A rounded cube that leans over the flat top of another; its corners are balls of the rounding's radius."""
    lean, lift = 0.05, 1e-3
    turn = about((0, 1, 0), np.degrees(lean))
    lowest = (oracles.rotation(turn)[2] @ CUBE().vertices.T).min() - rounding
    limits = (0.2, 0.1, 0.05)
    found, _, gaps = manifold(CUBE(rounding=0.3), CUBE(rounding=rounding), (-0.2, 0, 0.8 + lift - lowest), turn, limits)
    assert found == pytest.approx(lift, abs=1e-14)
    np.testing.assert_allclose(np.sort(gaps)[:2], lift, atol=1e-13)
    # Clipped where the upper cube stands out over the lower by more than the margin.
    assert len(gaps) == 4 and (gaps > lift - 1e-13).all() and gaps.max() < lift + np.sin(lean) + 1e-13


def test_rounded_edges_that_cross_have_the_gaps_of_their_surfaces():
    """Along the edges within the margin of the crossing: edges at 0.1 rad, one tilted as is allowed."""
    upside = about((1, 0, 0), 45)
    shape, turn = CUBE(rounding=0.3), oracles.product(about((0, 0, 1), np.degrees(0.1)), upside)
    points, gaps = np.empty((MAX_MANIFOLD, 3)), np.empty(MAX_MANIFOLD)
    bodies = (0, 1.0, tuple(upside)), (0, 1.0, tuple(turn))
    limits = (0.1, 0.02, 0.01)
    found = call_pair_manifold(
        stack_shapes([shape]), *bodies, (0.0, 0.0, 2 * sqrt(0.5) + 0.6 + 1e-3), limits, points, gaps
    )
    assert found[0] == pytest.approx(1e-3, abs=1e-14) and found[3] == 2
    np.testing.assert_allclose(gaps[:2], 1e-3, atol=1e-13)


def test_features_on_features_answer_exactly():
    """Shapes on a lattice, turned by quarters and eighths: cores that touch along points, edges and faces."""
    random = np.random.default_rng(5)
    bodies = (
        shapes.sphere(), CAPSULE, shapes.capsule(2.0), CUBE(), CUBE(rounding=0.25), shapes.box((1.0, 2.0, 3.0), 0.5),
        shapes.pyramid(1.0, 0.1), shapes.tetrahedron(), shapes.tetrahedron(0.5),
    )  # fmt: skip
    turns = [about(axis, angle) for axis in ((1, 0, 0), (0, 1, 0), (1, 1, 0)) for angle in (0, 45, 90)]
    for _ in range(2000):
        a, b = (bodies[k] for k in random.integers(len(bodies), size=2))
        tilt = TILTS[random.integers(len(TILTS))]
        turn_a, turn_b = (oracles.product(tilt, turns[k]) for k in random.integers(len(turns), size=2))
        offset = oracles.turned(tilt, random.integers(-4, 5, size=3) / 4.0)
        scale = a.radius + b.radius
        found = ps.separation(a, ((0, 0, 0), turn_a), b, (offset, turn_b))
        cores = oracles.corners(a, 1.0, turn_a), oracles.corners(b, 1.0, turn_b, offset)
        along = (cores[1] @ found.normal).min() - (cores[0] @ found.normal).max() - a.rounding - b.rounding
        assert along == pytest.approx(found.distance, abs=1e-12 * scale)
        parted = ps.separation(a, ((0, 0, 0), turn_a), b, (offset - found.distance * found.normal, turn_b))
        assert parted.distance == pytest.approx(0.0, abs=1e-12 * scale)
        assert np.isfinite(found.points).all() and np.linalg.norm(found.normal) == pytest.approx(1.0, abs=1e-13)
