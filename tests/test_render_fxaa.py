"""Smooth edges: what steps aslant comes closer to the area it covers, and nothing else changes."""

import numpy as np
import pytest

from particlesim.core.parallel import use_threads
from particlesim.rendering.shading.fxaa import fxaa


def as_drawn(picture):
    """A grey picture (height, width) or one of colours, the highest row first, as OpenGL hands it over."""
    picture = np.asarray(picture)
    if picture.ndim == 2:
        picture = np.repeat(picture[..., None], 3, axis=2)
    # The fourth channel is of no account.
    fourth = np.random.default_rng(0).integers(0, 256, (*picture.shape[:2], 1))
    return np.ascontiguousarray(np.concatenate([picture, fourth], axis=2)[::-1].astype(np.uint8))


def half_plane(angle, size=(96, 72), samples=1, through=0.37):
    """How much of each pixel lies to the left of a line aslant, 0 .. 1, by ``samples`` samples a side."""
    width, height = size
    x = (np.arange(width * samples) + 0.5) / samples - 0.5 * width
    y = (np.arange(height * samples) + 0.5) / samples - 0.5 * height
    inside = (np.cos(angle) * x[None, :] + np.sin(angle) * y[:, None] < through).astype(float)
    return inside.reshape(height, samples, width, samples).mean(axis=(1, 3))


@pytest.mark.parametrize("colour", [(0, 0, 0), (255, 255, 255), (12, 200, 77)])
def test_a_flat_picture_stays_as_it_is(colour):
    flat = np.tile(np.array(colour), (17, 31, 1))
    assert np.array_equal(fxaa(as_drawn(flat)), flat)


@pytest.mark.parametrize("size", [(1, 1), (1, 7), (7, 1), (2, 2), (33, 21), (64, 48), (101, 3)])
def test_the_picture_keeps_its_size_is_turned_over_and_loses_its_fourth_channel(size):
    # Steps too small to be edges.
    width, height = size
    picture = np.random.default_rng(1).integers(100, 105, (height, width, 3))
    smooth = fxaa(as_drawn(picture))
    assert smooth.shape == (height, width, 3) and smooth.dtype == np.uint8
    assert np.array_equal(smooth, picture)


@pytest.mark.parametrize("low", [0, 120])
def test_edges_along_rows_and_columns_stay_sharp(low):
    upright = np.where(np.arange(48)[None, :] < 20, low, 255) * np.ones((36, 1), dtype=int)
    for picture in (upright, upright[:, ::-1], upright.T, upright.T[::-1]):
        smooth = fxaa(as_drawn(picture)).astype(int)
        change = np.abs(smooth[..., 0] - picture)
        # A little, and in the rows beside the edge alone.
        assert change.max() < 0.08 * (255 - low)
        assert (change > 0).sum() <= 2 * max(picture.shape)


@pytest.mark.parametrize("degrees", [4, 11, 20, 34, 56, 70, 83, 101, 127, 160])
def test_edges_aslant_come_closer_to_the_area_they_cover(degrees):
    angle = np.radians(degrees)
    exact, jagged = 255.0 * half_plane(angle, samples=16), 255.0 * half_plane(angle)
    smooth = fxaa(as_drawn(np.round(jagged)))[..., 0].astype(float)
    # Where pixels are partly covered, apart from the rim of the picture, where edges are cut off.
    edge = ((exact > 0.0) & (exact < 255.0))[16:-16, 16:-16]
    before, after = (np.abs(one - exact)[16:-16, 16:-16][edge].mean() for one in (jagged, smooth))
    assert before > 40.0
    assert after < 0.6 * before
    # The whole is as bright as it was.
    assert smooth.mean() == pytest.approx(exact.mean(), abs=1.0)


def test_what_is_away_from_edges_is_untouched():
    # A soft wave, one sharp disc in it.
    x, y = np.meshgrid(np.arange(90), np.arange(70))
    wave = 128.0 + 60.0 * np.sin(0.05 * x) * np.cos(0.06 * y)
    colours = np.stack([wave, 0.5 * wave, 255.0 - wave], axis=-1)
    disc = (x - 50.3) ** 2 + (y - 30.7) ** 2 < 15.2**2
    picture = np.where(disc[..., None], (250, 240, 10), colours).astype(np.uint8)
    changed = (fxaa(as_drawn(picture)) != picture).any(axis=2)
    distance = np.abs(np.hypot(x - 50.3, y - 30.7) - 15.2)
    assert changed[distance < 1.0].mean() > 0.5
    assert not changed[distance > 2.0].any()


def test_a_round_outline_is_rounder():
    x, y = np.meshgrid(np.arange(80 * 16), np.arange(80 * 16))
    fine = ((x / 16.0 - 40.2) ** 2 + (y / 16.0 - 39.6) ** 2 < 25.5**2).astype(float)
    exact = 255.0 * fine.reshape(80, 16, 80, 16).mean(axis=(1, 3))
    jagged = 255.0 * fine[8::16, 8::16]
    smooth = fxaa(as_drawn(jagged))[..., 0].astype(float)
    assert np.abs(smooth - exact).sum() < 0.6 * np.abs(jagged - exact).sum()


def test_a_picture_upside_down_or_turned_is_smoothed_alike():
    jagged = 255.0 * half_plane(0.4)
    one = fxaa(as_drawn(jagged)).astype(int)
    for turn in (np.flipud, np.fliplr, lambda image: np.swapaxes(image, 0, 1)):
        other = fxaa(as_drawn(turn(jagged))).astype(int)
        assert np.abs(turn(one) - other).max() <= 1


def test_threads_smooth_alike():
    picture = np.random.default_rng(9).integers(0, 256, (80, 90, 3))
    try:
        smooth = []
        for count in (1, 2, 4):
            use_threads(count)
            smooth.append(fxaa(as_drawn(picture)))
    finally:
        use_threads(None)
    assert np.array_equal(smooth[0], smooth[1]) and np.array_equal(smooth[0], smooth[2])
