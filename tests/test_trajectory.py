"""Trajectories in GSD files."""

from dataclasses import fields

import gsd.hoomd
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from particlesim.simulation.simulation import Simulation
from particlesim.trajectory.frames import Ledger
from particlesim.trajectory.gsd_file import Trajectory, TrajectoryError, TrajectoryWriter
from tests.worlds import gas, scene


@pytest.fixture
def run(tmp_path):
    sim = Simulation(gas(5, boundary="periodic", size=(3, 3, 3)))
    frames = []
    with TrajectoryWriter(tmp_path / "run.gsd", sim.header) as writer:
        for _ in range(4):
            frames.append(sim.frame())
            writer.append(frames[-1])
            sim.run(steps=5)
    return sim, frames, tmp_path / "run.gsd"


def test_what_is_written_is_read(run):
    sim, frames, path = run
    with Trajectory(path) as trajectory:
        assert len(trajectory) == 4
        header = trajectory.header
        assert header.scene_json == sim.header.scene_json
        assert [shape.name for shape in header.shapes] == ["sphere", "cube", "pyramid", "box"]
        assert all(np.allclose(a.vertices, b.vertices) for a, b in zip(header.shapes, sim.shapes, strict=True))
        assert np.array_equal(header.size, sim.constants.size)
        assert np.array_equal(header.group, sim.constants.group)
        for read, written in zip(trajectory, frames, strict=True):
            assert read.time == written.time
            for name in ("position", "orientation", "velocity", "angular_momentum"):
                assert np.allclose(getattr(read, name), getattr(written, name), rtol=1e-6, atol=1e-5), name
            assert np.array_equal(read.image, written.image)
            assert np.array_equal(read.impacts, written.impacts)
            for field in fields(Ledger):
                assert np.array_equal(getattr(read.ledger, field.name), getattr(written.ledger, field.name)), field.name
                assert type(getattr(read.ledger, field.name)) is type(getattr(written.ledger, field.name)), field.name


def test_other_programs_find_the_hoomd_schema(run):
    sim, frames, path = run
    with gsd.hoomd.open(str(path)) as file:
        frame = file[3]
    particles = frame.particles
    assert frame.configuration.box.tolist() == [3, 3, 3, 0, 0, 0]
    shapes = [particles.type_shapes[t] for t in particles.typeid]
    assert shapes[0] == {"type": "Sphere", "diameter": pytest.approx(0.3)}
    assert shapes[5]["type"] == "ConvexPolyhedron"
    assert np.allclose(np.abs(shapes[5]["vertices"]), 0.15)
    assert particles.diameter[[0, 5]].tolist() == pytest.approx([0.3, 2.0])
    assert np.allclose(particles.mass, sim.constants.mass, rtol=1e-6)
    # HOOMD's angular momentum is 2 q (0, L_body).
    q, p = particles.orientation[7], particles.angmom[7]
    body = Rotation.from_quat(np.roll(q, -1)).inv().apply(frames[3].angular_momentum[7])
    conjugate = q * [1, -1, -1, -1]
    product = 0.5 * (conjugate[0] * p[1:] + p[0] * conjugate[1:] + np.cross(conjugate[1:], p[1:]))
    assert np.allclose(product, body, atol=1e-4)


def test_many_sizes_become_a_bounded_number_of_types(tmp_path):
    sizes = {"kind": "log-uniform", "low": 0.05, "high": 0.2}
    sim = Simulation(scene({"shape": "tetrahedron", "count": 300, "size": sizes}, size=(4, 4, 4)))
    with TrajectoryWriter(tmp_path / "run.gsd", sim.header) as writer:
        writer.append(sim.frame())
    with gsd.hoomd.open(str(tmp_path / "run.gsd")) as file:
        assert len(file[0].particles.types) == 64
    with Trajectory(tmp_path / "run.gsd") as trajectory:
        assert np.array_equal(trajectory.header.size, sim.constants.size)


def test_a_file_appears_whole_or_not_at_all(tmp_path):
    sim = Simulation(gas(2))
    (tmp_path / "run.gsd").write_text("what was there before")
    with pytest.raises(RuntimeError, match="half way"), TrajectoryWriter(tmp_path / "run.gsd", sim.header) as writer:
        writer.append(sim.frame())
        raise RuntimeError("half way")
    assert (tmp_path / "run.gsd").read_text() == "what was there before"
    assert [path.name for path in tmp_path.iterdir()] == ["run.gsd"]


def test_other_files_are_refused_in_one_line(tmp_path):
    with pytest.raises(TrajectoryError, match="no such file"):
        Trajectory(tmp_path / "missing.gsd")
    (tmp_path / "text.gsd").write_text("hello")
    with pytest.raises(TrajectoryError, match="not a GSD file"):
        Trajectory(tmp_path / "text.gsd")
    with gsd.hoomd.open(str(tmp_path / "other.gsd"), "w") as file:
        file.append(gsd.hoomd.Frame())
    with pytest.raises(TrajectoryError, match="not written by particlesim"):
        Trajectory(tmp_path / "other.gsd")
    with gsd.hoomd.open(str(tmp_path / "old.gsd"), "w") as file:
        frame = gsd.hoomd.Frame()
        frame.log["particlesim/scene"] = np.zeros(1, dtype=np.uint8)
        file.append(frame)
    with pytest.raises(TrajectoryError, match="older particlesim"):
        Trajectory(tmp_path / "old.gsd")
