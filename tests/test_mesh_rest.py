"""What lies, slides and rolls on triangle meshes: as on the plane that they are cut out of, against closed forms."""

import math
from pathlib import Path

import numpy as np
import pytest
import trimesh

from particlesim.geometry.shapes import half_space, triangle_mesh
from particlesim.model.materials import Material
from particlesim.scene.file import load_scene
from particlesim.setup.build import build
from particlesim.setup.obstacles import Obstacle, Piece
from particlesim.simulation.simulation import Simulation
from tests.meshes import ground
from tests.sleepers import G, asleep, check_taken_along
from tests.worlds import listed, scene

# Some 40 triangles lie beneath a cube.
FLOOR = ground(25, 5.0)

TABLES = {"capsule": {"kind": "capsule", "length": 1.0}, "rounded": {"kind": "cube", "rounding": 0.1}}


def on(surface, *groups, friction=0.0, **settings):
    """A simulation of bodies above a surface, all of a material that does not rebound unless told."""
    keys = {"boundary": "open", "gravity": (0, 0, -G), "restitution": 0.0, "friction": friction} | settings
    what = scene(*groups, **keys)
    made = surface if isinstance(surface, Obstacle) else Obstacle(surface, (0, 0, 0))
    obstacle = made._replace(material=Material(restitution=keys["restitution"], friction=friction))
    return Simulation.of_model(what, build(what, [obstacle]))


def turned(angle, axis=(0.0, 0.0, 1.0)):
    return {"axis": list(axis), "angle": angle}


def lying(height=0.5, velocity=(0.0, 0.0, 0.0), **pose):
    return {"position": (-3.0, 0.123, height), "velocity": velocity, **pose}


# ---- on a flat floor -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("shape", "angle"), [("sphere", 0), ("cube", 0), ("cube", 17), ("cube", 45), ("rounded", 17)])
def test_what_slides_without_friction_goes_straight_on_for_ever(shape, angle):
    """Over hundreds of inner edges, to rounding."""
    velocity, height = np.array([2.3, 0.37, 0.0]), 0.6 if shape == "rounded" else 0.5
    body = listed(TABLES.get(shape, shape), lying(height, tuple(velocity), orientation=turned(angle)))
    sim = on(FLOOR, body, step=0.01)
    sim.run(duration=2.5)
    np.testing.assert_allclose(sim.particles.position[0], (-3, 0.123, height) + 2.5 * velocity, rtol=0, atol=1e-9)
    np.testing.assert_allclose(sim.particles.velocity[0], velocity, rtol=0, atol=1e-12)
    np.testing.assert_allclose(sim.particles.angular_velocity[0], 0.0, atol=1e-12)


def test_a_ball_that_slides_begins_to_roll_and_goes_straight():
    """At 5/7 of its speed, after 2 v / (7 mu g) (A. Sommerfeld, Mechanics, paragraph 27)."""
    way, speed, friction = np.array([math.cos(0.2), math.sin(0.2), 0.0]), 3.0, 0.3
    at = 2.0 * speed / (7.0 * friction * G)
    sim = on(FLOOR, listed("sphere", lying(0.5, tuple(speed * way))), friction=friction)
    sim.run(duration=2.0)
    gone = speed * at - 0.5 * friction * G * at**2 + 5.0 / 7.0 * speed * (2.0 - at)
    np.testing.assert_allclose(sim.particles.velocity[0], 5.0 / 7.0 * speed * way, rtol=0, atol=1e-6)
    np.testing.assert_allclose(sim.particles.position[0], (-3, 0.123, 0.5) + gone * way, rtol=0, atol=1e-4)
    across = np.cross(way, sim.particles.position[0] - (-3, 0.123, 0.5))
    assert abs(across[2]) < 1e-9


def test_a_block_that_slides_stops_where_friction_says_without_turning():
    way, speed, friction = np.array([math.cos(0.2), math.sin(0.2), 0.0]), 3.0, 0.25
    sim = on(FLOOR, listed("cube", lying(0.5, tuple(speed * way), orientation=turned(17))), friction=friction)
    sim.run(duration=2.0)
    gone = speed**2 / (2.0 * friction * G)
    np.testing.assert_allclose(sim.particles.position[0], (-3, 0.123, 0.5) + gone * way, rtol=0, atol=1e-3)
    assert abs(np.cross(way, sim.particles.position[0] - (-3, 0.123, 0.5))[2]) < 1e-9
    assert sim.ledger.kinetic < 1e-20


@pytest.mark.parametrize("shape", ["sphere", "cube", "tetrahedron", "capsule", "rounded"])
def test_a_body_dropped_askew_lies_on_a_mesh_as_on_a_plane(shape):
    pose = {"position": (-1, 0.123, 1.5), "velocity": (0.3, 0.37, 0), "orientation": turned(37, (1, 2, 1))}
    body = listed(TABLES.get(shape, shape), pose)
    runs = [on(surface, body, restitution=0.3, friction=0.5) for surface in (FLOOR, half_space((0.0, 0.0, 1.0)))]
    for sim in runs:
        sim.run(duration=4.0)
    a, b = (sim.particles for sim in runs)
    np.testing.assert_allclose(a.position, b.position, rtol=0, atol=2e-3)
    np.testing.assert_allclose(a.position[:, 2], b.position[:, 2], rtol=0, atol=1e-6)
    np.testing.assert_allclose(a.velocity, b.velocity, rtol=0, atol=1e-6)


# ---- inclines --------------------------------------------------------------------------------------------------------


def incline(angle):
    """A floor that falls off at an angle [rad] along (cos 0.7, sin 0.7), and its normal."""
    half, axis = 0.5 * angle, np.array([-math.sin(0.7), math.cos(0.7), 0.0])
    normal = (math.sin(angle) * math.cos(0.7), math.sin(angle) * math.sin(0.7), math.cos(angle))
    return Obstacle(FLOOR, (0, 0, 0), (math.cos(half), *(math.sin(half) * axis))), np.array(normal)


def down(angle):
    """The direction of steepest descent."""
    return np.array([math.cos(angle) * math.cos(0.7), math.cos(angle) * math.sin(0.7), -math.sin(angle)])


def block_on(angle, friction, shape="cube"):
    slope, normal = incline(angle)
    start = 0.5 * normal - 2.0 * down(angle)
    body = listed(shape, {"position": tuple(start), "orientation": tuple(slope.orientation)})
    return on(slope, body, friction=friction), start


@pytest.mark.parametrize("friction", [0.2, 0.5])
def test_a_block_on_an_incline_stays_up_to_the_angle_of_friction(friction):
    angle = math.atan(friction)
    still, start = block_on(0.99 * angle, friction)
    still.run(duration=2.0)
    np.testing.assert_allclose(still.particles.position[0], start, rtol=0, atol=1e-3)
    assert np.abs(still.particles.velocity[0]).max() < 1e-9
    steeper = 1.2 * angle
    slides, start = block_on(steeper, friction)
    slides.run(duration=1.0)
    acceleration = G * (math.sin(steeper) - friction * math.cos(steeper))
    np.testing.assert_allclose(slides.particles.velocity[0], acceleration * down(steeper), rtol=0, atol=1e-4)
    np.testing.assert_allclose(
        slides.particles.position[0], start + 0.5 * acceleration * down(steeper), rtol=0, atol=1e-3
    )


def test_a_ball_rolls_down_an_incline_at_five_sevenths():
    angle = 0.4
    rolls, start = block_on(angle, 0.5, "sphere")
    rolls.run(duration=1.0)
    acceleration = 5.0 / 7.0 * G * math.sin(angle)
    np.testing.assert_allclose(rolls.particles.velocity[0], acceleration * down(angle), rtol=0, atol=1e-6)
    np.testing.assert_allclose(rolls.particles.position[0], start + 0.5 * acceleration * down(angle), rtol=0, atol=1e-6)


# ---- edges, corners and borders --------------------------------------------------------------------------------------

TROUGH = triangle_mesh(
    "trough",
    [(-1, -3, 1), (1, -3, 1), (-1, 3, 1), (1, 3, 1), (0, -3, 0), (0, 3, 0)],
    [(0, 4, 5), (0, 5, 2), (4, 1, 3), (4, 3, 5)],
)


def test_a_ball_slides_along_a_trough_on_both_its_sides():
    ball = listed("sphere", {"position": (0, -1.5, math.sqrt(0.5)), "velocity": (0, 1.0, 0)})
    sim = on(TROUGH, ball)
    sim.run(duration=2.0)
    np.testing.assert_allclose(sim.particles.position[0], (0, 0.5, math.sqrt(0.5)), rtol=0, atol=1e-4)
    np.testing.assert_allclose(sim.particles.velocity[0], (0, 1.0, 0), rtol=0, atol=1e-9)


def test_a_cube_comes_to_rest_in_the_corner_of_an_open_box():
    """On the floor and against two walls, which are one mesh, pressed by gravity that leans into the corner."""
    box = trimesh.creation.box((4.0, 4.0, 4.0)).subdivide().subdivide()
    box.update_faces(box.triangles_center[:, 2] < 1.99)
    room = triangle_mesh("room", box.vertices, box.faces)
    body = listed("cube", {"position": (0.7, 0.5, -1.2), "orientation": turned(5)})
    sim = on(room, body, gravity=(3.0, 4.0, -G), restitution=0.2, friction=0.1)
    sim.run(duration=4.0)
    np.testing.assert_allclose(sim.particles.position[0], (1.5, 1.5, -1.5), rtol=0, atol=1e-3)
    assert np.abs(sim.particles.velocity[0]).max() < 1e-6


@pytest.mark.parametrize(("over", "falls"), [(0.47, False), (0.53, True)])
def test_a_box_beyond_the_border_of_a_table_falls_if_its_middle_is(over, falls):
    table = ground(8, 2.0)
    body = listed("cube", {"position": (1.5 + over, 0.1, 0.5)})
    sim = on(table, body, friction=0.5)
    sim.run(duration=2.0)
    assert (sim.particles.position[0, 2] < -1.0) == falls
    if not falls:
        np.testing.assert_allclose(sim.particles.position[0], (1.5 + over, 0.1, 0.5), rtol=0, atol=1e-3)


# ---- moving meshes ---------------------------------------------------------------------------------------------------


def test_a_block_comes_to_the_speed_of_a_belt_of_triangles():
    """After v / (mu g); the belt works m v^2, of which friction takes half."""
    speed, friction = 2.0, 0.5
    belt = Obstacle(FLOOR, (0, 0, 0), surface_velocity=(speed, 0, 0))
    sim = on(belt, listed("cube", lying(), mass=3.0), friction=friction)
    sim.run(duration=1.0)
    at = speed / (friction * G)
    assert sim.particles.velocity[0] == pytest.approx((speed, 0, 0), abs=1e-6)
    assert sim.particles.position[0, 0] == pytest.approx(-3.0 + speed * (1.0 - 0.5 * at), abs=1e-3)
    assert sim.ledger.work == pytest.approx(3.0 * speed**2, rel=1e-3)


def test_a_block_on_a_lift_of_triangles_goes_up_with_it():
    lift = Obstacle(FLOOR, (0, 0, 0), pieces=(Piece(0.0, (0, 0, 0), velocity=(0, 0, 0.5)),))
    sim = on(lift, listed("cube", lying(velocity=(0, 0, 0.5)), mass=2.0))
    sim.run(duration=2.0)
    assert sim.particles.position[0] == pytest.approx((-3, 0.123, 1.5), abs=1e-3)
    assert sim.ledger.work == pytest.approx(2.0 * G * 1.0, rel=1e-3)


# ---- heaps -----------------------------------------------------------------------------------------------------------


def hills(x, y):
    return 0.25 * np.sin(2.5 * x) * np.cos(2.0 * y) + 0.4 * (x * x + y * y)


SHAPES = "sphere", "cube", "tetrahedron", {"kind": "capsule", "length": 1.0}


def heap(count, seed, shapes=SHAPES, **settings):
    """Mixed bodies that fall into a hilly bowl without a thickness."""
    bowl = ground(20, 1.6, hills)
    region = {"lower": (-0.8, -0.8, 1.2), "upper": (0.8, 0.8, 3.0)}
    placement = {"kind": "random", "region": region}
    groups = [{"shape": shape, "count": count, "size": 0.2, "placement": placement} for shape in shapes]
    return on(bowl, *groups, size=(8, 8, 8), restitution=0.3, friction=0.4, seed=seed, **settings)


def test_a_heap_on_a_thin_bowl_comes_to_rest_and_nothing_sinks_through():
    sim = heap(10, 4)
    before, deepest = sim.ledger.energy, 0.0
    for _ in range(30):
        sim.run(duration=0.1)
        deepest = max(deepest, sim.largest_overlap())
    # It loses energy only, and what it has is heat now.
    assert sim.ledger.energy < before
    assert (sim.particles.position[:, 2] > hills(*sim.particles.position[:, :2].T) - 1e-3).all()
    assert deepest < 2e-3 * 0.2
    assert sim.ledger.kinetic < 1e-3 * (before - sim.ledger.energy)


def test_a_heap_on_a_mesh_does_not_depend_on_broad_phase_or_threads(tmp_path):
    hashes = set()
    for method, threads in [("octree", 1), ("grid", 2), ("naive", 3)]:
        sim = heap(5, 2)
        sim = Simulation.of_model(sim.scene, sim.model, broad_phase=method, threads=threads)
        sim.run(duration=0.8)
        hashes.add(sim.state_hash())
    assert len(hashes) == 1
    sim.save(tmp_path / "run.ckpt")
    again = Simulation.load(tmp_path / "run.ckpt")
    for one in (sim, again):
        one.run(duration=0.2)
    assert again.state_hash() == sim.state_hash()


def test_a_hopper_empties_through_its_orifice_and_nowhere_else():
    """Half of it in 1.5 s: what is not below the orifice is within the funnel."""
    sim = Simulation(load_scene(Path(__file__).parent.parent / "scenes" / "hopper.toml"))
    sim.run(duration=1.5)
    x, y, z = sim.particles.position.T
    funnel = np.interp(z, [0.04, 0.5], [0.17, 0.5])
    assert (np.hypot(x, y)[z > -0.04] < funnel[z > -0.04]).all()
    assert 0.3 < (z < -0.04).mean() < 0.9


def test_a_fast_thin_plate_that_spins_onto_a_sheet_stays_on_its_side():
    """Thrown down on it at 40 m/s, turning at 300 rad/s, with friction and gravity on."""
    random = np.random.default_rng(6)
    plate, sheet = {"kind": "box", "edges": [1.0, 0.8, 0.02]}, ground(12, 3.0)
    poses = [
        {
            "position": (x, y, 0.5),
            "velocity": (3.0, 2.0, -40.0),
            "spin": tuple(random.normal(size=3) * 170.0),
            "orientation": random.normal(size=4).tolist(),
        }
        for x in (-1.5, 0.0, 1.5)
        for y in (-1.5, 0.0, 1.5)
    ]
    sim = on(sheet, listed(plate, *poses, size=0.6), restitution=0.4, friction=0.3)
    for _ in range(20):
        sim.run(duration=0.02)
        x, y, z = sim.particles.position.T
        assert (z[(np.abs(x) < 2.9) & (np.abs(y) < 2.9)] > -1e-3).all()


# ---- sleep -----------------------------------------------------------------------------------------------------------


def closed(sim):
    """What energy, dissipation and work add up to [J]: always the same."""
    return sim.ledger.energy + sim.ledger.dissipated.sum() - sim.ledger.work


@pytest.fixture(scope="module")
def sleepers(tmp_path_factory):
    """A heap asleep in a bowl of triangles, as a file; nothing in it rolls for ever."""
    sim = heap(3, 5, shapes=("cube", "tetrahedron"))
    begin = closed(sim)
    sim.run(duration=6.0)
    assert asleep(sim).all()
    assert closed(sim) == pytest.approx(begin, rel=1e-12)
    path = tmp_path_factory.mktemp("bowl") / "asleep.ckpt"
    sim.save(path)
    return path


def test_a_heap_asleep_on_a_mesh_does_not_move_by_a_bit(sleepers):
    sim = Simulation.load(sleepers)
    start, poses = sim.ledger, (sim.particles.position.tobytes(), sim.particles.orientation.tobytes())
    sim.run(duration=30.0)
    assert (sim.particles.position.tobytes(), sim.particles.orientation.tobytes()) == poses
    assert sim.ledger.energy == start.energy
    assert sim.largest_overlap() < 1e-4 * 0.2


def test_what_is_struck_in_a_heap_asleep_on_a_mesh_wakes(sleepers, tmp_path):
    """It goes on from there, the same whatever the threads and the broad phase, and gains nothing."""
    one = Simulation.load(sleepers)
    one.particles.velocity[one.particles.position[:, 2].argmax()] = (0.5, 0.3, 1.5)
    begin = closed(one)
    one.run(duration=0.2)
    assert not asleep(one).all()
    one.save(tmp_path / "half.ckpt")
    two = Simulation.load(tmp_path / "half.ckpt", broad_phase="naive", threads=2)
    for sim in (one, two):
        sim.run(duration=0.5)
        assert closed(sim) == pytest.approx(begin, rel=1e-12)
        assert (sim.particles.position[:, 2] > hills(*sim.particles.position[:, :2].T) - 1e-3).all()
    assert one.state_hash() == two.state_hash()
    one.run(duration=5.0)
    assert asleep(one).all()


def setting_off(speed, at):
    """The floor, which goes at a velocity from a time on [s]."""
    return Obstacle(FLOOR, (0, 0, 0), pieces=(Piece(0.0, (0, 0, 0)), Piece(at, (0, 0, 0), velocity=speed)))


def test_a_mesh_that_goes_up_takes_along_what_sleeps_on_it():
    """It works m g v, and what lies on it goes as fast."""
    stack = listed("cube", lying(), lying(1.5), mass=2.0)
    sim = on(setting_off((0, 0, 0.5), 2.0), stack, friction=0.5)
    sim.run(duration=2.0)
    check_taken_along(sim, 0.5)


def test_a_mesh_that_slides_away_drags_what_sleeps_on_it():
    """It slips with mu g until it is as fast, after v / (mu g)."""
    speed, friction = 1.0, 0.5
    sim = on(setting_off((speed, 0, 0), 2.0), listed("cube", lying()), friction=friction)
    sim.run(duration=2.0)
    assert asleep(sim).all()
    before = sim.particles.position[0].copy()
    sim.run(duration=1.0)
    gone = speed * (1.0 - 0.5 * speed / (friction * G))
    assert sim.particles.velocity[0] == pytest.approx((speed, 0, 0), abs=1e-6)
    assert sim.particles.position[0] - before == pytest.approx((gone, 0, 0), abs=2e-3)


def test_a_mesh_that_comes_up_through_a_hole_wakes_what_it_reaches():
    sides = trimesh.util.concatenate(
        [trimesh.creation.box((1, 4, 1)).apply_translation((x, 0, -0.5)) for x in (-0.8, 0.8)]
    )
    start = (0, 0, -0.5)
    rises = Piece(0.0, start), Piece(2.0, start, velocity=(0, 0, 0.5))
    obstacles = [
        Obstacle(triangle_mesh("sides", sides.vertices, sides.faces), (0, 0, 0)),
        Obstacle(ground(2, 0.2), start, pieces=rises),
    ]
    what = scene(listed("cube", {"position": (0, 0, 0.5)}), boundary="open", gravity=(0, 0, -G), restitution=0.0)
    sim = Simulation.of_model(what, build(what, [o._replace(material=Material(restitution=0.0)) for o in obstacles]))
    sim.run(duration=2.9)
    assert asleep(sim).all() and sim.particles.position[0, 2] == pytest.approx(0.5, abs=1e-3)
    sim.run(duration=1.1)
    assert sim.particles.position[0] == pytest.approx((0, 0, 1.0), abs=1e-3)
    assert sim.particles.velocity[0] == pytest.approx((0, 0, 0.5), abs=1e-6)
