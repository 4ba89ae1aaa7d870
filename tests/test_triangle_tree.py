"""The tree over the triangles of a mesh, and what is beside what: against going through all of them."""

import numpy as np
import pytest
import trimesh

from particlesim.geometry.mesh_table import stack_meshes
from particlesim.geometry.narrow_phase.mesh import has_normal, next_triangle
from particlesim.geometry.shape_table import stack_shapes
from particlesim.geometry.shapes import triangle_mesh
from particlesim.geometry.triangle_surface import beside, surface_of_triangles
from tests.kernels import callable_from_python
from tests.meshes import ground

call_next_triangle, call_has_normal = callable_from_python(next_triangle), callable_from_python(has_normal)


def found_in(table, meshes, box):
    rows, place = [], (0, 0)
    while True:
        place, row = call_next_triangle(table, meshes, 0, place, box)
        if row < 0:
            return rows
        rows.append(row)


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5, 8, 9, 100, 1001])
def test_a_tree_finds_the_triangles_whose_boxes_meet_a_box(count):
    random = np.random.default_rng(count)
    points = random.normal(size=(3 * count, 3))
    points[3:] = np.repeat(points[::3], 3, axis=0)[3:] + 0.2 * points[3:]
    shape = triangle_mesh("cloud", points, np.arange(3 * count).reshape(-1, 3))
    table, meshes = stack_shapes([shape]), stack_meshes([shape])
    corners = shape.vertices[shape.triangles]
    for _ in range(30):
        middle, half = random.normal(size=3), random.uniform(0.0, 1.0, 3)
        lower, upper = middle - half, middle + half
        meet = (corners.min(axis=1) <= upper).all(axis=1) & (corners.max(axis=1) >= lower).all(axis=1)
        rows = found_in(table, meshes, (tuple(lower), tuple(upper)))
        assert [row - 1 for row in rows] == np.flatnonzero(meet).tolist()


def test_all_of_a_mesh_is_in_its_table():
    """Each triangle is a row whose vertices, normals and plane are its own."""
    solid = trimesh.creation.icosphere(subdivisions=2)
    shape = triangle_mesh("ball", solid.vertices, solid.faces)
    table = stack_shapes([shape])
    assert len(shape.triangles) == len(solid.faces) == table.shape["last_part"][0] - table.shape["first_part"][0]
    rows = table.shape[1:]
    corners = np.stack([table.vertex[rows["first_vertex"] + k] for k in range(3)], axis=1)
    key = lambda triangles: sorted(map(tuple, np.sort(triangles.round(9), axis=1).reshape(-1, 9).tolist()))  # noqa: E731
    assert key(corners) == key(solid.vertices[solid.faces])
    up = table.face["normal"][rows["first_face"]]
    outwards = np.einsum("ij,ij->i", up, corners.mean(axis=1))
    assert (outwards > 0.9).all()
    np.testing.assert_allclose(table.face["offset"][rows["first_face"]], outwards, atol=1e-12)


def test_what_is_odd_about_a_surface_is_counted():
    points = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 0, 0), (1, 0, 0), (0, 0, 1)], dtype=float)
    # Point 5 is point 1. The second triangle is flipped, the third has no area, the fourth is the first once more.
    triangles = np.array([(0, 1, 2), (0, 3, 2), (0, 4, 5), (2, 0, 5), (0, 2, 6)])
    surface = surface_of_triangles(points, triangles)
    assert len(surface.vertices) == 5 and len(surface.triangles) == 3
    assert surface.remarks == (
        "triangles without area, left out: 1",
        "triangles that are there twice, left out once: 1",
        "holes or borders, where the surface ends: 1",
        "edges at which more than two triangles meet: 1",
    )
    flipped = surface_of_triangles(points, triangles[:2])
    assert flipped.remarks[1] == "edges at which one of two triangles is flipped, which does not matter: 1"
    with pytest.raises(ValueError, match="none of its triangles has an area"):
        surface_of_triangles(points, triangles[2:3])


def test_a_closed_surface_has_nothing_odd_about_it():
    solid = trimesh.creation.torus(1.0, 0.3)
    surface = surface_of_triangles(solid.vertices, solid.faces)
    assert surface.remarks == ()
    around = beside(surface.triangles, len(surface.vertices))
    assert (around.beyond >= 0).all() and len(around.ring) == 2 * len(solid.edges_unique)


def has_normals(shape, direction):
    """Of which triangles a mesh has a normal, by the middles of their triangles."""
    table, meshes = stack_shapes([shape]), stack_meshes([shape])
    unit = tuple((np.array(direction) / np.linalg.norm(direction)).tolist())
    return {row for row in range(1, len(table.shape)) if call_has_normal(table, meshes, row, unit)}


def test_a_flat_floor_has_one_normal_but_at_its_border():
    floor = ground(4, 2.0)
    everything = set(range(1, 33))
    assert has_normals(floor, (0, 0, 1)) == has_normals(floor, (0, 0, -1)) == everything
    leaning = has_normals(floor, (1e-6, 0, 1))
    right = {k + 1 for k, t in enumerate(floor.triangles) if (floor.vertices[t][:, 0] == 2.0).any()}
    assert leaning and leaning <= right


def test_a_convex_surface_has_the_normals_of_its_farthest_corner_only():
    """As a convex body: the triangles round the vertex that is farthest that way."""
    solid = trimesh.creation.icosphere(subdivisions=2)
    shape = triangle_mesh("ball", solid.vertices, solid.faces)
    for direction in np.random.default_rng(2).normal(size=(20, 3)):
        top = np.argmax(shape.vertices @ direction)
        round_it = {k + 1 for k, t in enumerate(shape.triangles) if top in t}
        assert has_normals(shape, direction) == round_it
