"""Where the camera stands: its pose and field of view at a time, fitted to the world where the scene leaves it open."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from particlesim.scene import Scene
from particlesim.scene.camera import FixedCamera, LookAtCamera, OrbitCamera, PathCamera
from particlesim.trajectory.frames import Frame, Header

# What is framed fills at most this fraction of the picture's width and height.
FILL = 0.92

# At so many times, evenly spread, it is looked where particles would be.
_GLANCES = 9

# Of many particles this share on each side does not count: a few that fly off for good make the others no smaller.
_STRAYS = 0.02

# Nor are flights followed farther than this beyond their start [diameters of a usual particle], or the world if that is
# larger: on a picture 720 pixels high particles would be smaller than three or four pixels.
_FARTHEST = 200.0

# Angles, evenly spread, from which an orbit looks at what it frames.
_ANGLES = 360

_UP = np.array([0.0, 0.0, 1.0])


class View(NamedTuple):
    """A camera. ``pose`` (4, 4) takes camera axes (x right, y up, looking along -z) to the world [m]."""

    pose: np.ndarray
    field_of_view: float  # [rad], vertical
    near: float  # [m], distance of the nearest plane that is drawn; there is no farthest
    skew: tuple[float, float] = (0.0, 0.0)  # how much farther right and up all is seen, at distance 1


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
    world, by_particles = world_box(scene), _axes_by_particles(scene)
    if not by_particles.any() or not len(first.position):
        return world
    reach = _reach(scene, header, first, world)
    return Box(np.where(by_particles, reach.lower, world.lower), np.where(by_particles, reach.upper, world.upper))


def foresees_flight(scene: Scene) -> bool:
    """Whether what the scene's camera frames depends on the velocities at the start."""
    return bool(_axes_by_particles(scene).any())


def _axes_by_particles(scene: Scene) -> np.ndarray:
    """Along which axes the camera frames particles, and not the world, (3,) bool."""
    subject = getattr(scene.camera, "subject", "world")
    is_open = np.array([boundary == "open" for boundary in scene.world.boundary])
    return {"auto": is_open, "world": np.zeros(3, bool), "particles": np.ones(3, bool)}[subject]


def frames_freely(scene: Scene) -> bool:
    """Whether the scene leaves open where its camera stands and what is in the middle of the picture."""
    camera = scene.camera
    free = isinstance(camera, FixedCamera | OrbitCamera) and camera.distance is None
    return free and getattr(camera, "target", None) is None


class Window(NamedTuple):
    """The part of a picture in which a camera places what it frames: -1 .. 1 to the right, and up, (2,) each."""

    lower: np.ndarray
    upper: np.ndarray


# All of the picture but a margin.
WHOLE = Window(np.array([-FILL, -FILL]), np.array([FILL, FILL]))


class Camera:
    """The camera of a scene.

    Parameters
    ----------
    scene
        Whose camera it is.
    aspect
        Width of the picture over its height.
    subject
        What it frames where the scene leaves the distance open, the world if not given.
    window
        Where in the picture that is placed.
    """

    def __init__(self, scene: Scene, aspect: float, subject: Box | None = None, window: Window = WHOLE) -> None:
        self._scene, self._box = scene, subject or world_box(scene)
        camera = scene.camera
        if isinstance(camera, FixedCamera | OrbitCamera):
            target = getattr(camera, "target", None)
            self._target = self._box.middle if target is None else np.asarray(target)
            self._stand = np.array([0.0, 0.0, camera.distance or 0.0])
            if frames_freely(scene):
                self._stand = _stand(self._points(camera), *_tangents(camera, aspect, window))
            elif camera.distance is None:
                self._stand[2] = _distance_ahead(self._points(camera), _tangents(camera, aspect, WHOLE)[1])

    def in_the_largest(self, aspect: float, windows: Sequence[Window]) -> Window:
        """The window in which what it frames is seen from nearest, the first of them that are as good."""
        camera = self._scene.camera
        assert isinstance(camera, FixedCamera | OrbitCamera)
        points = self._points(camera)
        distances = [_least_distance(points, *_tangents(camera, aspect, window))[0] for window in windows]
        return windows[int(np.argmin(np.array(distances) > min(distances) * (1.0 + 1e-9)))]

    def view(self, time: float) -> View:
        """Where it is at ``time`` [s]."""
        camera = self._scene.camera
        if isinstance(camera, PathCamera):
            position, target, field = _on_path(camera, time)
            return View(_looking(position, target), field, _near(position, self._scene, self._box))
        if isinstance(camera, LookAtCamera):
            pose = _looking(np.asarray(camera.position), np.asarray(camera.target))
        else:
            turned = 360.0 * time / camera.period if isinstance(camera, OrbitCamera) else 0.0
            axes = _axes(camera.azimuth + turned, camera.elevation)
            pose = _pose(axes, self._target + axes @ self._stand)
        field = float(np.radians(camera.field_of_view))
        return View(pose, field, _near(pose[:3, 3], self._scene, self._box))

    def through_lens(self, view: View, place: tuple[float, float]) -> View:
        """What is seen through a place on the lens, whose radius is 1 there: what is in focus stays where it is."""
        lens = self._scene.camera
        if lens.aperture == 0.0:
            return view
        focus = lens.focus or max(float((view.pose[:3, 3] - self._box.middle) @ view.pose[:3, 2]), view.near)
        aside = 0.5 * lens.aperture * np.asarray(place)
        pose = view.pose.copy()
        pose[:3, 3] += pose[:3, :2] @ aside
        return view._replace(pose=pose, skew=tuple((aside / focus).tolist()))

    def _points(self, camera: FixedCamera | OrbitCamera) -> np.ndarray:
        """All places that it is to show, about its target and in its own axes, (n, 3)."""
        corners = self._box.corners - self._target
        if isinstance(camera, FixedCamera):
            return corners @ _axes(camera.azimuth, camera.elevation)
        return np.concatenate([corners @ _axes(360.0 * k / _ANGLES, camera.elevation) for k in range(_ANGLES)])


def light_azimuth(scene: Scene) -> float:
    """Where the key light comes from [degrees about z]: over the left shoulder of the camera when it starts."""
    camera = scene.camera
    if isinstance(camera, FixedCamera | OrbitCamera):
        return camera.azimuth - 50.0
    start = camera.keys[0] if isinstance(camera, PathCamera) else camera
    away = np.subtract(start.position, start.target)
    return float(np.degrees(np.arctan2(away[1], away[0]))) - 50.0


def _reach(scene: Scene, header: Header, first: Frame, world: Box) -> Box:
    """Where particles are at first, and where they would fly freely in the scene's duration."""
    radius = header.of(first).radius
    start = _extent(first.position, radius, 0)
    strays, far = int(_STRAYS * len(radius)), 2.0 * _FARTHEST * float(np.median(radius))
    lowest, highest = np.minimum(world.lower, start.lower - far), np.maximum(world.upper, start.upper + far)
    lower, upper = start
    gravity = np.asarray(scene.world.gravity)
    for time in np.linspace(0.0, scene.duration, _GLANCES)[1:]:
        there = _extent(first.position + time * first.velocity + 0.5 * time**2 * gravity, radius, strays)
        lower = np.minimum(lower, np.maximum(there.lower, lowest))
        upper = np.maximum(upper, np.minimum(there.upper, highest))
    return Box(lower, upper)


def _extent(position: np.ndarray, radius: np.ndarray, strays: int) -> Box:
    """The box round balls but for so many ``strays`` on each side."""
    low, high = position - radius[:, None], position + radius[:, None]
    last = len(radius) - 1 - strays
    return Box(np.partition(low, strays, axis=0)[strays], np.partition(high, last, axis=0)[last])


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


def _tangents(camera: FixedCamera | OrbitCamera, aspect: float, window: Window) -> tuple[np.ndarray, np.ndarray]:
    """The lower and the upper bounds of a window, enlarged as the camera zooms, at a distance of 1, (2,) each."""
    half = np.tan(0.5 * np.radians(camera.field_of_view)) * np.array([aspect, 1.0])
    middle, reach = 0.5 * (window.lower + window.upper), 0.5 * camera.zoom * (window.upper - window.lower)
    return half * (middle - reach), half * (middle + reach)


def _stand(points: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Where a camera stands that sees all points within a window and is nearest to them, in its own axes, (3,).

    A camera at (a, b, d) sees a point (x, y, z) when lower (d - z) <= x - a <= upper (d - z), and likewise in y. So a
    lies between the largest x + upper z, less upper d, and the least x + lower z, less lower d; they meet at the least
    d. In the direction that has room to spare, the margins in the picture are the same on both sides if they can be.
    """
    distance, most, least = _least_distance(points, lower, upper)
    first, last = most - upper * distance, least - lower * distance
    aside = [_in_the_middle(points[:, k], distance - points[:, 2]) for k in range(2)]
    return np.array([*np.clip(aside, np.minimum(first, last), np.maximum(first, last)), distance])


def _least_distance(points: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """The least d of ``_stand``, the largest x + upper z, and the least x + lower z, of both directions."""
    most, least = (
        (points[:, :2] + upper * points[:, 2:]).max(axis=0),
        (points[:, :2] + lower * points[:, 2:]).min(axis=0),
    )
    return float(((most - least) / (upper - lower)).max()), most, least


def _distance_ahead(points: np.ndarray, reach: np.ndarray) -> float:
    """The least distance that shows points up to ``reach`` (2,) aside of straight ahead, at a distance of 1."""
    return float((np.abs(points[:, :2]) / reach + points[:, 2:]).max())


def _in_the_middle(across: np.ndarray, away: np.ndarray) -> float:
    """From where points (n,), so far ``away``, reach as far to one side in a picture as to the other."""
    low, high = float(across.min()), float(across.max())
    for _ in range(60):  # halvings, to rounding
        middle = 0.5 * (low + high)
        seen = (across - middle) / away
        low, high = (middle, high) if seen.max() + seen.min() > 0.0 else (low, middle)
    return 0.5 * (low + high)


def _near(position: np.ndarray, scene: Scene, box: Box) -> float:
    """Nearest distance [m] worth drawing: the nearer it is, the coarser are depths in the picture."""
    # What is much smaller than its world is looked at from near by.
    reach = float(np.linalg.norm(scene.world.size))
    small = 2e-3 * min(reach, float(np.linalg.norm(box.upper - box.lower)))
    return max(float(np.linalg.norm(position)) - reach, small)
