"""Motion blur: how far, which way, in light; and what does not move stays as it is."""

import numpy as np
import pytest

import particlesim as ps
from particlesim.geometry import shapes
from particlesim.jobs import partial_run
from particlesim.rendering import Renderer
from particlesim.rendering.exposure import moments_of
from particlesim.rendering.look import look_of
from particlesim.rendering.passes import mean_of
from particlesim.scene import Scene
from tests.test_render_picture import EYE, HEIGHT, SLOPE, WHITE, WIDTH, make_frame, make_header
from tests.worlds import gas

KINDS = [shapes.sphere(), shapes.cube()]


def scene_with(boundary="wall", quality="normal", size=(WIDTH, HEIGHT), **movie):
    return Scene(
        world={"size": (6.0, 6.0, 6.0), "boundary": boundary},
        particles=[{"shape": "sphere", "count": 1, "colour": "black"}] * 2,
        movie={"resolution": size, "background": WHITE, "quality": quality, **movie},
        camera={"kind": "look-at", "position": tuple(EYE)},
        show={"box": False, "readout": False},
    )


def moving(position, velocity, angular_momentum=(0.0, 0.0, 0.0), time=1.0):
    frame, count = make_frame(position), len(position)
    values = {"velocity": velocity, "angular_momentum": angular_momentum}
    rows = {name: np.array(np.broadcast_to(value, (count, 3)), float) for name, value in values.items()}
    return type(frame)(**{**vars(frame), **rows, "time": time})


def picture(scene, frame):
    count = len(frame.position)
    with Renderer(look_of(scene, make_header(KINDS, np.arange(count) % 2, np.full(count, 0.5)), frame)) as renderer:
        return renderer.draw(frame)


def moments(scene, frame):
    count = len(frame.position)
    header = make_header(KINDS, np.arange(count) % 2, np.full(count, 0.5))
    return list(moments_of(scene, header, frame, np.full(count, 0.25)))


@pytest.mark.parametrize("shutter", [0.0, 0.4, 1.0])
@pytest.mark.parametrize("speed", [-20.0, 30.0])
def test_a_streak_is_as_long_as_the_way_while_the_shutter_is_open(shutter, speed):
    scene = scene_with("open", "draft", shutter=shutter, fps=20.0)
    image = picture(scene, moving([(0.0, 0.5, 0.0)], (0.0, speed, 0.0)))
    columns = np.flatnonzero((image.min(axis=2) < 250).any(axis=0))
    # A ball of radius 0.25 m, 10 m away across the line of sight, and where it was.
    centres = np.array([0.5, 0.5 - speed * shutter / 20.0])
    away = np.hypot(centres, 10.0)
    edges = np.tan(np.arctan2(centres, 10.0) + np.array([[-1.0], [1.0]]) * np.arcsin(0.25 / away))
    expected = 0.5 * WIDTH + 0.5 * HEIGHT / SLOPE * np.array([edges.min(), edges.max()])
    assert [columns[0], columns[-1] + 1] == pytest.approx(expected, abs=1.0)


@pytest.mark.parametrize("quality", ["draft", "normal", "high", "best"])
def test_what_is_at_rest_is_drawn_to_the_byte_as_without_blur(quality):
    still = moving([(0.0, -0.5, -2.75), (0.0, 0.5, 3.0), (1.0, 1.2, 0.3)], (0.0, 0.0, 0.0))
    sharp, blurred = (scene_with(quality=quality, size=(96, 64), shutter=s, sub_frames=3) for s in (0.0, 0.5))
    assert np.array_equal(picture(sharp, still), picture(blurred, still))


def test_the_first_picture_of_a_run_is_sharp():
    frame = moving([(0.0, 0.5, 0.0)], (0.0, 9.0, 0.0), time=0.0)
    assert moments(scene_with(shutter=1.0), frame) == [frame]


def test_particles_were_where_their_velocities_say_but_not_behind_walls():
    scene = {axis: scene_with(axis, shutter=0.6, fps=10.0, speed=0.5, sub_frames=4) for axis in ("wall", "periodic")}
    frame = moving([(0.0, 2.7, 0.0), (0.0, -2.9, 0.0)], [(1.0, -20.0, 0.0), (0.0, 20.0, 0.0)])
    back = np.array([0.03, 0.02, 0.01, 0.0])
    for found, seconds in zip(moments(scene["wall"], frame), back, strict=True):
        assert found.time == pytest.approx(1.0 - seconds)
        # Walls are 3 m from the middle, and the balls about which the particles are have a radius of 0.25 m.
        assert found.position[0] == pytest.approx([-seconds, min(2.7 + 20.0 * seconds, 2.75), 0.0])
        assert found.position[1, 1] == -2.9  # it is as far in the wall now
    found = moments(scene["periodic"], frame)[0]
    assert found.position[:, 1] == pytest.approx([2.7 + 0.6 - 6.0, -2.9 - 0.6 + 6.0])


def test_particles_were_turned_by_their_angular_velocity():
    frame = moving([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0)], (0.0, 0.0, 0.0), (0.0, 0.0, 3.0))
    first, *_, last = moments(scene_with(shutter=1.0, fps=10.0, sub_frames=5), frame)
    # Inertia 1 kg m^2: 3 rad/s about z for 0.1 s. A ball looks the same however it turns.
    assert first.orientation[1] == pytest.approx([np.cos(0.15), 0.0, 0.0, -np.sin(0.15)])
    assert np.array_equal(first.orientation[0], frame.orientation[0])
    assert np.array_equal(last.orientation, frame.orientation)


def test_pictures_are_mixed_as_light_is():
    black, white = (np.full((2, 2, 4), value, dtype=np.uint8) for value in (0, 255))
    assert (mean_of([black, white], of_light=True) == round(255 * 0.5**0.5)).all()
    every = np.arange(256, dtype=np.uint8).reshape(8, 8, 4)
    assert np.array_equal(mean_of([every] * 7, of_light=True), every)


@pytest.mark.slow
def test_a_blurred_movie_has_the_same_bytes_however_it_is_made(tmp_path, monkeypatch):
    movie = {"resolution": [64, 64], "fps": 20, "quality": "draft", "shutter": 0.5, "sub_frames": 2}
    some = gas(2, duration=3.05, movie=movie, trajectory={"precision": "double"})
    ps.render(some, tmp_path / "scene.mp4")
    ps.simulate(some, tmp_path / "run.gsd")
    for k in (1, 2):
        ps.render(tmp_path / "run.gsd", tmp_path / f"{k}.mp4", shard=(k, 2))
    ps.join([tmp_path / "1.mp4", tmp_path / "2.mp4"], tmp_path / "joined.mp4")
    ps.render(tmp_path / "run.gsd", tmp_path / "workers.mp4", workers=1)
    monkeypatch.setattr(partial_run, "INTERVAL", 0.0)
    monkeypatch.setattr(partial_run, "_SPARE", 0.0)

    def leave(phase, done, total):
        if done == 7:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        ps.render(some, tmp_path / "resumed.mp4", progress=leave)
    ps.render(some, tmp_path / "resumed.mp4", resume=True)
    once = (tmp_path / "scene.mp4").read_bytes()
    assert all((tmp_path / f"{way}.mp4").read_bytes() == once for way in ("joined", "workers", "resumed"))
