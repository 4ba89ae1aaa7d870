"""Colours by shape, group, field and name; what hulls and cells are drawn from."""

import numpy as np
import pytest
from matplotlib import colormaps

from particlesim.geometry import shapes
from particlesim.rendering.gl import geometry
from particlesim.rendering.octree_cells import cell_lines
from particlesim.rendering.shading.colour import (
    PALETTE,
    ParticleColours,
    palette_colour,
    parse,
    shape_colours,
)
from particlesim.rendering.shading.colour_maps import encoded, luminance, map_colours
from particlesim.rendering.shading.fields import field_of, figures
from particlesim.scene import Scene, SceneError
from particlesim.scene.colours import MAPS, FieldColour
from particlesim.scene.file import stored_scene
from particlesim.trajectory.frames import Frame, Header

WHITE = np.ones(3)


def viridis(fraction):
    return map_colours(np.array(fraction), "viridis", encoded("#f4f2ee"))


def header(kinds, shape, group=None):
    shape = np.asarray(shape)
    group = shape if group is None else np.asarray(group)
    one = np.ones(len(shape))
    kinds = tuple(shapes.CATALOGUE[kind]() for kind in kinds)
    return Header("", kinds, shape, one, group, mass=one, inertia=np.ones((len(shape), 3)))


def frame(velocity, time=0.0):
    velocity = np.asarray(velocity, dtype=float)
    turn = np.tile([1.0, 0.0, 0.0, 0.0], (len(velocity), 1))
    zero = np.zeros_like(velocity)
    return Frame(time, zero, turn, velocity, zero, zero.astype(int), np.zeros(len(velocity), int))


def scene(*colours, gravity=(0.0, 0.0, 0.0), boundary="wall"):
    groups = [{"shape": "sphere", "count": 1, "colour": colour} for colour in colours]
    world = {"size": (1.0, 1.0, 4.0), "gravity": gravity, "boundary": boundary}
    return Scene(world=world, particles=groups)


def of_all(colours, frame):
    return colours(frame, np.arange(len(frame.position)))


def test_each_shape_keeps_its_colour_whatever_else_is_there():
    alone = shape_colours(header(["cube"], [0]))
    among = shape_colours(header(["sphere", "cube", "pyramid"], [0, 1, 2]))
    assert np.array_equal(alone[0], among[1])
    assert len(np.unique(among, axis=0)) == 3


def test_more_shapes_than_colours_still_have_one_each():
    many = shape_colours(header(["pyramid"] * 12, range(12)))
    assert many.shape == (12, 3)
    assert len(np.unique(many, axis=0)) == 12


def test_thirty_five_groups_differ_in_colour_and_the_first_are_the_palette():
    colours = np.array([palette_colour(number) for number in range(35)])
    assert np.array_equal(colours[:7] ** 2, [parse(colour) for colour in PALETTE])
    assert ((colours >= 0.0) & (colours <= 1.0)).all()
    apart = np.linalg.norm(colours[:, None] - colours[None], axis=2) + 9.0 * np.eye(35)
    assert apart.min() > 0.06 and apart[:21, :21].min() > 0.13


def test_groups_and_names():
    some = scene("by_group", "by_group", "#804020", "steelblue")
    colours = ParticleColours(some, header(["sphere"], [0] * 5, [0, 1, 2, 3, 0]), [frame(np.zeros((5, 3)))])
    rgb = of_all(colours, frame(np.zeros((5, 3))))
    assert rgb.dtype == np.float32
    assert rgb[0] == pytest.approx(parse(PALETTE[0])) and np.array_equal(rgb[0], rgb[4])
    assert rgb[1] == pytest.approx(parse(PALETTE[1]))
    assert np.sqrt(rgb[2]) * 255 == pytest.approx([128, 64, 32], abs=1e-3)
    assert np.sqrt(rgb[3]) * 255 == pytest.approx([70, 130, 180], abs=1e-3)


def test_speed_colours_grow_lighter_and_their_scale_stays():
    moving = scene("by_speed", "red")
    first = frame([[1.0, 0, 0], [0, 0, 0], [0, 1.0, 0]])
    colours = ParticleColours(moving, header(["sphere"], [0, 0, 0], [0, 1, 0]), [first])
    before = of_all(colours, first).copy()
    faster = of_all(colours, frame([[0.5, 0, 0], [9.0, 0, 0], [0, 1.0, 0]])).copy()
    assert faster[0].sum() < before[0].sum()
    assert np.array_equal(before[2], faster[2])
    assert np.array_equal(before[1], faster[1])


def lab(colours):
    """CIELAB (n, 3) of sRGB 0 .. 1 (n, 3), white of D65 (IEC 61966-2-1; CIE 15:2004)."""
    linear = np.where(colours <= 0.04045, colours / 12.92, ((colours + 0.055) / 1.055) ** 2.4)
    to_xyz = [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
    part = linear @ np.transpose(to_xyz) / [0.95047, 1.0, 1.08883]
    root = np.where(part > 216.0 / 24389.0, np.cbrt(part), (24389.0 / 27.0 * part + 16.0) / 116.0)
    x, y, z = root.T
    return np.column_stack([116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)])


@pytest.mark.parametrize("name", MAPS)
def test_maps_are_those_of_matplotlib(name):
    place = np.linspace(0.0, 1.0, 256)
    assert map_colours(place, name, WHITE) == pytest.approx(colormaps[name](place)[:, :3], abs=0.045)


@pytest.mark.parametrize("name", MAPS)
def test_maps_are_perceptually_even(name):
    lightness = lab(map_colours(np.linspace(0.0, 1.0, 65), name, WHITE))[:, 0]
    steps = np.diff(lightness)
    # In blacker black than a screen can show lightness is no measure of what is seen.
    steps = steps[lightness[1:] > 5.0]
    assert lightness[-1] - lightness[0] > 70.0
    assert steps.min() > 0.6 * steps.mean() and steps.max() < 1.4 * steps.mean()


def test_maps_that_are_uneven_or_unknown_are_refused_with_the_reason():
    for name in ("jet", "turbo", "hsv", "rainbow"):
        with pytest.raises(SceneError, match=f'map = "{name}": must be .*; the lightness of this one does not grow'):
            scene({"field": "speed", "map": name})
    with pytest.raises(SceneError, match=r"map = \"virdis\": must be .* or 'cividis'; did you mean 'viridis'\?$"):
        scene({"field": "speed", "map": "virdis"})


def test_scenes_stored_by_version_0_1_are_read_as_they_were():
    group = {"shape": "sphere", "count": 1, "colour": "by_height", "colour_range": [0, 3]}
    plain = {"shape": "sphere", "count": 1, "colour": "red", "colour_range": None}
    stored = stored_scene({"world": {"size": [4, 4, 4]}, "particles": [group, plain]})
    assert stored.particles[0].colour == FieldColour(field="height", range=(0, 3))
    assert stored.particles[1].colour == "red"


def test_a_field_is_shown_in_the_colours_of_its_map():
    quick = frame([[0.0, 0, 0], [1.0, 0, 0], [2.0, 0, 0]])
    colour = {"field": "speed", "map": "magma", "range": [0, 2]}
    rgb = np.sqrt(of_all(ParticleColours(scene(colour), header(["sphere"], [0] * 3), [quick]), quick))
    assert rgb == pytest.approx(colormaps["magma"]([0.0, 0.5, 1.0])[:, :3], abs=0.01)


def test_speed_colours_of_particles_that_start_at_rest():
    rest = frame(np.zeros((1, 3)))
    for gravity in ((0.0, 0.0, 0.0), (0.0, 0.0, -9.81)):
        colours = ParticleColours(scene("by_speed", gravity=gravity), header(["sphere"], [0]), [rest])
        still = of_all(colours, rest).copy()
        assert np.all(np.isfinite(still))
        assert not np.array_equal(still, of_all(colours, frame([[0.5, 0.0, 0.0]])))


def test_each_field_colours_its_own_groups():
    mixed = scene("by_height", "by_size", "#804020")
    head = header(["sphere"], [0] * 5, [0, 0, 1, 1, 2])
    head.size[:] = 1.0, 1.0, 2.0, 3.0, 4.0
    start = frame(np.zeros((5, 3)))
    start.position[:, 2] = -2.0, 2.0, 0.0, 0.0, 0.0
    colours = ParticleColours(mixed, head, [start])
    assert [field.name for field in colours.fields] == ["height", "size"]
    rgb = np.sqrt(of_all(colours, start))
    assert rgb[:2] == pytest.approx(viridis([0.0, 1.0]), abs=1e-6)
    # All sizes are on one scale, also those of groups coloured otherwise.
    assert rgb[2:4] == pytest.approx(viridis([1.0 / 3.0, 2.0 / 3.0]), abs=1e-6)
    assert rgb[4] * 255 == pytest.approx([128, 64, 32], abs=1e-3)


def test_impacts_colour_those_who_had_them():
    quiet = frame(np.zeros((3, 3)))
    colours = ParticleColours(scene({"field": "impacts", "range": (0, 10)}), header(["sphere"], [0, 0, 0]), [quiet])
    quiet.impacts[:] = 0, 5, 50
    rgb = np.sqrt(of_all(colours, quiet))
    assert rgb == pytest.approx(viridis([0.0, 0.5, 1.0]), abs=2e-3)


def test_scales_are_given_or_settled_by_what_the_particles_come_to():
    head = header(["sphere"], [0] * 100)
    speeds = np.zeros((100, 3))
    speeds[:, 0] = np.arange(100) / 50.0
    frames = [frame(factor * speeds) for factor in (1.0, 2.0)]
    for some in frames:
        some.position[:, 2] = np.linspace(7.0, 9.0, 100)
    frames[1].impacts[:] = np.arange(100)
    frames[1].impacts[99] = 10**6

    def scale(colour, **settings):
        some = scene(colour, **settings)
        field = field_of(some.particles[0].colour, some, head, frames)
        return field.low, field.high

    # All but one in fifty are slower than 3.86 m/s; the next round end is 4.
    assert scale("by_speed") == scale("by_speed", gravity=(0.0, 0.0, -2.0)) == (0.0, 4.0)
    assert scale({"field": "speed", "range": (1.0, 5.0)}) == (1.0, 5.0)
    assert scale("by_height") == (-2.0, 2.0)
    assert scale("by_height", boundary="open") == pytest.approx((7.0, 9.0))
    assert scale("by_size") == (0.5, 1.5)  # all are of size 1
    # Impacts add up: those of the last frame count, and not the one who had a million.
    assert scale("by_impacts") == (0.0, 100.0)


def test_most_particles_of_a_gas_are_neither_at_the_dark_end_nor_beyond_the_bright_one():
    rng = np.random.default_rng(1)
    gas = frame(rng.normal(size=(5000, 3)))
    field = field_of(FieldColour(field="speed"), scene("by_speed"), header(["sphere"], [0] * 5000), [gas])
    fractions = field.fractions(None, gas, np.arange(5000))
    assert np.median(fractions) == pytest.approx(0.45, abs=0.1) and (fractions > 1.0).mean() < 0.02


@pytest.mark.parametrize("background", ["#000000", "#0b0e14", "#10141b", "#203040", "#f3f2ef", "#ffffff", "#808080"])
@pytest.mark.parametrize("name", MAPS)
def test_both_ends_of_a_scale_stand_off_from_the_background(background, name):
    behind = encoded(background)
    ends = map_colours(np.array([0.0, 1.0]), name, behind)
    light = luminance(np.vstack([behind, ends])) + 0.05
    if light[0] < 0.1:
        assert light[1] / light[0] >= 2.45 and light[2] / light[0] > 5.0
    else:
        assert np.array_equal(ends, map_colours(np.array([0.0, 1.0]), name, WHITE))


@pytest.mark.parametrize(
    ("low", "high", "texts"),
    [
        (0.0, 7.0, ["0.0", "3.5", "7.0"]),
        (0.0, 10.0, ["0", "5", "10"]),
        (0.0, 60.0, ["0", "20", "40", "60"]),
        (0.0, 1.2, ["0.0", "0.3", "0.6", "0.9", "1.2"]),
        (-2.0, 2.0, ["-2", "-1", "0", "1", "2"]),
        (0.1, 0.34, ["0.10", "0.16", "0.22", "0.28", "0.34"]),
        (1000.1, 1000.2, ["1000.10", "1000.15", "1000.20"]),
        (0.0, 7.43712, ["0.000", "1.859", "3.719", "5.578", "7.437"]),
        (0.0, 3e7, ["0", "1e+07", "2e+07", "3e+07"]),
        (1e-5, 4e-5, ["1e-05", "2e-05", "3e-05", "4e-05"]),
    ],
)
def test_figures_on_a_scale_are_short_and_at_both_ends(low, high, texts):
    assert [text for _, text in figures(low, high)] == texts


def test_every_scale_has_three_to_five_figures_on_it_and_one_at_each_end():
    rng = np.random.default_rng(2)
    for low, width in zip(rng.normal(0.0, 10.0, 500), 10.0 ** rng.uniform(-3, 5, 500), strict=True):
        values = [value for value, _ in figures(low, low + width)]
        assert 3 <= len(values) <= 5
        assert values[0] == pytest.approx(low) and values[-1] == pytest.approx(low + width)
        assert np.diff(values) == pytest.approx(np.full(len(values) - 1, width / (len(values) - 1)))


def test_cells_have_twelve_edges_each():
    lower = np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]])
    rows = cell_lines(lower, lower + np.array([1.0, 2.0, 3.0]), np.array([1, 5]), width=1.0, background=WHITE)
    assert rows.shape == (24, 11)
    length = np.linalg.norm(rows[:, 4:7] - rows[:, :3], axis=1)
    assert np.array_equal(np.unique(length, return_counts=True)[1], [8, 8, 8])
    assert not np.array_equal(rows[0, 7:10], rows[12, 7:10])


def test_front_edges_of_the_box_are_fainter():
    half = np.array([1.0, 1.0, 1.0])
    assert np.sum(geometry.edge_opacity(-half, half, np.array([5.0, 4.0, 3.0])) < 1.0) == 3
    assert np.sum(geometry.edge_opacity(-half, half, np.zeros(3)) < 1.0) == 0
