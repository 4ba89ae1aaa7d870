"""Where the camera stands: its pose and field of view at a time, fitted to the world where the scene leaves it open."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from particlesim.scene import Scene
from particlesim.scene.picture import FixedCamera, LookAtCamera, OrbitCamera

# The world fills at most this fraction of the picture's width and height.
FILL = 0.92

_UP = np.array([0.0, 0.0, 1.0])


class View(NamedTuple):
    """A camera. ``pose`` (4, 4) takes camera axes (x right, y up, looking along -z) to the world [m]."""

    pose: np.ndarray
    field_of_view: float  # [rad], vertical
    near: float  # [m], distance of the nearest plane that is drawn; there is no farthest


def view_at(scene: Scene, time: float, aspect: float) -> View:
    """The scene's camera at ``time`` [s], for a picture of ``aspect`` = width / height."""
    camera = scene.camera
    field = np.radians(camera.field_of_view)
    slope = FILL * np.tan(0.5 * field) * np.array([aspect, 1.0])
    if isinstance(camera, FixedCamera):
        pose = _fitted(_axes(camera.azimuth, camera.elevation), _corners(scene), slope)
    elif isinstance(camera, OrbitCamera):
        axes = _axes(camera.azimuth + 360.0 * time / camera.period, camera.elevation)
        distance = camera.distance or _orbit_distance(camera, scene, slope)
        pose = _pose(axes, np.asarray(camera.target) + distance * axes[:, 2])
    else:
        pose = _looking(camera)
    return View(pose, float(field), _near(pose, scene))


def light_azimuth(scene: Scene) -> float:
    """Where the key light comes from [degrees about z]: over the left shoulder of the camera when it starts."""
    if isinstance(scene.camera, LookAtCamera):
        away = np.subtract(scene.camera.position, scene.camera.target)
        return float(np.degrees(np.arctan2(away[1], away[0]))) - 50.0
    return scene.camera.azimuth - 50.0


def _axes(azimuth: float, elevation: float) -> np.ndarray:
    """Camera axes as columns, for a camera that stands in the given direction [degrees] from what it looks at."""
    a, e = np.radians([azimuth, elevation])
    back = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    return np.column_stack([right, np.cross(back, right), back])


def _pose(axes: np.ndarray, position: np.ndarray) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, :3] = axes
    pose[:3, 3] = position
    return pose


def _looking(camera: LookAtCamera) -> np.ndarray:
    position = np.asarray(camera.position)
    back = position - np.asarray(camera.target)
    back = back / np.linalg.norm(back)
    right = np.cross(_UP, back)
    length = np.linalg.norm(right)
    # Straight up or down there is no horizon: the picture's right is then +y, as for an azimuth of zero.
    right = right / length if length > 1e-9 else np.array([0.0, 1.0, 0.0])
    return _pose(np.column_stack([right, np.cross(back, right), back]), position)


def _corners(scene: Scene) -> np.ndarray:
    signs = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    return 0.5 * signs * np.asarray(scene.world.size)


def _fitted(axes: np.ndarray, points: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """The pose nearest to the points that sees them all, with equal margins left and right, above and below.

    A camera at (a, b, d) in its own axes sees a point (x, y, z) when |x - a| <= slope_x (d - z), and likewise in y.
    The two sides of each inequality bound d from below by lines in a that rise and fall; they cross at the best a.
    """
    local = points @ axes
    rising = (local[:, :2] / slope + local[:, 2:]).max(axis=0)
    falling = (-local[:, :2] / slope + local[:, 2:]).max(axis=0)
    sideways = 0.5 * slope * (rising - falling)
    distance = float((0.5 * (rising + falling)).max())
    return _pose(axes, axes @ np.array([*sideways, distance]))


def _orbit_distance(camera: OrbitCamera, scene: Scene, slope: np.ndarray) -> float:
    """The distance from the target at which the world stays in the picture all the way round."""
    # Seen by a camera that circles, a corner runs round a circle about the target's axis.
    corners = _corners(scene) - np.asarray(camera.target)
    radius = np.hypot(corners[:, 0], corners[:, 1])[:, None]
    turn = np.linspace(0.0, 2.0 * np.pi, 361)
    height = np.broadcast_to(corners[:, 2:], (len(corners), len(turn)))
    swept = np.stack([radius * np.cos(turn), radius * np.sin(turn), height], axis=-1).reshape(-1, 3)
    local = swept @ _axes(0.0, camera.elevation)
    return float((np.abs(local[:, :2]) / slope + local[:, 2:]).max())


def _near(pose: np.ndarray, scene: Scene) -> float:
    """Nearest distance [m] worth drawing: the nearer it is, the coarser are depths in the picture."""
    reach = float(np.linalg.norm(scene.world.size))
    return max(float(np.linalg.norm(pose[:3, 3])) - reach, 2e-3 * reach)
