"""The light of the sky: amidst other particles, and on the floor below them."""

import numpy as np
import pytest

from particlesim.rendering.shading.ambient_occlusion import AmbientOcclusion
from particlesim.rendering.shading.floor import FloorOcclusion

HALF = np.array([3.0, 2.0])
FLOOR = -1.0

# Of all light that which comes to the floor from the sky.
SHARE = 0.4

WORLD = np.array([2.0, 2.0, 2.0])


def below(position, inner, outer=None):
    """Light on a floor whose squares are a tenth of a metre, (40, 60); rows along y."""
    inner = np.atleast_1d(inner)
    outer = inner if outer is None else np.atleast_1d(outer)
    light = FloorOcclusion(-HALF, HALF, FLOOR, inner, outer).light(np.atleast_2d(position))
    assert light.dtype == np.float32
    return light


def at(row, column, light):
    """The middle of a square of the floor."""
    rows, columns = light.shape
    return np.array([(2.0 * (column + 0.5) / columns - 1.0) * HALF[0], (2.0 * (row + 0.5) / rows - 1.0) * HALF[1]])


# ---- on the floor -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("high", [1.0, 1.2, 1.6, 2.0])
def test_below_a_sphere_the_floor_lacks_what_it_hides_of_the_sky(high):
    radius = 0.1
    empty = below((0.0, 0.0, 50.0), radius)
    assert empty.shape == (40, 60) and (empty == 1.0).all()
    light = below((*at(7, 41, empty), FLOOR + high * radius), radius)
    assert np.unravel_index(np.argmin(light), light.shape) == (7, 41)
    assert light[7, 41] == pytest.approx(1.0 - SHARE / high**2, abs=1e-6)
    # Aside it fades, by the book's power of the distance where that is not yet cut off.
    beside = 1.0 - SHARE / high**2 / (1.0 + 1.0 / high**2) ** 1.5
    assert light[7, 42] == light[7, 40] == pytest.approx(light[6, 41], abs=1e-6)
    assert light[7, 42] == pytest.approx(beside, abs=0.1 * (1.0 - beside))
    away = light[7, 41:]
    assert (np.diff(away) >= 0.0).all() and (away[int(3.6 * high) + 1 :] == 1.0).all()


def test_anywhere_between_the_points_the_shade_is_as_deep_within_their_coarseness():
    random = np.random.default_rng(1)
    for _ in range(50):
        place = random.uniform(-1.5, 1.5, 2)
        light = below((*place, FLOOR + 0.15), 0.1)
        # Half a square aside in both ways it is the book's (1 + 0.5^2 * 2 / 1.5^2)^(-3/2), or a little less.
        assert 1.0 - SHARE / 1.5**2 <= light.min() <= 1.0 - 0.7 * SHARE / 1.5**2
        row, column = np.unravel_index(np.argmin(light), light.shape)
        assert (np.abs(at(row, column, light) - place) <= 0.05 + 1e-9).all()


def test_the_shade_fades_evenly_as_a_sphere_rises():
    heights = np.linspace(0.08, 0.4, 321)
    lowest = np.array([below((0.05, 0.05, FLOOR + h), 0.1).min() for h in heights])
    assert (np.diff(lowest) >= 0.0).all()
    # A millimetre makes no jump: shades would blink.
    assert np.diff(lowest).max() < 0.01
    assert lowest[0] == pytest.approx(1.0 - SHARE) and lowest[-1] == 1.0


def test_a_hull_shades_about_as_the_sphere_between_those_within_and_about_it():
    place = (0.05, 0.05, FLOOR + 0.25)
    # As coarse a floor in all three.
    light = [
        below([place, (9, 9, 9), (9, 9, 9)], [i, 0.1, 0.1], [o, 0.1, 0.1])
        for i, o in ((0.15, 0.15), (0.15, 0.2), (0.2, 0.2))
    ]
    mean = below([place, (9, 9, 9), (9, 9, 9)], [0.175, 0.1, 0.1])
    assert (light[0] >= light[1]).all() and (light[1] >= light[2]).all()
    assert light[0].min() > light[1].min() > light[2].min()
    assert light[1] == pytest.approx(mean, abs=1e-6)


def test_shades_of_many_multiply_and_a_floor_below_nothing_is_light():
    places = np.array([(0.05, 0.05, FLOOR + 0.1), (0.35, 0.05, FLOOR + 0.15)])
    both = below(places, [0.1, 0.1])
    hidden = [(1.0 - below(place, 0.1)) / SHARE for place in places]
    assert both == pytest.approx(1.0 - SHARE * (1.0 - (1.0 - hidden[0]) * (1.0 - hidden[1])), abs=1e-5)
    empty_floor = FloorOcclusion(-HALF, HALF, FLOOR, np.zeros(0), np.zeros(0)).light(np.zeros((0, 3)))
    assert empty_floor.shape == (128, 192) and (empty_floor == 1.0).all()


# ---- amidst others ------------------------------------------------------------------------------------------------


def heap(count=3000, seed=2):
    """A dense crowd that fills the world: places and radii."""
    return np.random.default_rng(seed).uniform(-1.0, 1.0, (count, 3)), np.full(count, 0.06)


def test_one_alone_gets_all_the_light():
    random = np.random.default_rng(3)
    for radius, least in ((0.02, 0.95), (0.06, 0.8), (0.5, 0.8)):
        sky = AmbientOcclusion(WORLD, np.array([radius]))
        light = [sky.light(random.uniform(-0.9, 0.9, (1, 3)), np.array([0]))[0] for _ in range(40)]
        assert least < min(light) and max(light) <= 1.0
        assert np.mean(light) > 0.5 * (1.0 + least)  # darker only in the middle of a cell


def test_the_middle_of_a_crowd_gets_less_than_its_top():
    position, outer = heap(1000)
    light = AmbientOcclusion(WORLD, outer).light(position, np.arange(1000))
    assert ((light >= 0.5) & (light <= 1.0)).all()
    top, middle = position[:, 2] > 0.85, (np.abs(position) < 0.4).all(axis=1)
    bottom = (position[:, 2] < -0.8) & (np.abs(position[:, :2]) < 0.4).all(axis=1)
    assert light[top].mean() > 0.65
    # Half of the light comes whatever there is about; of what does not, the middle lacks much.
    assert light[middle].mean() < light[top].mean() - 0.5 * 0.385
    assert light[bottom].mean() < light[middle].mean()
    # Of some only that light is asked for.
    some = np.array([7, 2, 900])
    assert AmbientOcclusion(WORLD, outer).light(position, some).tolist() == light[some].tolist()


def test_fewer_particles_leave_more_light():
    position, outer = heap()
    light = [
        AmbientOcclusion(WORLD, outer[:count]).light(position[:count], np.arange(100)).mean()
        for count in (100, 300, 1000, 3000)
    ]
    assert (np.diff(light) < 0.0).all()


@pytest.mark.parametrize("way", [(1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.6, -0.7, 0.4)])
def test_light_does_not_jump_as_all_move_on(way):
    # Over three cells, by a twentieth of one at a time; what leaves the world goes on.
    position, outer = heap()
    cell, indices = 0.12, np.arange(0, 3000, 10)
    sky = AmbientOcclusion(WORLD, outer)
    light = np.array([sky.light(position + step * 0.05 * cell * np.array(way), indices) for step in range(60)])
    assert np.abs(np.diff(light, axis=0)).max() < 0.05
    # Apart from the cells' own coarseness it is the same all the way, away from where particles left.
    inside = (np.abs(position[indices]) < 0.5).all(axis=1)
    assert np.ptp(light[:, inside], axis=0).mean() < 0.05


@pytest.mark.parametrize("axis", [0, 2])
def test_one_that_leaves_the_crowd_comes_gently_into_the_light(axis):
    position, outer = heap()
    sky = AmbientOcclusion(WORLD, outer)
    light = []
    for x in np.linspace(-0.8, -1.4, 120):
        position[0] = 0.0
        position[0, axis] = x
        light.append(sky.light(position, np.array([0]))[0])
    assert np.abs(np.diff(light)).max() < 0.05
    assert light[-1] == 1.0


def test_light_does_not_depend_on_the_order_of_particles():
    position, outer = heap(500)
    outer = np.random.default_rng(4).uniform(0.02, 0.2, 500)
    order = np.random.default_rng(5).permutation(500)
    one = AmbientOcclusion(WORLD, outer).light(position, np.arange(500))
    other = AmbientOcclusion(WORLD, outer[order]).light(position[order], np.arange(500))
    assert other == pytest.approx(one[order], rel=1e-12)


def test_an_empty_sky_is_asked():
    assert AmbientOcclusion(WORLD, np.zeros(0)).light(np.zeros((0, 3)), np.zeros(0, dtype=np.int64)).shape == (0,)
