"""Whatever is given to a public function, it works or says in one line what is wrong, by the name of the argument."""

import inspect

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

import particlesim as ps
from particlesim.jobs.figures import plot
from particlesim.scene.sweep import Case
from tests.worlds import gas

# Examples are the same each time, and none is kept: a test that fails does so for everybody.
examples = settings(derandomize=True, deadline=None, database=None)

NUMBERS = [-1, 0, 2**63, 10**400, -1.0, 1.5, 1e300, np.nan, np.inf, -np.inf, 1j, True, np.float32("nan"), np.int8(-1)]
THINGS = [None, "", "x", "\0", b"x", object(), slice(0, 2), range(0), range(5, 9), lambda *given: None, {}, {"a": 1}]
LISTS = [[], [[]], (1, 2), (0, 0), ("a", "b"), [[1, 2, 3], [1, 2]], [[np.nan] * 3], [None], ((),) * 3]
FLOATS = st.sampled_from([0.0, -0.0, 1.0, -1.0, 5e-324, 1e300, -1e300, 1.7e308, np.nan, np.inf, -np.inf])

hostile_arrays = arrays.arrays(
    st.one_of(
        arrays.floating_dtypes(),
        arrays.integer_dtypes(),
        arrays.complex_number_dtypes(),
        arrays.datetime64_dtypes(),
        arrays.unicode_string_dtypes(),
        st.just(np.dtype(object)),
        st.just(np.dtype(bool)),
    ),
    st.sampled_from([(), (0,), (3,), (0, 3), (2, 3), (3, 2), (2, 2), (2, 4), (1, 2, 3)]),
)
anything = st.one_of(st.sampled_from(NUMBERS), st.sampled_from(THINGS), st.sampled_from(LISTS), hostile_arrays)

SCENE = gas(1, duration=0.1, movie={"resolution": [64, 64], "fps": 10})
POSES = {"pose_a": ([0, 0, 0],), "pose_b": ([1, 2, 3], [1, 0, 0, 0], 1.0)}
BOXES = {"lower": np.zeros((2, 3)), "upper": np.ones((2, 3))}
RESTS = {"progress": None, "threads": 1}

# Public functions by their names, with arguments that are right; files are in the current folder. What draws is given a
# folder that is not there, so that it ends when all arguments are looked at.
FUNCTIONS = {
    "find_pairs": (ps.find_pairs, {**BOXES, "method": "octree", "period": None, "threads": 1, "max_count": 4}),
    "find_pairs of a grid": (ps.find_pairs, {**BOXES, "method": "grid", "cells": 2}),
    "separation": (ps.separation, {"shape_a": "cube", "shape_b": "cube", **POSES}),
    "load_scene": (ps.load_scene, {"path": "scene.toml"}),
    "open": (ps.open, {"path": "run.gsd"}),
    "simulate": (ps.simulate, {"scene": SCENE, "path": "no/run.gsd", "resume": False, **RESTS}),
    "render": (
        ps.render,
        {"source": "run.gsd", "path": "no/a.mp4", "look": None, "frames": None, "shard": None, "resume": True, **RESTS},
    ),
    "still": (ps.still, {"source": "run.gsd", "path": "no/a.png", "time": 0.0, "look": None, **RESTS}),
    "join": (ps.join, {"parts": ["a.mp4"], "path": "b.mp4"}),
    "export": (ps.export, {"source": "run.gsd", "path": "a.xyz", "frames": range(1), **RESTS}),
    "view": (ps.view, {"source": "run.gsd", "path": "a.html", "frames": range(1), **RESTS}),
    "plot": (plot, {"source": "run.gsd", "path": "no/a.svg", "what": "energy", "csv": None, "parquet": None, **RESTS}),
    "sweep": (
        ps.sweep,
        {"source": [Case({}, SCENE)], "path": "no/a.csv", "figure": None, "workers": 1, "scheduler": None, **RESTS},
    ),
    "Simulation": (ps.Simulation, {"scene": SCENE, "broad_phase": None, "threads": 1}),
    "load": (ps.Simulation.load, {"path": "state", "broad_phase": None, "threads": 1}),
    **{name: (make, dict.fromkeys(inspect.signature(make).parameters, 0.1)) for name, make in ps.CATALOGUE.items()},
    "box": (ps.CATALOGUE["box"], {"edges": (1, 2, 3), "rounding": 0.1}),
    "mesh": (ps.CATALOGUE["mesh"], {"file": "x.stl", "rounding": 0.1, "unit": "m"}),
}
METHODS = {
    "save": {"path": "other"},
    "run": {"duration": 0.0, "steps": None},
    "run_until": {"end": 0.0},
    "step_towards": {"end": 1e3},
    "steps_of": {"duration": 1.0},
    "step": {"time_step": None},
    "add_force": {"force": None},
}
OF_A_TRAJECTORY = {
    "table": {"which": "time"},
    "plot": {"what": "energy"},
    "time": {"k": 0},
    "ledger": {"k": 0},
    "__getitem__": {"k": 0},
}
ALL = {
    **FUNCTIONS,
    **{f"Simulation.{name}": good for name, good in METHODS.items()},
    **{f"Trajectory.{name}": good for name, good in OF_A_TRAJECTORY.items()},
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with a scene, a trajectory and a checkpoint, which is the current one."""
    path = tmp_path_factory.mktemp("hostile")
    (path / "scene.toml").write_text('[world]\nsize = [4, 4, 4]\n[[particles]]\nshape = "cube"\ncount = 1\nsize = 1\n')
    ps.simulate(SCENE, path / "run.gsd")
    ps.Simulation(SCENE).save(path / "state")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(path)
        yield path


def callable_of(name):
    """A public function by its name in ALL, and arguments for it that are right."""
    owner, _, last = name.partition(".")
    if not last:
        return FUNCTIONS[name]
    return (getattr(ps.Simulation(SCENE) if owner == "Simulation" else ps.open("run.gsd"), last), ALL[name])


def refused(name, **given):
    """The line that a call ends in, None if it works."""
    function, good = callable_of(name)
    try:
        function(**{**good, **given})
    except (ps.SceneError, ps.TrajectoryError, ps.CheckpointError, IndexError, OSError) as error:
        line = str(error)
    except (ValueError, TypeError) as error:
        line = str(error)
        one_of_them = {name.partition(".")[2] or name.split()[0], *given}
        # An output is named by its path.
        assert any(each in line for each in one_of_them) or type(error).__name__ in ("OutputError", "ShardError"), line
    else:
        return None
    assert line and "\n" not in line and len(line) < 400, line
    return line


@pytest.mark.parametrize("name", [name for name in ALL if name != "sphere"])
def test_it_works_or_says_what_is_wrong(folder, name):
    arguments = sorted(callable_of(name)[1])

    @settings(examples, max_examples=25 * len(arguments))
    @given(argument=st.sampled_from(arguments), value=anything)
    def try_it(argument, value):
        with np.errstate(all="raise"):
            refused(name, **{argument: value})

    try_it()


@pytest.mark.parametrize("name", ALL)
def test_an_argument_that_there_is_not(folder, name):
    function, good = callable_of(name)
    with pytest.raises(TypeError, match=rf"{name.partition('.')[2] or name.split()[0]}.*'unheard_of'"):
        function(**good, unheard_of=1)


@settings(examples, max_examples=300)
@given(
    corners=arrays.arrays(np.float64, st.tuples(st.just(2), st.integers(0, 5), st.just(3)), elements=FLOATS),
    method=st.sampled_from(["naive", "grid", "octree"]),
)
def test_boxes_of_any_numbers_have_the_pairs_that_overlap(corners, method):
    lower, upper = corners
    if (np.abs(corners) <= 1e100).all() and (lower <= upper).all():
        meet = ((lower[:, None] <= upper) & (lower <= upper[:, None])).all(axis=2)
        found = ps.find_pairs(lower, upper, method)
        assert np.array_equal(found, np.argwhere(np.triu(meet, 1))) and found.dtype == np.int64
    else:
        with pytest.raises(ValueError, match=r"^find_pairs: (lower|upper) "):
            ps.find_pairs(lower, upper, method)


@settings(examples, max_examples=100)
@given(given_back=anything)
def test_a_force_that_is_none(given_back):
    simulation = ps.Simulation(SCENE)
    simulation.add_force(lambda particles: given_back)
    with pytest.raises(ValueError, match=r"force (returns must be real|must return finite) numbers"):
        simulation.step()
