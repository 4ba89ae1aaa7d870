"""Colours by shape, group, speed and name; what overlays and cells are made of."""

import numpy as np
import pytest

from particlesim import shapes
from particlesim.rendering import geometry
from particlesim.rendering.cells import cell_lines
from particlesim.rendering.colour import PALETTE, ParticleColours, map_colours, parse, shape_colours
from particlesim.rendering.overlay import Readout, energy_change, readout_rows
from particlesim.scene import Scene
from particlesim.trajectory import Frame, Header


def header(kinds, shape, group=None):
    shape = np.asarray(shape)
    group = shape if group is None else np.asarray(group)
    one = np.ones(len(shape))
    kinds = tuple(shapes.CATALOGUE[kind]() for kind in kinds)
    return Header("", kinds, shape, one, group, mass=one, inertia=np.ones((len(shape), 3)))


def frame(velocity, time=0.0, **ledger):
    velocity = np.asarray(velocity, dtype=float)
    turn = np.tile([1.0, 0.0, 0.0, 0.0], (len(velocity), 1))
    zero = np.zeros_like(velocity)
    return Frame(time, zero, turn, velocity, zero, zero.astype(int), ledger)


def scene(*colours, gravity=(0.0, 0.0, 0.0)):
    groups = [{"shape": "sphere", "count": 1, "colour": colour} for colour in colours]
    return Scene(world={"size": (1.0, 1.0, 1.0), "gravity": gravity}, particles=groups)


def test_each_shape_keeps_its_colour_whatever_else_is_there():
    alone = shape_colours(header(["cube"], [0]))
    among = shape_colours(header(["sphere", "cube", "pyramid"], [0, 1, 2]))
    assert np.array_equal(alone[0], among[1])
    assert len(np.unique(among, axis=0)) == 3


def test_more_shapes_than_colours_still_have_one_each():
    many = shape_colours(header(["pyramid"] * 12, range(12)))
    assert many.shape == (12, 3)
    assert len(np.unique(many[: len(PALETTE)], axis=0)) == len(PALETTE)


def test_groups_and_names():
    some = scene("by_group", "by_group", "#804020", "steelblue")
    colours = ParticleColours(some, header(["sphere"], [0] * 5, [0, 1, 2, 3, 0]), frame(np.zeros((5, 3))))
    rgb = colours(frame(np.zeros((5, 3))))
    assert rgb.dtype == np.float32
    assert rgb[0] == pytest.approx(parse(PALETTE[0])) and np.array_equal(rgb[0], rgb[4])
    assert rgb[1] == pytest.approx(parse(PALETTE[1]))
    assert np.sqrt(rgb[2]) * 255 == pytest.approx([128, 64, 32], abs=1e-3)
    assert np.sqrt(rgb[3]) * 255 == pytest.approx([70, 130, 180], abs=1e-3)


def test_speed_colours_grow_lighter_and_their_scale_stays():
    moving = scene("by_speed", "red")
    first = frame([[1.0, 0, 0], [0, 0, 0], [0, 1.0, 0]])
    colours = ParticleColours(moving, header(["sphere"], [0, 0, 0], [0, 1, 0]), first)
    before = colours(first).copy()
    faster = colours(frame([[2.0, 0, 0], [9.0, 0, 0], [0, 1.0, 0]])).copy()
    assert faster[0].sum() > before[0].sum()
    assert np.array_equal(before[2], faster[2])
    assert np.array_equal(before[1], faster[1])
    lightness = map_colours(np.linspace(0.0, 1.0, 200)) @ [0.2126, 0.7152, 0.0722]
    assert np.all(np.diff(lightness) > 0.0)


def test_speed_colours_of_particles_that_start_at_rest():
    rest = frame(np.zeros((1, 3)))
    for gravity in ((0.0, 0.0, 0.0), (0.0, 0.0, -9.81)):
        colours = ParticleColours(scene("by_speed", gravity=gravity), header(["sphere"], [0]), rest)
        still = colours(rest).copy()
        assert np.all(np.isfinite(still))
        assert not np.array_equal(still, colours(frame([[0.5, 0.0, 0.0]])))


def test_readout_says_what_the_ledger_knows():
    first = frame(np.zeros((1234, 3)), kinetic_translational=3.0, kinetic_rotational=1.0)
    later = frame(
        np.zeros((1234, 3)), 1.5, kinetic_translational=1.0, kinetic_rotational=1.0, potential=1.9, impacts=12345.0
    )
    assert readout_rows(later, first) == [
        ("time", "1.50 s"),
        ("particles", "1,234"),
        ("impacts", "12,345"),
        ("energy change", "-2.5 %"),
    ]
    assert [name for name, _ in readout_rows(frame(np.zeros((1, 3))), first)] == ["time", "particles"]
    assert readout_rows(first, first)[-1] == ("energy change", "0")


def test_energy_change_is_relative_to_the_parts_not_to_a_sum_that_may_vanish():
    first = frame(np.zeros((1, 3)), kinetic_translational=2.0, potential=-2.0)
    later = frame(np.zeros((1, 3)), kinetic_translational=2.0, potential=-1.0)
    assert energy_change(later, first) == pytest.approx(0.25)
    nothing = frame(np.zeros((1, 3)), potential=0.0)
    assert energy_change(nothing, nothing) == 0.0


@pytest.mark.parametrize("size", [(64, 64), (200, 120), (720, 1280), (1280, 720)])
@pytest.mark.parametrize("dark", [True, False])
def test_readout_stays_in_the_picture_and_in_its_corner(size, dark):
    image = np.full((size[1], size[0], 3), 120, dtype=np.uint8)
    now = frame(np.zeros((10**6, 3)), 12345.678, impacts=1e9, potential=1.0)
    Readout(size, dark).draw(image, now, frame(np.zeros((1, 3)), potential=3.0))
    changed = np.any(image != 120, axis=2)
    assert changed.any()
    if min(size) >= 700:
        assert not changed[:, 320:].any() and not changed[200:].any()
        panel = image[changed.any(axis=1)][:, changed.any(axis=0)].reshape(-1, 3).astype(int).sum(axis=1)
        assert panel.max() - panel.min() > 300


def test_figures_of_the_readout_do_not_move():
    first = frame(np.zeros((1, 3)))
    images = []
    for time in (1.11, 8.88):
        image = np.full((720, 1280, 3), 255, dtype=np.uint8)
        Readout((1280, 720), dark=True).draw(image, frame(np.zeros((1, 3)), time), first)
        images.append(image)
    changed = np.argwhere(np.any(images[0] != images[1], axis=2))
    # Only the three figures of the first line differ: not the point, the unit, or the line below.
    assert np.ptp(changed[:, 0]) < 25 and np.ptp(changed[:, 1]) < 60


def test_hull_mesh_is_closed_and_knows_its_edges():
    for shape in (shapes.cube(), shapes.pyramid(), shapes.tetrahedron()):
        rows, triangles = geometry.hull_mesh(shape)
        a, b, c = (rows[triangles[:, k], :3].astype(float) for k in range(3))
        assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0 == pytest.approx(shape.volume, rel=1e-6)
        # A corner lies on two edges of its face.
        assert np.all(np.sort(rows[:, 6:], axis=1)[:, 1] < 1e-6)


def test_faces_of_many_corners_are_cut_into_fans():
    turn = np.linspace(0.0, 2.0 * np.pi, 7)[:-1]
    prism = shapes.hull("prism", [(np.cos(t), np.sin(t), z) for t in turn for z in (-1.0, 1.0)])
    rows, triangles = geometry.hull_mesh(prism)
    a, b, c = (rows[triangles[:, k], :3].astype(float) for k in range(3))
    assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0 == pytest.approx(prism.volume, rel=1e-6)
    fans = rows[rows[:, 7] > 1e5]
    assert len(fans) == 2 * 6 * 3 and fans[:, 6].max() == pytest.approx(np.sqrt(0.75), rel=1e-6)


def test_cells_have_twelve_edges_each():
    lower = np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]])
    rows = cell_lines(lower, lower + np.array([1.0, 2.0, 3.0]), np.array([1, 5]), width=1.0)
    assert rows.shape == (24, 11)
    length = np.linalg.norm(rows[:, 4:7] - rows[:, :3], axis=1)
    assert np.array_equal(np.unique(length, return_counts=True)[1], [8, 8, 8])
    assert not np.array_equal(rows[0, 7:10], rows[12, 7:10])


def test_front_edges_of_the_box_are_fainter():
    half = np.array([1.0, 1.0, 1.0])
    assert np.sum(geometry.edge_opacity(-half, half, np.array([5.0, 4.0, 3.0])) < 1.0) == 3
    assert np.sum(geometry.edge_opacity(-half, half, np.zeros(3)) < 1.0) == 0
