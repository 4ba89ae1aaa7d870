"""What find_pairs refuses, and the octree's leaves as they are drawn."""

import numpy as np
import pytest

from particlesim.broad_phase import METHODS, find_pairs, octree_leaves


class TestGate:
    GOOD = np.zeros((3, 3))

    def bad(self, match, lower=GOOD, upper=GOOD, method="octree", **options):
        with pytest.raises(ValueError, match=match):
            find_pairs(lower, upper, method, **options)

    def test_method(self):
        self.bad("unknown method 'kd-tree', expected one of naive, grid, octree", method="kd-tree")

    @pytest.mark.parametrize("wrong", [np.zeros(3), np.zeros((3, 2)), 5.0, []])
    def test_shape(self, wrong):
        self.bad(r"lower must be \(n, 3\) float64", lower=wrong)
        self.bad(r"upper must be \(n, 3\) float64", upper=wrong)

    @pytest.mark.parametrize(
        "wrong", [np.zeros((3, 3), dtype=complex), [["a"] * 3] * 3, [[0, 0, 0], [0, 0]], None, [[None] * 3] * 3]
    )
    def test_type(self, wrong):
        self.bad("find_pairs: lower must be real numbers", lower=wrong)
        self.bad("find_pairs: upper must be real numbers", upper=wrong)
        if wrong is not None:
            self.bad("find_pairs: period must be real numbers", period=wrong)

    @pytest.mark.parametrize("dtype", [np.float32, np.float16, np.int8, np.uint64, list])
    @pytest.mark.parametrize("method", METHODS)
    def test_whatever_numpy_makes_numbers_of(self, dtype, method):
        lower = np.random.default_rng(1).integers(0, 9, (40, 3)).astype(np.float64)
        expected = find_pairs(lower, lower + 2.0, method, period=(8.0, 0.0, 8.0))
        given, wide = lower.astype(float if dtype is list else dtype), 2.0 if dtype is list else dtype(2)
        upper, period = given + wide, np.array([8, 0, 8])
        if dtype is list:
            given, upper, period = given.tolist(), upper.tolist(), (8, 0, 8)
        found = find_pairs(given, upper, method, period=period)
        assert found.dtype == np.int64
        np.testing.assert_array_equal(found, expected)

    @pytest.mark.parametrize("method", METHODS)
    def test_threads_are_the_calls_own(self, method):
        lower = np.random.default_rng(2).random((5000, 3))
        expected = find_pairs(lower, lower + 0.02, method)
        for threads in (1, 2, 3, np.int64(2)):
            np.testing.assert_array_equal(find_pairs(lower, lower + 0.02, method, threads=threads), expected)
        self.bad("find_pairs: the number of threads must be 1 to 4,096, not 0", method=method, threads=0)

    def test_unknown_and_odd_parameters(self):
        for method, known in (("naive", "threads"), ("grid", "cells"), ("octree", "max_count, max_depth")):
            with pytest.raises(TypeError, match=f"find_pairs: unknown parameter 'cell' of {method}.*{known}"):
                find_pairs(self.GOOD, self.GOOD, method, cell=3)
        for name, value in (("cells", 2.5), ("threads", "2"), ("threads", True)):
            with pytest.raises(TypeError, match=f"find_pairs: {name} must be a whole number, got {value!r}"):
                find_pairs(self.GOOD, self.GOOD, "grid", **{name: value})

    def test_number(self):
        self.bad("lower has 2 boxes, upper has 3", lower=np.zeros((2, 3)))

    @pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e200])
    def test_finite(self, value):
        wrong = np.zeros((3, 3))
        wrong[1, 2] = value
        self.bad("finite.*box 1", lower=wrong)
        self.bad("finite.*box 1", upper=wrong)

    def test_inverted(self):
        wrong = np.zeros((3, 3))
        wrong[2, 0] = -1e-300
        self.bad("lower exceeds upper in 1 boxes, first in box 2", upper=wrong)

    @pytest.mark.parametrize("period", [(1.0, 1.0), (1.0, -1.0, 1.0), (np.nan, 0.0, 0.0), 5.0])
    def test_period(self, period):
        self.bad("period must be three lengths", period=period)

    def test_periods_away(self):
        self.bad("periods from the origin", self.GOOD + 1e12, self.GOOD + 1e12, period=(1.0, 0.0, 0.0))

    @pytest.mark.parametrize("options", [{"cells": 0}, {"cells": -3}])
    def test_cells(self, options):
        self.bad("cells must be at least 1", method="grid", **options)

    @pytest.mark.parametrize("options", [{"max_count": 0}, {"max_depth": 0}, {"max_depth": 21}])
    def test_octree(self, options):
        self.bad("must be", method="octree", **options)


class TestLeaves:
    LOW, HIGH = np.array([-1.0, -2.0, 0.0]), np.array([3.0, 2.0, 1.0])

    def leaves(self, centre, max_count, max_depth):
        return octree_leaves(centre, centre, max_count, max_depth, self.LOW, self.HIGH)

    def centres(self, count):
        return self.LOW + np.random.default_rng(14).random((count, 3)) * (self.HIGH - self.LOW)

    def test_world_alone(self):
        for count in (0, 4):
            lower, upper, depth = self.leaves(self.centres(count), 4, 5)
            np.testing.assert_array_equal(lower, [self.LOW])
            np.testing.assert_array_equal(upper, [self.HIGH])
            np.testing.assert_array_equal(depth, [0])

    def test_leaves_fill_the_world_and_hold_few(self):
        centre = self.centres(500)
        lower, upper, depth = self.leaves(centre, 6, 12)
        assert (upper - lower).prod(axis=1).sum() == pytest.approx((self.HIGH - self.LOW).prod(), rel=1e-12)
        inside = (lower[:, None] <= centre) & (centre < upper[:, None])
        held = inside.all(axis=2).sum(axis=1)
        assert held.max() <= 6
        assert held.sum() == 500
        assert depth.max() < 12
        np.testing.assert_allclose(upper - lower, (self.HIGH - self.LOW) / 2.0 ** depth[:, None], rtol=1e-12)

    def test_coincident_end_at_the_depth(self):
        _, _, depth = self.leaves(np.full((30, 3), 0.3), 1, 7)
        assert depth.max() == 7
        assert len(depth) == 7 * 7 + 1

    def test_gate(self):
        for arguments in ((0, 5), (1, 0), (1, 21)):
            with pytest.raises(ValueError, match="octree_leaves"):
                self.leaves(self.centres(3), *arguments)
