"""Walls, and which of a crowd touch: against brute force over vertices and over all pairs."""

import itertools

import numba
import numpy as np
import pytest

from particlesim.core.constants import MAX_MANIFOLD, OPEN, PERIODIC, WALL
from particlesim.core.parallel import ALONE
from particlesim.geometry.shape_table import stack_shapes
from particlesim.model.bodies import State, World, particle_constants
from particlesim.model.touching import contact_now, deepest_overlap, touching_pairs, touching_walls
from tests import oracles
from tests.oracles import unit_quaternion

ZOO = oracles.zoo()
SHAPES = tuple(ZOO.values())
TABLE = stack_shapes(SHAPES)
UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])


def world(edge, boundary=(WALL, WALL, WALL)):
    half = np.full(3, 0.5 * edge)
    ways = np.array(boundary)
    return World(-half, half, ways, np.where(ways == PERIODIC, edge, 0.0), np.zeros(3), 1.0)


def bodies(shape, size, position, orientation):
    """Constants and state of resting particles."""
    n = len(shape)
    constants = particle_constants(
        SHAPES, np.asarray(shape), np.zeros(n), np.asarray(size, dtype=float), np.ones(n), np.ones(n)
    )
    state = State(
        np.ascontiguousarray(position, dtype=np.float64),
        np.ascontiguousarray(orientation, dtype=np.float64),
        np.zeros((n, 3)),
        np.zeros((n, 3)),
        np.zeros((n, 3), dtype=np.int64),
    )
    return constants, state


def crowd(random, count, edge):
    shape = random.integers(len(SHAPES), size=count)
    size = random.uniform(0.2, 1.0, count) / np.array([SHAPES[s].radius for s in shape])
    return bodies(
        shape, size, random.uniform(-0.5, 0.5, (count, 3)) * edge, [unit_quaternion(random) for _ in range(count)]
    )


def all_pairs(count):
    return np.array(list(itertools.combinations(range(count), 2)), dtype=np.int64)


def reach_of(constants, state, i, axis, side):
    """How far particle i reaches along an axis, from its vertices."""
    if constants.shape[i] == 0:
        return 0.5 * constants.size[i]
    vertices = oracles.corners(SHAPES[constants.shape[i]], constants.size[i], state.orientation[i])
    return (side * vertices[:, axis]).max()


def walls_by_force(constants, state, space):
    """Separation from each wall, (n, 6)."""
    gaps = np.empty((len(constants.mass), 6))
    for i in range(len(gaps)):
        for axis in range(3):
            for side in (-1, 1):
                plane = space.upper[axis] if side > 0 else -space.lower[axis]
                room = plane - side * state.position[i, axis]
                gaps[i, 2 * axis + (side > 0)] = room - reach_of(constants, state, i, axis, side)
    return gaps


def gap_by_force(constants, state, space, i, j):
    """Separation of two particles by contact_now, every image of j tried."""
    points = np.empty((MAX_MANIFOLD, 3))
    best = np.inf
    here = State(*(array[[i, j]].copy() for array in state))
    pair = type(constants)(*(array[[i, j]].copy() for array in constants))
    still = world(1e9, (OPEN, OPEN, OPEN))
    for image in itertools.product(*((-1, 0, 1) if period > 0 else (0,) for period in space.period)):
        here.position[1] = state.position[j] + np.array(image) * space.period
        best = min(best, contact_now(TABLE, still, pair, here, 0, 1, points)[0])
    return best


def test_walls_against_all_vertices():
    random = np.random.default_rng(1)
    space = world(3.0)
    constants, state = crowd(random, 400, 3.0)
    gaps = walls_by_force(constants, state, space)
    points = np.empty((MAX_MANIFOLD, 3))
    for i in range(len(gaps)):
        for wall in range(6):
            separation, normal, offset, count = contact_now(TABLE, space, constants, state, i, -1 - wall, points)
            axis, side = wall // 2, 2 * (wall % 2) - 1
            assert separation == pytest.approx(gaps[i, wall], abs=1e-14)
            assert np.array_equal(normal, side * np.eye(3)[axis]) and offset == (0.0, 0.0, 0.0)
            deep = side * points[:count, axis]
            np.testing.assert_allclose(deep, reach_of(constants, state, i, axis, side), atol=1e-6)
    expected = [(i, -1 - wall) for i, wall in np.argwhere(gaps <= 0.0).tolist()]
    found = touching_walls(TABLE, space, constants, state)
    assert [tuple(row) for row in found.tolist()] == expected
    assert len(expected) > 100


@pytest.mark.parametrize("boundary", [(WALL, PERIODIC, OPEN), (OPEN, OPEN, WALL)])
def test_only_walls_are_touched(boundary):
    random = np.random.default_rng(2)
    space = world(3.0, boundary)
    constants, state = crowd(random, 200, 3.0)
    gaps = walls_by_force(constants, state, space)
    solid = np.repeat(np.array(boundary) == WALL, 2)
    expected = [(i, -1 - wall) for i, wall in np.argwhere((gaps <= 0.0) & solid).tolist()]
    assert [tuple(row) for row in touching_walls(TABLE, space, constants, state).tolist()] == expected


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
    space = world(2.0)
    constants, state = bodies([1], [1.0], [[0.1, 0.2, 0.3]], [turn])
    points = np.empty((MAX_MANIFOLD, 3))
    separation, _, _, count = contact_now(TABLE, space, constants, state, 0, -6, points)
    assert separation == pytest.approx(0.7 - patch[0][2], abs=1e-14)
    rows = sorted(np.round(points[:count], 9).tolist())
    np.testing.assert_allclose(rows, sorted(np.round(patch, 9).tolist()), atol=1e-9)


@pytest.mark.parametrize("boundary", [(WALL, WALL, WALL), (PERIODIC, OPEN, PERIODIC)])
def test_touching_pairs_of_a_crowd(boundary):
    random = np.random.default_rng(3)
    space = world(4.2, boundary)
    constants, state = crowd(random, 60, 4.2)
    pairs = all_pairs(60)
    gaps = np.array([gap_by_force(constants, state, space, i, j) for i, j in pairs])
    found = touching_pairs(TABLE, space, constants, state, pairs)
    np.testing.assert_array_equal(found, pairs[gaps <= 0.0])
    assert 50 < len(found) < len(pairs)
    walls = walls_by_force(constants, state, space)[:, np.repeat(np.array(boundary) == WALL, 2)]
    deepest = max(-gaps.min(), -walls.min(initial=0.0))
    assert deepest_overlap(TABLE, space, constants, state, pairs) == pytest.approx(deepest, abs=1e-13)


def test_nothing_overlaps_nothing():
    constants, state = bodies([0, 1], [1.0, 1.0], [[-2.0, 0, 0], [2.0, 0, 0]], [UPRIGHT, UPRIGHT])
    space = world(10.0)
    assert deepest_overlap(TABLE, space, constants, state, all_pairs(2)) == 0.0
    empty = np.empty((0, 2), dtype=np.int64)
    assert touching_pairs(TABLE, space, constants, state, empty).shape == (0, 2)
    assert touching_walls(TABLE, space, constants, state).shape == (0, 2)


def test_the_number_of_threads_changes_nothing():
    random = np.random.default_rng(4)
    constants, state = crowd(random, 200, 6.0)
    space = world(6.0)
    pairs = all_pairs(200)
    assert len(pairs) > ALONE
    before = numba.get_num_threads()
    found = []
    try:
        for threads in (1, min(2, numba.config.NUMBA_NUM_THREADS)):
            numba.set_num_threads(threads)
            found.append(touching_pairs(TABLE, space, constants, state, pairs))
    finally:
        numba.set_num_threads(before)
    np.testing.assert_array_equal(found[0], found[1])
    assert len(found[0])
