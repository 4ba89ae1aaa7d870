"""Walls, and which of a crowd touch: against brute force over vertices and over all pairs."""

import itertools

import numba
import numpy as np
import pytest

from particlesim.core.constants import MAX_MANIFOLD, OPEN, PERIODIC, WALL
from particlesim.core.parallel import ALONE
from particlesim.geometry.narrow_phase.pair import pair_contact
from particlesim.geometry.shape_table import stack_shapes
from particlesim.model.bodies import make_particles
from particlesim.model.domain import make_domain
from particlesim.model.materials import Material
from particlesim.model.overlap import deepest_overlap, touching_pairs, touching_surroundings
from particlesim.setup.build import assemble
from tests import oracles
from tests.oracles import unit_quaternion

ZOO = oracles.zoo()
SHAPES = tuple(ZOO.values())
TABLE = stack_shapes(SHAPES)
UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])


def world(edge, boundary=(WALL, WALL, WALL)):
    return make_domain(np.full(3, edge), np.array(boundary), np.zeros(3))


def bodies(space, shape, size, position, orientation):
    """The system of resting particles in a domain."""
    n = len(shape)
    particles = make_particles(
        SHAPES, np.asarray(shape), np.zeros(n, dtype=np.int64), np.asarray(size, dtype=float), np.ones(n)
    )
    particles["position"], particles["orientation"] = position, orientation
    return assemble(list(SHAPES), particles, space, [Material(), Material()]).system


def crowd(space, random, count, edge):
    shape = random.integers(len(SHAPES), size=count)
    size = random.uniform(0.2, 1.0, count) / np.array([SHAPES[s].radius for s in shape])
    positions = random.uniform(-0.5, 0.5, (count, 3)) * edge
    return bodies(space, shape, size, positions, [unit_quaternion(random) for _ in range(count)])


def contact(system, i, j):
    """Separation, normal and points of bodies i and j, by no other image than the one that they are at."""
    a, b = system.body[i], system.body[j]
    points = np.empty((MAX_MANIFOLD, 3))
    offset = tuple((b["position"] - a["position"]).tolist())
    placed = ((int(body["shape_row"]), float(body["scale"]), tuple(body["orientation"].tolist())) for body in (a, b))
    separation, normal, count = pair_contact(system.shapes, *placed, offset, points)
    return separation, normal, points[:count]


def all_pairs(count):
    return np.array(list(itertools.combinations(range(count), 2)), dtype=np.int64)


def reach_of(body, axis, side):
    """How far a body reaches along an axis, from its vertices."""
    shape = SHAPES[body["shape_row"]]
    vertices = oracles.corners(shape, body["scale"], body["orientation"])
    return (side * vertices[:, axis]).max() + shape.rounding * body["scale"]


def walls_by_force(system):
    """Separation from each of six walls, (n, 6)."""
    half = system.domain[0]["upper"]
    gaps = np.empty((system.particles, 6))
    for i in range(len(gaps)):
        for axis in range(3):
            for side in (-1, 1):
                room = half[axis] - side * system.body["position"][i, axis]
                gaps[i, 2 * axis + (side > 0)] = room - reach_of(system.body[i], axis, side)
    return gaps


def gap_by_force(system, i, j):
    """Separation of two particles, every image of j tried."""
    period, there, best = system.domain[0]["period"], system.body["position"][j].copy(), np.inf
    for image in itertools.product(*((-1, 0, 1) if p > 0 else (0,) for p in period)):
        system.body["position"][j] = there + np.array(image) * period
        best = min(best, contact(system, i, j)[0])
    system.body["position"][j] = there
    return best


def test_walls_against_all_vertices():
    system = crowd(world(3.0), np.random.default_rng(1), 400, 3.0)
    gaps = walls_by_force(system)
    for i in range(len(gaps)):
        for wall in range(6):
            separation, normal, points = contact(system, i, system.bounded + wall)
            axis, side = wall // 2, 2 * (wall % 2) - 1
            assert separation == pytest.approx(gaps[i, wall], abs=1e-14)
            assert np.array_equal(normal, side * np.eye(3)[axis])
            np.testing.assert_allclose(side * points[:, axis], reach_of(system.body[i], axis, side), atol=1e-6)
    expected = [(i, system.bounded + wall) for i, wall in np.argwhere(gaps <= 0.0).tolist()]
    assert [tuple(row) for row in touching_surroundings(system).tolist()] == expected
    assert len(expected) > 100


@pytest.mark.parametrize("boundary", [(WALL, PERIODIC, OPEN), (OPEN, OPEN, WALL)])
def test_only_walls_are_touched(boundary):
    system = crowd(world(3.0, boundary), np.random.default_rng(2), 200, 3.0)
    solid = np.repeat(np.array(boundary) == WALL, 2)
    gaps = walls_by_force(system)[:, solid]
    assert system.body["wall"][system.bounded :].tolist() == np.flatnonzero(solid).tolist()
    expected = [(i, system.bounded + k) for i, k in np.argwhere(gaps <= 0.0).tolist()]
    assert [tuple(row) for row in touching_surroundings(system).tolist()] == expected


@pytest.mark.parametrize(
    ("turn", "patch"),
    [
        (UPRIGHT, [(x, y, 0.5) for x in (-0.5, 0.5) for y in (-0.5, 0.5)]),
        (np.array([np.cos(np.pi / 8), np.sin(np.pi / 8), 0, 0]), [(x, 0.0, np.sqrt(0.5)) for x in (-0.5, 0.5)]),
        (
            np.array([np.cos(0.4776583090622546), *(np.sin(0.4776583090622546) * np.array([1, -1, 0]) / np.sqrt(2))]),
            [(0.0, 0.0, np.sqrt(0.75))],
        ),
    ],
    ids=["face", "edge", "corner"],
)
def test_the_patch_of_a_cube_at_a_wall(turn, patch):
    system = bodies(world(2.0), [1], [1.0], [[0.1, 0.2, 0.3]], [turn])
    separation, _, points = contact(system, 0, 6)
    assert separation == pytest.approx(0.7 - patch[0][2], abs=1e-14)
    np.testing.assert_allclose(sorted(np.round(points, 9).tolist()), sorted(np.round(patch, 9).tolist()), atol=1e-9)


@pytest.mark.parametrize("boundary", [(WALL, WALL, WALL), (PERIODIC, OPEN, PERIODIC)])
def test_touching_pairs_of_a_crowd(boundary):
    system = crowd(world(4.2, boundary), np.random.default_rng(3), 60, 4.2)
    pairs = all_pairs(60)
    gaps = np.array([gap_by_force(system, i, j) for i, j in pairs])
    found = touching_pairs(system, pairs)
    np.testing.assert_array_equal(found, pairs[gaps <= 0.0])
    assert 50 < len(found) < len(pairs)
    walls = walls_by_force(system)[:, np.repeat(np.array(boundary) == WALL, 2)]
    deepest = max(-gaps.min(), -walls.min(initial=0.0))
    assert deepest_overlap(system, pairs) == pytest.approx(deepest, abs=1e-13)


def test_nothing_overlaps_nothing():
    system = bodies(world(10.0), [0, 1], [1.0, 1.0], [[-2.0, 0, 0], [2.0, 0, 0]], [UPRIGHT, UPRIGHT])
    assert deepest_overlap(system, all_pairs(2)) == 0.0
    assert touching_pairs(system, np.empty((0, 2), dtype=np.int64)).shape == (0, 2)
    assert touching_surroundings(system).shape == (0, 2)


def test_the_number_of_threads_changes_nothing():
    system = crowd(world(6.0), np.random.default_rng(4), 200, 6.0)
    pairs = all_pairs(200)
    assert len(pairs) > ALONE
    before = numba.get_num_threads()
    found = []
    try:
        for threads in (1, min(2, numba.config.NUMBA_NUM_THREADS)):
            numba.set_num_threads(threads)
            found.append(touching_pairs(system, pairs))
    finally:
        numba.set_num_threads(before)
    np.testing.assert_array_equal(found[0], found[1])
    assert len(found[0])
