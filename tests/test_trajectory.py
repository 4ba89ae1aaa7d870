"""Trajectories in GSD files."""

from dataclasses import fields

import gsd.fl
import gsd.hoomd
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import particlesim as ps
from particlesim.scene.file import SceneError
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


def test_frames_are_counted_from_the_end_too(run):
    _, frames, path = run
    with Trajectory(path) as trajectory:
        for k in range(-4, 0):
            assert trajectory[k].time == trajectory.time(k) == trajectory.ledger(k).time == frames[k].time
            assert np.array_equal(trajectory[k].impacts, frames[k].impacts)
        for k in (-5, 4):
            with pytest.raises(IndexError, match=rf"run.gsd: frames are 0 to 3, or -4 to -1, there is no {k}$"):
                trajectory[k]


def test_what_is_written_is_read(run):
    sim, frames, path = run
    with Trajectory(path) as trajectory:
        assert len(trajectory) == 4
        header = trajectory.header
        assert header.scene_json == sim.header.scene_json
        assert [shape.name for shape in header.shapes] == ["sphere", "cube", "pyramid", "box"]
        assert all(np.allclose(a.vertices, b.vertices) for a, b in zip(header.shapes, sim.model.shapes, strict=True))
        assert np.array_equal(header.size, sim.particles.size)
        assert np.array_equal(header.group, sim.particles.group)
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
    assert np.allclose(particles.mass, sim.particles.mass, rtol=1e-6)
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
        assert np.array_equal(trajectory.header.size, sim.particles.size)


def test_a_file_appears_whole_or_not_at_all(tmp_path):
    def stop(*_):
        raise RuntimeError("half way")

    (tmp_path / "run.gsd").write_text("what was there before")
    with pytest.raises(RuntimeError, match="half way"):
        ps.simulate(gas(2), tmp_path / "run.gsd", progress=stop)
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
    with pytest.raises(TrajectoryError, match="has no frames"):
        Trajectory(tmp_path / "other.gsd")
    with gsd.hoomd.open(str(tmp_path / "old.gsd"), "w") as file:
        frame = gsd.hoomd.Frame()
        frame.log["particlesim/scene"] = np.zeros(1, dtype=np.uint8)
        file.append(frame)
    with pytest.raises(TrajectoryError, match="older particlesim"):
        Trajectory(tmp_path / "old.gsd")


def look_through(path):
    """Everything that is in a trajectory."""
    with Trajectory(path) as trajectory:
        return (
            trajectory.scene,
            trajectory.header,
            list(trajectory),
            [trajectory.time(k) for k in range(len(trajectory))],
        )


def spoiled(path, chunk, values):
    """A trajectory's copy with other values in one of its chunks, or without it if they are None."""
    copy = path.with_name("spoiled.gsd")
    with gsd.fl.open(str(path), "r") as old, gsd.fl.open(str(copy), "w", "a", "hoomd", [1, 4]) as new:
        for k in range(old.nframes):
            for name in old.find_matching_chunk_names(""):
                if old.chunk_exists(k, name) and not (name == chunk and values is None):
                    new.write_chunk(name, values if name == chunk else old.read_chunk(k, name))
            new.end_frame()
    return copy


def text(words):
    return np.frombuffer(words.encode(), dtype=np.uint8)


@pytest.mark.parametrize(
    ("chunk", "values"),
    [
        ("log/particlesim/shapes", None),
        ("log/particlesim/shapes", text("[{]")),
        ("log/particlesim/shapes", text('[{"kind": 0}]')),
        ("log/particlesim/scene", text('{"world": }')),
        ("log/particlesim/scene", np.array([200, 201, 202], dtype=np.uint8)),
        ("log/particlesim/scene", text('{"world": {"size": [3, 3, 3]}, "particles": [{"shape": "cube", "count": 1}]}')),
        ("log/particlesim/shape", np.full(20, 99, dtype=np.int32)),
        ("log/particlesim/shape", np.zeros(3, dtype=np.int32)),
        ("log/particlesim/size", np.zeros(20)),
        ("log/particlesim/group", np.full(20, 99, dtype=np.int32)),
        ("log/particlesim/time", np.array([np.nan])),
        ("log/particlesim/ledger/momentum", np.zeros(2)),
        ("log/particlesim/ledger/impacts", np.array([np.nan])),
        ("particles/position", np.full((20, 3), np.inf, dtype=np.float32)),
        ("particles/position", np.zeros((19, 3), dtype=np.float32)),
        ("particles/orientation", np.zeros((20, 4), dtype=np.float32)),
        ("particles/mass", np.full(20, -1.0, dtype=np.float32)),
    ],
)
def test_what_a_file_says_is_not_taken_for_granted(run, chunk, values):
    look_through(spoiled(run[2], "no such chunk", None))
    path = spoiled(run[2], chunk, values)
    with pytest.raises(TrajectoryError) as error:
        look_through(path)
    assert str(error.value).startswith(f"{path}: damaged") and "\n" not in str(error.value)


def test_a_file_without_a_number_of_the_ledger_is_an_older_one(run):
    path = spoiled(run[2], "log/particlesim/ledger/virial", None)
    with pytest.raises(TrajectoryError, match="written by an older particlesim; simulate its scene again"):
        Trajectory(path)


# Where in an index entry its frame, its rows and its columns are, each with more than there can be.
@pytest.mark.parametrize(("at", "length", "value"), [(0, 8, 2**50), (8, 8, 2**40), (8, 8, 2**63), (24, 4, 2**31)])
def test_sizes_are_checked_before_memory_is_asked_for(run, at, length, value):
    content = bytearray(run[2].read_bytes())
    begin = int.from_bytes(content[8:16], "little") + 32 * 5 + at
    content[begin : begin + length] = value.to_bytes(length, "little")
    run[2].write_bytes(content)
    with pytest.raises(TrajectoryError, match="damaged: its index points to what is not there"):
        look_through(run[2])


def test_a_file_that_ends_early_is_damaged(run):
    content = run[2].read_bytes()
    for length in range(0, len(content), max(1, len(content) // 40)):
        run[2].write_bytes(content[:length])
        with pytest.raises(TrajectoryError) as error:
            look_through(run[2])
        assert "\n" not in str(error.value)


def test_files_with_changed_bytes_are_read_or_refused_in_one_line(run):
    rng = np.random.default_rng(1)
    content = run[2].read_bytes()
    outcomes = []
    for _ in range(60):
        changed = np.frombuffer(content, dtype=np.uint8).copy()
        changed[rng.integers(0, len(changed), 200)] = rng.integers(0, 256, 200)
        run[2].write_bytes(changed.tobytes())
        try:
            look_through(run[2])
            outcomes.append("")
        except (TrajectoryError, SceneError) as error:
            outcomes.append(str(error))
    assert all("\n" not in line for line in outcomes)
    assert sum(bool(line) for line in outcomes) > 30
