"""Random placement where insertion one by one jams, above a fill of 0.3: particles are pushed apart."""

import math

import numpy as np
import pytest

import particlesim as ps
from particlesim.setup.build import build

EDGE = 4.0
VOLUME = {"sphere": math.pi / 6.0, "cube": 1.0, "tetrahedron": 1.0 / (6.0 * math.sqrt(2.0))}


def group(shape, count, fill, **keys):
    """A group that fills so much of the world."""
    return {"shape": shape, "count": count, "size": (fill * EDGE**3 / (count * VOLUME[shape])) ** (1.0 / 3.0), **keys}


def built(*groups, boundary="wall", seed=3, **keys):
    world = {"size": [EDGE] * 3, "boundary": boundary}
    return build(ps.Scene(world=world, seed=seed, particles=list(groups), **keys))


def least_gap(particles, shape, boundary):
    """The least distance between two particles of a shape, and between one and a wall [m]; below 0 is an overlap."""
    period = [EDGE * (boundary == "periodic")] * 3
    position, reach = particles["position"], particles["radius"][:, None]
    pairs = ps.find_pairs(position - reach, position + reach, "naive", period=period)
    poses = [
        ps.Pose(p.tolist(), orientation=q.tolist(), size=float(s))
        for p, q, s in zip(position, particles["orientation"], particles["scale"], strict=True)
    ]
    gaps = []
    for i, j in pairs:
        away = position[j] - position[i]
        away -= np.multiply(period, np.round(away / EDGE))
        other = poses[j]._replace(position=(position[i] + away).tolist())
        gaps.append(ps.separation(shape, poses[i], shape, other).distance)
    return min(gaps)


@pytest.mark.parametrize(
    ("shape", "count", "fill", "boundary"),
    [
        ("sphere", 400, 0.5, "wall"),
        ("sphere", 400, 0.5, "periodic"),
        ("sphere", 400, 0.59, "periodic"),
        ("cube", 300, 0.36, "periodic"),
        ("tetrahedron", 300, 0.29, "wall"),
    ],
)
def test_a_dense_crowd_is_placed_without_overlap(shape, count, fill, boundary):
    asked = group(shape, count, fill)
    particles = built(asked, boundary=boundary).particles
    assert (particles["scale"] == asked["size"]).all()
    assert (np.abs(particles["position"]) <= 0.5 * EDGE).all()
    assert least_gap(particles, shape, boundary) > -1e-12
    assert particles["position"].tobytes() == built(asked, boundary=boundary).particles["position"].tobytes()


def test_a_dense_crowd_is_spread_evenly():
    position = built(group("sphere", 1500, 0.55), boundary="periodic").particles["position"]
    # Spheres keep their distance, so numbers scatter less than those of points do.
    for axis in range(3):
        for shift in (0.0, 0.25 * EDGE):
            half = ((position[:, axis] + shift) % EDGE < 0.5 * EDGE).sum()
            assert abs(half - 750) < 3.0 * math.sqrt(1500 / 4)


def test_a_dense_crowd_of_many_sizes_is_placed():
    sizes = {"kind": "uniform", "low": 0.2, "high": 0.6}
    particles = built({"shape": "sphere", "count": 800, "size": sizes}, boundary="periodic").particles
    assert 0.45 < (math.pi / 6.0 * particles["scale"] ** 3).sum() / EDGE**3 < 0.7
    assert least_gap(particles, "sphere", "periodic") > -1e-12


def test_what_is_not_at_random_stays_and_is_in_the_way():
    listed = {"shape": "sphere", "size": 1.5, "placement": {"kind": "list", "poses": [{"position": [0.7, 0.7, 0.7]}]}}
    obstacle = {"shape": "sphere", "size": 1.5, "position": [-0.8, -0.8, -0.8]}
    floor = {"shape": {"kind": "plane", "normal": [0, 0, 1]}, "position": [0, 0, -1.7]}
    particles = built(group("sphere", 400, 0.42), listed, obstacles=[obstacle, floor]).particles
    assert particles["position"][-1].tolist() == [0.7, 0.7, 0.7]
    assert least_gap(particles, "sphere", "wall") > -1e-12
    radius = 0.5 * particles["scale"]
    assert (np.linalg.norm(particles["position"] + 0.8, axis=1) - 0.75 - radius)[:-1].min() > -1e-12
    assert (particles["position"][:, 2] + 1.7 - radius).min() > -1e-12


def test_a_dense_crowd_keeps_to_an_ellipsoid():
    region = {"lower": [-1, -2, -1.5], "upper": [1, 2, 1.5], "form": "ellipsoid"}
    asked = {"shape": "sphere", "count": 500, "size": 0.3, "placement": {"kind": "random", "region": region}}
    particles = built(asked).particles
    smaller = np.array([1.0, 2.0, 1.5]) - 0.15
    assert np.linalg.norm(particles["position"] / smaller, axis=1).max() < 1.0 + 1e-12
    assert least_gap(particles, "sphere", "wall") > -1e-12


@pytest.mark.parametrize("shape", VOLUME)
def test_what_is_denser_than_can_be_says_what_is_reached(shape):
    with pytest.raises(ps.SceneError, match=r"would fill 0\.7 of their room, where 0\.[2-6]\d? is reached") as error:
        built(group(shape, 200, 0.7))
    assert "\n" not in str(error.value)
    assert "particles[0].count = 200: no room for all of them at random" in str(error.value)


def test_where_nothing_fits_is_said():
    obstacle = {"shape": "cube", "size": 3.9, "position": [0, 0, 0]}
    region = {"lower": [-1, -1, -1], "upper": [1, 1, 1]}
    with pytest.raises(ps.SceneError, match="next to nothing is reached"):
        built(
            {"shape": "sphere", "count": 5, "size": 0.1, "placement": {"kind": "random", "region": region}},
            obstacles=[obstacle],
        )
