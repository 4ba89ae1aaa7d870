"""Scene files: what they may say, in TOML and from Python, and the schema that editors read."""

import json
from pathlib import Path

import numpy as np
import pytest

import particlesim as ps
from particlesim.scene import Scene
from particlesim.scene.file import parse_scene
from particlesim.scene.groups import FixedSize, FixedVelocity, Group, PolyhedronShape
from particlesim.scene.world import Grid, Solver, World

SCENES = sorted((Path(__file__).parent.parent / "scenes").glob("*.toml"))

EVERYTHING = """
title = "Everything"
seed = 7
duration = 2
camera = "orbit"

[world]
size = [4, 5, 6]
boundary = ["wall", "periodic", "open"]
gravity = [0, 0, -9.81]
restitution = 0.9
friction = 0.4
rolling_friction = 0.001

[[particles]]
shape = "sphere"
count = 1e2
size = 0.2
density = 500
velocity = [1, 0, 0]
spin = "rest"
colour = { field = "speed", map = "magma", range = [0, 3] }

[[particles]]
name = "two"
shape = { kind = "box", edges = [1, 2, 3], rounding = 0.25 }
size = { kind = "log-uniform", low = 0.1, high = 0.3 }
mass = 2
restitution = 0.5
friction = 0.3
static_friction = 0.5
tangential_restitution = -0.2
placement = { kind = "list", poses = [
    { position = [0, 0, 0] },
    { position = [1, 0, 0], orientation = [1, 1, 0, 0], velocity = [0, 1, 0], spin = [0, 0, 1] },
    { position = [0, 2, 0], orientation = { axis = [0, 0, 1], angle = 45 } },
] }

[[particles]]
shape = { kind = "mesh", file = "part.stl" }
count = 3
placement = { kind = "cluster", spread = 0.5, centres = [[0, 0, 0], [1, 1, 1]] }
orientation = { axis = [0, 0, 1], angle = 45 }
velocity = { kind = "outward", speed = 2 }
spin = { kind = "uniform", speed = 3 }
colour = "#ff8800"

[[contact]]
between = ["two", "walls"]
restitution = 0.7
friction = 0.1

[[contact]]
between = ["two", "two"]
static_friction = 0.6

[solver]
broad_phase = "grid"
time_step = 0.001

[movie]
fps = 25
resolution = [640, 480]
background = "white"

speed = 0.5
quality = "high"
fade = 0.2
crf = 28

[show]
cells = true
box = true
legend = true
readout = ["time", "broad phases"]
"""


@pytest.fixture
def everything(tmp_path):
    path = tmp_path / "everything.toml"
    path.write_text(EVERYTHING)
    (tmp_path / "part.stl").touch()
    return path


def test_shorthands_stand_for_tables():
    table = {"size": [1, 1, 1], "boundary": "periodic"}
    group = {"shape": "cube", "count": 1, "size": 0.2, "velocity": [1, 0, 0], "spin": "rest", "placement": "lattice"}
    scene = Scene(world=table, particles=[group], solver={"broad_phase": "grid"}, camera="orbit")
    assert scene.world.boundary == ("periodic",) * 3
    assert scene.particles[0].shape == PolyhedronShape(kind="cube")
    assert scene.particles[0].size == FixedSize(kind="fixed", value=0.2)
    assert scene.particles[0].velocity == FixedVelocity(kind="fixed", vector=(1.0, 0.0, 0.0))
    assert (scene.particles[0].placement.kind, scene.camera.kind) == ("lattice", "orbit")
    assert scene.solver == Solver(broad_phase=Grid(kind="grid"))


def test_a_scene_from_a_file_equals_one_from_python(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text('[world]\nsize = [1, 1, 1]\n[[particles]]\nshape = "cube"\ncount = 2\nsize = 0.2\n')
    of_dicts = ps.Scene(world={"size": (1, 1, 1)}, particles=[{"shape": "cube", "count": 2, "size": 0.2}])
    size = FixedSize(kind="fixed", value=0.2)
    of_models = ps.Scene(
        world=World(size=(1.0, 1.0, 1.0)), particles=[Group(shape=PolyhedronShape(kind="cube"), count=2, size=size)]
    )
    of_arrays = ps.Scene(
        world={"size": np.ones(3)}, particles=[{"shape": "cube", "count": np.int64(2), "size": np.float64(0.2)}]
    )
    assert ps.load_scene(path) == of_dicts == of_models == of_arrays
    assert of_dicts != of_dicts.model_copy(update={"seed": 1})


@pytest.mark.parametrize("path", SCENES, ids=lambda p: p.stem)
def test_scenes_survive_the_way_through_json(path):
    scene = ps.load_scene(path)
    assert Scene.model_validate_json(scene.model_dump_json()) == scene


def test_capsules_and_roundings_are_read(everything):
    assert ps.load_scene(everything).particles[1].shape.rounding == 0.25
    groups = [
        {"shape": shape, "count": 1}
        for shape in ({"kind": "capsule", "length": 2}, {"kind": "tetrahedron", "rounding": 0.5}, "cube", "pyramid")
    ]
    capsule, tetrahedron, cube, pyramid = (
        g.shape for g in ps.Scene(world={"size": (9, 9, 9)}, particles=groups).particles
    )
    assert (capsule.kind, capsule.length) == ("capsule", 2.0)
    assert [shape.rounding for shape in (tetrahedron, cube, pyramid)] == [0.5, 0.0, 0.0]


def test_everything_survives_the_way_through_json(everything):
    scene = ps.load_scene(everything)
    assert scene.number == 106
    assert Scene.model_validate_json(scene.model_dump_json()) == scene


def test_paths_start_at_the_folder_of_the_scene_file(everything, monkeypatch):
    monkeypatch.chdir("/")
    assert ps.load_scene(everything).particles[2].shape.file == everything.parent / "part.stl"
    monkeypatch.chdir(everything.parent)
    scene = ps.Scene(world={"size": [1, 1, 1]}, particles=[{"shape": {"kind": "mesh", "file": "part.stl"}, "count": 1}])
    assert scene.particles[0].shape.file == Path("part.stl")


def test_a_mark_of_the_encoding_is_no_error(tmp_path):
    path = tmp_path / "notepad.toml"
    path.write_text('[world]\r\nsize = [1, 1, 1]\r\n[[particles]]\r\nshape = "cube"\r\ncount = 2\r\n', "utf-8-sig")
    assert ps.load_scene(path).number == 2


def test_the_first_frame_is_at_zero_and_the_last_at_the_end():
    scene = parse_scene({"world": {"size": [1, 1, 1]}, "particles": [{"shape": "sphere", "count": 0}], "duration": 2})
    assert scene.frames == 61


def test_a_slow_movie_has_more_frames_of_the_same_time():
    table = {"world": {"size": [1, 1, 1]}, "particles": [{"shape": "sphere", "count": 0}], "duration": 2.0}
    slow = Scene(**table, movie={"fps": 25, "speed": 0.1})
    assert (slow.frames, slow.time_of(250), slow.frame_at(1.0), slow.frame_at(1.003)) == (501, 1.0, 250, 250)
    assert (Scene(**table).time_of(7), Scene(**table).frame_at(7 / 30)) == (7 / 30, 7)


def test_the_quality_settles_the_resolution_unless_that_is_given():
    table = {"world": {"size": [1, 1, 1]}, "particles": [{"shape": "sphere", "count": 0}]}
    sizes = {quality: Scene(**table, movie={"quality": quality}).movie.size for quality in ("draft", "normal", "high")}
    assert sizes == {"draft": (640, 360), "normal": (1280, 720), "high": (1920, 1080)}
    assert Scene(**table).movie.size == (1280, 720)
    assert Scene(**table, movie={"quality": "high", "resolution": [64, 128]}).movie.size == (64, 128)


def test_assignments_are_checked():
    scene = ps.Scene(world={"size": [1, 1, 1]}, particles=[{"shape": "cube", "count": 1}])
    scene.solver.time_step = 0.5
    for table, key, value, line in (
        (scene.solver, "time_step", "fast", "time_step = \"fast\": must be 'auto' or a number of seconds above 0"),
        (scene, "duration", -1.0, "duration = -1.0: must be a number of seconds above 0, up to 1e9"),
        (scene, "solver", "octree", 'solver = "octree": must be a table'),
        (scene.world, "size", (1, 2), "size = [1, 2]: must be a list of 3 numbers above 0, [x, y, z]"),
    ):
        with pytest.raises(ps.SceneError) as error:
            setattr(table, key, value)
        assert str(error.value) == line


# ---- the schema ---------------------------------------------------------------------------------------------------


def accepts(schema, value, root):
    """Whether a JSON Schema, of the words that ours uses, accepts a value."""
    if "$ref" in schema:
        return accepts(root["$defs"][schema["$ref"].rsplit("/", 1)[1]], value, root)
    if any(key in schema for key in ("anyOf", "oneOf")):
        return any(accepts(s, value, root) for s in schema.get("anyOf", schema.get("oneOf")))
    if "const" in schema or "enum" in schema:
        return value in schema.get("enum", [schema.get("const")])
    types = {"object": dict, "array": list, "string": str, "boolean": bool, "null": type(None)}
    kind = schema["type"]
    if kind in ("number", "integer"):
        if isinstance(value, bool) or not isinstance(value, int | float):
            return False
        if kind == "integer" and value != int(value):
            return False
        return value > schema.get("exclusiveMinimum", -np.inf) and value >= schema.get("minimum", -np.inf)
    if not isinstance(value, types[kind]):
        return False
    if kind == "array":
        parts = schema.get("prefixItems", [schema.get("items", {})] * len(value))
        lengths = schema.get("minItems", 0) <= len(value) <= schema.get("maxItems", len(value))
        return lengths and all(accepts(s, v, root) for s, v in zip(parts, value, strict=False))
    if kind == "object":
        keys = schema["properties"]
        needed = set(schema.get("required", [])) <= set(value)
        return needed and all(key in keys and accepts(keys[key], item, root) for key, item in value.items())
    return True


@pytest.fixture(scope="module")
def schema():
    return json.loads(json.dumps(Scene.model_json_schema()))


def test_the_schema_accepts_what_scene_files_say(schema, everything):
    import tomllib  # noqa: PLC0415

    table = tomllib.loads(EVERYTHING)
    table["particles"][0]["count"] = 100
    assert accepts(schema, table, schema)
    for path in SCENES:
        assert accepts(schema, tomllib.loads(path.read_text()), schema), path


@pytest.mark.parametrize(
    ("place", "good", "bad"),
    [
        (("particles", 0, "shape"), ["cube", {"kind": "box", "edges": [1, 2, 3]}], ["cuba", "box", 3, {"kind": "box"}]),
        (("particles", 0, "size"), [0.2, 2, {"kind": "fixed", "value": 1}], [-1, "0.2", True, {"kind": "uniform"}]),
        (("particles", 0, "velocity"), [[1, 0, 0], "rest", {"kind": "maxwell", "temperature": 1}], [[1, 0], 3]),
        (("particles", 0, "spin"), [[1, 0, 0], "rest"], [[1, 0], {"kind": "outward", "speed": 1}]),
        (("particles", 0, "placement"), ["random", "lattice", {"kind": "cluster", "spread": 1}], ["cluster", 1]),
        (
            ("particles", 0, "orientation"),
            ["random", "aligned", [1, 0, 0, 0], {"axis": [0, 0, 1], "angle": 3}],
            ["up", [1, 0, 0]],
        ),
        (("world", "boundary"), ["wall", ["wall", "open", "periodic"]], ["wal", ["wall", "open"]]),
        (("solver", "broad_phase"), ["octree", "grid", "naive", {"kind": "grid", "cells": 4}], ["tree", 4]),
        (("solver", "time_step"), ["auto", 0.1], ["fast", 0, -1]),
        (("show",), [{"readout": True}, {"readout": ["time", "speed"]}, {}], [{"readout": "on"}, {"readout": ["tme"]}]),
        (("particles", 0, "count"), [0, 5], [-1, "5", True, 2.5]),
        (
            ("camera",),
            [
                "orbit",
                {"kind": "fixed", "zoom": 2},
                {"kind": "look-at", "position": [1, 2, 3]},
                {"kind": "path", "keys": [{"time": 0, "position": [1, 2, 3]}]},
            ],
            ["look-at", 1, "path", {"kind": "path", "keys": [{"time": 0}]}],
        ),
    ],
    ids=lambda value: ".".join(map(str, value)) if isinstance(value, tuple) else None,
)
def test_the_schema_and_the_scene_agree_on_shorthands(schema, place, good, bad):
    for value in [*good, *bad]:
        table = {"world": {"size": [1, 1, 1]}, "particles": [{"shape": "cube", "count": 1}], "solver": {}}
        inner = table
        for step in place[:-1]:
            inner = inner[step]
        inner[place[-1]] = value
        assert accepts(schema, table, schema) == (value in good), value
        if value in good:
            Scene(**table)
        else:
            with pytest.raises(ps.SceneError):
                Scene(**table)
