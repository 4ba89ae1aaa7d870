"""Compounds: bodies of several convex parts, against closed forms and part by part."""

import math
import sys

import numpy as np
import pytest
import trimesh

import particlesim as ps
from particlesim.broad_phase import METHODS
from particlesim.core.rotations import conjugates, quaternion_products
from particlesim.geometry.separation import separation
from particlesim.model.overlap import separation_of
from particlesim.scene.errors import SceneError
from particlesim.setup.build import build
from particlesim.simulation.estimate import estimate
from tests.compounds import HALVES, MIXED, L, U, apart, block, compound, part, ring, shape_of
from tests.sleepers import G, asleep
from tests.worlds import listed, scene

FREE = {"gravity": (0, 0, 0), "restitution": 1.0, "friction": 0.0}


# ---- what they are ---------------------------------------------------------------------------------------------------


def test_a_dumb_bell_has_the_moments_of_two_spheres():
    """2/5 m r^2 each, and m d^2 across by Steiner's theorem."""
    shape = shape_of(compound(part("sphere", 0, 0, -1, size=0.6), part("sphere", 0, 0, 1, size=0.6)))
    mass = math.pi / 6 * 0.6**3
    along = 2 * 0.4 * mass * 0.3**2
    assert shape.volume == pytest.approx(2 * mass, rel=1e-14)
    np.testing.assert_allclose(shape.moments, [along + 2 * mass, along + 2 * mass, along], rtol=1e-14)
    assert shape.radius == pytest.approx(1.3, rel=1e-15)


def test_an_l_of_three_cubes_has_the_moments_of_its_mesh(tmp_path):
    """The mesh of one closed surface, integrated by another program."""
    prism = _prism(tmp_path / "corner.stl")
    shape = shape_of(L)
    assert shape.volume == pytest.approx(prism.volume, rel=1e-14)
    np.testing.assert_allclose(np.sort(shape.moments), np.sort(np.linalg.eigvalsh(prism.moment_inertia)), rtol=1e-13)
    described = ps.Scene(world={"size": [9, 9, 9]}, particles=[listed(L, {"position": (1, 2, 3)})])
    assert ps.Simulation(described).particles.mass[0] == pytest.approx(3000.0)


def _prism(path):
    """An L as a closed mesh in a file."""
    outline = np.array([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)], dtype=float)
    ears = np.array([(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 5)])
    prism = trimesh.creation.extrude_triangulation(outline, ears, height=1.0)
    prism.export(path)
    return prism


def test_a_mesh_is_split_into_convex_parts(tmp_path):
    """Their mass and moments are those of the mesh, by another program; what `check` says of them is their number."""
    prism, world = _prism(tmp_path / "corner.stl"), {"size": [9, 9, 9]}
    group = listed({"kind": "mesh", "file": str(tmp_path / "corner.stl"), "decompose": True}, {"position": (0, 0, 0)})
    sim = ps.Simulation(ps.Scene(world=world, particles=[group]))
    (shape,) = sim.model.shapes
    assert len(shape.parts) == 2
    assert sim.particles.mass[0] == pytest.approx(1000.0 * prism.volume, rel=1e-3)
    moments = 1000.0 * np.linalg.eigvalsh(prism.moment_inertia)
    np.testing.assert_allclose(np.sort(sim.particles.inertia[0]), moments, rtol=2e-3)
    assert any("corner" in value and "2 convex parts, -0.0" in value for _, value in estimate(sim.scene))


def test_without_coacd_it_is_said_in_a_line_how_to_get_it(tmp_path, monkeypatch):
    _prism(tmp_path / "corner.stl")
    monkeypatch.setitem(sys.modules, "coacd", None)
    group = listed({"kind": "mesh", "file": str(tmp_path / "corner.stl"), "decompose": True}, {"position": (0, 0, 0)})
    with pytest.raises(SceneError) as caught:
        ps.Simulation(ps.Scene(world={"size": [9, 9, 9]}, particles=[group]))
    assert str(caught.value) == (
        "particles[0].shape.decompose = true: coacd is not installed; pip install 'particlesim[decompose]' does it"
    )


def test_parts_that_overlap_are_both_there():
    shape = shape_of(compound(part("cube", 0, 0, 0), part("cube", 0.5, 0, 0)))
    assert shape.volume == pytest.approx(2.0)


@pytest.mark.parametrize("other", [L, "cube", "sphere", {"kind": "capsule", "length": 1.0}, MIXED])
def test_separations_are_those_of_the_nearest_parts(other):
    """Of each two parts as shapes of their own, wherever the compounds are; how deep, where they overlap."""
    random, a, b, overlaps = np.random.default_rng(3), shape_of(MIXED), shape_of(other), 0
    groups = [listed(MIXED, {"position": (-5, 0, 0)}, size=0.8), listed(other, {"position": (5, 0, 0)}, size=0.7)]
    system = build(scene(*groups, **FREE)).system
    for _ in range(40):
        turns = random.normal(size=(2, 4))
        system.body["position"][:2] = random.uniform(-0.6, 0.6, (2, 3))
        system.body["orientation"][:2] = turns / np.linalg.norm(turns, axis=1, keepdims=True)
        poses = [(each["position"].copy(), each["orientation"].copy(), each["scale"]) for each in system.body[:2]]
        expected, found = apart(a, poses[0], b, poses[1]), separation_of(system, 0, 1)
        assert found == pytest.approx(expected, abs=1e-13) if expected < 0.0 else found > 0.0
        described = [
            (position, quaternion_products(turn[None], conjugates(shape.orientation[None]))[0], size)
            for (position, turn, size), shape in zip(poses, (a, b), strict=True)
        ]
        assert separation(a, described[0], b, described[1]).distance == pytest.approx(expected, abs=1e-13)
        overlaps += expected < 0.0
    assert 5 < overlaps < 40


# ---- impacts ---------------------------------------------------------------------------------------------------------


def test_two_meet_when_the_first_of_their_parts_do():
    """Sought in small steps along free paths, part by part, then by halves."""
    random, groups = np.random.default_rng(8), []
    for sign, table in ((-1.0, L), (1.0, MIXED)):
        turn, spin = random.normal(size=4), random.normal(size=3) * 3.0
        pose = {"position": (1.6 * sign, 0.1, 0.05), "orientation": tuple(turn), "spin": tuple(spin)}
        groups.append(listed(table, pose, size=0.7, velocity=(-1.5 * sign, 0.0, 0.0)))
    alone = [ps.Simulation(scene(group, boundary="open", **FREE)) for group in groups]
    shapes = [sim.model.shapes[0] for sim in alone]

    def gap(time):
        poses = []
        for sim in alone:
            sim.run_until(time)
            poses.append((sim.particles.position[0].copy(), sim.particles.orientation[0].copy(), 0.7))
        return apart(shapes[0], poses[0], shapes[1], poses[1])

    time = 0.0
    while gap(time + 1e-3) > 0.0:
        time += 1e-3
    together = ps.Simulation(scene(*groups, boundary="open", **FREE))
    together.run_until(time)
    assert together.ledger.impacts == 0
    together.run_until(time + 1e-3)
    assert together.ledger.impacts == 1


def test_energy_and_momentum_are_kept_over_thousands_of_impacts():
    motion = {"velocity": {"kind": "maxwell", "temperature": 20.0}, "spin": {"kind": "maxwell", "temperature": 20.0}}
    groups = [{"shape": shape, "count": 8, "size": 0.4, **motion} for shape in (L, U, MIXED, "cube")]
    sim = ps.Simulation(scene(*groups, size=(3, 3, 3), boundary="periodic", seed=2, **FREE))
    before = sim.ledger
    sim.run(duration=18.0)
    after = sim.ledger
    assert after.impacts > 1000
    assert after.unresolved == 0
    assert after.energy == pytest.approx(before.energy, rel=1e-13)
    scale = np.linalg.norm(sim.particles.mass[:, None] * sim.particles.velocity, axis=1).sum()
    np.testing.assert_allclose(after.momentum, before.momentum, atol=1e-12 * scale)
    assert sim.frame().ledger.largest_overlap < 1e-6


def test_two_halves_of_a_cube_strike_as_the_cube_does():
    tumbling = {"velocity": (2.0, 0.3, 0.2), "spin": (1.0, 2.0, 0.5), "size": 0.8}
    poses = [{"position": (-0.3, 0, 0), "orientation": (0.9, 0.1, 0.3, 0.2)}, {"position": (1.2, 0.1, 0.2)}]
    found = []
    for shape in ("cube", HALVES):
        sim = ps.Simulation(scene(listed(shape, *poses, **tumbling), size=(4, 4, 4), **FREE))
        sim.run(duration=1.0)
        found.append(sim)
    cubes, halves = found
    assert cubes.ledger.impacts == halves.ledger.impacts > 5
    np.testing.assert_allclose(halves.particles.position, cubes.particles.position, atol=1e-8)
    np.testing.assert_allclose(halves.particles.angular_velocity, cubes.particles.angular_velocity, atol=1e-7)


def test_the_same_bytes_on_any_threads_and_broad_phases():
    group = {"count": 12, "size": 0.3, "velocity": {"kind": "maxwell", "temperature": 20.0}}
    hashes = set()
    for method in METHODS:
        for threads in (1, 2):
            groups = [{"shape": shape, **group} for shape in (L, MIXED)]
            falls = {"gravity": (0, 0, -G), "restitution": 0.4, "friction": 0.3, "size": (2.2, 2.2, 2.2)}
            sim = ps.Simulation(scene(*groups, seed=5, broad_phase=method, **falls), threads=threads)
            sim.run(steps=60)
            hashes.add(sim.state_hash())
    assert len(hashes) == 1


# ---- lasting contacts ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("angle", [20.0, 35.0])
def test_what_lies_on_a_slope_stays_or_slides_as_coulomb_says(angle):
    """g (sin - mu cos) t^2 / 2, of a cube of two halves."""
    slope, friction, time = math.radians(angle), 0.5, 0.8
    gravity = (G * math.sin(slope), 0.0, -G * math.cos(slope))
    body = listed(HALVES, {"position": (-8, 0, -9.5)})
    sim = ps.Simulation(scene(body, gravity=gravity, restitution=0.0, friction=friction))
    sim.run(duration=time)
    acceleration = max(0.0, G * (math.sin(slope) - friction * math.cos(slope)))
    expected = (-8 + 0.5 * acceleration * time**2, 0.0, -9.5)
    np.testing.assert_allclose(sim.particles.position[0], expected, atol=1e-9)
    np.testing.assert_allclose(sim.particles.angular_velocity[0], 0.0, atol=1e-9)


@pytest.mark.parametrize("shape", ["sphere", "cube"])
def test_nothing_catches_where_parts_are_flush(shape):
    """Over a floor of twelve boxes, which is one body."""
    floor = compound(*(block((0.5, 3, 0.5), 0.5 * k - 2.75, 0, 0) for k in range(12)))
    bodies = [
        listed(floor, {"position": (0, 0, -9.75)}, density=1e9),
        listed(shape, {"position": (-2, 0.1, -9.25)}, size=0.5, velocity=(3.0, 0.2, 0.0)),
    ]
    sim = ps.Simulation(scene(*bodies, gravity=(0, 0, -G), restitution=0.0, friction=0.0))
    sim.run(duration=1.0)
    np.testing.assert_allclose(sim.particles.velocity[1], (3.0, 0.2, 0.0), atol=1e-6)
    np.testing.assert_allclose(sim.particles.position[1], (1.0, 0.3, -9.25), atol=1e-5)


def test_a_ball_falls_through_a_ring_that_a_larger_one_rests_on():
    """The larger one lies on the tubes of the ring, whose middles are straight."""
    heights = []
    for size in (0.6, 2.0):
        bodies = [
            listed(ring(0.6, 0.2), {"position": (0, 0, -9.9)}),
            listed("sphere", {"position": (0, 0, -8)}, size=size),
        ]
        sim = ps.Simulation(scene(*bodies, gravity=(0, 0, -G), restitution=0.0, friction=0.3))
        sim.run(duration=1.5)
        heights.append(sim.particles.position[1, 2])
    assert heights[0] == pytest.approx(-9.7, abs=1e-4)
    assert heights[1] == pytest.approx(-9.9 + math.sqrt((1.0 + 0.1) ** 2 - 0.6**2), abs=1e-4)


def test_a_ball_rests_in_a_trough():
    """On its base, between its walls; 1/3 m is from the middle of the base to the centroid."""
    bodies = [
        listed(U, {"position": (0, 0, -10 + 0.125 + 1 / 3)}),
        listed("sphere", {"position": (0.02, 0.1, -8.5)}, size=0.4),
    ]
    sim = ps.Simulation(scene(*bodies, gravity=(0, 0, -G), restitution=0.2, friction=0.3, rolling_friction=0.01))
    sim.run(duration=2.0)
    trough, ball = sim.particles.position
    assert abs(ball - trough)[0] < 0.05 + 1e-6
    assert ball[2] == pytest.approx(-10 + 0.25 + 0.2, abs=1e-4)


def test_a_ring_hangs_in_a_ring_that_hangs_on_a_bar():
    """Where one holds the other; falling, it would be 5 m lower by then."""
    turns = {"axis": [1, 0, 0], "angle": 90}, {"axis": [0, 1, 0], "angle": 90}
    rings = [{"position": (0, 0, z), "orientation": turn} for z, turn in zip((0.0, -0.99), turns, strict=True)]
    bar = {"shape": {"kind": "box", "edges": [0.1, 4.0, 0.1]}, "position": [0, 0, 0.44]}
    links = listed(ring(0.6, 0.2), *rings)
    keys = {"gravity": (0, 0, -G), "restitution": 0.0, "friction": 0.5}
    sim = ps.Simulation(scene(links, boundary="open", obstacles=[bar], **keys))
    sim.run(duration=1.0)
    np.testing.assert_allclose(sim.particles.position, [(0, 0, -0.01), (0, 0, -1.01)], atol=2e-3)
    np.testing.assert_allclose(sim.particles.velocity, 0.0, atol=2e-2)


def test_a_heap_comes_to_rest_and_its_energy_is_booked():
    groups = [{"shape": shape, "count": 8, "size": 0.3} for shape in (L, U)]
    fall = {"gravity": (0, 0, -G), "restitution": 0.1, "friction": 0.6, "size": (1.4, 1.4, 3.0), "seed": 4}
    sim = ps.Simulation(scene(*groups, **fall))
    before = sim.ledger.energy
    sim.run(duration=4.0)
    after = sim.ledger
    assert asleep(sim).all()
    assert after.unresolved < 20
    assert sim.largest_overlap() < 1e-4 * 0.3
    assert before - after.energy == pytest.approx(after.dissipated.sum(), rel=1e-9)


def test_a_compound_obstacle_that_turns_works_what_bodies_gain():
    """A cross of two bars among elastic balls."""
    bars = compound(block((1.6, 0.2, 0.2), 0, 0, 0), block((0.2, 1.6, 0.2), 0, 0, 0))
    stirrer = {"shape": bars, "position": [0, 0, 0], "motion": {"kind": "spin", "axis": [0, 0.6, 0.8], "rate": 8.0}}
    balls = {"shape": "sphere", "count": 12, "size": 0.3, "velocity": {"kind": "uniform", "speed": 1.0}}
    sim = ps.Simulation(scene(balls, obstacles=[stirrer], size=(2, 2, 2), seed=3, **FREE))
    before = sim.ledger.energy
    sim.run(duration=3.0)
    assert sim.ledger.energy > 2.0 * before
    assert sim.ledger.energy - sim.ledger.work == pytest.approx(before, rel=1e-9)
    assert sim.largest_overlap() < 1e-6


# ---- what is said ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("table", "key"),
    [
        ({"kind": "compound"}, "particles[0].shape: the key 'parts' is missing"),
        ({"kind": "compound", "parts": []}, "particles[0].shape.parts = []: must be 1 to 256 parts, not 0"),
        (compound(part("cube", 0, 0, 0), part("cube", 1e25, 0, 0)), "particles[0].shape: the parts of a compound are"),
        (compound(part("cub", 0, 0, 0)), "particles[0].shape.parts[0].shape"),
        (compound(part("cube", 0, 0, 0, size=-1.0)), "particles[0].shape.parts[0].size"),
        (compound(part(L, 0, 0, 0)), "particles[0].shape.parts[0].shape"),
    ],
)
def test_what_is_no_compound_is_refused_in_a_line(table, key):
    with pytest.raises(SceneError) as caught:
        ps.Simulation(scene(listed(table, {"position": (0, 0, 0)})))
    assert key in str(caught.value)
    assert "\n" not in str(caught.value)
