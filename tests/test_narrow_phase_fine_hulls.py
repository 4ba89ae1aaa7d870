"""Hulls of hundreds and thousands of corners: climbed, not gone through, and as exact as others."""

from math import cos, pi, sin, tan

import numpy as np
import pytest
import trimesh

import particlesim as ps
from particlesim.core.constants import MAX_MANIFOLD
from particlesim.core.jit import entry_kernel
from particlesim.core.math3d import load_vec3
from particlesim.geometry import shapes
from particlesim.geometry.shape_table import stack_shapes
from particlesim.geometry.support import support_vertex
from particlesim.geometry.tolerances import CLIMBED_VERTICES
from tests import oracles


def on_a_ball(count, seed):
    points = np.random.default_rng(seed).normal(size=(count, 3))
    return points / np.linalg.norm(points, axis=1)[:, None]


def prism(sides, height=1.0):
    """A prism of so many sides about z, inscribed in a circle of radius 1, with an edge on +x."""
    angle = 2.0 * pi / sides * np.arange(sides)
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return shapes.hull("prism", [(x, y, z) for z in (-0.5 * height, 0.5 * height) for x, y in ring])


FINE = {
    "ball": on_a_ball(1000, 1),
    "plate": on_a_ball(500, 2) * (1.0, 1.0, 1e-3),
    "needle": on_a_ball(500, 3) * (1.0, 1e-3, 1e-3),
    "globe": np.float32(trimesh.creation.uv_sphere(count=[24, 24]).vertices).astype(np.float64),
    "drum": prism(300).vertices,
}


def separation(a, b, offset):
    """Of (shape, size, orientation of its body axes), as the oracles have them, b's centroid at ``offset`` from a's."""
    poses = []
    for (shape, size, turn), centre in ((a, np.zeros(3)), (b, offset)):
        back = shape.orientation * (1.0, -1.0, -1.0, -1.0)
        poses += [shape, (centre, oracles.product(turn, back), size)]
    return ps.separation(*poses)


@entry_kernel
def climb(table, directions, found):
    for k in range(len(directions)):
        found[k] = support_vertex(table, 0, load_vec3(directions, k))


@pytest.mark.parametrize("name", FINE)
def test_a_climb_ends_at_a_farthest_vertex(name):
    shape = shapes.hull(name, FINE[name])
    assert len(shape.vertices) >= CLIMBED_VERTICES
    random = np.random.default_rng(4)
    # Any direction, along axes, along the edges of the cells that climbs begin in, and across faces: those have ties.
    coarse = random.integers(-4, 5, size=(500, 3)).astype(np.float64)
    directions = np.concatenate([random.normal(size=(2000, 3)), coarse[coarse.any(axis=1)], shape.face_normals])
    found = np.empty(len(directions), dtype=np.int64)
    climb(stack_shapes([shape]), directions, found)
    reach = np.einsum("ij,ij->i", shape.vertices[found], directions)
    farthest = (directions @ shape.vertices.T).max(axis=1)
    assert (farthest - reach <= 1e-15 * np.linalg.norm(directions, axis=1)).all()


@pytest.mark.parametrize("sides", [200, 2000])
@pytest.mark.parametrize("gap", [0.3, 1e-6, 0.0, -1e-9, -1e-4, -0.2])
def test_prisms_of_many_sides_are_as_far_apart_as_closed_forms_say(sides, gap):
    drum, apothem = prism(sides), cos(pi / sides)
    turn = oracles.unit_quaternion(np.random.default_rng(5))
    for way, reach in (
        ((0.0, 0.0, 1.0), 1.0),  # base on base
        ((cos(pi / sides), sin(pi / sides), 0.0), 2.0 * apothem),  # side on side
        ((-cos(3 * pi / sides), -sin(3 * pi / sides), 0.0), 2.0 * apothem),
    ):
        normal = oracles.turned(turn, way)
        found = ps.separation(drum, ((0, 0, 0), turn), drum, ((reach + gap) * normal, turn))
        assert found.distance == pytest.approx(gap, abs=3e-14)
        np.testing.assert_allclose(found.normal, normal, atol=1e-11 if gap else 1e-7)
        heights = found.points @ normal
        np.testing.assert_allclose(heights, 0.5 * (reach + gap), atol=1e-11)
        assert len(found.points) == (MAX_MANIFOLD if reach == 1.0 else 4)
        if reach == 1.0:
            # The corners of the patch are spread around the base, near its border.
            assert np.linalg.norm(found.points.mean(axis=0) - heights[0] * normal) < 0.05
            assert np.linalg.norm(found.points - heights[0] * normal, axis=1).min() > 0.99


@pytest.mark.parametrize("gap", [0.2, 1e-9, -1e-9, -0.1])
def test_a_sphere_and_a_capsule_beside_a_prism_of_many_sides(gap):
    sides = 400
    drum, side = prism(sides), (cos(pi / sides), sin(pi / sides), 0.0)
    upright = ps.CATALOGUE["capsule"](0.5)
    for shape in ("sphere", upright):
        found = ps.separation(drum, ((0, 0, 0),), shape, (np.multiply(cos(pi / sides) + 0.5 + gap, side),))
        assert found.distance == pytest.approx(gap, abs=1e-14)
        np.testing.assert_allclose(found.normal, side, atol=1e-9)
        assert len(found.points) == (1 if shape == "sphere" else 2)
    # On top of an edge of the base: the nearest point is on the edge.
    corner = np.array([1.0, 0.0, 0.5])
    out = np.array([1.0, 0.0, 1.0]) / np.sqrt(2.0)
    found = ps.separation(drum, ((0, 0, 0),), "sphere", (corner + (0.5 + abs(gap)) * out,))
    assert found.distance == pytest.approx(abs(gap), abs=1e-14)
    np.testing.assert_allclose(found.normal, out, atol=1e-9)


def test_distances_of_fine_hulls_are_those_of_coal():
    random = np.random.default_rng(7)
    # Of a drum's base coal's triangles would have more neighbours than it can count; closed forms are above.
    hulls = [shapes.hull(name, points) for name, points in FINE.items() if name != "drum"]
    others = [shapes.cube(), shapes.sphere(), shapes.capsule(1.0), *hulls]
    for shape in hulls:
        of_coal = oracles.coal_geometry(shape)
        for other in others:
            for _ in range(10):
                turns = oracles.unit_quaternion(random), oracles.unit_quaternion(random)
                sizes = shape.radius + other.radius
                offset = oracles.direction(random) * sizes * random.uniform(0.8, 1.5)
                found = separation((shape, 1.0, turns[0]), (other, 1.0, turns[1]), offset)
                expected, _ = oracles.coal_distance(of_coal, turns[0], oracles.coal_geometry(other), turns[1], offset)
                assert found.distance == pytest.approx(expected, abs=1e-11 * sizes), (shape.name, other.name)


@pytest.mark.parametrize("size", [1.0, 1e-3])
def test_depths_of_fine_hulls_are_those_of_the_minkowski_difference(size):
    random = np.random.default_rng(6)
    hulls = [shapes.hull(name, FINE[name][: 200 if name == "ball" else None]) for name in ("ball", "plate", "drum")]
    cube = shapes.cube()
    for shape in hulls:
        for depth in (0.2, 1e-3, 1e-8):
            turns = oracles.unit_quaternion(random), oracles.unit_quaternion(random)
            bodies = (shape, 1.0, turns[0]), (cube, size, turns[1])
            # Shifted along the normal of a deep overlap until it is as shallow as wanted.
            offset = 0.1 * size * random.normal(size=3)
            deep = separation(*bodies, offset)
            sizes = shape.radius + size * cube.radius
            offset = offset - (deep.distance + depth * sizes) * deep.normal
            found = separation(*bodies, offset)
            points = oracles.corners(shape, 1.0, turns[0]), oracles.corners(cube, size, turns[1], offset)
            assert found.distance == pytest.approx(oracles.difference_distance(*points), abs=1e-13 * sizes)


def test_two_fine_balls_one_within_the_other():
    """Centre on centre every direction is as good: the depth is that of the flattest face on a corner or face."""
    ball = shapes.hull("ball", trimesh.creation.icosphere(subdivisions=3).vertices)
    found = ps.separation(ball, ((0, 0, 0),), ball, ((0, 0, 0),))
    assert -2.0 * ball.radius <= found.distance <= -2.0 * ball.inradius


def test_a_regular_prism_has_its_closed_form():
    """Mass properties of n sides: area n/2 sin(2 pi / n), moment about the axis A (2 + cos(2 pi / n)) / 6."""
    sides, height = 1000, 2.0
    drum = prism(sides, height)
    area = 0.5 * sides * sin(2.0 * pi / sides)
    about_axis = area * height * (2.0 + cos(2.0 * pi / sides)) / 6.0
    assert (len(drum.vertices), len(drum.faces)) == (2 * sides, sides + 2)
    assert drum.volume == pytest.approx(area * height, rel=1e-13)
    across = 0.5 * about_axis + area * height * height**2 / 12.0
    np.testing.assert_allclose(np.sort(drum.moments), np.sort([across, across, about_axis]), rtol=1e-12)
    assert drum.radius == pytest.approx(np.sqrt(2.0), rel=1e-14)
    assert tan(pi / sides) > 0.0 and drum.inradius == pytest.approx(cos(pi / sides), rel=1e-14)
