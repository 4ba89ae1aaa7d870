"""Scenes that are in the gallery, run as they are: what they show is what a law of its own says."""

from math import comb
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chisquare

import particlesim as ps

pytestmark = pytest.mark.slow

SCENES = Path(__file__).parents[1] / "scenes"


def shown(name):
    """The simulation of a scene, at its start."""
    return ps.Simulation(ps.load_scene(SCENES / f"{name}.toml"))


def test_the_bins_of_a_galton_board_fill_by_the_binomial_law():
    """Eight turns to either side, each with the same chance and of no memory: 8 over k in 256 come to bin k."""
    rows, pitch = 8, 0.1
    sim = shown("galton")
    sim.run(duration=sim.scene.duration)
    x, _, z = sim.particles.position.T
    assert (z < -0.2).all()  # all are down, and no bin is full
    bins = np.floor(x / pitch + 0.5 * (rows + 1)).astype(int)
    counts = np.bincount(bins, minlength=rows + 1)
    expected = len(x) / 2**rows * np.array([comb(rows, k) for k in range(rows + 1)])
    # As is usual for this statistic, in classes in which five or more are expected.
    classes = [0, 3, 4, 5, 6]
    assert chisquare(np.add.reduceat(counts, classes), np.add.reduceat(expected, classes)).pvalue > 0.01
    assert bins.mean() == pytest.approx(0.5 * rows, abs=3.0 * np.sqrt(0.25 * rows / len(x)))
    assert bins.var() == pytest.approx(0.25 * rows, rel=3.0 * np.sqrt(2.0 / len(x)))
