"""Edges that are all but parallel: where their bodies touch, to the last digits that the question has."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from particlesim.core.constants import CAPSULE, MAX_MANIFOLD
from particlesim.geometry import shapes
from particlesim.geometry.narrow_phase.pair import pair_contact, pair_manifold
from particlesim.geometry.shape_table import stack_shapes
from tests import oracles
from tests.kernels import callable_from_python
from tests.positions import about

call_pair_manifold = callable_from_python(pair_manifold)

SHAPES = (
    shapes.cube(),
    shapes.box((1.0, 2.0, 3.0)),
    shapes.tetrahedron(),
    shapes.pyramid(),
    oracles.zoo()["hull30"],
    shapes.capsule(1.0),
    shapes.cube(0.2),
)
TABLE = stack_shapes(SHAPES)
POINTS, GAPS = np.empty((MAX_MANIFOLD, 3)), np.empty(MAX_MANIFOLD)


def with_an_edge_up(random, shape):
    """A rotation (3, 3) that brings an edge of a shape along x, its faces below, and the middle of that edge."""
    start, end, left, right = shape.edges[random.integers(len(shape.edges))]
    along = shape.vertices[end] - shape.vertices[start]
    along /= np.linalg.norm(along)
    share = random.uniform(0.2, 0.8)
    up = random.normal(size=3)
    if shape.kind != CAPSULE:
        up = share * shape.face_normals[left] + (1.0 - share) * shape.face_normals[right]
    up -= (up @ along) * along
    up /= np.linalg.norm(up)
    turn = np.array([along, np.cross(up, along), up])
    return turn, 0.5 * turn @ (shape.vertices[start] + shape.vertices[end])


def edge_over_edge(random, angle, tilt):
    """Bodies a and b, an edge of b over one of a, at these angles to it beside and up [rad], and b's offset."""
    s, t = (int(k) for k in random.integers(len(SHAPES), size=2))
    size, gap = random.uniform(0.3, 1.5), 10.0 ** random.integers(-9, 0)
    (turn_a, edge_a), (turn_b, edge_b) = (with_an_edge_up(random, SHAPES[k]) for k in (s, t))
    over = Rotation.from_euler("yz", (tilt, angle)).as_matrix() @ np.diag((1.0, -1.0, -1.0))
    apart = (
        random.uniform(-0.8, 0.8),
        random.choice([0.0, 1e-6]),
        gap + SHAPES[s].rounding + size * SHAPES[t].rounding,
    )
    world = Rotation.random(rng=random)
    a, b = (
        (k, scale, tuple(np.roll((world * Rotation.from_matrix(turn)).as_quat(), 1)))
        for k, scale, turn in ((s, 1.0, turn_a), (t, size, over @ turn_b))
    )
    return a, b, world.apply(edge_a + apart - size * over @ edge_b)


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-9, 1e-7, 1e-6, 3e-6, 3e-5, 1e-3])
def test_points_lie_half_way_between_edges_that_are_all_but_parallel(angle):
    random = np.random.default_rng(1)
    count = 0
    for _ in range(150):
        a, b, offset = edge_over_edge(random, angle, random.choice([0.0, 1e-7, 1e-6, 1e-5, 1e-4]))
        distance, _, found = pair_contact(TABLE, a, b, tuple(offset), POINTS)
        if distance <= 0.0:
            continue
        count += 1
        scale = sum(SHAPES[s].radius * size for s, size, _ in (a, b))
        for (s, size, turn), centre in ((a, np.zeros(3)), (b, offset)):
            for point in POINTS[:found]:
                height = oracles.surface_distance(point, SHAPES[s], size, np.array(turn), centre)
                assert height == pytest.approx(0.5 * distance, abs=1e-8 * scale), (a, b, offset)
    assert count > 75


def test_capsules_that_all_but_line_up_touch_along_both_ends():
    """Side by side, one leaning away: the gaps at the two ends of what they share are those of the surfaces."""
    lean, lift = 0.005, 1e-3
    turn = about((0, 1, 0), np.degrees(lean))
    bodies = (5, 1.0, (1.0, 0.0, 0.0, 0.0)), (5, 1.0, tuple(turn))
    distance = 1.0 + lift + 0.5 * np.sin(lean)
    found, _, _, count = call_pair_manifold(TABLE, *bodies, (distance, 0.0, 0.0), (0.1, 0.02, 0.05), POINTS, GAPS)
    assert found == pytest.approx(lift, rel=1e-3)
    near, far = np.sort(GAPS[:count])
    assert near == pytest.approx(lift, abs=1e-5) and far == pytest.approx(lift + np.sin(lean), abs=5e-5)
    assert np.ptp(POINTS[:count, 2]) == pytest.approx(1.0, abs=1e-3)
