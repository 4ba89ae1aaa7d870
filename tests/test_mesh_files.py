"""Mesh files: their convex hulls, with the mass properties of the whole; and what is wrong with a file, in one line."""

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

import particlesim as ps
from particlesim.core.constants import POLYHEDRON
from particlesim.geometry import shapes
from particlesim.geometry.mass_properties import mass_properties
from particlesim.geometry.tolerances import MAX_MESH_VERTICES
from tests import oracles


@pytest.mark.parametrize("ending", ["obj", "stl"])
@pytest.mark.parametrize("steps", [15, 32])
def test_a_mesh_with_many_points_on_its_faces_keeps_its_shape(tmp_path, ending, steps):
    """A cube, turned, with a grid of points on each face: in a file's digits no more than a cube."""
    line = np.linspace(-0.5, 0.5, steps + 1)
    grid = np.stack(np.meshgrid(line, line, [-0.5, 0.5], indexing="ij"), axis=-1).reshape(-1, 3)
    points = np.unique(np.concatenate([np.roll(grid, k, axis=1) for k in range(3)]), axis=0)
    # Any triangles will do: what matters is which points the file has.
    corners = trimesh.Trimesh(points, np.arange(3 * len(points)).reshape(-1, 3) % len(points), process=False)
    corners.apply_transform(trimesh.transformations.rotation_matrix(1.0, (1.0, 2.0, 3.0)))
    corners.export(tmp_path / f"cube.{ending}")
    shape = shapes.mesh(tmp_path / f"cube.{ending}")
    assert (len(shape.vertices), len(shape.faces)) == (8, 6)
    assert shape.volume == pytest.approx(1.0, rel=1e-6)
    np.testing.assert_allclose(shape.moments, 1.0 / 6.0, rtol=1e-6)


@pytest.mark.parametrize("ending", ["stl", "obj", "ply"])
def test_a_mesh_file_gives_its_convex_hull(tmp_path, ending):
    solid = trimesh.creation.torus(1.0, 0.4, major_sections=12, minor_sections=6)
    file = tmp_path / f"ring.{ending}"
    solid.export(file)
    shape = shapes.mesh(file)
    hull = solid.convex_hull
    assert shape.name == "ring" and shape.kind == POLYHEDRON
    assert shape.volume == pytest.approx(hull.volume, rel=1e-5) and shape.volume > solid.volume
    np.testing.assert_allclose(np.sort(shape.moments), np.sort(hull.principal_inertia_components), rtol=1e-5)
    assert np.abs(shape.orientation).max() > 0.0 and ps.CATALOGUE["mesh"](file).volume == shape.volume


@pytest.mark.parametrize(
    "solid",
    [trimesh.creation.icosphere(subdivisions=2), trimesh.creation.cylinder(0.5, 1.0, sections=49)],
    ids=["162 corners", "98 corners"],
)
def test_a_mesh_of_more_than_a_hundred_corners_stays_as_it_is(tmp_path, solid):
    solid.export(tmp_path / "mesh.stl")
    shape = shapes.mesh(tmp_path / "mesh.stl")
    corners = 162 if len(solid.vertices) == 162 else 98
    assert len(shape.vertices) == shape.described_corners == corners
    assert shape.volume == pytest.approx(solid.volume, rel=1e-6)
    np.testing.assert_allclose(np.sort(shape.moments), np.sort(solid.principal_inertia_components), rtol=1e-6)


def test_a_mesh_of_thousands_of_corners_is_thinned_and_keeps_its_mass_properties(tmp_path):
    solid = trimesh.creation.icosphere(subdivisions=5, radius=2.0)
    # An egg without symmetry, away from the origin: its centroid and its principal axes must be found.
    solid.vertices = solid.vertices * np.where(solid.vertices > 0.0, (2.0, 1.0, 1.5), 1.0) + (5.0, 6.0, 7.0)
    solid.export(tmp_path / "egg.ply")
    shape = shapes.mesh(tmp_path / "egg.ply")
    assert len(shape.vertices) == MAX_MESH_VERTICES and shape.described_corners == len(solid.vertices) == 10_242
    assert shape.volume == pytest.approx(solid.volume, rel=1e-6)
    np.testing.assert_allclose(np.sort(shape.moments), np.sort(solid.principal_inertia_components), rtol=1e-6)
    # The vertices are corners of the file, about the centroid of the whole and in its axes.
    there = oracles.corners(shape, 1.0, shape.orientation) + solid.center_mass
    distance, _ = cKDTree(solid.vertices).query(there)
    assert distance.max() < 2e-5 * shape.radius  # but for what makes its faces plane
    assert mass_properties(shape.vertices, shape.faces).volume == pytest.approx(solid.volume, rel=2e-3)
    rounded = shapes.mesh(tmp_path / "egg.ply", rounding=0.1)
    assert rounded.volume == pytest.approx(solid.volume + 0.1 * solid.area, rel=0.01)
    assert np.abs(rounded.vertices - shape.vertices).max() < 0.1


@pytest.mark.parametrize(("unit", "metres"), [("m", 1.0), ("cm", 0.01), ("mm", 0.001), ("um", 1e-6), ("in", 0.0254)])
def test_a_mesh_is_in_the_unit_that_is_said(tmp_path, unit, metres):
    trimesh.creation.box((1.0, 2.0, 3.0)).export(tmp_path / "box.stl")
    shape = shapes.mesh(tmp_path / "box.stl", unit=unit)
    np.testing.assert_allclose(shape.volume, 6.0 * metres**3, rtol=1e-14)
    with pytest.raises(ValueError, match="one of m, cm, mm, um, in, not 'foot'"):
        shapes.mesh(tmp_path / "box.stl", unit="foot")


@pytest.mark.parametrize("ending", ["stl", "obj", "ply"])
def test_letters_of_another_encoding_in_names_and_remarks_do_not_matter(tmp_path, ending):
    text = trimesh.creation.box().export(file_type="stl_ascii" if ending == "stl" else ending)
    text = text.encode() if isinstance(text, str) else text
    named = {
        "stl": text.replace(b"solid", b"solid W\xfcrfel", 1),
        "obj": b"# W\xfcrfel\n" + text,
        "ply": text.replace(b"comment", b"comment \xfc"),
    }[ending]
    assert b"\xfc" in named
    file = tmp_path / f"box.{ending}"
    file.write_bytes(named)
    assert shapes.mesh(file).volume == pytest.approx(1.0, rel=1e-6)
    # Nor does what stands after the triangles of a binary file.
    file.with_suffix(".stl").write_bytes(trimesh.creation.box().export(file_type="stl") + b"made by hand")
    assert shapes.mesh(file.with_suffix(".stl")).volume == pytest.approx(1.0, rel=1e-6)


def test_a_mesh_is_what_its_faces_have(tmp_path):
    solid = trimesh.creation.box().export(file_type="obj")
    lines = solid.splitlines()
    last = max(k for k, line in enumerate(lines) if line.startswith("v "))
    (tmp_path / "stray.obj").write_text("\n".join([*lines[: last + 1], "v 9 9 9", *lines[last + 1 :]]))
    assert shapes.mesh(tmp_path / "stray.obj").volume == pytest.approx(1.0, rel=1e-6)


BOX = {kind: trimesh.creation.box().export(file_type=kind) for kind in ("stl", "stl_ascii", "obj", "ply")}
POINTS = "".join(f"v {x} {y} {z}\n" for x in (0, 1) for y in (0, 1) for z in (0, 1))
END = "truncated, or not a mesh: it ends at byte "


@pytest.mark.parametrize(
    ("name", "content", "wrong"),
    [
        ("none.stl", None, "no such file"),
        ("garbage.stl", b"\x00\x01 not a mesh", END + "13 within its header"),
        ("garbage.obj", b"\xff\xfe\x00\x00", "has no faces; points and lines are not a mesh"),
        ("garbage.ply", b"ply\nformat ascii 1.0\nend_header\n", ""),
        ("random.stl", np.random.default_rng(0).bytes(2000), END + "2,000 where 1,191,196,492 triangles take"),
        ("empty.stl", b"", "is empty"),
        ("text.txt", b"hello", "must be an STL, OBJ or PLY file"),
        ("short.stl", BOX["stl"][:300], END + "300 where 12 triangles take 684"),
        ("text.stl", BOX["stl_ascii"][:700].encode(), END + "700 without 'endsolid'"),
        ("short.ply", BOX["ply"][:-60], END),
        ("points.obj", POINTS.encode(), "has no faces; points and lines are not a mesh"),
        ("lines.obj", (POINTS + "l 1 2\nl 2 3\n").encode(), "has no faces; points and lines are not a mesh"),
        ("flat.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 2 4 3\n", "enclose no volume"),
        ("nan.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 inf\nf 1 2 3\nf 1 2 4\n", "numbers that are not finite"),
    ],
)
def test_what_is_no_mesh_is_said_in_one_line(tmp_path, name, content, wrong):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises((ValueError, FileNotFoundError)) as error:
        shapes.mesh(tmp_path / name)
    assert name.split(".")[0] in str(error.value) and wrong in str(error.value)
    assert "\n" not in str(error.value) and "charset" not in str(error.value)
