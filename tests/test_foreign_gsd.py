"""GSD files of other programs, written here by GSD's own library as HOOMD-blue does: what is drawn, what is assumed."""

import gsd.hoomd
import numpy as np
import pytest
from typer.testing import CliRunner

import particlesim as ps
from particlesim.cli.main import app

CUBE = [[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]
OF_A = {"type": "ConvexPolyhedron", "vertices": CUBE, "rounding_radius": 0.1}


def write(path, frames=2, count=4, box=(8, 8, 8, 0, 0, 0), **particles):
    random = np.random.default_rng(3)
    with gsd.hoomd.open(str(path), "w") as file:
        for k in range(frames):
            frame = gsd.hoomd.Frame()
            frame.configuration.step, frame.configuration.box = 1000 * k, box
            frame.particles.N = count
            frame.particles.position = random.uniform(-3, 3, (count, 3))
            for name, value in particles.items():
                setattr(frame.particles, name, value)
            file.append(frame)
    return path


def test_shapes_of_types(tmp_path):
    shapes = [{"type": "Sphere", "diameter": 1.5}, OF_A, {}]
    typeid, diameter = [0, 1, 2, 2], [9.0, 9.0, 0.25, 0.5]
    path = write(tmp_path / "x.gsd", types=["S", "P", "D"], type_shapes=shapes, typeid=typeid, diameter=diameter)
    with ps.Trajectory(path) as trajectory:
        header, frame = trajectory.header, trajectory[1]
        np.testing.assert_allclose(header.size, [1.5, 1.0, 0.25, 0.5])
        rounded = header.shapes[header.shape[1]]
        corner = np.sqrt(3.0) * 0.5 + 0.1
        assert rounded.rounding == pytest.approx(0.1) and rounded.radius == pytest.approx(corner)
        assert [group.name for group in trajectory.scene.particles] == ["S", "P", "D"]
        assert trajectory.scene.world.size == (8, 8, 8) and trajectory.time(1) == pytest.approx(1 / 30)
        assert trajectory.assumed == (
            "D: spheres of the diameters in the file",
            "a frame every 1/30 s, and lengths in metres",
        )
        assert frame.ledger is None and frame.position.shape == (4, 3)


def test_polygons_and_ellipsoids(tmp_path):
    shapes = [
        {"type": "Polygon", "vertices": [[0, 1], [-1, -1], [1, -1]]},
        {"type": "Ellipsoid", "a": 2.0, "b": 1.0, "c": 0.5},
        {"type": "SphereUnion", "diameters": [1.0]},
    ]
    path = write(tmp_path / "x.gsd", box=(8, 8, 0, 0, 0, 0), types=list("PEU"), type_shapes=shapes, typeid=[0, 1, 2, 2])
    with ps.Trajectory(path) as trajectory:
        polygon, ellipsoid, union = trajectory.header.shapes
        assert np.ptp(polygon.vertices, axis=0) == pytest.approx([2.0, 2.0, 0.2])
        assert np.ptp(ellipsoid.vertices, axis=0) == pytest.approx([4.0, 2.0, 1.0], rel=5e-3)
        assert union.kind == ps.CATALOGUE["sphere"]().kind
        assert trajectory.scene.world.boundary == ("periodic", "periodic", "open")
        told = " | ".join(trajectory.assumed)
        for part in (
            "P: polygons as thin prisms",
            "E: ellipsoids as hulls of 600 points",
            'U: spheres, as its shape {"type',
        ):
            assert part in told


def test_tilted_boxes(tmp_path):
    """The corners of a box with xy = 1/2, xz = 1/4 and yz = 1/2, by the definition of HOOMD's lattice vectors."""
    with ps.Trajectory(write(tmp_path / "x.gsd", box=(4, 4, 4, 0.5, 0.25, 0.5))) as trajectory:
        edges = np.array([[4, 0, 0], [2, 4, 0], [1, 2, 4]])
        assert trajectory.scene.world.size == tuple(np.abs(edges).sum(axis=0))
        assert "a tilted box: the straight one about it" in trajectory.assumed


@pytest.mark.parametrize(
    ("shape", "message"),
    [
        ({"type": "Sphere"}, "type 'A' is a Sphere without the key 'diameter'"),
        ({"type": "Sphere", "diameter": -1}, "type 'A' is no Sphere that can be drawn: its size is -1"),
        ({"type": "ConvexPolyhedron", "vertices": [[0, 0, 0], [1, 0, 0]]}, "the vertices of 'A' enclose no volume"),
        ({"type": "ConvexPolyhedron", "vertices": [[0, 0], [1, "x"]]}, "type 'A' is no ConvexPolyhedron that can be"),
        ({"type": "Mesh", "vertices": 7, "indices": []}, "its vertices are not rows of 3 finite numbers"),
    ],
)
def test_bad_shapes_end_in_one_line(tmp_path, shape, message):
    path = write(tmp_path / "x.gsd", types=["A"], type_shapes=[shape])
    result = CliRunner().invoke(app, ["render", str(path), "-o", str(tmp_path / "x.mp4")])
    assert result.exit_code == 2 and message in result.stderr
    assert result.stderr.startswith(f"{path}: ") and result.stderr.count("\n") == 1
    assert not (tmp_path / "x.mp4").exists()


def test_particles_that_come_or_change(tmp_path):
    with gsd.hoomd.open(str(tmp_path / "grows.gsd"), "w") as file:
        for count in (3, 4):
            frame = gsd.hoomd.Frame()
            frame.configuration.box, frame.particles.N = [8, 8, 8, 0, 0, 0], count
            frame.particles.position = np.zeros((count, 3))
            file.append(frame)
    come_or_go = pytest.raises(ps.TrajectoryError, match="particles come or go in frame 1")
    with ps.Trajectory(tmp_path / "grows.gsd") as trajectory, come_or_go:
        trajectory[1]
    with pytest.raises(ps.TrajectoryError, match="has no particles to draw"):
        ps.Trajectory(write(tmp_path / "none.gsd", count=0))


def test_a_movie_says_what_was_assumed(tmp_path):
    path = write(tmp_path / "x.gsd", diameter=[0.5, 1.0, 1.5, 2.0])
    args = ["render", str(path), "-o", str(tmp_path / "x.mp4"), "--size", "64x64"]
    result = CliRunner().invoke(app, args)
    assert result.exit_code == 0 and (tmp_path / "x.mp4").stat().st_size and (tmp_path / "x.png").exists()
    assert f"{path}: assumed: A: spheres of the diameters in the file\n" in result.stderr
    assert "assumed" not in CliRunner().invoke(app, [*args, "--quiet"]).stderr
