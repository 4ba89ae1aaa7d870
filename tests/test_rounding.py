"""Mass, boxes and files of capsules and rounded polyhedra."""

from math import pi

import gsd.hoomd
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from particlesim.core.constants import CAPSULE, POLYHEDRON
from particlesim.geometry import shapes
from particlesim.geometry.aabb import shape_aabb
from particlesim.geometry.mass_properties import mass_properties
from particlesim.geometry.shape_table import stack_shapes
from particlesim.trajectory.gsd_file import Frame, Header, Trajectory, TrajectoryWriter
from tests import oracles
from tests.kernels import callable_from_python
from tests.worlds import ledger

call_shape_aabb = callable_from_python(shape_aabb)

ROUNDED = {name: shape for name, shape in oracles.zoo().items() if shape.kind == POLYHEDRON and shape.rounding > 0.0}
CUBE = shapes.CATALOGUE["cube"]


@pytest.mark.parametrize("length", [1e-6, 0.5, 1.0, 20.0])
def test_a_capsule_is_a_cylinder_between_half_spheres(length):
    capsule = shapes.capsule(length)
    assert (capsule.kind, capsule.inradius, capsule.radius) == (CAPSULE, 0.5, 0.5 * length + 0.5)
    half = 0.5 * length + 0.5

    def section(z):
        """Squared radius of the disc at height z."""
        return 0.25 - max(abs(z) - 0.5 * length, 0.0) ** 2

    volume, around, across = (
        sum(quad(f, *ends, epsabs=0, epsrel=1e-13)[0] for ends in ((-half, -0.5 * length), (-0.5 * length, 0.0)))
        for f in (
            lambda z: 2.0 * pi * section(z),
            lambda z: pi * section(z) ** 2,
            lambda z: 0.5 * pi * section(z) ** 2 + 2.0 * pi * section(z) * z**2,
        )
    )
    assert capsule.volume == pytest.approx(volume, rel=1e-12)
    np.testing.assert_allclose(capsule.moments, (across, across, around), rtol=1e-12)


def test_a_capsule_without_length_has_the_mass_of_a_sphere():
    sphere, capsule = shapes.sphere(), shapes.capsule(1e-300)
    assert capsule.volume == pytest.approx(sphere.volume, rel=1e-15)
    np.testing.assert_allclose(capsule.moments, sphere.moments, rtol=1e-15)


@pytest.mark.parametrize("rounding", [1e-3, 0.3, 5.0])
def test_a_rounded_cube_by_its_sections(rounding):
    """The section of a rounded cube at height z is a square rounded with radius sqrt(r^2 - (z - 1/2)^2)."""

    def area(r):
        return 1.0 + 4.0 * r + pi * r**2

    def second(r):
        """The integral of x^2: square, strips at two sides, strips above and below, four quarters of a disc."""
        quarter = 0.25 * pi * r**2 * 0.25 + r**3 / 3.0 + pi * r**4 / 16.0
        return 1.0 / 12.0 + 2.0 / 3.0 * ((0.5 + r) ** 3 - 0.125) + r / 6.0 + 4.0 * quarter

    def integral(f):
        # Over the angle at which the outline of the rounding is: smooth, where its radius over z is not.
        cap = quad(lambda t: f(rounding * np.cos(t)) * rounding * np.cos(t), 0.0, 0.5 * pi, epsabs=0, epsrel=1e-13)
        return f(rounding) + 2.0 * cap[0]

    cube = CUBE(rounding=rounding)
    assert cube.volume == pytest.approx(integral(area), rel=1e-12)
    np.testing.assert_allclose(cube.moments, 2.0 * integral(second), rtol=1e-12)
    assert cube.radius == pytest.approx(np.sqrt(0.75) + rounding, rel=1e-15)
    assert cube.inradius == pytest.approx(0.5 + rounding, rel=1e-15)
    assert cube.orientation.tolist() == [1.0, 0.0, 0.0, 0.0]


@pytest.mark.parametrize("name", ROUNDED)
def test_the_volume_is_steiners(name):
    """V + S r + M r^2 + 4/3 pi r^3, M half the sum of the lengths of edges times their exterior angles."""
    shape, core = ROUNDED[name], ConvexHull(ROUNDED[name].vertices)
    bend = 0.0
    for t, neighbours in enumerate(core.neighbors):
        for k, other in enumerate(neighbours):
            ends = core.points[np.delete(core.simplices[t], k)]
            cosine = core.equations[t, :3] @ core.equations[other, :3]
            sine = np.linalg.norm(np.cross(core.equations[t, :3], core.equations[other, :3]))
            bend += 0.25 * np.linalg.norm(ends[1] - ends[0]) * np.arctan2(sine, cosine)  # each edge twice
    r = shape.rounding
    expected = core.volume + core.area * r + bend * r**2 + 4.0 / 3.0 * pi * r**3
    assert shape.volume == pytest.approx(expected, rel=1e-12)


def covered(shape, count):
    """Mass properties of the convex hull of points all over the surface of a shape."""
    height = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    angle, around = pi * (1.0 + np.sqrt(5.0)) * np.arange(count), np.sqrt(1.0 - height**2)
    directions = np.stack([around * np.cos(angle), around * np.sin(angle), height], axis=1)
    farthest = (shape.vertices @ directions.T).argmax(axis=0)
    points = [shape.vertices[farthest] + shape.rounding * directions]
    points += [
        shape.vertices[list(loop)] + shape.rounding * normal
        for loop, normal in zip(shape.faces, shape.face_normals, strict=True)
    ]
    outside = np.concatenate(points)
    hull = ConvexHull(outside)
    a, b, c = (outside[hull.simplices[:, k]] for k in range(3))
    inwards = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) < 0.0
    triangles = np.where(inwards[:, None], hull.simplices[:, ::-1], hull.simplices)
    return mass_properties(outside, triangles.tolist())


@pytest.mark.parametrize("name", ROUNDED)
def test_mass_properties_are_those_of_a_hull_of_many_points(name):
    """The hull of n points on the surface is off by about 1 / n: what two of them lack is extrapolated away."""
    shape = ROUNDED[name]
    coarse, fine = covered(shape, 4000), covered(shape, 16000)
    volume, centroid, inertia = ((4.0 * f - c) / 3.0 for c, f in zip(coarse, fine, strict=True))
    assert shape.volume == pytest.approx(volume, rel=1e-5)
    np.testing.assert_allclose(centroid, 0.0, atol=1e-5 * shape.radius)
    np.testing.assert_allclose(inertia, np.diag(shape.moments), atol=2e-5 * shape.moments.max())


def test_a_needle_that_is_rounded_has_the_mass_of_a_capsule():
    needle = shapes.box((1e-5, 1e-5, 2.0), rounding=0.5)
    capsule = shapes.capsule(2.0)
    assert needle.volume == pytest.approx(capsule.volume, rel=3e-5)
    np.testing.assert_allclose(needle.moments, capsule.moments, rtol=1e-4)


def test_the_centroid_may_be_outside_of_a_flat_core():
    """A cone so flat and with so much rounding that the centroid is below its base: still inside the shape."""
    egg = ROUNDED["egg"]
    below = -oracles.surface_distance((0, 0, 0), egg, 1.0, (1, 0, 0, 0), (0, 0, 0))
    assert egg.inradius == pytest.approx(below, rel=1e-12)


@pytest.mark.parametrize("rounding", [-0.1, np.nan, np.inf])
def test_a_rounding_below_zero_is_refused(rounding):
    with pytest.raises(ValueError, match="the rounding of 'cube' must be a number of 0 or more"):
        CUBE(rounding=rounding)


@pytest.mark.parametrize("length", [0.0, -1.0, np.nan, np.inf])
def test_a_capsule_has_a_length(length):
    with pytest.raises(ValueError, match="the length of a capsule must be a number above 0"):
        shapes.capsule(length)


def test_boxes_are_those_of_the_vertices_and_the_rounding():
    random, zoo = np.random.default_rng(2), tuple(oracles.zoo().values())
    table = stack_shapes(zoo)
    for s, shape in enumerate(zoo):
        for size in (1.0, 0.3):
            turn = oracles.unit_quaternion(random)
            lower, upper = call_shape_aabb(table, (s, size, tuple(turn)))
            vertices = oracles.corners(shape, size, turn)
            np.testing.assert_allclose(lower, vertices.min(axis=0) - size * shape.rounding, atol=1e-14 * shape.radius)
            np.testing.assert_allclose(upper, vertices.max(axis=0) + size * shape.rounding, atol=1e-14 * shape.radius)


def test_the_box_of_a_half_space_is_all_of_space():
    table = stack_shapes([shapes.half_space()])
    lower, upper = call_shape_aabb(table, (0, 1.0, (1.0, 0.0, 0.0, 0.0)))
    assert lower == (-np.inf,) * 3 and upper == (np.inf,) * 3


def written(path, kinds):
    """A trajectory of one frame of particles of these shapes, of sizes 1, 2, ..."""
    n = len(kinds)
    numbers = np.arange(n)
    header = Header(
        '{"world": {"size": [9, 9, 9], "boundary": ["wall", "wall", "wall"]}}',
        kinds,
        numbers,
        1.0 + numbers,
        numbers,
        np.ones(n),
        np.ones((n, 3)),
    )
    still = np.zeros((n, 3))
    upright = np.tile((1.0, 0.0, 0.0, 0.0), (n, 1))
    with TrajectoryWriter(path, header) as writer:
        writer.append(Frame(0.0, still, upright, still, still, still, numbers, ledger()))


def test_files_keep_capsules_and_roundings(tmp_path):
    kinds = (shapes.sphere(), shapes.capsule(2.5), CUBE(rounding=0.25), ROUNDED["pebble"], shapes.tetrahedron())
    written(tmp_path / "run.gsd", kinds)
    with Trajectory(tmp_path / "run.gsd") as trajectory:
        for read, shape in zip(trajectory.header.shapes, kinds, strict=True):
            assert (read.name, read.kind, read.rounding) == (shape.name, shape.kind, shape.rounding)
            assert read.volume == pytest.approx(shape.volume, rel=1e-12)
            np.testing.assert_allclose(read.vertices, shape.vertices, atol=1e-12 * shape.radius)


def test_other_programs_find_rounded_polyhedra(tmp_path):
    """HOOMD's schema: a polyhedron of four or more vertices and its rounding radius, of the particle's size."""
    written(tmp_path / "run.gsd", (shapes.capsule(2.5), CUBE(rounding=0.25)))
    with gsd.hoomd.open(str(tmp_path / "run.gsd")) as file:
        capsule, cube = file[0].particles.type_shapes
    assert cube["type"] == "ConvexPolyhedron" and cube["rounding_radius"] == 0.5
    np.testing.assert_allclose(np.abs(cube["vertices"]), 1.0)
    core, rounding = np.array(capsule["vertices"]), capsule["rounding_radius"]
    assert ConvexHull(core).volume > 0.0
    # A prism about the axis, so thin that its rounded hull is the capsule within a thousandth.
    np.testing.assert_allclose(np.hypot(core[:, 0], core[:, 1]) + rounding, 0.5, rtol=1e-12)
    np.testing.assert_allclose(np.abs(core[:, 2]), 1.25)
    assert rounding > 0.499


def test_principal_axes_are_those_of_the_rounded_body():
    """A turned box with rounding has the moments of the box with rounding that is not turned."""
    turn = Rotation.random(rng=np.random.default_rng(2))
    box = shapes.box((1.0, 2.0, 3.0), rounding=0.4)
    turned = shapes.hull("turned", turn.apply(box.vertices) + np.array([5.0, 6.0, 7.0]), rounding=0.4)
    np.testing.assert_allclose(np.sort(turned.moments), np.sort(box.moments), rtol=1e-13)
    back = oracles.corners(turned, 1.0, turned.orientation)
    np.testing.assert_allclose(np.sort(back, axis=0), np.sort(turn.apply(box.vertices), axis=0), atol=1e-13)
