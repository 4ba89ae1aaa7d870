"""The camera sees the whole world, and no more than it must."""

from pathlib import Path

import numpy as np
import pytest

import particlesim as ps
from particlesim.geometry.shapes import sphere
from particlesim.rendering.camera import FILL, Box, Camera, Window, light_azimuth, subject_box
from particlesim.scene import Scene
from particlesim.trajectory.frames import Frame, Header
from tests.worlds import quick_twin

SCENES = sorted((Path(__file__).parent.parent / "scenes").glob("*.toml"))
SPHERES = [{"shape": "sphere", "count": 1}]

PATH = {
    "kind": "path",
    "keys": [
        {"time": 0.5, "position": (9.0, 0.0, 3.0), "field_of_view": 40.0},
        {"time": 2.0, "position": (0.0, 8.0, 1.0), "target": (0.0, 1.0, 0.0), "field_of_view": 20.0},
        {"time": 3.0, "position": (0.0, 8.0, 1.0), "target": (0.0, 1.0, 0.0), "field_of_view": 20.0},
        {"time": 6.0, "position": (-5.0, 0.0, 2.0), "target": (0.0, 1.0, 0.0), "field_of_view": 30.0},
    ],
}


def scene(camera, size=(10.0, 8.0, 6.0)):
    return Scene(world={"size": size}, particles=SPHERES, camera=camera)


def project(view, aspect, points):
    """Points on the picture, both axes from -1 to 1, and their distance along the camera's axis."""
    local = (np.asarray(points) - view.pose[:3, 3]) @ view.pose[:3, :3]
    slope = np.tan(0.5 * view.field_of_view)
    away = -local[:, 2]
    return local[:, :2] / (away[:, None] * slope * np.array([aspect, 1.0])), away


def view_at(scene, time, aspect, subject=None):
    return Camera(scene, aspect, subject).view(time)


def corners(size):
    signs = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    return 0.5 * signs * np.asarray(size)


@pytest.mark.parametrize("aspect", [0.3, 9 / 16, 1.0, 16 / 9, 4.0])
@pytest.mark.parametrize("size", [(10.0, 8.0, 6.0), (1.0, 1.0, 1.0), (100.0, 1.0, 1.0), (1e-3, 1e-3, 5e-3)])
@pytest.mark.parametrize("elevation", [-30.0, 0.0, 20.0, 80.0])
def test_fixed_camera_fits_the_world_tightly_and_centred(aspect, size, elevation):
    view = view_at(scene({"kind": "fixed", "elevation": elevation}, size), 0.0, aspect)
    place, away = project(view, aspect, corners(size))
    assert np.all(away > view.near)
    low, high = place.min(axis=0), place.max(axis=0)
    assert max(-low.min(), high.max()) == pytest.approx(FILL, rel=1e-9)
    tight = np.argmax(high - low)
    assert low[tight] == pytest.approx(-high[tight], abs=1e-9)


@pytest.mark.parametrize("aspect", [9 / 16, 16 / 9])
@pytest.mark.parametrize("target", [None, (0.0, 0.0, 0.0), (1.0, -2.0, 0.5)])
def test_orbit_fits_the_world_at_every_angle(aspect, target):
    orbit = scene({"kind": "orbit", "period": 8.0, "target": target})
    reach = []
    for time in np.linspace(0.0, 8.0, 97):
        place, away = project(view_at(orbit, time, aspect), aspect, corners(orbit.world.size))
        assert np.all(away > 0.0)
        reach.append(np.abs(place).max())
    assert max(reach) <= FILL + 1e-3
    assert max(reach) > 0.9 * FILL


def test_an_orbit_without_a_target_leaves_equal_margins_above_and_below():
    orbit = scene({"kind": "orbit", "period": 8.0, "elevation": 30.0})
    places = [
        project(view_at(orbit, time, 3.0), 3.0, corners(orbit.world.size))[0][:, 1]
        for time in np.linspace(0.0, 8.0, 97)
    ]
    assert np.max(places) == pytest.approx(-np.min(places), abs=2e-3)


def test_orbit_turns_once_in_its_period_at_the_distance_given():
    orbit = scene({"kind": "orbit", "period": 8.0, "distance": 12.0, "target": (1.0, 0.0, 0.0), "elevation": 0.0})
    start, quarter, whole = (view_at(orbit, time, 1.0).pose for time in (0.0, 2.0, 8.0))
    target = np.array([1.0, 0.0, 0.0])
    arms = [pose[:3, 3] - target for pose in (start, quarter)]
    assert np.linalg.norm(arms, axis=1) == pytest.approx([12.0, 12.0])
    assert arms[0] @ arms[1] == pytest.approx(0.0, abs=1e-9)
    assert np.cross(arms[0], arms[1])[2] > 0.0
    assert whole == pytest.approx(start)


@pytest.mark.parametrize("position", [(5.0, 1.0, 2.0), (0.0, 0.0, 9.0), (0.0, 0.0, -9.0)])
def test_look_at_puts_its_target_in_the_middle(position):
    view = view_at(scene({"kind": "look-at", "position": position, "target": (0.0, 0.0, 1.0)}), 0.0, 1.5)
    place, away = project(view, 1.5, [(0.0, 0.0, 1.0)])
    assert place[0] == pytest.approx([0.0, 0.0], abs=1e-12)
    assert away[0] == pytest.approx(np.linalg.norm(np.subtract(position, (0.0, 0.0, 1.0))))


@pytest.mark.parametrize(
    "camera",
    [{"kind": "fixed"}, {"kind": "orbit"}, {"kind": "look-at", "position": (3.0, 2.0, 1.0)}, PATH],
)
def test_poses_are_rotations_with_the_horizon_level(camera):
    axes = view_at(scene(camera), 1.0, 1.0).pose[:3, :3]
    assert axes.T @ axes == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1.0)
    assert axes[2, 0] == pytest.approx(0.0, abs=1e-12)
    assert axes[2, 1] > 0.0


def test_a_path_goes_through_its_keys_and_holds_before_and_after():
    on_path = scene(PATH)
    for key in PATH["keys"]:
        view = view_at(on_path, key["time"], 1.5)
        assert view.pose[:3, 3] == pytest.approx(key["position"], abs=1e-12)
        assert np.degrees(view.field_of_view) == pytest.approx(key["field_of_view"])
        place, _ = project(view, 1.5, [key.get("target", (0.0, 0.0, 0.0))])
        assert place[0] == pytest.approx([0.0, 0.0], abs=1e-12)
    for time, held in ((-1.0, 0.5), (0.0, 0.5), (2.5, 2.0), (99.0, 6.0)):
        assert view_at(on_path, time, 1.5).pose == pytest.approx(view_at(on_path, held, 1.5).pose, abs=1e-12)


def test_a_path_is_smooth_starts_and_ends_at_rest_and_does_not_swing_beyond_its_keys():
    times = np.linspace(0.0, 7.0, 1401)
    place = np.array([view_at(scene(PATH), time, 1.5).pose[:3, 3] for time in times])
    speed = np.diff(place, axis=0) / 5e-3
    # A corner would change the speed at once, by metres a second.
    assert np.abs(np.diff(speed, axis=0)).max() < 0.25
    assert np.abs(speed[[100, 1199]]).max() < 0.1 and np.abs(speed).max() > 1.0
    keys = np.array([key["position"] for key in PATH["keys"]])
    assert np.all(place >= keys.min(axis=0) - 1e-12) and np.all(place <= keys.max(axis=0) + 1e-12)


def test_a_path_of_one_key_stands_still():
    one = scene({"kind": "path", "keys": PATH["keys"][:1]})
    same = scene({"kind": "look-at", "position": (9.0, 0.0, 3.0)})
    assert view_at(one, 5.0, 1.5).pose == pytest.approx(view_at(same, 0.0, 1.5).pose)
    assert light_azimuth(one) == light_azimuth(same)


def header(size):
    count = len(size)
    return Header("", (sphere(),), *(np.zeros(count, int), np.asarray(size)), np.zeros(count, int), None, None)


def frame(position, velocity=None):
    position = np.asarray(position, dtype=float)
    velocity = np.zeros_like(position) if velocity is None else np.asarray(velocity, dtype=float)
    return Frame(0.0, position, None, velocity, None, None, None)


def open_scene(camera="fixed", boundary="open", gravity=(0.0, 0.0, 0.0), **settings):
    world = {"size": (100.0, 100.0, 100.0), "boundary": boundary, "gravity": gravity}
    return Scene(world=world, particles=SPHERES, camera=camera, duration=2.0, **settings)


def test_an_open_world_is_framed_by_where_its_particles_start_and_fly():
    start = frame([(10.0, 0.0, 0.0), (12.0, 3.0, 1.0)], [(0.0, 0.0, 2.0), (1e9, 0.0, 0.0)])
    box = subject_box(open_scene(), header([2.0, 1.0]), start)
    assert box.lower == pytest.approx([9.0, -1.0, -1.0])
    # As far as 200 diameters go, however fast something leaves the world.
    assert box.upper == pytest.approx([12.5 + 200.0 * 1.5, 3.5, 5.0])
    far = frame([(500.0, 0.0, 0.0)], [(1.0, 0.0, 0.0)])
    assert subject_box(open_scene(), header([2.0]), far).upper == pytest.approx([503.0, 1.0, 1.0])


def test_what_falls_and_what_is_blown_apart_is_framed_all_along_but_for_a_few_that_stray():
    falling = open_scene(gravity=(0.0, 0.0, -9.81))
    start = frame([(0.0, 0.0, 45.0)])
    # In 2 s it falls by 19.62 m.
    assert subject_box(falling, header([2.0]), start).lower[2] == pytest.approx(45.0 - 19.62 - 1.0)
    deep = subject_box(open_scene(gravity=(0.0, 0.0, -100.0)), header([2.0]), frame([(0.0, 0.0, -49.0)]))
    assert deep.lower[2] == pytest.approx(-49.0 - 200.0 - 1.0)
    rng = np.random.default_rng(4)
    directions = rng.normal(size=(1000, 3))
    directions *= 40.0 / np.linalg.norm(directions, axis=1)[:, None]
    directions[:10] *= 100.0
    box = subject_box(open_scene(), header(np.full(1000, 1.0)), frame(np.zeros((1000, 3)), directions))
    assert (box.upper > 70.0).all() and (box.upper < 81.0).all() and (box.lower < -70.0).all()


@pytest.mark.parametrize("elevation", [5.0, 15.0, 40.0])
@pytest.mark.parametrize("size", [(10.0, 10.0, 0.2), (10.0, 3.0, 3.0), (1.0, 1.0, 4.0)])
def test_margins_are_equal_in_the_picture(size, elevation):
    place, _ = project(view_at(scene({"kind": "fixed", "elevation": elevation}, size), 0.0, 1.5), 1.5, corners(size))
    assert place.max(axis=0) == pytest.approx(-place.min(axis=0), abs=1e-9)


@pytest.mark.parametrize("kind", ["fixed", "orbit"])
@pytest.mark.parametrize(
    "window", [((-0.4, -0.92), (0.92, 0.92)), ((-0.92, -0.92), (0.5, 0.3)), ((0.1, -0.2), (0.9, 0.9))]
)
def test_what_is_framed_stays_in_its_window_and_as_near_to_the_middle_as_it_can(kind, window):
    window = Window(*np.array(window))
    some = scene({"kind": kind, "elevation": 15.0})
    camera, places = Camera(some, 1.5, None, window), []
    for time in np.linspace(0.0, 60.0, 41):
        place, away = project(camera.view(time), 1.5, corners(some.world.size))
        assert (away > 0.0).all()
        places.append(place)
    low, high = np.min(places, axis=(0, 1)), np.max(places, axis=(0, 1))
    assert (low >= window.lower - 2e-3).all() and (high <= window.upper + 2e-3).all()
    room = (window.upper - window.lower) - (high - low)
    assert room.min() < 0.05
    for axis in range(2):
        off = high[axis] + low[axis]
        at_rim = min(low[axis] - window.lower[axis], window.upper[axis] - high[axis]) < 0.02
        assert abs(off) < 0.02 or at_rim


def test_walls_are_framed_and_open_axes_by_their_particles_unless_told_otherwise():
    start = frame([(10.0, 0.0, 0.0)])
    boxes = [
        subject_box(
            open_scene({"kind": "orbit", "subject": subject}, ("wall", "periodic", "open")), header([2.0]), start
        )
        for subject in ("auto", "world", "particles")
    ]
    assert [box.upper.tolist() for box in boxes] == [[50.0, 50.0, 1.0], [50.0, 50.0, 50.0], [11.0, 1.0, 1.0]]
    assert subject_box(open_scene(), header([]), frame(np.zeros((0, 3)))) is not None
    assert subject_box(scene(PATH), header([2.0]), start).upper == pytest.approx([5.0, 4.0, 3.0])


@pytest.mark.parametrize("kind", ["fixed", "orbit"])
def test_what_is_framed_fills_the_picture(kind):
    some = open_scene(kind)
    box = subject_box(some, header([2.0, 1.0]), frame([(10.0, 0.0, 0.0), (12.0, 3.0, 1.0)]))
    view = view_at(some, 0.0, 1.5, box)
    place, away = project(view, 1.5, box.corners)
    assert 0.7 * FILL < np.abs(place).max() <= FILL + 1e-9
    assert np.all(away > view.near)


def test_zoom_makes_what_is_framed_larger_and_a_distance_is_kept():
    sizes = []
    for zoom in (0.5, 1.0, 2.0):
        view = view_at(scene({"kind": "fixed", "zoom": zoom}, (0.1, 0.1, 0.1)), 0.0, 1.5)
        sizes.append(np.ptp(project(view, 1.5, corners((0.1, 0.1, 0.1)))[0], axis=0).max())
    assert sizes == pytest.approx([FILL, 2.0 * FILL, 4.0 * FILL], rel=1e-6)
    view = view_at(scene({"kind": "fixed", "distance": 30.0}), 0.0, 1.5)
    assert np.linalg.norm(view.pose[:3, 3]) == pytest.approx(30.0)
    box = Box(np.array([1.0, 1.0, 1.0]), np.array([3.0, 3.0, 3.0]))
    for camera in ({"kind": "fixed", "distance": 9.0}, {"kind": "orbit", "distance": 9.0}):
        view = view_at(scene(camera), 0.0, 1.5, box)
        assert np.linalg.norm(view.pose[:3, 3] - 2.0) == pytest.approx(9.0)


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
@pytest.mark.parametrize("aspect", [9 / 16, 16 / 9])
def test_scene_files_show_all_their_particles(path, aspect):
    loaded = quick_twin(path)
    if loaded.camera.kind == "path":
        # It stands where the scene says, for pictures of the shape that the scene says.
        aspect = np.divide(*loaded.movie.size)
    simulation = ps.Simulation(loaded)
    start = simulation.frame()
    box = subject_box(loaded, simulation.header, start)
    for time in (0.0, loaded.duration):
        place, away = project(view_at(loaded, time, aspect, box), aspect, start.position)
        assert np.all(np.abs(place) < 1.0) and np.all(away > 0.0)


def test_light_comes_over_the_left_shoulder():
    same = {"kind": "look-at", "position": (2.0, 2.0 * np.tan(np.radians(30.0)), 1.0)}
    assert light_azimuth(scene(same)) == pytest.approx(light_azimuth(scene({"kind": "fixed", "azimuth": 30.0})))
