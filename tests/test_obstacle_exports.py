"""Obstacles in the formats of other programs and in pages: what they look like, and where they are at each time.

Where they should be is their motion in closed form; files are read back by libraries that are not ours.
"""

import xml.etree.ElementTree as ET

import meshio
import numpy as np
import pygltflib
import pytest
import trimesh
from pxr import Usd, UsdGeom
from scipy.spatial.transform import Rotation

import particlesim as ps
from tests.browser import CHROMIUM, Browser
from tests.test_view import PIXEL, VIEWER, unpacked
from tests.worlds import listed, scene

TURNED = {"axis": [0, 0, 1], "angle": 30}
ARM = {
    "name": "arm",
    "shape": {"kind": "box", "edges": [1.0, 0.2, 0.3]},
    "size": 2.0,
    "position": [2.0, 0, 0],
    "motion": {"kind": "spin", "axis": [0, 0, 2], "rate": 2.0, "centre": [1.0, 0, 0]},
    "colour": "#ff8000",
}
CUBE = {"shape": "cube", "size": 0.5, "position": [-2, 0, 1], "orientation": TURNED, "opacity": 0.25, "colour": "lime"}
HIDDEN = {"shape": "sphere", "position": [0, 0, -3], "opacity": 0}
SLAB = {"shape": {"kind": "plane", "normal": [0, 0, 1]}, "position": [0, 0, -4], "name": "ground"}
L = {
    "kind": "compound",
    "parts": [{"shape": "cube"}, {"shape": "cube", "position": [1, 0, 0]}, {"shape": "cube", "position": [0, 0, 1]}],
}
CART = {
    "shape": L,
    "position": [0, -3, 0],
    "motion": {"kind": "translate", "velocity": [0, 0, 2], "until": 0.15},
    "opacity": 0.5,
}


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """The folder of the exports of a run among obstacles, and its times."""
    folder = tmp_path_factory.mktemp("obstacles")
    bowl = trimesh.creation.icosphere(subdivisions=2)
    bowl.update_faces(bowl.triangles_center[:, 2] < 0.0)
    bowl.export(folder / "bowl.ply")
    swings = {"kind": "vibrate", "direction": [0, 0, 1], "amplitude": 0.3, "frequency": 2.0}
    shape = {"kind": "mesh", "file": folder / "bowl.ply", "scale": 0.5}
    dish = {"name": "dish", "shape": shape, "position": [0, 3, 0], "motion": swings}
    among = [ARM, CUBE, HIDDEN, SLAB, dish, CART]
    this = scene(listed("sphere", {"position": [0, 0, 3]}), size=(8, 8, 8), duration=0.3, obstacles=among)
    ps.simulate(this, folder / "run.gsd")
    for ending in ("pvd", "glb", "usda", "xyz"):
        ps.export(folder / "run.gsd", folder / f"run.{ending}")
    with ps.open(folder / "run.gsd") as trajectory:
        return folder, [frame.time for frame in trajectory]


def of_box(*edges):
    """The corners of a box about the origin, (8, 3)."""
    return np.stack(np.meshgrid(*([-0.5 * edge, 0.5 * edge] for edge in edges)), axis=-1).reshape(-1, 3)


def corners(folder, number, time):
    """Where the corners of an obstacle are at a time [s], (v, 3)."""
    if number == 0:
        axis, arm = np.array([1.0, 0.0, 0.0]), np.array([1.0, 0.0, 0.0])
        return axis + Rotation.from_rotvec([0, 0, 2.0 * time]).apply(arm + of_box(2.0, 0.4, 0.6))
    if number == 1:
        return np.array([-2, 0, 1]) + Rotation.from_rotvec([0, 0, np.pi / 6]).apply(of_box(0.5, 0.5, 0.5))
    if number == 3:
        return np.array([0, 0, -4.04]) + of_box(8, 8, 0.08)
    if number == 4:
        swing = 0.3 * np.sin(2.0 * np.pi * 2.0 * time)
        return np.array([0, 3, swing]) + 0.5 * trimesh.load(folder / "bowl.ply").vertices
    # The common centroid of three cubes is where it stands.
    parts = [of_box(1, 1, 1) + middle - [1 / 3, 0, 1 / 3] for middle in ([0, 0, 0], [1, 0, 0], [0, 0, 1])]
    return np.array([0, -3, 2.0 * min(time, 0.15)]) + np.concatenate(parts)


def assert_same_points(found, expected, accuracy):
    """Each point of two sets is one of the other."""
    for some, others in ((found, expected), (expected, found)):
        distance = np.linalg.norm(np.asarray(some)[:, None] - np.asarray(others)[None], axis=2)
        assert distance.min(axis=1).max() < accuracy


SEEN = {0: ("arm", "#ff8000", 1.0), 1: ("obstacle 1", "#00ff00", 0.25), 3: ("ground", "#8899aa", 1.0)}
SEEN |= {4: ("dish", "#8899aa", 1.0), 5: ("obstacle 5", "#8899aa", 0.5)}
MOVING = {0, 4, 5}


def bytes_of(colour):
    return [int(colour[k : k + 2], 16) for k in (1, 3, 5)]


def light_of(colour):
    """Linear, as our pictures have it."""
    return (np.array(bytes_of(colour)) / 255.0) ** 2


def test_vtk_is_read_by_meshio(run):
    folder, times = run
    series = ET.parse(folder / "run.pvd").getroot().findall("Collection/DataSet")
    assert [(float(entry.get("timestep")), entry.get("part")) for entry in series] == [
        (time, part) for time in times for part in "012"
    ]
    for entry in series:
        if entry.get("part") == "0":
            continue
        time, grid = float(entry.get("timestep")), meshio.read(folder / entry.get("file"))
        of = grid.cell_data["obstacle"][0].ravel()
        assert set(of) == (MOVING if entry.get("part") == "2" else set(SEEN) - MOVING)
        triangles = grid.cells_dict["triangle"]
        for number in set(of):
            mine = of == number
            assert_same_points(grid.points[triangles[mine].ravel()], corners(folder, number, time), 1e-6)
            assert (grid.cell_data["colour"][0][mine] == bytes_of(SEEN[number][1])).all()
            assert (grid.cell_data["opacity"][0][mine] == SEEN[number][2]).all()
        # All that is closed has its outside outside.
        first, second, third = (grid.points[triangles[:, k]] for k in range(3))
        out = np.einsum(
            "ij,ij->i", np.cross(second - first, third - first), grid.point_data["Normals"][triangles[:, 0]]
        )
        assert (out > 0.0).all()
    assert trimesh.Trimesh(grid.points, triangles[of == 0]).volume == pytest.approx(8 * 0.06, rel=1e-9)


def test_gltf_is_read_by_trimesh(run):
    """As the first frame has them, with y up."""
    folder, _ = run
    read = trimesh.load_scene(folder / "run.glb")
    for number, (name, _, _) in SEEN.items():
        matrix, geometry = read.graph[name]
        x, y, z = trimesh.transform_points(read.geometry[geometry].vertices, matrix).T
        assert_same_points(np.column_stack([x, -z, y]), corners(folder, number, 0.0), 1e-5)


def test_their_animation_is_read_by_pygltflib(run):
    folder, times = run
    tree = pygltflib.GLTF2().load(str(folder / "run.glb"))

    def numbers(accessor):
        said = tree.accessors[accessor]
        start = tree.bufferViews[said.bufferView].byteOffset or 0
        wide = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[said.type]
        return np.frombuffer(tree.binary_blob(), np.float32, said.count * wide, start).reshape(said.count, wide)

    assert [node.name for node in tree.nodes] == ["particle 0", *(name for name, _, _ in SEEN.values()), "run"]
    (animation,) = tree.animations
    paths = {
        (each.target.node, each.target.path): numbers(animation.samplers[each.sampler].output)
        for each in animation.channels
    }
    for node, (number, (_, colour, opacity)) in enumerate(SEEN.items(), 1):
        mesh = tree.meshes[tree.nodes[node].mesh].primitives[0]
        material = tree.materials[mesh.material]
        np.testing.assert_allclose(material.pbrMetallicRoughness.baseColorFactor, [*light_of(colour), opacity])
        assert material.alphaMode == ("OPAQUE" if opacity == 1.0 else "BLEND")
        assert bool(material.doubleSided) == (number == 4)
        assert ((node, "translation") in paths) == ((node, "rotation") in paths) == (number in MOVING)
        if number in MOVING:
            points = numbers(mesh.attributes.POSITION)
            for k, time in enumerate(times):
                there = paths[node, "translation"][k] + Rotation.from_quat(paths[node, "rotation"][k]).apply(points)
                assert_same_points(there, corners(folder, number, time), 1e-5)


def test_usd_is_read_by_its_library(run):
    folder, times = run
    stage = Usd.Stage.Open(str(folder / "run.usda"))
    meshes = [UsdGeom.Mesh(prim) for prim in stage.GetPrimAtPath("/Run/Obstacles").GetChildren()]
    assert [mesh.GetPrim().GetDisplayName() for mesh in meshes] == [name for name, _, _ in SEEN.values()]
    for mesh, (number, (_, colour, opacity)) in zip(meshes, SEEN.items(), strict=True):
        np.testing.assert_allclose(mesh.GetDisplayColorAttr().Get()[0], light_of(colour), rtol=1e-6)
        assert list(mesh.GetDisplayOpacityAttr().Get()) == [opacity]
        assert mesh.GetDoubleSidedAttr().Get() == (number == 4)
        assert mesh.TransformMightBeTimeVarying() == (number in MOVING)
        for time in times:
            matrix = np.array(mesh.ComputeLocalToWorldTransform(time * stage.GetTimeCodesPerSecond()))
            points = np.array(mesh.GetPointsAttr().Get()) @ matrix[:3, :3] + matrix[3, :3]
            assert_same_points(points, corners(folder, number, time), 1e-5)


def test_a_page_holds_them(run):
    folder, times = run
    said, arrays = unpacked(ps.view(folder / "run.gsd").text)
    assert [(each["name"], each["colour"], each["opacity"]) for each in said["obstacles"]] == list(SEEN.values())
    assert [each["two_sided"] for each in said["obstacles"]] == [number == 4 for number in SEEN]
    poses = arrays["obstacle_pose"].reshape(len(times), len(SEEN), 7)
    for k, number in enumerate(SEEN):
        points = arrays[f"obstacle_{k}_position"].reshape(-1, 3)
        for pose, time in zip(poses[:, k], times, strict=True):
            there = pose[:3] + Rotation.from_quat(pose[3:]).apply(points)
            assert_same_points(there, corners(folder, number, time), 1e-5)


PICK = "viewer.pick(window.innerWidth / 2, window.innerHeight / 2); return viewer.particles.picked;"


@pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium")
def test_a_browser_shows_them(tmp_path):
    """A ball in a glass box; a beam that comes between it and the camera at frame 5, and has gone by at frame 10."""
    trimesh.creation.box((1.0, 1.0, 1.0)).export(tmp_path / "box.stl")
    glass = {"shape": {"kind": "mesh", "file": tmp_path / "box.stl"}, "opacity": 0.4, "colour": "lime"}
    # Seen along -x.
    camera = {"kind": "fixed", "azimuth": 0.0, "elevation": 0.0}
    passing = {"shape": {"kind": "box", "edges": [0.2, 0.2, 1.0]}, "position": [1, -1, 0], "colour": "red"}
    passing["motion"] = {"kind": "translate", "velocity": [0, 6, 0]}
    ball = listed("sphere", {"position": [0, 0, 0]}, size=0.5, colour="blue")
    there = scene(ball, size=(3, 3, 3), duration=1 / 3, movie={"fps": 30}, camera=camera, obstacles=[glass, passing])
    ps.view(there, tmp_path / "page.html")
    with Browser(tmp_path / "profile") as browser:
        browser.open(tmp_path / "page.html")
        browser.run(VIEWER)
        pixels = [np.array(browser.run(f"viewer.show({frame}); {PIXEL}"), dtype=float) for frame in (0, 5, 10)]
        assert browser.run(PICK) == 0
        assert browser.errors == []
    (red, green, blue), beam, after = pixels
    assert blue > 2 * red and green > 2 * red  # the ball through the glass
    assert beam[0] > 5 * beam[1] and beam[0] > 5 * beam[2]
    assert (after == pixels[0]).all()
