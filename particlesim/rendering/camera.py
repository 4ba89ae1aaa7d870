"""Where the camera stands: its pose and field of view at a time, fitted to the world where the scene leaves it open."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from particlesim.scene import Scene
from particlesim.scene.camera import FixedCamera, LookAtCamera, OrbitCamera, PathCamera
from particlesim.trajectory.frames import Frame, Header

# The world fills at most this fraction of the picture's width and height.
FILL = 0.92

# At so many times, evenly spread, it is looked where particles would be.
_GLANCES = 9

_UP = np.array([0.0, 0.0, 1.0])


class View(NamedTuple):
    """A camera. ``pose`` (4, 4) takes camera axes (x right, y up, looking along -z) to the world [m]."""

    pose: np.ndarray
    field_of_view: float  # [rad], vertical
    near: float  # [m], distance of the nearest plane that is drawn; there is no farthest


class Box(NamedTuple):
    """What a camera has to show, in a box along the axes of the world [m]."""

    lower: np.ndarray  # (3,)
    upper: np.ndarray  # (3,)

    @property
    def middle(self) -> np.ndarray:
        """Its middle, (3,) [m]."""
        return 0.5 * (self.lower + self.upper)

    @property
    def corners(self) -> np.ndarray:
        """Its corners, (8, 3) [m]."""
        return np.array([[(self.lower, self.upper)[k][axis] for axis, k in enumerate(c)] for c in np.ndindex(2, 2, 2)])


def world_box(scene: Scene) -> Box:
    """The world of a scene."""
    upper = 0.5 * np.asarray(scene.world.size)
    return Box(-upper, upper)


def subject_box(scene: Scene, header: Header, first: Frame) -> Box:
    """What the scene's camera frames, as ``first``, the frame at the start, foretells it."""
    subject = getattr(scene.camera, "subject", "world")
    world = world_box(scene)
    is_open = np.array([boundary == "open" for boundary in scene.world.boundary])
    by_particles = {"auto": is_open, "world": np.zeros(3, bool), "particles": np.ones(3, bool)}[subject]
    if not by_particles.any() or not len(first.position):
        return world
    reach = _reach(scene, header, first, world)
    return Box(np.where(by_particles, reach.lower, world.lower), np.where(by_particles, reach.upper, world.upper))


def view_at(scene: Scene, time: float, aspect: float, subject: Box | None = None) -> View:
    """The scene's camera at ``time`` [s], for a picture of ``aspect`` = width / height.

    ``subject`` is what is framed where the scene leaves the distance open, the world if not given.
    """
    camera = scene.camera
    box = subject or world_box(scene)
    if isinstance(camera, PathCamera):
        position, target, field = _on_path(camera, time)
        return View(_looking(position, target), field, _near(position, scene, box))
    field = float(np.radians(camera.field_of_view))
    if isinstance(camera, LookAtCamera):
        pose = _looking(np.asarray(camera.position), np.asarray(camera.target))
    else:
        slope = FILL * np.tan(0.5 * field) * np.array([aspect, 1.0]) * camera.zoom
        pose = _fixed(camera, box, slope) if isinstance(camera, FixedCamera) else _orbit(camera, time, box, slope)
    return View(pose, field, _near(pose[:3, 3], scene, box))


def light_azimuth(scene: Scene) -> float:
    """Where the key light comes from [degrees about z]: over the left shoulder of the camera when it starts."""
    camera = scene.camera
    if isinstance(camera, FixedCamera | OrbitCamera):
        return camera.azimuth - 50.0
    start = camera.keys[0] if isinstance(camera, PathCamera) else camera
    away = np.subtract(start.position, start.target)
    return float(np.degrees(np.arctan2(away[1], away[0]))) - 50.0


def _reach(scene: Scene, header: Header, first: Frame, world: Box) -> Box:
    """Where particles are at first, and where they would fly freely in the scene's duration as far as the world goes.

    A few that fly off for good do not make all others small.
    """
    radius = header.radius
    lower, upper = _extent(first.position, radius)
    gravity = np.asarray(scene.world.gravity)
    for time in np.linspace(0.0, scene.duration, _GLANCES)[1:]:
        low, high = _extent(first.position + time * first.velocity + 0.5 * time**2 * gravity, radius)
        lower = np.minimum(lower, np.maximum(low, world.lower))
        upper = np.maximum(upper, np.minimum(high, world.upper))
    return Box(lower, upper)


def _extent(position: np.ndarray, radius: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Corners (3,) of the box round balls."""
    return (position - radius[:, None]).min(axis=0), (position + radius[:, None]).max(axis=0)


def _fixed(camera: FixedCamera, box: Box, slope: np.ndarray) -> np.ndarray:
    axes = _axes(camera.azimuth, camera.elevation)
    if camera.distance is not None:
        return _pose(axes, box.middle + camera.distance * axes[:, 2])
    return _fitted(axes, box.corners, slope)


def _orbit(camera: OrbitCamera, time: float, box: Box, slope: np.ndarray) -> np.ndarray:
    axes = _axes(camera.azimuth + 360.0 * time / camera.period, camera.elevation)
    target = box.middle if camera.target is None else np.asarray(camera.target)
    if camera.distance is not None:
        return _pose(axes, target + camera.distance * axes[:, 2])
    rising, falling = _bounds_all_round(box.corners - target, camera.elevation, slope)
    if camera.target is None:
        # Above or below its middle, so that the margins are equal.
        return _pose(axes, target + axes @ _stand(rising, falling, slope))
    return _pose(axes, target + max(*rising, *falling) * axes[:, 2])


def _on_path(camera: PathCamera, time: float) -> tuple[np.ndarray, np.ndarray, float]:
    """Position and target (3,) [m] and vertical field of view [rad] between the keys of a path."""
    keys = camera.keys
    values = np.array([(*key.position, *key.target, np.radians(key.field_of_view)) for key in keys])
    now = _eased(np.array([key.time for key in keys]), values, time) if len(keys) > 1 else values[0]
    return now[:3], now[3:6], float(now[6])


def _eased(times: np.ndarray, values: np.ndarray, time: float) -> np.ndarray:
    """Values (m,) at ``time`` between rows (k, m) at ``times`` (k,): smooth, at rest at both ends and beyond them.

    A cubic between each two rows whose slopes keep it from swinging beyond either of them (F. N. Fritsch, J. Butland,
    SIAM J. Sci. Stat. Comput. 5 (1984) 300): where two rows are the same the camera stands still.
    """
    from scipy.interpolate import CubicHermiteSpline, PchipInterpolator  # noqa: PLC0415  (slow to import)

    slopes = PchipInterpolator(times, values).derivative()(times)
    slopes[[0, -1]] = 0.0
    return CubicHermiteSpline(times, values, slopes)(np.clip(time, times[0], times[-1]))


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


def _looking(position: np.ndarray, target: np.ndarray) -> np.ndarray:
    back = position - target
    distance = np.linalg.norm(back)
    # A path may lead through its own target: there any direction is as good.
    back = back / distance if distance > 0.0 else np.array([1.0, 0.0, 0.0])
    right = np.cross(_UP, back)
    length = np.linalg.norm(right)
    # Straight up or down there is no horizon: the picture's right is then +y, as for an azimuth of zero.
    right = right / length if length > 1e-9 else np.array([0.0, 1.0, 0.0])
    return _pose(np.column_stack([right, np.cross(back, right), back]), position)


def _fitted(axes: np.ndarray, points: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """The pose nearest to the points that sees them all, with equal margins left and right, above and below."""
    seen = points @ axes
    rising = (seen[:, :2] / slope + seen[:, 2:]).max(axis=0)
    falling = (-seen[:, :2] / slope + seen[:, 2:]).max(axis=0)
    return _pose(axes, axes @ _stand(rising, falling, slope))


def _stand(rising: np.ndarray, falling: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """Where a camera stands that sees all points and is nearest to them, in its own axes, (3,).

    A camera at (a, b, d) sees a point (x, y, z) when |x - a| <= slope_x (d - z), and likewise in y. The two sides of
    each inequality bound d from below by lines in a that rise and fall, which start from the largest x / slope_x + z,
    ``rising``, and -x / slope_x + z, ``falling``, (2,) each; they cross at the best a.
    """
    sideways = 0.5 * slope * (rising - falling)
    return np.array([*sideways, float((0.5 * (rising + falling)).max())])


def _bounds_all_round(points: np.ndarray, elevation: float, slope: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What ``_stand`` wants of points (n, 3) that turn about the upright axis through the origin.

    The largest value of a sine and a cosine of one angle, added up, is the root of the sum of their squares.
    """
    radius, height = np.hypot(points[:, 0], points[:, 1]), points[:, 2]
    s, c = np.sin(np.radians(elevation)), np.cos(np.radians(elevation))
    across = (radius * np.hypot(1.0 / slope[0], c) + height * s).max()
    up = (radius * abs(c - s / slope[1]) + height * (s + c / slope[1])).max()
    down = (radius * abs(c + s / slope[1]) + height * (s - c / slope[1])).max()
    return np.array([across, up]), np.array([across, down])


def _near(position: np.ndarray, scene: Scene, box: Box) -> float:
    """Nearest distance [m] worth drawing: the nearer it is, the coarser are depths in the picture."""
    # What is much smaller than its world is looked at from near by.
    reach = float(np.linalg.norm(scene.world.size))
    small = 2e-3 * min(reach, float(np.linalg.norm(box.upper - box.lower)))
    return max(float(np.linalg.norm(position)) - reach, small)
