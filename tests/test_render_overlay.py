"""The readout and the legends: what they say, where they lie, and that they hold still."""

import unicodedata

import numpy as np
import pytest

import particlesim as ps
from particlesim.broad_phase import METHODS
from particlesim.geometry import shapes
from particlesim.rendering.camera import Camera
from particlesim.rendering.hud.history import WINDOW, History
from particlesim.rendering.hud.legend import swatches
from particlesim.rendering.hud.overlay import Overlay, legend_places
from particlesim.rendering.hud.panel import Panel, Style
from particlesim.rendering.hud.readout import readout_rows
from particlesim.rendering.look import look_of
from particlesim.rendering.shading.colour import PALETTE, palette_colour
from particlesim.rendering.shading.colour_maps import encoded, map_colours
from particlesim.scene import Scene
from particlesim.trajectory.analysis.observables import energy_change, pressure
from particlesim.trajectory.frame_aabb import frame_boxes
from particlesim.trajectory.frames import Frame, Header
from tests.gases import spheres
from tests.worlds import gas, ledger


def make_header(count, group=None):
    zero = np.zeros(count, dtype=int)
    one = np.ones(count)
    return Header("", (shapes.sphere(),), zero, one, zero if group is None else group, one, np.ones((count, 3)))


def make_frame(count=1, time=0.0, velocity=(0.0, 0.0, 0.0), **known):
    """Particles in one place, with a ledger if anything is known of it."""
    zero = np.zeros((count, 3))
    turn = np.tile([1.0, 0.0, 0.0, 0.0], (count, 1))
    velocity = np.tile(np.asarray(velocity, float), (count, 1))
    return Frame(
        time,
        zero,
        turn,
        velocity,
        zero,
        zero.astype(int),
        np.zeros(count, int),
        ledger(time=time, **known) if known else None,
    )


def make_scene(*groups, size=(1280, 720), world=None, camera="fixed", **show):
    groups = groups or ({"shape": "sphere", "count": 1},)
    world = {"size": (2.0, 3.0, 4.0), **(world or {})}
    return Scene(world=world, particles=groups, show=show, movie={"resolution": size}, camera=camera)


def rows_of(scene, frame, first, header=None):
    look = look_of(scene, header or make_header(len(frame.position)), first)
    return [(row.name, row.value) for row in readout_rows(look, frame, History().then(first.ledger))]


def overlay(scene, first, dark=True, header=None):
    return Overlay(look_of(scene, header or make_header(len(first.position)), first), dark)


def drawn(scene, frame, first=None, dark=True, header=None):
    """What the overlay changes in a grey picture, (h, w) bool, and the picture."""
    width, height = scene.movie.size
    image = np.full((height, width, 3), 120, dtype=np.uint8)
    overlay(scene, first or frame, dark, header).draw(image, frame, History())
    return np.any(image != 120, axis=2), image


def test_the_usual_readout_says_what_the_ledger_knows():
    first = make_frame(1234, kinetic_translational=3.0, kinetic_rotational=1.0)
    later = make_frame(1234, 1.5, kinetic_translational=1.0, kinetic_rotational=1.0, potential=1.9, impacts=12345)
    assert rows_of(make_scene(), later, first) == [
        ("time", "1.50 s"),
        ("particles", "1,234"),
        ("impacts", "12,345"),
        ("energy change", "-2.5 %"),
    ]
    nothing = make_frame()
    assert [name for name, _ in rows_of(make_scene(), nothing, first)] == ["time", "particles"]
    assert rows_of(make_scene(), first, first)[-1] == ("energy change", "0")
    assert rows_of(make_scene(readout=False), later, first) == []


def test_the_time_tells_frames_of_a_slow_movie_apart():
    slow = make_scene()
    slow.movie.speed = 0.01
    assert rows_of(slow, make_frame(time=1 / 3000), make_frame())[0] == ("time", "0.0003 s")


def test_rows_come_in_the_order_of_the_list():
    scene = make_scene(readout=["temperature", "speed", "time"])
    frame = make_frame(4, 2.0, velocity=(3.0, 4.0, 0.0), kinetic_translational=60.0)
    assert rows_of(scene, frame, frame) == [("temperature", "10.00 J"), ("mean speed", "5.000 m/s"), ("time", "2.00 s")]


def test_pairs_tested_are_those_of_the_broad_phases():
    scene = gas(60, show={"readout": ["pairs tested", "broad phases"]}, broad_phase={"kind": "grid", "cells": 3})
    simulation = ps.Simulation(scene)
    frame = simulation.frame()
    rows = dict(rows_of(scene, frame, frame, simulation.header))
    lower, upper = frame_boxes(simulation.header, frame)
    tested = {name: METHODS[name](lower, upper, np.zeros(3))[1] for name in METHODS}
    assert rows["naive tests"] == f"{tested['naive']:,}" == f"{240 * 239 // 2:,}"
    assert (rows["grid tests"], rows["octree tests"]) == (f"{tested['grid']:,}", f"{tested['octree']:,}")
    own = METHODS["grid"](lower, upper, np.zeros(3), cells=3)[1]
    assert rows["pairs tested"] == f"{100 * own / tested['naive']:.2f} %"


def pressure_of(sim, duration):
    window = [sim.ledger]
    for _ in range(10):
        sim.run(duration / 10)
        window.append(sim.ledger)
    return pressure(sim.scene, window)


def test_the_pressure_is_that_of_the_equation_of_state_on_walls_and_without():
    fill = 0.1
    compressibility = (1 + fill + fill**2 - fill**3) / (1 - fill) ** 3  # Carnahan and Starling
    periodic = spheres(500, fill)
    density = 500 / np.prod(periodic.scene.world.size)
    assert pressure_of(periodic, 10.0) == pytest.approx(density * compressibility, rel=0.05)
    # Centres stay half a diameter off the walls: a little denser inside.
    walled = spheres(500, fill, boundary="wall")
    assert pressure_of(walled, 10.0) == pytest.approx(density * compressibility, rel=0.2)
    assert pressure_of(walled, 10.0) > density


def test_a_world_that_is_open_has_no_pressure_and_a_first_frame_not_yet():
    known = {"wall_impulse": np.ones(6), "virial": 1.0, "kinetic_translational": 1.0}
    window = [ledger(time=0.0, **known), ledger(time=1.0, **known)]
    assert pressure(make_scene(world={"boundary": ("open", "periodic", "open")}), window) is None
    scene = make_scene(readout=["pressure"])
    assert rows_of(scene, make_frame(**known), make_frame(**known)) == [("pressure", "-")]
    open_scene = make_scene(world={"boundary": "open"}, readout=["pressure"])
    assert rows_of(open_scene, make_frame(**known), make_frame(**known)) == []
    later = {**known, "wall_impulse": np.array([1.0, 1.0, 1.0, 1.0, 1.0, 53.0])}
    # 52 N s on 52 m^2 in 2 s.
    assert rows_of(scene, make_frame(time=2.0, **later), make_frame(**known)) == [("pressure", "0.5000 Pa")]


def test_a_history_is_of_the_frames_before_and_forgets_the_oldest():
    history = History()
    for k in range(WINDOW + 5):
        history = history.then(ledger(time=float(k)))
    assert [passed.time for passed in history.ledgers] == [float(k) for k in range(5, WINDOW + 5)]
    # What is not later, or not known, changes nothing; and no frame is in its own past.
    assert history.then(ledger(time=3.0)) == history.then(None) == history
    assert [passed.time for passed in history.up_to(ledger(time=7.0))] == [5.0, 6.0, 7.0]


def test_energy_change_is_relative_to_the_parts_not_to_a_sum_that_may_vanish():
    first = ledger(kinetic_translational=2.0, potential=-2.0)
    later = ledger(kinetic_translational=2.0, potential=-1.0)
    assert energy_change(later, first) == pytest.approx(0.25)
    assert energy_change(ledger(), ledger()) == 0.0


@pytest.mark.parametrize("size", [(64, 64), (200, 120), (720, 1280), (1280, 720)])
@pytest.mark.parametrize("dark", [True, False])
def test_readout_stays_in_the_picture_and_in_its_corner(size, dark):
    now = make_frame(10**6, 12345.678, impacts=10**9, potential=1.0)
    changed, image = drawn(make_scene(size=size), now, make_frame(10**6, potential=3.0), dark)
    assert changed.any()
    if min(size) >= 700:
        assert not changed[:, 320:].any() and not changed[200:].any()
        panel = image[changed.any(axis=1)][:, changed.any(axis=0)].reshape(-1, 3).astype(int).sum(axis=1)
        assert panel.max() - panel.min() > 300


@pytest.mark.parametrize("size", [(320, 180), (640, 360), (1280, 720), (720, 1280)])
@pytest.mark.parametrize("edges", [(6.0, 1.6, 1.6), (3.0, 3.0, 3.0), (8.0, 8.0, 0.3), (1.2, 1.2, 2.4)])
@pytest.mark.parametrize("kind", ["fixed", "orbit"])
def test_panels_cover_no_corner_of_the_world(size, edges, kind):
    camera = {"kind": kind, "elevation": 12.0}
    scene = make_scene(SPEED, size=size, world={"size": edges}, camera=camera, legend=True)
    first = make_frame(impacts=1, potential=1.0)
    covered = drawn(scene, first)[0]
    assert 0.01 < covered.mean() < 0.3
    look = look_of(scene, make_header(1), first)
    half = 0.5 * np.array(edges)
    corners = (2.0 * np.array(list(np.ndindex(2, 2, 2))) - 1.0) * half
    for time in np.linspace(0.0, 60.0, 25):
        view = Camera(scene, size[0] / size[1], look.subject, look.window).view(time)
        seen = (corners - view.pose[:3, 3]) @ view.pose[:3, :3]
        per = 0.5 * size[1] / np.tan(0.5 * view.field_of_view) / -seen[:, 2]
        columns, rows = 0.5 * size[0] + per * seen[:, 0], 0.5 * size[1] - per * seen[:, 1]
        assert ((columns > 0) & (columns < size[0]) & (rows > 0) & (rows < size[1])).all()
        assert not covered[rows.astype(int), columns.astype(int)].any()


def test_figures_of_the_readout_do_not_move():
    images = [drawn(make_scene(), make_frame(time=time), make_frame())[1] for time in (1.11, 8.88)]
    changed = np.argwhere(np.any(images[0] != images[1], axis=2))
    # Only the three figures of the first line differ: not the point, the unit, or the line below.
    assert np.ptp(changed[:, 0]) < 25 and np.ptp(changed[:, 1]) < 60


def test_letters_are_large_enough_to_read_in_a_draft():
    assert Style((640, 360), dark=False).em >= 12.0
    assert Style((1920, 1080), dark=False).em > 1.4 * Style((1280, 720), dark=False).em


SPEED = {"shape": "sphere", "count": 1, "colour": {"field": "speed", "range": (0.0, 4.0)}}
HEIGHT = {"shape": "sphere", "count": 1, "colour": "by_height"}


@pytest.mark.parametrize("size", [(640, 360), (1280, 720), (480, 480), (360, 640)])
def test_legends_touch_neither_the_readout_nor_each_other(size):
    both = make_header(2, np.array([0, 1]))
    frame = make_frame(2, impacts=1, potential=1.0)
    groups = {"speed": [SPEED, SPEED], "both": [SPEED, HEIGHT]}
    shown = {
        (name, readout): drawn(make_scene(*group, size=size, readout=readout), frame, header=both)[0]
        for name, group in groups.items()
        for readout in (True, False)
    }
    readout = drawn(
        make_scene({**SPEED, "colour": "red"}, size=size),
        make_frame(1, impacts=1, potential=1.0),
    )[0]
    for name, group in groups.items():
        legends = shown[name, True] & ~readout
        assert legends.sum() > 0.9 * 11 * 3 * 12 * 12 * len(set(map(str, group)))
        rows, columns = np.nonzero(legends)
        # Not at an edge of the picture, not within the readout or at its side.
        assert min(rows.min(), columns.min()) > 5 and not legends[-6:].any() and not legends[:, -6:].any()
        grown = np.roll(readout, 5, axis=1) | np.roll(readout, 5, axis=0)
        assert not (grown & legends).any()
    assert (shown["both", False].sum()) == 2 * (shown["speed", False].sum())


def test_the_bar_of_a_legend_has_the_colours_of_the_map_in_order():
    changed, image = drawn(make_scene(SPEED, readout=False), make_frame())
    colours = image[changed].astype(int)
    for fraction in (0.0, 0.25, 0.5, 0.75, 1.0):
        wanted = 255.0 * map_colours(np.array([fraction]), "viridis", encoded("#f4f2ee"))[0]
        assert np.abs(colours - wanted).sum(axis=1).min() < 8


def test_the_legend_stays_the_same_while_speeds_change():
    first, later = make_frame(), make_frame(time=1.0, velocity=(3.0, 0.0, 0.0))
    scene = make_scene(SPEED, readout=False)
    assert np.array_equal(drawn(scene, first)[1], drawn(scene, later, first)[1])


def test_legends_are_shown_for_fields_unless_told_otherwise():
    plain = {"shape": "sphere", "count": 1, "colour": "red", "name": "red one"}
    shown = {
        (name, legend): drawn(make_scene(group, readout=False, legend=legend), make_frame())[0].any()
        for name, group in (("field", SPEED), ("plain", plain))
        for legend in (None, True, False)
    }
    assert [key for key, there in shown.items() if there] == [("field", None), ("field", True), ("plain", True)]


def test_swatches_name_groups_and_shapes_once_each():
    groups = [
        {"shape": "sphere", "count": 1},
        {"shape": "sphere", "count": 1},
        {"shape": "sphere", "count": 1, "colour": "by_group"},
        {"shape": "sphere", "count": 1, "colour": "#ff8000", "name": "e = 1"},
        SPEED,
        {"shape": "sphere", "count": 0, "colour": "red"},
    ]
    named = swatches(make_scene(*groups), make_header(5, np.arange(5)), Style((1280, 720), dark=True).can_write)
    assert [swatch.name for swatch in named] == ["sphere", "group 3", "e = 1"]
    assert named[1].colour == pytest.approx(encoded(PALETTE[2]))
    assert named[2].colour == pytest.approx([1.0, 0x80 / 255, 0.0])


@pytest.mark.parametrize(("count", "lines"), [(14, 14), (30, 30), (50, 32)])
def test_a_legend_names_all_groups_or_says_how_many_more_there_are(count, lines):
    groups = [{"shape": "sphere", "count": 1, "colour": "by_group", "name": f"g{k}"} for k in range(count)]
    scene = make_scene(*groups, readout=False, legend=True)
    image = drawn(scene, make_frame(count), header=make_header(count, np.arange(count)))[1]
    shown = [
        k
        for k in range(min(count, 35))
        if (np.abs(image - 255.0 * palette_colour(k)).max(axis=2) <= 1.0).sum() >= 0.9 * round(0.8 * 18.72) ** 2
    ]
    assert shown == list(range(min(count, lines - (count > lines))))


def test_values_of_a_scale_are_in_the_middle_below_their_marks():
    image = drawn(make_scene(SPEED, readout=False), make_frame())[1]
    panel = image[10:200, 900:].astype(int)
    panel[(panel == 120).all(axis=2)] = 0  # what is not panel
    bar = np.flatnonzero((np.ptp(panel, axis=2) > 60).sum(axis=1) > 100)
    columns = np.flatnonzero((np.ptp(panel[bar], axis=2) > 60).any(axis=0))
    mark = np.flatnonzero((panel[bar[-1] + 2] > panel[bar[-1] + 2].min() + 60).all(axis=1))
    # The outermost marks are at the ends of the bar.
    assert abs(mark.min() - columns.min()) <= 2 and abs(mark.max() - columns.max()) <= 2
    inked = (panel[bar[-1] + 6 : bar[-1] + 26] > 150).all(axis=2).any(axis=0).nonzero()[0]
    for end in (mark.min(), mark.max()):
        near = inked[np.abs(inked - end) < 12]
        assert abs(0.5 * (near.min() + near.max()) - end) <= 1.5


def test_letters_that_the_usual_font_lacks_come_from_others_or_the_group_goes_by_its_number():
    style = Style((1280, 720), dark=True)
    lacking = style.ink("\U0010ffff")
    for name in ("Stöße", "Sto\u0308ße", "Δt = 3 µs", "шары", "\U0001f600", "\u2764\ufe0f"):
        assert style.can_write(name)
        letters = [letter for letter in unicodedata.normalize("NFC", name) if letter not in " \ufe0f"]
        assert all(style.ink(letter).max() > 0.5 for letter in letters)
        assert not any(np.array_equal(style.ink(letter), lacking) for letter in letters)
    assert np.array_equal(style.ink("Sto\u0308ße"), style.ink("Stöße"))
    # What no font has (a code point for private use) is not drawn as a box.
    groups = [{"shape": "sphere", "count": 1, "colour": "red", "name": name} for name in ("ok", "no \U000ffffd")]
    named = swatches(make_scene(*groups), make_header(2, np.arange(2)), style.can_write)
    assert [swatch.name for swatch in named] == ["ok", "group 2"]


def test_texts_go_as_their_script_does():
    """From right to left, with letters that join, and marks where they belong."""
    style = Style((1280, 720), dark=True)
    both, bet = style.ink("אב"), style.ink("ב")
    inked = np.flatnonzero(bet.max(axis=0) > 0.0)
    assert both[:, : inked[-1]] == pytest.approx(bet[:, : inked[-1]], abs=1e-6)
    assert style.width("سلام") < 0.9 * sum(style.width(letter) for letter in "سلام")
    plain, barred = style.ink("x"), style.ink("x\u0304")
    assert np.flatnonzero(barred.max(axis=1))[0] < np.flatnonzero(plain.max(axis=1))[0]
    assert style.width("x\u0304") < 1.5 * style.width("x")  # of two fonts


def test_legends_that_do_not_fit_are_left_out():
    style = Style((100, 100), dark=False)
    panels = [Panel(style, 40, 60)] * 3
    assert legend_places(panels, (100, 100), (95, 95), 5) == []
    assert len(legend_places(panels, (400, 100), (95, 95), 5)) == 2
    assert [place[1:] for place in legend_places(panels, (100, 200), (95, 95), 5)] == [(5, 155), (5, 110)]
