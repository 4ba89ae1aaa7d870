"""The camera sees the whole world, and no more than it must."""

import numpy as np
import pytest

from particlesim.rendering.camera import FILL, light_azimuth, view_at
from particlesim.scene import Scene

SPHERES = [{"shape": "sphere", "count": 1}]


def scene(camera, size=(10.0, 8.0, 6.0)):
    return Scene(world={"size": size}, particles=SPHERES, camera=camera)


def project(view, aspect, points):
    """Points on the picture, both axes from -1 to 1, and their distance along the camera's axis."""
    local = (np.asarray(points) - view.pose[:3, 3]) @ view.pose[:3, :3]
    slope = np.tan(0.5 * view.field_of_view)
    away = -local[:, 2]
    return local[:, :2] / (away[:, None] * slope * np.array([aspect, 1.0])), away


def corners(size):
    signs = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    return 0.5 * signs * np.asarray(size)


@pytest.mark.parametrize("aspect", [0.3, 9 / 16, 1.0, 16 / 9, 4.0])
@pytest.mark.parametrize("size", [(10.0, 8.0, 6.0), (1.0, 1.0, 1.0), (100.0, 1.0, 1.0), (1e-3, 1e-3, 5e-3)])
@pytest.mark.parametrize("elevation", [-30.0, 0.0, 20.0, 80.0])
def test_fixed_camera_fits_the_world_tightly_and_centred(aspect, size, elevation):
    view = view_at(scene({"kind": "fixed", "elevation": elevation}, size), 0.0, aspect)
    place, away = project(view, aspect, corners(size))
    assert np.all(away > view.near)
    low, high = place.min(axis=0), place.max(axis=0)
    assert max(-low.min(), high.max()) == pytest.approx(FILL, rel=1e-9)
    tight = np.argmax(high - low)
    assert low[tight] == pytest.approx(-high[tight], abs=1e-9)


@pytest.mark.parametrize("aspect", [9 / 16, 16 / 9])
@pytest.mark.parametrize("target", [(0.0, 0.0, 0.0), (1.0, -2.0, 0.5)])
def test_orbit_fits_the_world_at_every_angle(aspect, target):
    orbit = scene({"kind": "orbit", "period": 8.0, "target": target})
    reach = []
    for time in np.linspace(0.0, 8.0, 97):
        place, away = project(view_at(orbit, time, aspect), aspect, corners(orbit.world.size))
        assert np.all(away > 0.0)
        reach.append(np.abs(place).max())
    assert max(reach) <= FILL + 1e-3
    assert max(reach) > 0.9 * FILL


def test_orbit_turns_once_in_its_period_at_the_distance_given():
    orbit = scene({"kind": "orbit", "period": 8.0, "distance": 12.0, "target": (1.0, 0.0, 0.0), "elevation": 0.0})
    start, quarter, whole = (view_at(orbit, time, 1.0).pose for time in (0.0, 2.0, 8.0))
    target = np.array([1.0, 0.0, 0.0])
    arms = [pose[:3, 3] - target for pose in (start, quarter)]
    assert np.linalg.norm(arms, axis=1) == pytest.approx([12.0, 12.0])
    assert arms[0] @ arms[1] == pytest.approx(0.0, abs=1e-9)
    assert np.cross(arms[0], arms[1])[2] > 0.0
    assert whole == pytest.approx(start)


@pytest.mark.parametrize("position", [(5.0, 1.0, 2.0), (0.0, 0.0, 9.0), (0.0, 0.0, -9.0)])
def test_look_at_puts_its_target_in_the_middle(position):
    view = view_at(scene({"kind": "look-at", "position": position, "target": (0.0, 0.0, 1.0)}), 0.0, 1.5)
    place, away = project(view, 1.5, [(0.0, 0.0, 1.0)])
    assert place[0] == pytest.approx([0.0, 0.0], abs=1e-12)
    assert away[0] == pytest.approx(np.linalg.norm(np.subtract(position, (0.0, 0.0, 1.0))))


@pytest.mark.parametrize(
    "camera",
    [{"kind": "fixed"}, {"kind": "orbit"}, {"kind": "look-at", "position": (3.0, 2.0, 1.0)}],
)
def test_poses_are_rotations_with_the_horizon_level(camera):
    axes = view_at(scene(camera), 1.0, 1.0).pose[:3, :3]
    assert axes.T @ axes == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1.0)
    assert axes[2, 0] == pytest.approx(0.0, abs=1e-12)
    assert axes[2, 1] > 0.0


def test_light_comes_over_the_left_shoulder():
    same = {"kind": "look-at", "position": (2.0, 2.0 * np.tan(np.radians(30.0)), 1.0)}
    assert light_azimuth(scene(same)) == pytest.approx(light_azimuth(scene({"kind": "fixed", "azimuth": 30.0})))
