"""Shapes against half-spaces, turned anyhow, by brute force over the vertices of their cores."""

import numpy as np
import pytest

from particlesim.core.constants import MAX_MANIFOLD
from particlesim.core.math3d import quat_to_matrix
from particlesim.geometry import shapes
from particlesim.geometry.narrow_phase.gjk import NO_SIMPLEX
from particlesim.geometry.narrow_phase.pair import pair_contact, pair_manifold, pair_overlaps, pair_separation
from particlesim.geometry.shape_table import stack_shapes
from tests import oracles
from tests.kernels import callable_from_python
from tests.positions import UPRIGHT, about

call_pair_separation = callable_from_python(pair_separation)
call_pair_overlaps = callable_from_python(pair_overlaps)
call_pair_manifold = callable_from_python(pair_manifold)
call_quat_to_matrix = callable_from_python(quat_to_matrix)

AXES = [side * axis for axis in np.eye(3) for side in (1.0, -1.0)]
SHAPES = tuple(oracles.zoo().values())
WALLS = tuple(shapes.half_space(axis) for axis in AXES)
TABLE = stack_shapes((*SHAPES, *WALLS))
POINTS, GAPS = np.empty((MAX_MANIFOLD, 3)), np.empty(MAX_MANIFOLD)


def half_space(k, turn=UPRIGHT):
    """Half-space number k of WALLS as kernels take it."""
    return len(SHAPES) + k, 1.0, tuple(turn)


def test_normals_of_walls_are_exact():
    for axis, wall in zip(AXES, WALLS, strict=True):
        np.testing.assert_array_equal(wall.face_normals, [axis])


def random_cases(count):
    """(body, half-space, offset, lowest point of the body's surface, outward normal)."""
    random = np.random.default_rng(1)
    for _ in range(count):
        s, k = int(random.integers(len(SHAPES))), int(random.integers(len(WALLS)))
        size, turn, tilt = random.uniform(0.2, 2.0), oracles.unit_quaternion(random), oracles.unit_quaternion(random)
        normal = oracles.turned(tilt, AXES[k])
        offset = random.normal(size=3) * SHAPES[s].radius * size
        lowest = (oracles.corners(SHAPES[s], size, turn) @ normal).min() - SHAPES[s].rounding * size
        yield (s, size, tuple(turn)), half_space(k, tilt), tuple(offset), lowest, normal


def test_separation_and_points_in_any_direction():
    for body, wall, offset, lowest, normal in random_cases(1000):
        scale = SHAPES[body[0]].radius * body[1]
        separation, into, count = pair_contact(TABLE, body, wall, offset, POINTS)
        assert separation == pytest.approx(lowest - normal @ offset, abs=1e-14 * scale)
        np.testing.assert_allclose(into, -normal, atol=1e-15)
        np.testing.assert_allclose(POINTS[:count] @ normal, lowest, atol=1e-6 * scale)
        alone, _, _ = call_pair_separation(TABLE, body, wall, offset, NO_SIMPLEX, POINTS)
        assert alone == separation
        assert call_pair_overlaps(TABLE, body, wall, offset, POINTS) == (separation <= 0.0)


def test_points_within_reach_are_all_or_the_nearest_and_some():
    for body, wall, offset, lowest, normal in random_cases(500):
        reach = lowest - normal @ offset + 0.3 * SHAPES[body[0]].radius * body[1]
        separation, _, _, count = call_pair_manifold(TABLE, body, wall, offset, (reach, 0.1, 0.0), POINTS, GAPS)
        surface = oracles.corners(SHAPES[body[0]], body[1], body[2]) - SHAPES[body[0]].rounding * body[1] * normal
        there = np.sort((surface - offset) @ normal)
        there = there[there <= reach]
        gaps = np.sort(GAPS[:count])
        assert count == min(len(there), MAX_MANIFOLD)
        if len(there) <= MAX_MANIFOLD:
            np.testing.assert_allclose(gaps, there, atol=1e-13)
        which = np.abs(there[:, None] - gaps).argmin(axis=0)
        assert len(np.unique(which)) == count
        np.testing.assert_allclose(gaps, there[which], atol=1e-13)
        np.testing.assert_allclose((POINTS[:count] - offset) @ normal, GAPS[:count], atol=1e-13)
        assert separation == pytest.approx(there[0], abs=1e-13)
        assert gaps[0] == pytest.approx(there[0], abs=1e-13)


@pytest.mark.parametrize("lean", [0.0, 1e-6, 1e-4])
def test_a_round_base_stands_on_points_all_round(lean):
    """Of a hundred corners, whichever is lowest by a hair, those that are kept hold it on every side."""
    angles = 2.0 * np.pi * np.arange(100) / 100
    rim = np.column_stack((0.5 * np.cos(angles), 0.5 * np.sin(angles)))
    drum = shapes.hull("drum", np.concatenate([np.column_stack((rim, np.full(100, z))) for z in (-0.5, 0.5)]))
    table = stack_shapes([drum, shapes.half_space((0.0, 0.0, 1.0))])
    body, floor = (0, 1.0, tuple(about((1, 2, 0), np.degrees(lean)))), (1, 1.0, UPRIGHT)
    _, _, _, count = call_pair_manifold(table, body, floor, (0.0, 0.0, -0.5), (0.01, 0.1, 0.0), POINTS, GAPS)
    assert count == MAX_MANIFOLD
    seen = np.sort(np.arctan2(POINTS[:count, 1], POINTS[:count, 0]))
    assert np.diff(np.append(seen, seen[0] + 2.0 * np.pi)).max() < 1.2
    assert np.hypot(POINTS[:count, 0], POINTS[:count, 1]).min() == pytest.approx(0.5, abs=1e-3)


@pytest.mark.parametrize(
    ("shape", "turn", "patch"),
    [
        (shapes.cube(), UPRIGHT, [(x, y, -0.5) for x in (-0.5, 0.5) for y in (-0.5, 0.5)]),
        (shapes.cube(), about((1, 0, 0), 45), [(x, 0.0, -np.sqrt(0.5)) for x in (-0.5, 0.5)]),
        (shapes.cube(0.2), UPRIGHT, [(x, y, -0.7) for x in (-0.5, 0.5) for y in (-0.5, 0.5)]),
        (shapes.sphere(), UPRIGHT, [(0.0, 0.0, -0.5)]),
        (shapes.capsule(1.0), UPRIGHT, [(0.0, 0.0, -1.0)]),
        (shapes.capsule(1.0), about((0, 1, 0), 90), [(x, 0.0, -0.5) for x in (-0.5, 0.5)]),
    ],
    ids=["face", "edge", "rounded face", "sphere", "standing capsule", "lying capsule"],
)
def test_patches_on_a_floor(shape, turn, patch):
    table = stack_shapes([shape, shapes.half_space((0.0, 0.0, 1.0))])
    separation, normal, count = pair_contact(table, (0, 1.0, tuple(turn)), (1, 1.0, UPRIGHT), (7.0, 8.0, -0.9), POINTS)
    assert separation == pytest.approx(0.9 + patch[0][2], abs=1e-14)
    assert tuple(normal) == (0.0, 0.0, -1.0)
    np.testing.assert_allclose(
        sorted(np.round(POINTS[:count], 9).tolist()), sorted(np.round(patch, 9).tolist()), atol=1e-9
    )


def test_a_wall_that_is_upright_keeps_every_digit():
    """The normal of a wall is an axis to the last bit, and the separation is that of one coordinate."""
    random = np.random.default_rng(3)
    for _ in range(200):
        turn, x = tuple(oracles.unit_quaternion(random)), random.uniform(1.0, 2.0)
        separation, normal, _ = pair_contact(TABLE, (1, 0.7, turn), half_space(1), (x, 9.0, -9.0), POINTS)
        reach = max(np.array(call_quat_to_matrix(turn)[:3]) @ vertex for vertex in SHAPES[1].vertices)
        assert separation == pytest.approx(x - 0.7 * reach, rel=1e-15) and normal == (1.0, 0.0, 0.0)
