"""Meshes and heightfields of scene files: what they are, what is wrong with them, and what they look like."""

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image
from typer.testing import CliRunner

import particlesim as ps
from particlesim.cli import main as cli
from particlesim.scene.messages import shown
from particlesim.setup.build import build
from particlesim.setup.scene_obstacles import obstacles_of
from tests.scene_texts import GOOD, emitter, group, obstacle
from tests.worlds import listed, scene

OPEN_WORLD = {"size": (8, 8, 8), "boundary": "open"}


def among(*groups, obstacles, **settings):
    return scene(*groups, obstacles=list(obstacles), **{**OPEN_WORLD, **settings})


def lands(field, x, y, radius=0.05):
    """How high a small ball that falls onto a field at (x, y) is when it strikes it [m]."""
    ball = listed("sphere", {"position": (x, y, 3.0), "velocity": (0, 0, -1.0)}, size=2 * radius)
    sim = ps.Simulation(among(ball, obstacles=[{"shape": field}], step=0.01))
    below = 3.0
    while not sim.ledger.impacts:
        below = sim.particles.position[0, 2]
        sim.run(duration=0.002)
    return below - radius


@pytest.mark.parametrize("ending", ["npy", "png"])
def test_rows_of_a_heightfield_run_from_far_to_near_and_columns_along_x(ending, tmp_path):
    """A ramp along each axis: black is 0, white is 1, and the size says what that is."""
    file = tmp_path / f"field.{ending}"
    grid = np.linspace(0.0, 1.0, 5)[:, None] * np.ones(7) * 0.5 + np.linspace(0.0, 1.0, 7) * 0.25
    if ending == "npy":
        np.save(file, grid)
    else:
        Image.fromarray(np.rint(65535 * grid).astype(np.uint16)).save(file)
    field = {"kind": "heightfield", "file": file, "size": (4.0, 2.0, 2.0)}
    # The first row is at y = 1, so the ramp of rows falls with y.
    for x, y in [(-1.5, 0.7), (1.3, 0.7), (1.3, -0.7), (0.0, 0.0)]:
        expected = 2.0 * (0.5 * (0.5 - 0.5 * y) + 0.25 * (0.5 + x / 4.0))
        # The ball touches a slope beside its lowest point: a little sooner.
        assert lands(field, x, y) == pytest.approx(expected, abs=0.02)


def test_a_picture_of_eight_bits_is_as_bright_as_it_is(tmp_path):
    file = tmp_path / "field.png"
    Image.fromarray(np.full((3, 3), 51, dtype=np.uint8)).save(file)
    (field,) = obstacles_of(
        among(
            listed("sphere", {"position": (0, 0, 3)}),
            obstacles=[{"shape": {"kind": "heightfield", "file": file, "size": (1, 1, 10)}}],
        )
    )
    np.testing.assert_allclose(field.shape.vertices[:, 2], 2.0, rtol=1e-12)


def test_a_mesh_of_an_obstacle_is_what_it_is_and_not_its_hull(tmp_path):
    """In the hollow of a bowl there is room; its unit and scale say how large it is."""
    bowl = trimesh.creation.icosphere(subdivisions=3)
    bowl.update_faces(bowl.triangles_center[:, 2] < 0.0)
    bowl.export(tmp_path / "bowl.stl")
    shape = {"kind": "mesh", "file": tmp_path / "bowl.stl", "unit": "cm", "scale": 200.0}
    ball = listed("sphere", {"position": (0, 0, -1.0)}, size=0.5)
    sim = ps.Simulation(among(ball, obstacles=[{"shape": shape}]))
    (made,) = sim.model.obstacle_shapes
    np.testing.assert_allclose(np.linalg.norm(made.vertices, axis=1), 2.0, rtol=1e-6)
    assert len(made.triangles) == len(bowl.faces)
    with pytest.raises(ps.SceneError, match=r"starts 0\.[01]\d* m inside obstacles\[0\]"):
        ps.Simulation(among(listed("sphere", {"position": (0, 0, -1.85)}, size=0.5), obstacles=[{"shape": shape}]))


def test_random_particles_are_put_beside_the_triangles_of_a_mesh(tmp_path):
    np.save(tmp_path / "field.npy", np.random.default_rng(1).random((9, 9)))
    field = {
        "shape": {"kind": "heightfield", "file": tmp_path / "field.npy", "size": (2, 2, 1)},
        "position": (0, 0, -0.5),
    }
    crowd = {"shape": "cube", "count": 80, "size": 0.12}
    model = build(among(crowd, obstacles=[field], size=(2, 2, 2), boundary="wall"))
    assert len(model.particles) == 80


def test_a_crowd_is_pushed_apart_out_of_the_triangles_of_a_mesh(tmp_path):
    """Above what random insertion reaches: none is in a triangle in the end, nor in another."""
    np.save(tmp_path / "field.npy", np.random.default_rng(1).random((9, 9)))
    field = {"shape": {"kind": "heightfield", "file": tmp_path / "field.npy", "size": (2, 2, 0.4)}}
    crowd = {"shape": "sphere", "count": 650, "size": 0.2}
    sim = ps.Simulation(among(crowd, obstacles=[field], size=(2, 2, 2), boundary="wall"))
    assert len(sim.particles.mass) == 650
    assert sim.largest_overlap() < 1e-12


# ---- what is wrong with them -----------------------------------------------------------------------------------------


def surface(name, **keys):
    more = "".join(f", {key} = {value}" for key, value in keys.items())
    return GOOD + f'[[obstacles]]\nshape = {{ kind = "mesh", file = "{name}"{more} }}\n'


def field(name):
    return GOOD + f'[[obstacles]]\nshape = {{ kind = "heightfield", file = "{name}", size = [2, 2, 1] }}\n'


def write_all(folder):
    """Files that are no meshes and no heights."""
    (folder / "empty.stl").write_bytes(b"")
    (folder / "words.stl").write_text(
        "not a mesh at all, but quite a few words, enough for a header of eighty bytes or more"
    )
    points = np.array([(0.0, 0, 0), (1, 0, 0), (2, 0, 0)])
    (folder / "line.obj").write_text("".join(f"v {x} {y} {z}\n" for x, y, z in points) + "f 1 2 3\n")
    (folder / "nan.obj").write_text("v 0 0 0\nv 1 0 nan\nv 0 1 0\nf 1 2 3\n")
    (folder / "folder.stl").mkdir()
    np.save(folder / "cube.npy", np.zeros((2, 2, 2)))
    np.save(folder / "words.npy", np.array([["a", "b"], ["c", "d"]]))
    np.save(folder / "nan.npy", np.full((2, 2), np.nan))
    (folder / "not.npy").write_text("no array")
    (folder / "not.png").write_text("no picture")
    (folder / "field.txt").write_text("0 1")


BROKEN = [
    (surface("none.stl"), 'shape.file = "none.stl": no such file'),
    (surface("x" * 3000), f'shape.file = "{"x" * 56}...: no such file'),
    (surface("folder.stl"), 'shape.file = "folder.stl": is a folder'),
    (surface("empty.stl"), 'shape.file = "empty.stl": is empty'),
    (surface("words.stl"), 'shape.file = "words.stl": truncated, or not a mesh'),
    (surface("line.obj"), 'shape.file = "line.obj": none of its triangles has an area'),
    (surface("nan.obj"), 'shape.file = "nan.obj": holds numbers that are not finite'),
    (surface("empty.stl", scale=0), "shape.scale = 0: must be a number above 0"),
    (surface("empty.stl", rounding=0.1), "shape.rounding = 0.1: unknown key; allowed: kind, file, unit, scale"),
    (field("none.npy"), 'shape.file = "none.npy": no such file'),
    (field("field.txt"), 'shape.file = "field.txt": must be an NPY or PNG file'),
    (field("cube.npy"), 'shape.file = "cube.npy": must hold rows and columns of heights, 2 at least, not 2 x 2 x 2'),
    (field("words.npy"), 'shape.file = "words.npy": must hold an array of numbers'),
    (field("nan.npy"), 'shape.file = "nan.npy": holds numbers that are not finite'),
    (field("not.npy"), 'shape.file = "not.npy": is no numpy array, or damaged'),
    (field("not.png"), 'shape.file = "not.png": is no PNG picture, or damaged'),
]


@pytest.mark.parametrize(("text", "line"), [pytest.param(*case, id=case[1][:50]) for case in BROKEN])
def test_a_mesh_that_is_none_is_said_to_be_in_one_line(text, line, tmp_path, monkeypatch):
    folder = tmp_path / "scenes"
    folder.mkdir()
    write_all(folder)
    (folder / "scene.toml").write_text(text)
    monkeypatch.chdir(folder)
    with pytest.raises(ps.SceneError) as caught:
        ps.Simulation(ps.load_scene("scene.toml"))
    said = str(caught.value).removeprefix("scene.toml: ")
    assert said.startswith(f"obstacles[0].{line}") and "\n" not in said


# Everything of a scene that names a file.
_MESH = '{ kind = "mesh", file = "%s" }'
_COMPOUND = '{ kind = "compound", parts = [{ shape = ' + _MESH + " }] }"
NAMES = {
    "particles[0].shape.file": group(shape=_MESH),
    "particles[0].shape.file (decompose)": group(shape=_MESH.replace(" }", ", decompose = true }")),
    "particles[0].shape.parts[0].shape.file": group(shape=_COMPOUND),
    "emitters[0].shape.file": emitter(shape=_MESH),
    "obstacles[0].shape.file": obstacle(_MESH),
    "obstacles[0].shape.file (heightfield)": obstacle('{ kind = "heightfield", file = "%s", size = [1, 1, 1] }'),
    "obstacles[0].shape.parts[0].shape.file": obstacle(_COMPOUND),
}


@pytest.mark.parametrize(("key", "text"), NAMES.items())
@pytest.mark.parametrize("way", ["../beside.stl", "../scenes-of-others/beside.stl", "link.stl", "none", "absolute"])
def test_a_scene_file_names_no_file_outside_its_folder(key, text, way, tmp_path, monkeypatch):
    """There or not; not even by a link. What Python says may be anywhere."""
    for folder in ("scenes/more", "scenes-of-others"):
        (tmp_path / folder).mkdir(parents=True)
    for file in ("beside.stl", "scenes-of-others/beside.stl", "scenes/more/inside.stl"):
        trimesh.creation.box().export(tmp_path / file)
    monkeypatch.chdir(tmp_path / "scenes")
    Path("link.stl").symlink_to("../beside.stl")
    way = {"none": "../../none.stl", "absolute": str(tmp_path / "beside.stl")}.get(way, way)
    Path("scene.toml").write_text(text % way)
    line = f"scene.toml: {key.split(' ')[0]} = {shown(way)}: is outside the folder of the file that names it"
    with pytest.raises(ps.SceneError, match=f"^{re.escape(line)}$"):
        ps.load_scene("scene.toml")
    for inside in ("more/inside.stl", "../scenes/more/inside.stl", str(tmp_path / "scenes/more/inside.stl")):
        Path("scene.toml").write_text(text % inside)
        ps.load_scene("scene.toml")
    if way != "../../none.stl":
        ps.Scene(**tomllib.loads(text % way))


def test_check_says_what_is_odd_about_a_mesh(tmp_path):
    """A box in millimetres without its lid, with one triangle twice, in a world of 4 m."""
    box = trimesh.creation.box((1000.0, 800.0, 600.0))
    faces = box.faces[box.face_normals[:, 2] < 0.5]
    box = trimesh.Trimesh(box.vertices, np.concatenate([faces, faces[:1]]), process=False)
    box.export(tmp_path / "box.stl")
    (tmp_path / "scene.toml").write_text(surface("box.stl") + 'name = "box"\n')
    told = CliRunner().invoke(cli.app, ["check", str(tmp_path / "scene.toml")])
    assert told.exit_code == 0
    for line in (
        "10 triangles, 1e+03 x 800 x 600 m",
        "triangles that are there twice, left out once: 1",
        "holes or borders, where the surface ends: 1",
        "250 times as large as the world: is its file in the unit that its shape says?",
    ):
        assert line in " ".join(told.output.replace("│", " ").split())


# ---- what they look like ---------------------------------------------------------------------------------------------


def picture(what, path):
    ps.still(what, path, time=0.0)
    return np.asarray(Image.open(path)).astype(int)


def test_a_mesh_looks_like_the_body_that_it_encloses(tmp_path):
    """A box as triangles and as a box: the same but for its rims and the borders of shadows; through it, too."""
    trimesh.creation.box((2.0, 1.5, 1.0)).export(tmp_path / "box.stl")
    ball = listed("sphere", {"position": (1, 2, 0)}, {"position": (-2, 0.5, 1)})
    view = {"movie": {"resolution": [320, 192]}, "show": {"readout": False}}
    turned = {"orientation": {"axis": [1, 2, 3], "angle": 50}, "colour": "steelblue"}
    for opacity in (1.0, 0.4):
        shapes = {"kind": "mesh", "file": tmp_path / "box.stl"}, {"kind": "box", "edges": [2.0, 1.5, 1.0]}
        scenes = [among(ball, obstacles=[{"shape": s, "opacity": opacity, **turned}], **view) for s in shapes]
        one, other = (picture(what, tmp_path / f"{k}.png") for k, what in enumerate(scenes))
        nothing = picture(among(ball, obstacles=[], **view), tmp_path / "none.png")
        assert (np.abs(one - other).max(axis=2) > 24).mean() < 0.01
        assert (np.abs(one - nothing).max(axis=2) > 24).mean() > 0.04


def test_a_sheet_is_seen_from_both_sides_and_is_not_in_its_own_shadow(tmp_path):
    np.save(tmp_path / "flat.npy", np.zeros((20, 20)))
    ball = listed("sphere", {"position": (1.9, -1.9, 0)}, size=0.01)
    view = {"movie": {"resolution": [320, 192]}, "show": {"readout": False, "box": False}, "size": (4, 4, 4)}
    shape = {"kind": "heightfield", "file": tmp_path / "flat.npy", "size": (3, 3, 1)}
    for height in (5.0, -5.0):
        camera = {"kind": "look-at", "position": [0.1, 0.1, height], "target": [0, 0, 0]}
        what = among(ball, obstacles=[{"shape": shape, "colour": "#c03020"}], camera=camera, **view)
        seen = picture(what, tmp_path / f"{height}.png")
        middle = seen[60:132, 120:200].reshape(-1, 3)
        # Red, and evenly so: no stripes of shadow, no lines between triangles.
        assert (middle[:, 0] > 1.5 * middle[:, 1]).all()
        assert np.ptp(middle, axis=0).max() <= 12


def test_a_trajectory_keeps_its_meshes(tmp_path):
    """It is drawn as the scene is, though the file is gone."""
    trimesh.creation.torus(1.0, 0.3).export(tmp_path / "ring.stl")
    spin = {"kind": "spin", "axis": [1, 0, 0], "rate": 2.0}
    ring = {"shape": {"kind": "mesh", "file": tmp_path / "ring.stl"}, "motion": spin}
    view = {"movie": {"resolution": [160, 96]}, "show": {"readout": False}, "duration": 0.1}
    what = among(listed("sphere", {"position": (2, 2, 0)}), obstacles=[ring], **view)
    a = picture(what, tmp_path / "a.png")
    ps.simulate(what, tmp_path / "run.gsd")
    (tmp_path / "ring.stl").unlink()
    ps.still(tmp_path / "run.gsd", tmp_path / "b.png", time=0.0)
    b = np.asarray(Image.open(tmp_path / "b.png")).astype(int)
    assert (np.abs(a - b).max(axis=2) > 8).mean() < 0.01
