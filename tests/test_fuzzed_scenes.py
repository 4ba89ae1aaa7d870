"""Scene files in which anything may be wrong either make a scene or are refused in one line."""

import copy
import datetime
import tomllib
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import particlesim as ps
from particlesim.scene.file import parse_scene

SCENES = sorted((Path(__file__).parents[1] / "scenes").glob("*.toml"))

# Examples are the same each time, and none is kept: a test that fails does so for everybody.
examples = settings(derandomize=True, deadline=None, database=None, max_examples=60)

HOSTILE = [
    *(float("nan"), float("inf"), -float("inf"), -1, 0, -0.0, 1, 2.5, 5e-324, 1e300, -1e300, 2**63, -(10**400)),
    *("", "x", "\0", "\u202e", "../..", "x" * 5000, "1", "sphere", "naive", "auto"),
    *([], [[]], [0, 0, 0], [1, 2], [1, 2, 3, 4], [1e300] * 3, ["a"], [None], {}, {"kind": "list"}, {"x": 1}),
    *(True, False, datetime.date(2020, 1, 1), datetime.time(1)),
]
# What a scene may amount to for it to be built in a test.
FEW, BUILT = 3, 40


def places(table, path=()):
    """The path of every value in a table."""
    for key, value in table.items() if isinstance(table, dict) else enumerate(table):
        yield (*path, key)
        if isinstance(value, dict | list):
            yield from places(value, (*path, key))


def changed(table, path, draw):
    """Remove, rename, replace or wrap up one value."""
    for key in path[:-1]:
        table = table[key]
    key, how = path[-1], draw(st.sampled_from(["remove", "rename", "replace", "replace", "replace", "wrap"]))
    if how == "replace":
        table[key] = copy.deepcopy(draw(st.sampled_from(HOSTILE)))
    elif how == "wrap":
        table[key] = draw(st.sampled_from([lambda v: [v], lambda v: {"kind": v}, str, lambda v: [v, v]]))(table[key])
    elif how == "rename" and isinstance(table, dict):
        table[draw(st.sampled_from([f"{key}s", key.upper(), "", "kind", "size"]))] = table.pop(key)
    else:
        del table[key]


@st.composite
def broken(draw, path):
    """A scene of a few particles, wrong in one place to three."""
    table = tomllib.loads(path.read_text())
    for group in table.get("particles", []) + table.get("emitters", []):
        group["count"] = min(group.get("count", 1), FEW)
    for _ in range(draw(st.integers(1, 3))):
        found = list(places(table))
        if found:
            changed(table, draw(st.sampled_from(found)), draw)
    return table


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_whatever_is_wrong_in_a_scene_it_is_made_or_refused_in_a_line(path):
    @examples
    @given(table=broken(path))
    def holds(table):
        try:
            scene = parse_scene(table, path)
            if scene.number <= BUILT:
                ps.Simulation(scene).frame()
        except ps.SceneError as error:
            assert len(str(error).splitlines()) == 1

    holds()
