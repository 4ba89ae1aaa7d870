"""The contract of the broad phases: every method of the registry against a brute force written in numpy."""

import itertools

import numpy as np
import pytest

from particlesim.broad_phase import METHODS, find_pairs
from particlesim.core.parallel import use_threads

VARIANTS = {
    "naive": ("naive", {}),
    "grid": ("grid", {}),
    "grid-1": ("grid", {"cells": 1}),
    "grid-2": ("grid", {"cells": 2}),
    "grid-3": ("grid", {"cells": 3}),
    "grid-50": ("grid", {"cells": 50}),
    "octree": ("octree", {}),
    "octree-1": ("octree", {"max_count": 1, "max_depth": 20}),
    "octree-shallow": ("octree", {"max_count": 1, "max_depth": 1}),
}


def brute_force(lower, upper, period=None):
    """All shifts by whole periods are tried, one by one, for boxes first moved near the primary cell."""
    count = len(lower)
    overlap = np.ones((count, count), dtype=bool)
    for axis in range(3):
        low, high = lower[:, axis], upper[:, axis]
        length = 0.0 if period is None else period[axis]
        shifts = np.zeros(1)
        if length > 0.0:
            home = np.floor(low / length) * length
            low, high = low - home, high - home
            reach = 2 + int(np.ceil((high - low).max(initial=0.0) / length))
            shifts = length * np.arange(-reach, reach + 1)
        meets = np.zeros((count, count), dtype=bool)
        for shift in shifts:
            meets |= (low[:, None] <= high[None, :] + shift) & (low[None, :] + shift <= high[:, None])
        overlap &= meets
    return np.argwhere(np.triu(overlap, 1))


def boxes(centre, half):
    centre = np.asarray(centre, dtype=np.float64)
    half = np.broadcast_to(np.asarray(half, dtype=np.float64).reshape(-1, 1), centre.shape)
    return centre - half, centre + half


@pytest.fixture(params=VARIANTS)
def search(request):
    method, parameters = VARIANTS[request.param]

    def run(lower, upper, period=None):
        return find_pairs(lower, upper, method, period=period, **parameters)

    return run


@pytest.fixture
def threads():
    """Give the number of threads back."""
    yield
    use_threads(None)


def check(search, lower, upper, period=None):
    pairs = search(lower, upper, period)
    expected = brute_force(lower, upper, period)
    assert pairs.dtype == np.int64
    assert pairs.shape == expected.shape
    np.testing.assert_array_equal(pairs, expected)
    return pairs


class TestContract:
    @pytest.mark.parametrize("count", [0, 1, 2])
    def test_a_few(self, search, count):
        pairs = check(search, *boxes(np.zeros((count, 3)), 1.0))
        assert len(pairs) == max(count - 1, 0)

    @pytest.mark.parametrize("half", [0.0, 0.5])
    @pytest.mark.parametrize("period", [None, (4.0, 4.0, 4.0)])
    def test_all_coincide(self, search, half, period):
        pairs = check(search, *boxes(np.full((200, 3), 0.3), half), period)
        assert len(pairs) == 200 * 199 // 2

    @pytest.mark.parametrize("axis", [0, 1, 2])
    def test_touching_counts_and_one_ulp_apart_does_not(self, search, axis):
        lower, upper = boxes(np.zeros((2, 3)), 0.1)
        upper[0, axis] = lower[1, axis] = 0.7
        upper[1, axis] = 0.9
        assert len(check(search, lower, upper)) == 1
        lower[1, axis] = np.nextafter(0.7, 1.0)
        assert len(check(search, lower, upper)) == 0

    @pytest.mark.parametrize("spacing", [1.0, 0.1, 1.0 / 3.0])
    @pytest.mark.parametrize("period", [None, (7, 7, 7), (0, 7, 0)])
    def test_lattice(self, search, spacing, period):
        lattice = np.array(list(itertools.product(range(7), repeat=3)), dtype=np.float64)
        shuffled = np.random.default_rng(1).permutation(lattice)
        # Binary fractions are exact; of the others the boxes share their faces' coordinates to the last bit.
        lower, upper = shuffled * spacing, (shuffled + 1.0) * spacing
        if period is None:
            check(search, lower, upper)
        elif spacing == 1.0:
            pairs = check(search, lower, upper, np.array(period, dtype=np.float64))
            assert len(pairs) >= 343 * 26 // 2 * 0.7

    @pytest.mark.parametrize("ratio", [1e3, 1e4])
    def test_size_ratio(self, search, ratio):
        rng = np.random.default_rng(2)
        half = np.where(rng.random(400) < 0.05, 0.2, 0.2 / ratio)
        check(search, *boxes(rng.random((400, 3)), half))
        check(search, *boxes(rng.random((400, 3)), half), (1.0, 1.0, 1.0))
        half = 0.2 * ratio ** -rng.random(400)
        check(search, *boxes(rng.random((400, 3)), half))
        check(search, *boxes(rng.random((400, 3)), half), (1.0, 0.0, 1.0))

    def test_points(self, search):
        rng = np.random.default_rng(3)
        check(search, np.zeros((100, 3)), np.zeros((100, 3)))
        points = rng.integers(0, 4, (300, 3)).astype(np.float64)
        assert len(check(search, points, points)) > 0
        check(search, points, points, (4.0, 4.0, 3.0))
        check(search, rng.random((300, 3)) * 0.0, rng.random((300, 3)))

    @pytest.mark.parametrize("axis", [0, 1, 2])
    def test_flat_and_long(self, search, axis):
        rng = np.random.default_rng(4)
        lower = rng.random((300, 3))
        edges = np.full(3, 0.1)
        edges[axis] = 0.0
        check(search, lower, lower + edges)
        edges[axis] = 5.0
        check(search, lower, lower + edges)
        lower[:, axis] = 0.25
        edges[axis] = 0.0
        check(search, lower, lower + edges)
        check(search, lower, lower + edges, (1.0, 1.0, 1.0))

    @pytest.mark.parametrize("distance", [1e6, 1e15, 1e90])
    def test_far_outliers(self, search, distance):
        rng = np.random.default_rng(5)
        centre = rng.random((300, 3))
        centre[[7, 8, 100]] += distance
        centre[200, 1] -= distance
        check(search, *boxes(centre, 0.05))
        check(search, *boxes(centre * 1e-3 + 1e6, 0.05e-3))

    @pytest.mark.parametrize("period", list(itertools.product((0.0, 1.0), repeat=3)))
    @pytest.mark.parametrize("half", [0.01, 0.07, 0.2, 0.2499, 0.26, 0.4999, 0.55, 1.3])
    def test_periodic(self, search, period, half):
        rng = np.random.default_rng(6)
        check(search, *boxes(rng.random((60, 3)), half), period)
        check(search, *boxes(rng.random((60, 3)) * 9.0 - 5.0, half * rng.random(60)), period)

    def test_periodic_touching(self, search):
        """In a period of 8, boxes of whole edges at whole places: every touch is exact."""
        rng = np.random.default_rng(7)
        for _ in range(20):
            lower = rng.integers(-30, 30, (40, 3)).astype(np.float64)
            check(search, lower, lower + rng.integers(0, 5, (40, 3)), (8.0, 8.0, 16.0))

    def test_clusters(self, search):
        rng = np.random.default_rng(8)
        centre = np.concatenate([rng.normal(place, 1e-4, (80, 3)) for place in rng.random((5, 3))])
        check(search, *boxes(centre, 5e-5))
        check(search, *boxes(centre, 5e-5), (1.0, 1.0, 1.0))

    def test_many_small_scenes(self, search):
        rng = np.random.default_rng(9)
        for _ in range(400):
            count = int(rng.integers(2, 12))
            period = rng.choice([0.0, 1.0, 2.5], 3)
            scale = 10.0 ** rng.uniform(-3, 1)
            if rng.random() < 0.5:
                lower = rng.integers(-4, 5, (count, 3)) * 0.25
                check(search, lower, lower + rng.integers(0, 4, (count, 3)) * 0.25, period)
            else:
                half = 0.3 * rng.random(count) ** 3
                check(search, *boxes(rng.normal(0.0, scale, (count, 3)), half), period)

    @pytest.mark.parametrize("period", [None, (1.0, 1.0, 1.0)])
    def test_many_coincide_where_splitting_ends(self, search, period):
        """More boxes at one place than a leaf holds or a batch takes, and some beside them."""
        rng = np.random.default_rng(16)
        centre = np.concatenate([np.full((900, 3), 0.7), np.full((300, 3), 0.1), rng.random((50, 3))])
        check(search, *boxes(centre, np.repeat([0.0, 0.15, 0.02], [900, 300, 50])), period)

    def test_order_of_the_boxes_does_not_matter(self, search):
        rng = np.random.default_rng(10)
        lower, upper = boxes(rng.random((500, 3)), 0.05)
        mixed = rng.permutation(500)
        renamed = np.sort(mixed[search(lower[mixed], upper[mixed])], axis=1)
        pairs = search(lower, upper)
        np.testing.assert_array_equal(renamed[np.lexsort((renamed[:, 1], renamed[:, 0]))], pairs)

    def test_arrays_of_any_layout(self, search):
        rng = np.random.default_rng(11)
        lower, upper = boxes(rng.random((50, 3)), 0.1)
        pairs = search(np.asfortranarray(lower), np.repeat(upper, 2, axis=0)[::2])
        lower.flags.writeable = False
        np.testing.assert_array_equal(search(lower, upper), pairs)


def brute_force_of_each(lower, upper, period):
    """Rows (scene, i, j), i < j, of boxes that overlap, of scenes (s, n, 3) with periods (s, 3) each.

    Two periods either way are tried, which suffices for boxes within a period of the origin.
    """
    overlap = np.ones((len(lower), lower.shape[1], lower.shape[1]), dtype=bool)
    for axis in range(3):
        low, high = lower[:, :, axis], upper[:, :, axis]
        meets = np.zeros_like(overlap)
        for turns in range(-2, 3):
            shift = (turns * period[:, axis])[:, None, None]
            meets |= (low[:, :, None] <= high[:, None] + shift) & (low[:, None] + shift <= high[:, :, None])
        overlap &= meets
    return np.argwhere(np.triu(overlap, 1))


def few_particles(rng, scenes):
    """Scenes of five boxes within a period of the origin; all numbers are multiples of 1/16, so touches are exact."""
    shape = (scenes, 5, 3)
    lower = rng.integers(-16, 16, shape) / 16.0
    largest = 2 ** rng.integers(0, 6, (scenes, 5, 1))  # from points to boxes of one and a half times the period
    edges = rng.integers(0, 32, shape) % largest / 16.0
    return lower, lower + edges, rng.choice([0.0, 1.0, 1.25], (scenes, 3))


@pytest.mark.parametrize("method", METHODS)
def test_thousands_of_scenes_of_few_particles(method):
    lower, upper, period = few_particles(np.random.default_rng(17), 20_000)
    found = [METHODS[method](*scene)[0] for scene in zip(lower, upper, period, strict=True)]
    numbers = np.repeat(np.arange(len(found)), [len(pairs) for pairs in found])
    rows = np.column_stack([numbers, np.concatenate(found)])
    np.testing.assert_array_equal(rows, brute_force_of_each(lower, upper, period))


@pytest.mark.parametrize("method", ["grid", "octree"])
def test_a_hundred_thousand_scenes_side_by_side(method):
    """Scenes of few particles 8 m apart, all in one call, in an order that has nothing to do with where they are."""
    lower, upper, _ = few_particles(np.random.default_rng(18), 100_000)
    rows = brute_force_of_each(lower, upper, np.zeros((100_000, 3)))
    place = 8.0 * np.stack(np.unravel_index(np.arange(100_000), (50, 50, 40)), axis=1)[:, None]
    mixed = np.random.default_rng(19).permutation(500_000)
    number = np.empty(500_000, dtype=np.int64)
    number[mixed] = np.arange(500_000)
    expected = np.sort(number[5 * rows[:, :1] + rows[:, 1:]], axis=1)
    pairs, _ = METHODS[method](
        (lower + place).reshape(-1, 3)[mixed], (upper + place).reshape(-1, 3)[mixed], np.zeros(3)
    )
    np.testing.assert_array_equal(pairs, expected[np.lexsort((expected[:, 1], expected[:, 0]))])


LARGE_SCENES = (
    "uniform", "periodic", "clustered", "sizes", "one giant", "crowded", "a thousand to one", "periodic sizes",
    "flat", "sparse",
)  # fmt: skip


def large_scene(name, count=20000):
    """More boxes than one thread takes alone."""
    rng = np.random.default_rng(12)
    centre = rng.random((count, 3))
    spacing = count ** (-1.0 / 3.0)
    period = np.zeros(3)
    half = np.full(count, 0.36 * spacing)
    if name == "periodic":
        period[:] = 1.0
    elif name == "clustered":
        centre = rng.random((20, 3))[rng.integers(0, 20, count)] + rng.normal(0.0, 0.01, (count, 3))
        half *= 0.05
    elif name == "sizes":
        half *= 0.1 * 50.0 ** rng.random(count)
    elif name == "one giant":
        half[count // 2] = 0.4
    elif name == "crowded":
        half *= 2.0  # more pairs than the first lists hold
    elif name == "a thousand to one":
        half = 0.05 * 1000.0 ** -rng.random(count)
    elif name == "periodic sizes":
        period[:] = 1.0, 0.0, 1.0
        half = 0.03 * 100.0 ** -rng.random(count)
    elif name == "flat":
        centre[:, 2] = 0.5
        half *= 0.1
    elif name == "sparse":
        half *= 0.01  # many more cells than boxes
    return *boxes(centre, half), period


@pytest.fixture(scope="module")
def reference():
    """Pairs by the naive method, which the small scenes hold to the brute force, of each large scene."""
    return {name: METHODS["naive"](*large_scene(name))[0] for name in LARGE_SCENES}


@pytest.mark.parametrize("name", LARGE_SCENES)
@pytest.mark.parametrize("method", ["grid", "octree"])
def test_large_scenes_on_any_number_of_threads(threads, reference, method, name):
    scene = large_scene(name)
    tests = []
    for number in (1, 2, 4):
        use_threads(number)
        pairs, tested = METHODS[method](*scene)
        assert len(pairs) <= tested
        assert tested < 20000 * 19999 // 20
        np.testing.assert_array_equal(pairs, reference[name])
        tests.append(tested)
    assert len(set(tests)) == 1


def test_naive_tests_each_pair_once_on_any_number_of_threads(threads):
    lower, upper, period = large_scene("uniform", 17000)
    results = []
    for number in (1, 2, 4):
        use_threads(number)
        pairs, tested = METHODS["naive"](lower, upper, period)
        assert tested == 17000 * 16999 // 2
        results.append(pairs)
    np.testing.assert_array_equal(results[0], results[1])
    np.testing.assert_array_equal(results[0], results[2])


def test_more_cells_than_memory_holds():
    lower, upper = boxes(np.random.default_rng(15).random((100, 3)), 0.02)
    np.testing.assert_array_equal(find_pairs(lower, upper, "grid", cells=10**9), brute_force(lower, upper))


def test_lattice_tests_by_hand():
    """Unit cells on a line, one box in each: a box is tested against the next, and no other."""
    lower = np.zeros((10, 3))
    lower[:, 0] = np.arange(10.0)
    pairs, tested = METHODS["grid"](lower, lower + 0.5, np.zeros(3), cells=10)
    assert (len(pairs), tested) == (0, 9)


def test_every_method_takes_lists_that_grow():
    """300 boxes that all overlap: many times the room that is made at first."""
    lower, upper = boxes(np.random.default_rng(13).random((300, 3)), 1.0)
    for method in METHODS:
        pairs, tested = METHODS[method](lower, upper, np.zeros(3))
        assert len(pairs) == tested == 300 * 299 // 2
