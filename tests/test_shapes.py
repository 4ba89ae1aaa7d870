"""The catalogue: closed convex hulls with the right sizes, volumes, centroids and moments."""

from math import pi, sqrt

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

import particlesim as ps
from particlesim.core.constants import POLYHEDRON, SPHERE
from particlesim.core.polyhedra import POLYHEDRA
from particlesim.geometry import shapes
from particlesim.geometry.mass_properties import mass_properties, principal_axes
from particlesim.geometry.shape_table import stack_shapes
from tests import oracles


def every_shape(folder):
    """All of the catalogue, and the odd shapes of the other tests."""
    trimesh.creation.torus(1.0, 0.4, major_sections=9, minor_sections=7).export(folder / "torus.stl")
    needs = {"mesh": {"file": folder / "torus.stl"}, "capsule": {"length": 2.0}}
    catalogue = {name: make(**needs.get(name, {})) for name, make in shapes.CATALOGUE.items()}
    return {**oracles.zoo(), **catalogue}


@pytest.fixture(scope="module")
def catalogue(tmp_path_factory):
    return every_shape(tmp_path_factory.mktemp("meshes"))


def solids(catalogue):
    """The polyhedra that are not rounded."""
    return [(name, shape) for name, shape in catalogue.items() if shape.kind == POLYHEDRON and not shape.rounding]


def cores(catalogue):
    return [(name, shape) for name, shape in catalogue.items() if shape.kind == POLYHEDRON]


def as_trimesh(shape):
    return trimesh.Trimesh(shape.vertices, oracles.triangles(shape), process=False)


def test_hulls_are_closed_and_obey_euler(catalogue):
    for name, shape in cores(catalogue):
        edges = shape.edges
        assert len(shape.vertices) - len(edges) + len(shape.faces) == 2, name
        assert 2 * len(edges) == sum(len(loop) for loop in shape.faces), name
        assert as_trimesh(shape).is_watertight and as_trimesh(shape).is_winding_consistent, name
        assert {v for loop in shape.faces for v in loop} == set(range(len(shape.vertices))), name
        for a, b, left, right in edges:
            for face, (start, end) in ((left, (a, b)), (right, (b, a))):
                loop = shape.faces[face]
                assert loop[(loop.index(start) + 1) % len(loop)] == end, name


def test_faces_are_plane_convex_and_counter_clockwise(catalogue):
    for name, shape in cores(catalogue):
        for loop, normal in zip(shape.faces, shape.face_normals, strict=True):
            corners = shape.vertices[list(loop)]
            heights = shape.vertices @ normal - corners[0] @ normal
            assert np.abs(heights[list(loop)]).max() < 1e-14 * shape.radius, name
            # No vertex is above a face, and none but its own is on it: the hull is convex and has no two faces in one.
            others = np.delete(heights, list(loop))
            assert others.max() < 0.0, name
            edge = np.roll(corners, -1, axis=0) - corners
            assert (np.cross(edge, np.roll(edge, -1, axis=0)) @ normal > 0.0).all(), name
            assert np.linalg.norm(normal) == pytest.approx(1.0, abs=1e-15), name


def test_bounding_and_inscribed_spheres(catalogue):
    for name, shape in catalogue.items():
        assert shape.radius == np.linalg.norm(shape.vertices, axis=1).max() + shape.rounding, name
        inscribed = -oracles.surface_distance(np.zeros(3), shape, 1.0, (1.0, 0.0, 0.0, 0.0), np.zeros(3))
        assert shape.inradius == pytest.approx(inscribed, rel=1e-12), name
    assert catalogue["sphere"].radius == catalogue["sphere"].inradius == 0.5


def test_mass_properties_are_those_of_trimesh(catalogue):
    for name, shape in solids(catalogue):
        solid = as_trimesh(shape)
        assert shape.volume == pytest.approx(solid.volume, rel=1e-12), name
        # About the centroid, in the principal axes: the vertices themselves are given there.
        np.testing.assert_allclose(solid.center_mass, 0.0, atol=1e-13 * shape.radius, err_msg=name)
        scale = shape.volume * shape.radius**2
        np.testing.assert_allclose(solid.moment_inertia, np.diag(shape.moments), atol=1e-13 * scale, err_msg=name)


def test_closed_forms():
    cube, box, tetrahedron = shapes.cube(), shapes.box((1.0, 2.0, 3.0)), shapes.tetrahedron()
    assert cube.volume == pytest.approx(1.0, rel=1e-15)
    np.testing.assert_allclose(cube.moments, 1.0 / 6.0, rtol=1e-15)
    assert (cube.radius, cube.inradius) == (sqrt(0.75), 0.5)
    np.testing.assert_allclose(box.moments, 6.0 * np.array([4 + 9, 1 + 9, 1 + 4]) / 12.0, rtol=1e-14)
    assert tetrahedron.volume == pytest.approx(1.0 / (6.0 * sqrt(2.0)), rel=1e-14)
    np.testing.assert_allclose(tetrahedron.moments, tetrahedron.volume / 20.0, rtol=1e-14)
    assert tetrahedron.radius == pytest.approx(sqrt(3.0 / 8.0), rel=1e-14)
    assert tetrahedron.inradius == pytest.approx(sqrt(1.0 / 24.0), rel=1e-14)
    lengths = [np.linalg.norm(tetrahedron.vertices[a] - tetrahedron.vertices[b]) for a, b, *_ in tetrahedron.edges]
    np.testing.assert_allclose(lengths, 1.0, rtol=1e-14)
    sphere = shapes.sphere()
    assert sphere.kind == SPHERE and sphere.volume == pi / 6.0
    np.testing.assert_allclose(sphere.moments, 0.4 * sphere.volume * 0.25, rtol=1e-15)


@pytest.mark.parametrize("height", [0.01, 1.0, 2.5, 50.0])
def test_a_pyramid_has_its_centroid_a_quarter_up(height):
    shape = shapes.pyramid(height)
    np.testing.assert_allclose(shape.vertices[:, 2].min(), -height / 4, rtol=1e-13)
    np.testing.assert_allclose(shape.vertices[:, 2].max(), 0.75 * height, rtol=1e-13)
    assert shape.volume == pytest.approx(height / 3.0, rel=1e-13)
    # Of a right square pyramid of base 1: m (1/20 + 3/80 h^2) across, m / 10 along its axis.
    across = shape.volume * (1.0 / 20.0 + 3.0 / 80.0 * height**2)
    np.testing.assert_allclose(shape.moments, (across, across, shape.volume / 10.0), rtol=1e-12)
    assert shape.orientation.tolist() == [1.0, 0.0, 0.0, 0.0]


def test_described_axes_are_kept_unless_they_are_not_principal(catalogue):
    for name in ("sphere", "cube", "box", "pyramid", "tetrahedron", "plate", "rod", "flat", "tall"):
        assert catalogue[name].orientation.tolist() == [1.0, 0.0, 0.0, 0.0], name
    turn = Rotation.random(rng=np.random.default_rng(2))
    box = shapes.box((1.0, 2.0, 3.0))
    turned = shapes.hull("turned", turn.apply(box.vertices) + np.array([5.0, 6.0, 7.0]))
    np.testing.assert_allclose(np.sort(turned.moments), np.sort(box.moments), rtol=1e-13)
    back = oracles.corners(turned, 1.0, turned.orientation)
    np.testing.assert_allclose(np.sort(back, axis=0), np.sort(turn.apply(box.vertices), axis=0), atol=1e-13)


def test_mass_properties_do_not_depend_on_the_origin():
    random = np.random.default_rng(3)
    body = shapes.hull("body", random.normal(size=(20, 3)))
    here, there = (mass_properties(body.vertices + shift, body.faces) for shift in (0.0, (300.0, -200.0, 100.0)))
    assert there.volume == pytest.approx(here.volume, rel=1e-11)
    np.testing.assert_allclose(there.centroid, (300.0, -200.0, 100.0), atol=1e-11)
    np.testing.assert_allclose(there.inertia, here.inertia, atol=1e-11)


@pytest.mark.parametrize("width", [1e-3, 1e-5, 2e-6])
def test_the_small_moment_of_a_needle_keeps_its_digits(width):
    needle = shapes.box((1.0, width, width))
    expected = np.array([2.0 * width**2, 1.0 + width**2, 1.0 + width**2]) * width**2 / 12.0
    np.testing.assert_allclose(needle.moments, expected, rtol=1e-13)
    # Turned, its corners are rounded by 1e-16, which is a fraction of the width.
    turn = Rotation.random(rng=np.random.default_rng(1))
    turned = shapes.hull("turned", turn.apply(needle.vertices))
    np.testing.assert_allclose(np.sort(turned.moments), expected, rtol=1e-14 / width)


def test_principal_axes_are_a_rotation():
    random = np.random.default_rng(4)
    for _ in range(100):
        turn = Rotation.random(rng=random).as_matrix()
        inertia = turn @ np.diag(random.uniform(1.0, 2.0, 3)) @ turn.T
        moments, axes = principal_axes(inertia)
        np.testing.assert_allclose(axes @ np.diag(moments) @ axes.T, inertia, atol=1e-14)
        assert np.linalg.det(axes) == pytest.approx(1.0, abs=1e-14)


def test_vertices_inside_the_hull_its_faces_and_edges_are_dropped():
    grid = np.stack(np.meshgrid(*3 * [np.linspace(-0.5, 0.5, 5)]), axis=-1).reshape(-1, 3)
    for points in (grid, np.concatenate([grid, grid]), grid + np.array([100.0, 0.0, 0.0])):
        shape = shapes.hull("grid", points)
        assert (len(shape.vertices), sorted(len(loop) for loop in shape.faces)) == (8, 6 * [4])


@pytest.mark.parametrize("noise", ["float32", 1e-7, 1e-9, 1e-12])
def test_what_is_plane_but_for_rounding_becomes_plane(noise):
    random = np.random.default_rng(5)
    grid = np.stack(np.meshgrid(*3 * [np.linspace(-0.5, 0.5, 5)]), axis=-1).reshape(-1, 3)
    angle = np.arange(24) * pi / 12
    prism = np.array([(np.cos(t), np.sin(t), z) for t in angle for z in (-0.5, 0.0, 0.5)])
    signs = np.stack(np.meshgrid(*3 * [(-1.0, 1.0)]), axis=-1).reshape(-1, 3)
    # Small rhombicuboctahedron: three squares and a triangle meet at each corner, more planes than a point can obey.
    rhombi = np.concatenate([signs * np.roll((1.0, 1.0, 1.0 + sqrt(2.0)), k) for k in range(3)])
    for points, count in ((grid, (8, 6)), (prism, (48, 26)), (rhombi, (24, 26))):
        for _ in range(5):
            turned = Rotation.random(rng=random).apply(points)
            rough = np.float32(turned) if noise == "float32" else turned + noise * random.normal(size=turned.shape)
            shape = shapes.hull("rough", rough)
            assert (len(shape.vertices), len(shape.faces)) == count
            for loop, normal in zip(shape.faces, shape.face_normals, strict=True):
                assert np.ptp(shape.vertices[list(loop)] @ normal) < 5e-14 * shape.radius
                assert (shape.vertices @ normal).max() < shape.vertices[loop[0]] @ normal + 5e-14 * shape.radius
            assert shape.volume == pytest.approx(trimesh.convex.convex_hull(turned).volume, rel=1e-5)


@pytest.mark.parametrize("thickness", [1e-3, 1e-5])
def test_a_thin_box_keeps_its_six_faces(thickness):
    shape = shapes.box((1.0, 1.0, thickness))
    assert (len(shape.vertices), len(shape.faces)) == (8, 6)
    assert shape.volume == pytest.approx(thickness, rel=1e-12)


@pytest.mark.parametrize(
    "vertices",
    [
        [],
        [(0, 0, 0)],
        [(0, 0, 0), (1, 0, 0), (0, 1, 0)],
        [(x, y, 0.0) for x in (0, 1) for y in (0, 1)],
        [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, np.nan)],
        [(0, 0), (1, 0), (0, 1), (1, 1)],
        [(t, t, t) for t in range(8)],
    ],
)
def test_what_encloses_no_volume_is_refused(vertices):
    with pytest.raises(ValueError, match="bad"):
        shapes.hull("bad", vertices)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("count", [4, 5, 8, 30])
def test_nearly_flat_points_are_a_shape_or_refused_in_one_line(count):
    random = np.random.default_rng(6)
    outcomes = {True: 0, False: 0}
    clouds = [np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 1e-9)])]
    for _ in range(100):
        points = random.normal(size=(count, 3)) * (1.0, 1.0, 10.0 ** random.uniform(-17.0, -3.0))
        tilted = Rotation.random(rng=random).apply(points)
        clouds += [tilted, np.float32(tilted)]
    for cloud in clouds:
        try:
            shape = shapes.hull("flat", cloud)
        except ValueError as error:
            assert str(error) == "the vertices of 'flat' enclose no volume"
            outcomes[False] += 1
        else:
            assert min(shape.volume, shape.inradius, *shape.moments) > 0.0
            outcomes[True] += 1
    assert min(outcomes.values()) > 20


@pytest.mark.parametrize("name", POLYHEDRA)
def test_a_polyhedron_is_one_entry_for_catalogue_and_scenes(name):
    assert shapes.CATALOGUE[name]().name == name
    scene = ps.Scene(world={"size": (9, 9, 9)}, particles=[{"shape": name, "count": 1}])
    assert scene.particles[0].shape.kind == name
    assert name in ps.Scene.model_json_schema()["$defs"]["PolyhedronShape"]["properties"]["kind"]["enum"]


def test_adding_a_shape_is_one_entry(monkeypatch):
    def octahedron():
        """The regular octahedron of edge 1."""
        return shapes.hull("octahedron", np.concatenate([np.eye(3), -np.eye(3)]) * sqrt(0.5))

    monkeypatch.setitem(shapes.CATALOGUE, "octahedron", octahedron)
    shape = shapes.CATALOGUE["octahedron"]()
    assert (len(shape.vertices), len(shape.faces), len(shape.edges)) == (6, 8, 12)
    assert shape.volume == pytest.approx(sqrt(2.0) / 3.0, rel=1e-14)
    np.testing.assert_allclose(shape.moments, shape.volume / 10.0, rtol=1e-14)
    assert stack_shapes([shape]).edge.shape == (12, 4)
    # Corner to corner along x, and face to face.
    found = ps.separation("octahedron", ((0, 0, 0),), "octahedron", ((3.0, 0, 0),))
    assert found.distance == pytest.approx(3.0 - sqrt(2.0), rel=1e-14)
    normal = np.full(3, sqrt(1.0 / 3.0))
    found = ps.separation("octahedron", ((0, 0, 0),), "octahedron", (2.0 * normal,))
    assert found.distance == pytest.approx(2.0 - sqrt(2.0 / 3.0), rel=1e-14) and len(found.points) == 6


@pytest.mark.parametrize("thickness", [1e-2, 1e-3, 1e-4])
def test_thin_curved_bodies_are_convex(thickness):
    """What is so thin is curved by about as much as the digits of files are uncertain."""
    points = np.random.default_rng(8).normal(size=(500, 3))
    points *= np.array([1.0, 1.0, thickness]) / np.linalg.norm(points, axis=1)[:, None]
    for scale in ((1.0, 1.0, 1.0), (1.0, thickness, 1.0)):
        shape = shapes.hull("thin", points * scale)
        for loop, normal in zip(shape.faces, shape.face_normals, strict=True):
            assert (shape.vertices @ normal).max() - shape.vertices[loop[0]] @ normal < 1e-14
        assert shape.volume == pytest.approx(trimesh.convex.convex_hull(points * scale).volume, rel=1e-2)
