"""Meshes of thousands of corners in motion, at rest and in files: as any other body, with the mass of the whole."""

import numpy as np
import pytest
import trimesh

import particlesim as ps
from particlesim.trajectory.gsd_file import Trajectory


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """A ball of 2,562 corners, one of 10,242 and a drum of 400, of diameter 1."""
    folder = tmp_path_factory.mktemp("meshes")
    trimesh.creation.icosphere(subdivisions=4, radius=0.5).export(folder / "ball.stl")
    trimesh.creation.icosphere(subdivisions=5, radius=0.5).export(folder / "fine.stl")
    trimesh.creation.cylinder(radius=0.5, height=1.0, sections=200).export(folder / "drum.stl")
    return folder


def mesh(files, name, **keys):
    return {"shape": {"kind": "mesh", "file": str(files / f"{name}.stl")}, **keys}


def test_a_gas_of_fine_meshes_keeps_its_energy(files):
    motion = {"velocity": {"kind": "maxwell", "temperature": 20.0}, "spin": {"kind": "maxwell", "temperature": 20.0}}
    scene = ps.Scene(
        seed=3,
        world={"size": (3, 3, 3), "boundary": ["periodic", "wall", "wall"]},
        particles=[
            mesh(files, "ball", count=8, size=0.8, **motion),
            mesh(files, "drum", count=8, size=0.6, **motion),
            {"shape": "cube", "count": 4, "size": 0.5, **motion},
            {"shape": "sphere", "count": 4, "size": 0.5, **motion},
        ],
    )
    simulation = ps.Simulation(scene)
    before = simulation.ledger
    simulation.run(duration=2.0)
    after = simulation.ledger
    assert after.impacts > 50
    assert after.energy == pytest.approx(before.energy, rel=1e-12)
    assert after.momentum[0] == pytest.approx(before.momentum[0], abs=1e-12 * before.energy)
    assert simulation.largest_overlap() < 1e-6


def test_a_drum_that_lands_flat_comes_to_rest_on_its_base(files):
    scene = ps.Scene(
        world={"size": (4, 4, 4), "gravity": (0, 0, -9.81), "restitution": 0.3},
        particles=[
            mesh(files, "drum", placement={"kind": "list", "poses": [{"position": (0, 0, -1.3)}]}),
            mesh(files, "ball", size=0.5, placement={"kind": "list", "poses": [{"position": (0.02, 0, -0.4)}]}),
        ],
    )
    simulation = ps.Simulation(scene)
    simulation.run(duration=1.0)
    assert np.linalg.norm(simulation.particles.velocity[0]) < 1e-3
    assert simulation.particles.position[0, 2] == pytest.approx(-1.5, abs=1e-3)
    assert simulation.largest_overlap() < 1e-4


def test_a_thinned_mesh_stays_what_it_is_in_a_trajectory(files, tmp_path):
    poses = [{"position": (0, 0, 0), "spin": (1, 2, 3)}]
    group = mesh(files, "fine", placement={"kind": "list", "poses": poses})
    scene = ps.Scene(duration=0.1, world={"size": (4, 4, 4)}, particles=[group])
    ps.simulate(scene, tmp_path / "run.gsd")
    (shape,) = ps.Simulation(scene).model.shapes
    with Trajectory(tmp_path / "run.gsd") as run:
        (stored,) = run.header.shapes
        assert (len(stored.vertices), stored.described_corners) == (4096, 10_242)
        np.testing.assert_allclose(np.sort(stored.vertices, axis=0), np.sort(shape.vertices, axis=0), atol=1e-12)
        assert (stored.volume, *stored.moments) == (shape.volume, *shape.moments)
        assert run.header.mass[0] == pytest.approx(1000.0 * shape.volume, rel=1e-6)
    assert shape.volume == pytest.approx(trimesh.load(files / "fine.stl").volume, rel=1e-6)
