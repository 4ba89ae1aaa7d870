"""Runs in the formats of other programs, read back by libraries that are not ours."""

import resource
import sys
import xml.etree.ElementTree as ET

import ase.io
import meshio
import numpy as np
import pygltflib
import pytest
import trimesh
from pxr import Usd, UsdGeom
from typer.testing import CliRunner

import particlesim as ps
from particlesim.cli import main as cli
from particlesim.core.rotations import rotations_of
from particlesim.geometry.shapes import CATALOGUE
from particlesim.geometry.surface import surface_of
from particlesim.jobs import figures
from particlesim.simulation.simulation import Simulation
from particlesim.trajectory.export import Exported, ExportError
from particlesim.trajectory.export.gltf import MAX_PARTICLES, write_glb
from tests.worlds import gas, scene


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """The frames of a gas of four shapes, and the folder its exports are in."""
    folder = tmp_path_factory.mktemp("export")
    periodic = gas(3, boundary="periodic", duration=0.1)
    ps.simulate(periodic, folder / "run.gsd")
    for ending in ("pvd", "glb", "usda", "xyz"):
        ps.export(folder / "run.gsd", folder / f"run.{ending}")
    with ps.open(folder / "run.gsd") as trajectory:
        return folder, trajectory.header, list(trajectory)


class TestSurfaces:
    @pytest.mark.parametrize(
        "shape",
        [
            CATALOGUE["sphere"](),
            CATALOGUE["capsule"](length=2.0),
            CATALOGUE["pyramid"](),
            CATALOGUE["box"](edges=[1.0, 0.7, 0.4]),
            CATALOGUE["cube"](rounding=0.2),
        ],
        ids=lambda shape: f"{shape.name} {shape.rounding}",
    )
    def test_it_is_closed_and_holds_the_volume(self, shape):
        surface = surface_of(shape)
        mesh = trimesh.Trimesh(surface.vertices, surface.triangles, process=False)
        mesh.merge_vertices(merge_norm=True)
        assert mesh.is_watertight
        if shape.rounding:  # corners on a round surface enclose less: of a ball of 162 corners 4 %
            assert 0.95 * shape.volume < mesh.volume < shape.volume
        else:
            assert mesh.volume == pytest.approx(shape.volume, rel=1e-12)
        np.testing.assert_allclose(np.linalg.norm(surface.normals, axis=1), 1.0, rtol=1e-12)
        corners = surface.vertices[surface.triangles]
        out = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        assert (np.einsum("ij,ikj->ik", out, surface.normals[surface.triangles]) > 0.0).all()


def test_xyz_is_read_by_ase(run):
    folder, header, frames = run
    read = ase.io.read(folder / "run.xyz", index=":")
    assert len(read) == len(frames)
    for atoms, frame in zip(read, frames, strict=True):
        np.testing.assert_allclose(atoms.positions, frame.position, rtol=1e-8, atol=1e-12)
        np.testing.assert_allclose(np.roll(atoms.arrays["orientation"], 1, axis=1), frame.orientation, rtol=1e-7)
        np.testing.assert_allclose(atoms.arrays["radius"], header.radius, rtol=1e-8)
        np.testing.assert_array_equal(atoms.arrays["id"], frame.ids)
        assert atoms.info["Time"] == frame.time
        assert atoms.cell.lengths().tolist() == [2.5, 2.5, 2.5] and atoms.pbc.all()


def test_vtk_is_read_by_meshio(run):
    folder, header, frames = run
    series = ET.parse(folder / "run.pvd").getroot().findall("Collection/DataSet")
    assert [float(entry.get("timestep")) for entry in series] == [frame.time for frame in frames]
    for entry, frame in zip(series, frames, strict=True):
        points = meshio.read(folder / entry.get("file"))
        np.testing.assert_array_equal(points.points, frame.position)
        assert points.cells[0].type == "vertex" and len(points.cells[0]) == len(frame.position)
        expected = {"size": header.size, "shape": header.shape, "mass": header.mass, "impacts": frame.impacts}
        for name, values in {**expected, "orientation": frame.orientation, "velocity": frame.velocity}.items():
            np.testing.assert_array_equal(points.point_data[name].reshape(values.shape), values)
    for number, shape in enumerate(header.shapes):
        glyph = meshio.read(folder / f"run/shape_{number}.vtu")
        solid = trimesh.Trimesh(glyph.points, glyph.cells_dict["triangle"])
        assert solid.volume == pytest.approx(shape.volume, rel=0.05)


def test_gltf_is_read_by_trimesh(run):
    """In its scene everything is where the first frame has it, with y up."""
    folder, header, frames = run
    read = trimesh.load_scene(folder / "run.glb")
    assert len(read.graph.nodes_geometry) == len(header.shape)
    for k in range(len(header.shape)):
        matrix, _ = read.graph[f"particle {k}"]
        x, y, z = frames[0].position[k]
        np.testing.assert_allclose(matrix[:3, 3], [x, z, -y], atol=1e-6)
        turned = rotations_of(frames[0].orientation[k]).as_matrix() * header.size[k]
        np.testing.assert_allclose(matrix[:3, :3], turned[[0, 2, 1]] * [[1], [1], [-1]], atol=1e-6)


def test_the_animation_is_read_by_pygltflib(run):
    folder, header, frames = run
    tree = pygltflib.GLTF2().load(str(folder / "run.glb"))

    def numbers(accessor):
        said = tree.accessors[accessor]
        start = tree.bufferViews[said.bufferView].byteOffset
        wide = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[said.type]
        return np.frombuffer(tree.binary_blob(), np.float32, said.count * wide, start).reshape(said.count, wide)

    (animation,) = tree.animations
    assert len(animation.channels) == 2 * len(header.shape)
    for channel in animation.channels:
        sampler, k = animation.samplers[channel.sampler], channel.target.node
        np.testing.assert_allclose(numbers(sampler.input)[:, 0], [frame.time for frame in frames], rtol=1e-6)
        if channel.target.path == "translation":
            known = np.array([frame.position[k] for frame in frames])
            crosses = any((frame.image[k] != frames[0].image[k]).any() for frame in frames)
            assert sampler.interpolation == ("STEP" if crosses else "LINEAR")
        else:
            known = np.array([np.roll(frame.orientation[k], -1) for frame in frames])
        np.testing.assert_allclose(numbers(sampler.output), known, atol=1e-6)


def test_usd_is_read_by_its_library(run):
    folder, header, frames = run
    stage = Usd.Stage.Open(str(folder / "run.usda"))
    assert UsdGeom.GetStageUpAxis(stage) == "Z" and UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    instancer = UsdGeom.PointInstancer(stage.GetPrimAtPath("/Run/Particles"))
    for frame in frames:
        code = frame.time * stage.GetTimeCodesPerSecond()
        assert code == pytest.approx(round(code), abs=1e-9)
        matrices = instancer.ComputeInstanceTransformsAtTime(code, code)
        for k, matrix in enumerate(np.array(matrices)):
            np.testing.assert_allclose(matrix[3, :3], frame.position[k], atol=1e-6)
            turned = rotations_of(frame.orientation[k]).as_matrix() * header.size[k]
            np.testing.assert_allclose(matrix[:3, :3].T, turned, atol=2e-3 * header.size[k])


def test_what_comes_and_goes(tmp_path):
    """Of an emitter: no entries before, but for glTF, whose nodes have size 0 until then."""
    region = {"lower": [-0.5, -0.5, 1], "upper": [0.5, 0.5, 1.5]}
    coming = {"shape": "sphere", "size": 0.1, "count": 5, "rate": 20.0, "region": region, "velocity": [0, 0, -1]}
    flowing = scene(emitters=[coming], size=(4, 4, 4), boundary="open", duration=0.4)
    ps.simulate(flowing, tmp_path / "run.gsd")
    with ps.open(tmp_path / "run.gsd") as trajectory:
        ids = [frame.ids.tolist() for frame in trajectory]
        codes = [frame.time / flowing.time_of(1) for frame in trajectory]
    assert len(ids[0]) < len(ids[-1]) == 5
    for ending in ("xyz", "glb", "usda"):
        ps.export(tmp_path / "run.gsd", tmp_path / f"x.{ending}")
    assert [atoms.arrays["id"].tolist() for atoms in ase.io.read(tmp_path / "x.xyz", index="1:")] == ids[1:]
    stage = Usd.Stage.Open(str(tmp_path / "x.usda"))
    instancer = UsdGeom.PointInstancer(stage.GetPrimAtPath("/Run/Particles"))
    assert [list(instancer.GetIdsAttr().Get(code) or []) for code in codes] == ids
    nodes = pygltflib.GLTF2().load(str(tmp_path / "x.glb")).nodes
    assert [node.scale[0] > 0.0 for node in nodes[:5]] == [k in ids[0] for k in range(5)]


def test_too_many_for_gltf(tmp_path):
    many = scene({"shape": "sphere", "count": MAX_PARTICLES + 1, "size": 0.1})
    header = Simulation(many).header
    with pytest.raises(
        ExportError, match=r"x\.glb: 5,001 particles; \.glb takes up to 5,000, \.usda and \.pvd any number"
    ):
        write_glb(tmp_path / "x.glb", Exported(many, header, [], np.zeros((len(header.shape), 3))))
    assert not list(tmp_path.iterdir())


class TestCommand:
    def run(self, *arguments):
        return CliRunner().invoke(cli.app, ["export", *map(str, arguments)])

    def test_it_says_what_it_wrote(self, run, tmp_path):
        done = self.run(run[0] / "run.gsd", "-o", tmp_path / "x.pvd")
        assert (done.exit_code, done.stdout) == (0, f"{tmp_path}/x.pvd\n{tmp_path}/x\n")

    @pytest.mark.parametrize(
        ("output", "line"),
        [
            ("x.obj", "x.obj: the output must end in .pvd, .glb, .usda or .xyz"),
            ("none/x.xyz", "none/x.xyz: there is no folder none"),
        ],
    )
    def test_wrong_output_has_one_line(self, run, tmp_path, monkeypatch, output, line):
        monkeypatch.chdir(tmp_path)
        done = self.run(run[0] / "run.gsd", "-o", output)
        assert (done.exit_code, done.stdout, done.stderr) == (2, "", line + "\n")
        assert not list(tmp_path.iterdir())

    @pytest.mark.parametrize("other", ["file", "folder"])
    def test_what_is_not_of_the_series_stays(self, run, tmp_path, other):
        there = tmp_path / "x"
        there.mkdir() if other == "folder" else there.write_text("mine")
        done = self.run(run[0] / "run.gsd", "-o", tmp_path / "x.pvd")
        assert done.exit_code == 2 and done.stderr.startswith(f"{tmp_path}/x.pvd: its frames go to a folder {there}, ")
        assert list(tmp_path.iterdir()) == [there]

    def test_a_series_takes_the_place_of_a_former_one_as_a_whole(self, run, tmp_path):
        (tmp_path / "x").mkdir()
        (tmp_path / "x/frame_99999.vtu").touch()
        (tmp_path / "x.pvd").touch()
        assert self.run(run[0] / "run.gsd", "-o", tmp_path / "x.pvd").exit_code == 0
        assert sorted(file.name for file in tmp_path.iterdir()) == ["x", "x.pvd"]
        assert not (tmp_path / "x/frame_99999.vtu").exists()

    def test_without_usd_it_is_said_how_to_get_it(self, run, tmp_path, monkeypatch):
        monkeypatch.setitem(sys.modules, "pxr.Usd", None)
        done = self.run(run[0] / "run.gsd", "-o", tmp_path / "x.usda")
        assert done.stderr == "usd-core is not installed; pip install 'particlesim[usd]' does it\n"
        assert done.exit_code == 1 and not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["x.pvd", "x.glb", "x.xyz", "x.html", "x.svg"])
def test_what_does_not_fit_is_told_of_the_output_and_leaves_nothing(run, tmp_path, name):
    make = {".html": ps.view, ".svg": figures.plot}.get(name[1:], ps.export)
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, limits[1]))
    try:
        with pytest.raises(OSError, match="File too large") as error:
            make(run[0] / "run.gsd", tmp_path / name)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert error.value.filename == str(tmp_path / name) and not list(tmp_path.iterdir())


def test_some_frames_only(run, tmp_path):
    """Of a trajectory those that are asked for, of a scene the same ones, which it is simulated for."""
    folder, _, stored = run
    expected = [stored[k].time for k in (1, 3)]
    with ps.open(folder / "run.gsd") as whole:
        ps.export(whole.scene, tmp_path / "scene.xyz", frames=range(1, 4, 2))
    ps.export(folder / "run.gsd", tmp_path / "run.xyz", frames=range(1, 4, 2))
    for name in ("scene.xyz", "run.xyz"):
        assert [float(atoms.info["Time"]) for atoms in ase.io.read(tmp_path / name, ":")] == expected
    asked = ["export", str(folder / "run.gsd"), "-q", "-o", str(tmp_path / "asked.xyz")]
    assert CliRunner().invoke(cli.app, [*asked, "--frames", "1:", "--every", "2"]).exit_code == 0
    assert (tmp_path / "asked.xyz").read_bytes() == (tmp_path / "run.xyz").read_bytes()


def test_frames_that_are_not_there(run, tmp_path):
    asked = ["export", str(run[0] / "run.gsd"), "-o", str(tmp_path / "x.xyz"), "--frames", "9:"]
    done = CliRunner().invoke(cli.app, asked)
    assert (done.exit_code, done.stderr) == (2, "--frames 9:: there are none; the frames are 0 to 3\n")
    with pytest.raises(ValueError, match="frames must be some of 0 to 3, not"):
        ps.export(run[0] / "run.gsd", tmp_path / "x.xyz", frames=range(9, 10))
    assert not list(tmp_path.iterdir())
