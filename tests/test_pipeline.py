"""From a scene to a movie: decoded, counted, looked at."""

from pathlib import Path

import imageio.v3 as iio
import numpy as np
import pytest

import particlesim as ps
from particlesim.jobs.frame_source import frame_source, frames_ahead, opened
from particlesim.rendering.look import look_of
from particlesim.trajectory.gsd_file import Trajectory
from tests.worlds import gas, listed, quick_twin, scene

SCENES = sorted((Path(__file__).parent.parent / "scenes").glob("*.toml"))
SMALL = {"movie": {"fps": 10.0, "resolution": [320, 180]}, "duration": 0.5}


@pytest.mark.parametrize("path", SCENES, ids=lambda p: p.stem)
def test_every_scene_runs(path):
    sim = ps.Simulation(quick_twin(path))
    before = sim.ledger
    sim.run(steps=10)
    after = sim.ledger
    assert sim.largest_overlap() < 0.05 * sim.particles.inradius.min()
    assert after.own_energy <= before.own_energy + 1e-9 * after.energy


def test_the_path_of_a_scene_stands_for_it(tmp_path):
    with opened(str(SCENES[0])) as found:
        assert found == ps.load_scene(SCENES[0])
    with pytest.raises(ps.SceneError, match=r"none\.toml"), opened(tmp_path / "none.toml"):
        pass
    with pytest.raises(ps.SceneError, match=r"none\.toml"):
        ps.simulate(tmp_path / "none.toml", tmp_path / "run.gsd")


def test_a_movie_has_its_frames_and_shows_its_particles(tmp_path):
    dark = listed("sphere", {"position": (0, 0, 0), "velocity": (0.5, 0, 0)}, colour="#101010")
    look = {"kind": "look-at", "position": (0, -8, 0)}
    s = scene(dark, size=(6, 6, 6), boundary="open", camera=look, show={"box": False, "readout": False}, **SMALL)
    calls = []
    summary = ps.render(s, tmp_path / "movie.mp4", progress=lambda *call: calls.append(call))
    movie = np.array(list(iio.imiter(tmp_path / "movie.mp4", plugin="FFMPEG")))
    assert movie.shape == (6, 180, 320, 3)
    assert summary.frames == 6
    assert calls[-1] == ("rendering", 6, 6)
    background = movie[0, 0, 0].astype(int)
    changed = np.abs(movie.astype(int) - background).sum(axis=3) > 60
    for k, picture in enumerate(changed):
        rows, columns = np.nonzero(picture)
        # One metre at 8 m seen under 40 degrees over 180 rows; a ball looks a little larger than its diameter.
        scale = 180 / (2 * np.tan(np.radians(20)) * 8)
        assert columns.mean() == pytest.approx(160 + scale * 0.5 * 0.1 * k, abs=1.0)
        assert rows.mean() == pytest.approx(90, abs=1.0)
        assert rows.max() - rows.min() == pytest.approx(scale, abs=2.0)
    poster = iio.imread(tmp_path / "movie.png")
    assert poster.shape == (180, 320, 3)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["movie.mp4", "movie.png"]


@pytest.mark.parametrize("colour", ["by_shape", "by_speed"])
def test_a_trajectory_renders_to_the_movie_of_its_scene(tmp_path, colour):
    s = gas(5, **SMALL)
    for group in s.particles:
        group.colour = colour
    written = ps.simulate(s, tmp_path / "run.gsd")
    direct = ps.render(s, tmp_path / "direct.mp4")
    read = ps.render(tmp_path / "run.gsd", tmp_path / "read.mp4")
    assert written.impacts == direct.impacts == read.impacts > 0
    assert "simulating" not in read.seconds
    a, b = (np.array(list(iio.imiter(tmp_path / n, plugin="FFMPEG"))).astype(int) for n in ("direct.mp4", "read.mp4"))
    # Single precision moves an edge by far less than a pixel.
    assert a.shape == b.shape
    assert np.abs(a - b).mean() < 0.1


def test_a_scale_is_settled_by_the_run_and_not_by_its_start(tmp_path):
    # At rest at first, and at 4.9 m/s when it has fallen for half a second.
    ball = listed("sphere", {"position": (0, 0, 0)}, colour="by_speed")
    s = scene(ball, size=(6, 6, 6), boundary="open", gravity=(0, 0, -9.81), **SMALL)
    source = frame_source(s, None, None, None)
    calls = []
    frames, sample = frames_ahead(source, source.frames, lambda *call: calls.append(call), 0)
    assert [number for number, _ in frames] == list(range(6)) and calls[-1] == ("simulating", 6, 6)
    (field,) = look_of(s, source.header, source.first, sample).colours.fields
    assert (field.low, field.high) == (0.0, 5.0)
    ps.simulate(s, tmp_path / "run.gsd")
    with Trajectory(tmp_path / "run.gsd") as stored:
        late = frame_source(stored, range(4, 6), None, None)
        frames, sample = frames_ahead(late, late.frames, None, 0)
        assert [number for number, _ in frames] == [4, 5]
        assert [frame.time for frame in sample] == pytest.approx([0.0, 0.1, 0.2, 0.3, 0.4, 0.5])


def test_the_same_scene_gives_the_same_bytes(tmp_path):
    for name in ("one.mp4", "two.mp4"):
        ps.render(gas(5, **SMALL), tmp_path / name)
    assert (tmp_path / "one.mp4").read_bytes() == (tmp_path / "two.mp4").read_bytes()


def test_a_movie_fades_but_its_poster_does_not(tmp_path):
    settings = {**SMALL, "movie": {**SMALL["movie"], "fade": 0.2, "background": "white"}, "show": {"readout": False}}
    ps.render(gas(5, **settings), tmp_path / "movie.mp4")
    movie = np.array(list(iio.imiter(tmp_path / "movie.mp4", plugin="FFMPEG"))).astype(float)
    darkness = (255.0 - movie).mean(axis=(1, 2, 3))
    # Frames 2 and 3 of 0 to 5 are seen as they are, those beside them by half.
    assert darkness[0] < 0.5 and darkness[5] < 0.5
    assert darkness[1] == pytest.approx(0.5 * darkness[2], rel=0.1)
    assert darkness[4] == pytest.approx(0.5 * darkness[3], rel=0.1)
    assert np.abs(255.0 - iio.imread(tmp_path / "movie.png")).mean() == pytest.approx(darkness[2], rel=0.1)


def test_a_slow_movie_shows_the_same_motion(tmp_path):
    settings = {**SMALL, "movie": {**SMALL["movie"], "speed": 0.5}, "duration": 0.2}
    ps.simulate(gas(5, **settings), tmp_path / "slow.gsd")
    ps.simulate(gas(5, **{**SMALL, "duration": 0.2}), tmp_path / "usual.gsd")
    with ps.Trajectory(tmp_path / "slow.gsd") as slow, ps.Trajectory(tmp_path / "usual.gsd") as usual:
        assert (len(slow), len(usual)) == (5, 3)
        for k in range(3):
            assert slow[2 * k].time == usual[k].time
            assert slow[2 * k].position == pytest.approx(usual[k].position, abs=1e-6)


@pytest.mark.parametrize("frames", [range(0), range(3, 7), range(-1, 2)])
def test_frames_that_are_not_there_are_refused(frames, tmp_path):
    with pytest.raises(ValueError, match="frames must be some of 0 to 5, not range"):
        ps.render(gas(1, **SMALL), tmp_path / "movie.mp4", frames=frames)
    assert not list(tmp_path.iterdir())


def test_the_summary_adds_up(tmp_path):
    summary = ps.simulate(gas(5, gravity=(0, 0, -3), **SMALL), tmp_path / "run.gsd")
    assert summary.frames == 6
    assert summary.simulated_seconds == pytest.approx(0.5)
    assert summary.worst_energy_drift < 1e-13
    assert summary.momentum_error < 1e-12
    assert summary.largest_overlap < 0.01
    assert set(summary.seconds) == {"simulating"}


def test_octree_cells_are_drawn_when_asked_for(tmp_path):
    plain, with_cells = gas(5, **SMALL), gas(5, show={"cells": True}, **SMALL)
    for name, s in (("plain", plain), ("cells", with_cells)):
        ps.render(s, tmp_path / f"{name}.mp4")
    a, b = (iio.imread(tmp_path / f"{n}.png").astype(int) for n in ("plain", "cells"))
    assert (np.abs(a - b).sum(axis=2) > 30).mean() > 0.01
