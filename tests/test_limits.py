"""What a scene cannot be, as far as that is known before any kernel is compiled."""

from pathlib import Path

import pytest

import particlesim as ps
from particlesim.scene.errors import SceneError
from particlesim.setup import limits
from particlesim.setup.limits import check_limits

SCENES = sorted((Path(__file__).parents[1] / "scenes").glob("*.toml"))


def gas(**keys):
    group = {"shape": "sphere", "count": 10, "size": 0.3}
    solver = {"time_step": keys.pop("time_step", "auto")}
    return ps.Scene(duration=1.0, world={"size": [3, 3, 3]}, solver=solver, particles=[group | keys])


FULL = "do not fit: their volumes add up to 1.94 times the world's"  # 1000 pi/6 0.464^3 / 27
IMPOSSIBLE = [
    (gas(count=1000, size=0.464), FULL),
    (gas(count=1000, size={"kind": "uniform", "low": 0.464, "high": 1.0}), FULL),
    (gas(velocity={"kind": "maxwell", "temperature": 1e30}), "duration = 1.0: takes more than 9e\\+12 time steps"),
    (gas(velocity={"kind": "uniform", "speed": 1e29}), "duration = 1.0: takes more than 3e\\+27 time steps"),
    (gas(velocity=[0, 0, 1e29]), "duration = 1.0: takes more than 3e\\+27 time steps"),
    (gas(time_step=1e-20), "solver.time_step = 1e-20: takes about 1e\\+20 time steps"),
]


@pytest.mark.parametrize(("scene", "words"), IMPOSSIBLE)
@pytest.mark.parametrize(
    ("make", "name"), [(ps.simulate, "a.gsd"), (ps.render, "a.mp4"), (lambda s, path: ps.still(s, path, 0.5), "a.png")]
)
def test_what_cannot_be_is_refused_before_anything_is_compiled(tmp_path, monkeypatch, make, name, scene, words):
    monkeypatch.setattr("particlesim.jobs.movie.compile_kernels", None)
    with pytest.raises(SceneError, match=words):
        make(scene, tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_time_steps_are_not_overestimated(monkeypatch):
    found = []
    monkeypatch.setattr(limits, "check_steps", lambda scene, steps, about: found.append(steps))
    for velocity in ({"kind": "maxwell", "temperature": 1e9}, {"kind": "uniform", "speed": 1e5}, [0, 3e4, 0]):
        scene = gas(velocity=velocity)
        check_limits(scene)
        assert 0.0 < found[-1] < ps.Simulation(scene).steps_of(scene.duration)


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_scenes_that_can_be_pass(path):
    check_limits(ps.load_scene(path))
