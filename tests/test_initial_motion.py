"""From a scene to arrays: how particles are turned at the start, and how they move."""

import math

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree
from scipy.stats import kstest

import particlesim as ps
from particlesim.setup.build import build
from tests.test_build import built, turns

# ---- how they are turned ------------------------------------------------------------------------------------------


def test_random_orientations_are_even():
    made = built({"shape": "cube", "count": 3000, "size": 0.02})
    z = turns(made.particles["orientation"]).apply([0.0, 0.0, 1.0])
    for axis in range(3):  # Archimedes: each coordinate of an even unit vector is even
        assert kstest(z[:, axis], "uniform", args=(-1.0, 2.0)).pvalue > 0.01


def test_a_group_may_be_turned_as_one():
    group = {"shape": "cube", "count": 5, "size": 0.1, "orientation": {"axis": [1, 0, 0], "angle": 60}}
    for q in built(group, {**group, "orientation": "aligned"}).particles["orientation"][:5]:
        assert q == pytest.approx([math.cos(math.pi / 6.0), 0.5, 0.0, 0.0])
    assert (built({**group, "orientation": "aligned"}).particles["orientation"] == [1.0, 0.0, 0.0, 0.0]).all()


@pytest.mark.parametrize("suffix", [".stl", ".obj", ".ply"])
@pytest.mark.parametrize("turn", [[1.0, 0.0, 0.0, 0.0], [0.5, 0.1, -0.7, 0.2]])
def test_a_mesh_stands_as_its_file_says(suffix, turn, tmp_path):
    rng = np.random.default_rng(5)
    corners = rng.normal(size=(12, 3)) * [1.0, 0.6, 0.3]
    hull = trimesh.convex.convex_hull(corners)
    hull.export(tmp_path / f"part{suffix}")
    path = tmp_path / "scene.toml"
    path.write_text(
        f"[world]\nsize = [9, 9, 9]\n[[particles]]\nsize = 0.7\ncount = 1\norientation = {turn}\n"
        f'shape = {{ kind = "mesh", file = "part{suffix}" }}\n'
    )
    made = build(ps.load_scene(path))
    shape = made.shapes[0]
    there = turns(made.particles["orientation"]).apply(shape.vertices * 0.7)
    expected = turns(np.array([turn])).apply((hull.vertices - hull.center_mass) * 0.7)
    distance, _ = cKDTree(there).query(expected)
    assert distance.max() < 1e-5  # STL holds single precision
    assert shape.volume == pytest.approx(hull.volume, rel=1e-5)
    assert made.particles["mass"][0] == pytest.approx(1000.0 * hull.volume * 0.7**3, rel=1e-5)


# ---- how they move ------------------------------------------------------------------------------------------------


def moving(count=6000, shape="cube", **keys):
    return built({"shape": shape, "count": count, "size": 0.01, "mass": 2.0, **keys}, seed=11)


def test_maxwell_velocities_have_their_temperature_and_drift():
    velocity = moving(velocity={"kind": "maxwell", "temperature": 8.0, "drift": [1.0, 0.0, -2.0]}).particles["velocity"]
    for axis, drift in enumerate([1.0, 0.0, -2.0]):  # variance T / m
        assert kstest(velocity[:, axis], "norm", args=(drift, 2.0)).pvalue > 0.01


def test_maxwell_spins_have_their_temperature_about_every_axis():
    made = moving(shape={"kind": "box", "edges": [1, 2, 3]}, spin={"kind": "maxwell", "temperature": 8.0})
    body = turns(made.particles["orientation"]).apply(made.particles["angular_momentum"], inverse=True)
    for axis in range(3):  # variance I T of the angular momentum about each principal axis
        width = math.sqrt(8.0 * made.particles["principal_inertia"][0, axis])
        assert kstest(body[:, axis] / width, "norm").pvalue > 0.01
    energy = 0.5 * (body**2 / made.particles["principal_inertia"]).sum(axis=1)
    assert energy.mean() == pytest.approx(1.5 * 8.0, rel=0.05)


def test_uniform_speeds_go_evenly_in_all_directions():
    velocity = moving(velocity={"kind": "uniform", "speed": 3.0, "drift": [0.0, 0.0, 5.0]}).particles["velocity"]
    velocity = velocity - [0.0, 0.0, 5.0]
    assert np.linalg.norm(velocity, axis=1) == pytest.approx(3.0)
    for axis in range(3):
        assert kstest(velocity[:, axis], "uniform", args=(-3.0, 6.0)).pvalue > 0.01


def test_radial_velocities_point_from_the_centre_or_to_it():
    centre = np.array([0.5, 0.0, 0.0])
    for kind, sign in (("outward", 1.0), ("inward", -1.0)):
        state = moving(200, velocity={"kind": kind, "speed": 2.0, "centre": centre.tolist()}).particles
        arm = state["position"] - centre
        assert state["velocity"] == pytest.approx(sign * 2.0 * arm / np.linalg.norm(arm, axis=1, keepdims=True))


def test_a_particle_in_the_centre_has_no_way_outward():
    listed = {"kind": "list", "poses": [{"position": [0, 0, 0]}]}
    group = {"shape": "sphere", "size": 1, "placement": listed, "velocity": {"kind": "outward", "speed": 2}}
    assert built(group).particles["velocity"].tolist() == [[0.0, 0.0, 0.0]]


def test_given_and_even_spins_are_angular_velocities():
    for spin in ([1.0, 2.0, 3.0], {"kind": "uniform", "speed": 4.0}):
        made = moving(300, shape={"kind": "box", "edges": [1, 2, 3]}, spin=spin)
        body = turns(made.particles["orientation"]).apply(made.particles["angular_momentum"], inverse=True)
        omega = turns(made.particles["orientation"]).apply(body / made.particles["principal_inertia"])
        if isinstance(spin, list):
            assert omega == pytest.approx(np.tile(spin, (300, 1)))
        else:
            assert np.linalg.norm(omega, axis=1) == pytest.approx(4.0)


def test_what_is_not_said_is_at_rest():
    state = moving(10).particles
    assert not state["velocity"].any()
    assert not state["angular_momentum"].any()
