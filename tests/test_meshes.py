"""Obstacles that are triangle meshes: against half-spaces, closed forms and each triangle by itself."""

import itertools

import numpy as np
import pytest
import trimesh

from particlesim.geometry.mesh_table import stack_meshes
from particlesim.geometry.separation import separation
from particlesim.geometry.shapes import CATALOGUE, half_space, hull, triangle_mesh
from particlesim.model.overlap import separation_of
from particlesim.setup.build import build
from particlesim.setup.obstacles import Obstacle, Piece
from particlesim.simulation.simulation import Simulation
from tests.meshes import ground
from tests.worlds import gas, listed, scene

FLOOR = ground(10, 5.0)
SHAPES = ["sphere", "cube", "tetrahedron", "capsule", "cylinder", "rounded"]
TABLES = {"capsule": {"kind": "capsule", "length": 1.0}, "rounded": {"kind": "cube", "rounding": 0.1}}


def among(what, *obstacles, **options):
    return Simulation.of_model(what, build(what, obstacles), **options)


def tilted(angle):
    return {"axis": [0.3, 1.0, 0.0], "angle": angle}


# ---- a flat floor is a plane -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("velocity", [(1.3, 0.2, -1.0), (0.7, 0.9, -5.0)])
def test_a_flat_floor_of_triangles_is_a_plane(shape, velocity):
    """Tumbling over it is what it is on a half-space."""
    poses = [{"position": (x, 0.1, 1.5), "velocity": velocity, "orientation": tilted(20)} for x in (-3.0, -2.0, 0.5)]
    for pose in poses:
        what = scene(listed(TABLES.get(shape, shape), pose), boundary="open")
        runs = [among(what, Obstacle(floor, (0, 0, 0))) for floor in (FLOOR, half_space((0.0, 0.0, 1.0)))]
        for sim in runs:
            sim.run(duration=1.5)
        a, b = (sim.particles for sim in runs)
        assert runs[0].ledger.impacts == runs[1].ledger.impacts > 0
        np.testing.assert_allclose(a.velocity, b.velocity, rtol=0, atol=1e-9)
        np.testing.assert_allclose(a.angular_velocity, b.angular_velocity, rtol=0, atol=1e-8)
        np.testing.assert_allclose(a.position, b.position, rtol=0, atol=1e-9)


@pytest.mark.parametrize("angle", [0, 17, 45])
def test_a_box_that_lands_flat_on_many_triangles_does_not_tip(angle):
    """All that its face covers is one patch: it goes off as it came."""
    turned = {"axis": [0, 0, 1], "angle": angle}
    box = listed("cube", {"position": (-3, 0.1, 1.5), "velocity": (1.3, 0.2, -1.0), "orientation": turned})
    sim = among(scene(box, boundary="open"), Obstacle(FLOOR, (0, 0, 0)))
    sim.run(duration=2.0)
    assert sim.ledger.impacts == 1
    np.testing.assert_allclose(sim.particles.velocity, [(1.3, 0.2, 1.0)], rtol=0, atol=1e-8)
    np.testing.assert_allclose(sim.particles.angular_velocity, 0.0, atol=1e-7)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("sunk", [0.0, 1e-12, 1e-9, 1e-7, 3e-7])
def test_nothing_catches_on_inner_edges(shape, sunk):
    """What slides over a flat floor goes straight on for ever, though it has sunk in by as much as it may."""
    height = {"tetrahedron": np.sqrt(2.0 / 3.0) / 4.0, "rounded": 0.6}.get(shape, 0.5)
    turned = {"axis": [0, 1, 0], "angle": 90} if shape == "capsule" else {"axis": [0, 0, 1], "angle": 17}
    velocity, start = np.array([2.3, 0.37, 0.0]), np.array([-3.0, 0.123, height])
    body = listed(
        TABLES.get(shape, shape), {"position": tuple(start), "velocity": tuple(velocity), "orientation": turned}
    )
    if shape == "tetrahedron":
        body["placement"]["poses"][0]["orientation"] = upright_tetrahedron()
    what = scene(body, boundary="open", step=0.01)
    model = build(what, [Obstacle(FLOOR, (0, 0, 0))])
    model.particles["position"][0, 2] -= sunk
    sim = Simulation.of_model(what, model)
    sim.run(duration=2.5)
    assert sim.ledger.impacts == 0
    np.testing.assert_allclose(sim.particles.velocity[0], velocity, rtol=0, atol=1e-12)
    np.testing.assert_allclose(sim.particles.position[0], start - (0, 0, sunk) + 2.5 * velocity, rtol=0, atol=1e-11)


def upright_tetrahedron():
    """The orientation in which a tetrahedron stands on one of its faces."""
    shape = CATALOGUE["tetrahedron"]()
    normal = shape.face_normals[0]
    axis = np.cross(normal, (0.0, 0.0, -1.0))
    angle = np.degrees(np.arctan2(np.linalg.norm(axis), -normal[2]))
    return {"axis": axis.tolist(), "angle": float(angle)} if np.linalg.norm(axis) > 1e-9 else (1.0, 0.0, 0.0, 0.0)


# ---- triangles by themselves -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("shape", ["sphere", "cube", "capsule", "cylinder"])
def test_an_overlap_with_a_mesh_is_that_with_its_deepest_triangle(shape):
    """Where they overlap, by how much: as with a wafer in place of each triangle, thinner than counts."""
    random = np.random.default_rng(5)
    hill = ground(3, 1.5, lambda x, y: 0.4 * np.sin(2.0 * x) * np.cos(1.7 * y))
    wafers = []
    for corners in hill.vertices[hill.triangles]:
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        normal *= 1e-5 / np.linalg.norm(normal)
        wafers.append(hull("wafer", np.concatenate([corners - normal, corners + normal])))
    offsets = [hill.vertices[t].mean(axis=0) for t in hill.triangles]
    compared = 0
    for _ in range(40):
        position, q = random.uniform((-1.2, -1.2, -0.6), (1.2, 1.2, 0.6)), random.normal(size=4)
        body = listed(TABLES.get(shape, shape), {"position": (0, 0, 5), "orientation": q.tolist()}, size=0.4)
        what = scene(body, boundary="open")
        model = build(what, [Obstacle(hill, (0, 0, 0))])
        model.particles["position"][0] = position
        found = separation_of(model.system, 0, len(model.system.body) - 1)
        made = CATALOGUE[TABLES[shape]["kind"]](1.0) if shape in TABLES else CATALOGUE[shape]()
        least = min(
            separation(made, (position, q, 0.4), wafer, (offset,)).distance
            for wafer, offset in zip(wafers, offsets, strict=True)
        )
        if least < 0.0:
            compared += 1
            assert found == pytest.approx(least, abs=2e-5)
        else:
            assert found > -2e-5
    assert compared > 10


def test_nothing_gets_through_a_sheet():
    """From both sides, at any speed and in any step, of any shape; with restitution 1 it keeps its energy."""
    sheet, random = ground(4, 1.0), np.random.default_rng(3)
    for step, shape, speed in itertools.product((0.01, 1.0), ("sphere", "cube", "capsule"), (0.3, 300.0)):
        poses = []
        for k in range(12):
            side, (x, y) = (1 if k % 2 else -1), (-0.75 + 0.5 * (k % 4), -0.75 + 0.5 * (k // 4))
            position = (*(np.array([x, y]) + random.uniform(-0.05, 0.05, 2)), side * random.uniform(0.05, 0.1))
            spin = tuple(50.0 * random.normal(size=3))
            poses.append({"position": position, "velocity": (0, 0, -side * speed), "spin": spin})
        what = scene(listed(TABLES.get(shape, shape), *poses, size=0.04), boundary="open", step=step)
        sim = among(what, Obstacle(sheet, (0, 0, 0)))
        before = sim.ledger.kinetic
        sim.run(duration=0.4 / speed)
        sides = np.sign([pose["position"][2] for pose in poses])
        assert (np.sign(sim.particles.position[:, 2]) == sides).all()
        assert sim.ledger.impacts >= 12 and sim.ledger.unresolved == 0
        assert sim.ledger.kinetic == pytest.approx(before, rel=1e-12)


@pytest.mark.parametrize("rate", [3.0, 100.0])
def test_a_sheet_that_spins_lets_nothing_through_and_pays_for_what_it_does(rate):
    """In its own frame all stay on their sides while they are within its border; the work is what energy they got."""
    random, sheet = np.random.default_rng(8), ground(3, 1.0)
    groups = []
    for shape in ("sphere", "cube"):
        position = 0.9 * random.uniform(-1, 1, (20, 3))
        position[:, 2] += 0.06 * np.sign(position[:, 2])
        groups.append(listed(shape, *({"position": tuple(p)} for p in position), size=0.06))
    blade = Obstacle(sheet, (0, 0, 0), pieces=(Piece(0.0, (0, 0, 0), angular_velocity=(rate, 0, 0)),))
    sim = among(scene(*groups, boundary="open"), blade)
    sides = np.sign(sim.particles.position[:, 2])
    angle, inside = 0.0, np.hypot(*sim.particles.position[:, 1:].T) < 0.9
    for _ in range(20):
        sim.run(duration=0.1 / rate)
        angle += 0.1
        x, y, z = sim.particles.position.T
        own_y, own_z = y * np.cos(angle) + z * np.sin(angle), z * np.cos(angle) - y * np.sin(angle)
        # What has been beyond the border may come back on the other side.
        inside &= (np.abs(x) < 0.95) & (np.abs(own_y) < 0.95)
        assert (np.sign(own_z) == sides)[inside].all()
    assert sim.ledger.impacts > 5 and sim.ledger.unresolved == 0
    assert sim.ledger.work == pytest.approx(sim.ledger.kinetic, rel=1e-12)


def test_a_ball_at_rest_between_two_ramps_is_struck_by_both_at_once():
    """A ball falls into a trough of 45 degrees: the two faces send it back as it came."""
    trough = triangle_mesh(
        "trough",
        [(-1, -3, 1), (1, -3, 1), (-1, 3, 1), (1, 3, 1), (0, -3, 0), (0, 3, 0)],
        [(0, 4, 5), (0, 5, 2), (4, 1, 3), (4, 3, 5)],
    )
    ball = listed("sphere", {"position": (0, 0.2, 3.0), "velocity": (0, 0.5, -2.0)})
    sim = among(scene(ball, boundary="open"), Obstacle(trough, (0, 0, 0)))
    sim.run(duration=2.5)
    # It touches both where its centre is sqrt(2) radii above the bottom.
    met = (3.0 - np.sqrt(0.5)) / 2.0
    assert sim.ledger.impacts == 2
    np.testing.assert_allclose(sim.particles.velocity[0], (0, 0.5, 2.0), rtol=0, atol=1e-10)
    assert sim.particles.position[0, 2] == pytest.approx(np.sqrt(0.5) + 2.0 * (2.5 - met), abs=1e-9)


def test_a_ball_meets_a_ridge_where_a_cylinder_would_be():
    """Off the edge of a roof: a ball that comes down beside the ridge is reflected at the line from the edge to it."""
    roof = triangle_mesh(
        "roof",
        [(-1, -3, -1), (1, -3, -1), (-1, 3, -1), (1, 3, -1), (0, -3, 0), (0, 3, 0)],
        [(0, 4, 5), (0, 5, 2), (4, 1, 3), (4, 3, 5)],
    )
    aside = 0.2
    ball = listed("sphere", {"position": (aside, 0.3, 2.0), "velocity": (0, 0, -1.0)})
    sim = among(scene(ball, boundary="open"), Obstacle(roof, (0, 0, 0)))
    sim.run(duration=1.8)
    normal = np.array([aside, 0.0, np.sqrt(0.25 - aside * aside)]) / 0.5
    assert sim.ledger.impacts == 1
    np.testing.assert_allclose(
        sim.particles.velocity[0], np.array([0, 0, -1.0]) + 2.0 * normal[2] * normal, rtol=0, atol=1e-10
    )


def test_a_closed_mesh_is_hollow_and_keeps_what_is_in_it():
    """A gas inside an icosphere stays in it, one outside stays out, and both keep their energy."""
    skin = trimesh.creation.icosphere(subdivisions=3, radius=1.2)
    ball = triangle_mesh("ball", skin.vertices, skin.faces)
    thermal = {"kind": "maxwell", "temperature": 1.0}
    inside = {"kind": "random", "region": {"lower": (-1, -1, -1), "upper": (1, 1, 1), "form": "ellipsoid"}}
    groups = [
        {
            "shape": shape,
            "count": 12,
            "size": 0.15,
            "mass": 1.0,
            "velocity": thermal,
            "spin": thermal,
            "placement": where,
        }
        for shape in ("sphere", "cube")
        for where in (inside, {"kind": "random"})
    ]
    what = scene(*groups, size=(4, 4, 4), boundary="wall")
    sim = among(what, Obstacle(ball, (0, 0, 0)))
    radius = np.linalg.norm(sim.particles.position, axis=1)
    was_in, before = radius < 1.15, sim.ledger.kinetic
    sim.run(duration=3.0)
    radius = np.linalg.norm(sim.particles.position, axis=1)
    assert was_in.sum() >= 24 and (radius[was_in] < 1.2).all() and (radius[~was_in] > 1.1).all()
    assert sim.ledger.impacts > 100
    assert sim.ledger.kinetic == pytest.approx(before, rel=1e-11)


def test_the_result_does_not_depend_on_broad_phase_or_threads_with_meshes():
    hashes = set()
    hill = ground(12, 1.25, lambda x, y: 0.2 * np.sin(5.0 * x) + 0.2 * np.cos(4.0 * y))
    for method, threads in [("octree", 1), ("grid", 2), ("naive", 4)]:
        pieces = (Piece(0.0, (0, 0, -1.0), amplitude=(0, 0, 0.1), angular_frequency=9.0),)
        sim = among(gas(12), Obstacle(hill, (0, 0, -1.0), pieces=pieces), broad_phase=method, threads=threads)
        sim.run(duration=0.7)
        hashes.add(sim.state_hash())
    assert len(hashes) == 1


def test_a_checkpoint_goes_on_among_meshes(tmp_path):
    """A run that is loaded is the run that was not stopped."""
    hill = ground(8, 1.25, lambda x, y: 0.2 * np.sin(5.0 * x))
    one = among(gas(8), Obstacle(hill, (0, 0, -0.6)))
    one.run(duration=0.2)
    one.save(tmp_path / "run.ckpt")
    two = Simulation.load(tmp_path / "run.ckpt")
    for sim in (one, two):
        sim.run(duration=0.3)
    assert one.state_hash() == two.state_hash()


def test_scenes_without_meshes_have_no_table_of_them():
    assert stack_meshes([CATALOGUE["cube"](), half_space()]) is None


def test_a_ball_alone_meets_a_mesh_that_is_far_away():
    """Nothing touches it for thousands of substeps; then a sheet does."""
    sheet = ground(1, 1.0)
    ball = listed("sphere", {"position": (0.3, 0.1, 90.0), "velocity": (0, 0, -1000.0)}, size=0.1)
    sim = among(scene(ball, boundary="open", size=(200, 200, 200), step=0.5), Obstacle(sheet, (0, 0, -50)))
    sim.run(duration=0.2)
    assert sim.ledger.impacts == 1
    assert sim.particles.position[0, 2] == pytest.approx(-50 + 0.05 + 200.0 - (140.0 - 0.05), abs=1e-6)
