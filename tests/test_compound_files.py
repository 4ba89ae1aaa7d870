"""Compounds in files and pictures: all of their parts are there."""

import gsd.hoomd
import numpy as np
import pytest
import trimesh

import particlesim as ps
from particlesim.geometry.surface import surface_of
from tests.compounds import MIXED, L, U, compound, part, shape_of
from tests.test_render_picture import covered, draw, edge, make_frame, make_scene, seen
from tests.worlds import listed, scene


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A trajectory of three compounds, one of them an obstacle, and its scene."""
    path = tmp_path_factory.mktemp("compounds") / "run.gsd"
    groups = [listed(shape, {"position": (x, 0, 0)}, size=0.8) for shape, x in ((L, -1.5), (MIXED, 1.5))]
    keys = {"gravity": (0, 0, -9.81), "size": (6, 6, 6), "duration": 0.2}
    this = scene(*groups, obstacles=[{"shape": U, "position": (0, 0, -2.5)}], **keys)
    ps.simulate(this, path)
    return path, this


def test_what_is_written_is_read(run):
    with ps.open(run[0]) as trajectory:
        header = trajectory.header
    assert [len(shape.parts) for shape in (*header.shapes, *header.obstacles)] == [3, 4, 3]
    for read, table in zip((*header.shapes, *header.obstacles), (L, MIXED, U), strict=True):
        made = shape_of(table)
        assert read.volume == made.volume
        assert read.radius == pytest.approx(made.radius, rel=1e-15)
        np.testing.assert_array_equal(read.moments, made.moments)
        for one, other in zip(read.parts, made.parts, strict=True):
            assert one.rounding == other.rounding
            np.testing.assert_allclose(sorted(map(tuple, one.vertices)), sorted(map(tuple, other.vertices)), atol=1e-15)


def test_other_programs_find_triangles(run):
    with gsd.hoomd.open(run[0]) as frames:
        described = frames[0].particles.type_shapes
    for each, table in zip(described, (L, MIXED), strict=True):
        surface = surface_of(shape_of(table))
        assert each["type"] == "Mesh"
        np.testing.assert_allclose(each["vertices"], 0.8 * surface.vertices, rtol=1e-6, atol=1e-7)
        assert np.array_equal(each["indices"], surface.triangles)


def test_the_surface_is_that_of_all_parts():
    surface = surface_of(shape_of(L))
    mesh = trimesh.Trimesh(surface.vertices, surface.triangles)
    assert mesh.volume == pytest.approx(3.0)
    assert mesh.area == pytest.approx(18.0)


def test_a_run_goes_on_to_the_same_bits(run, tmp_path):
    sim = ps.Simulation(run[1])
    sim.run(duration=0.1)
    sim.save(tmp_path / "half.ckpt")
    again = ps.Simulation.load(tmp_path / "half.ckpt")
    for each in (sim, again):
        each.run(duration=0.1)
    assert again.state_hash() == sim.state_hash()
    assert len(again.model.shapes[1].parts) == 4


def test_a_dumb_bell_is_drawn_as_two_balls():
    """Where each is, as the compound is turned."""
    shape = shape_of(compound(part("sphere", 0, 0, -0.8), part("sphere", 0, 0, 0.8)))
    turn = [np.cos(np.pi / 4), np.sin(np.pi / 4), 0.0, 0.0]
    image = covered(draw(make_scene("#000000"), [shape], [1.0], make_frame([(0.2, 0.0, 0.1)], [turn])))
    expected = seen((0.2, -0.8, 0.1), 0.5) | seen((0.2, 0.8, 0.1), 0.5)
    assert not (image ^ expected)[~edge(expected)].any()
