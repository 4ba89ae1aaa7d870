"""Draws the frames of a trajectory: particles with their shadows, floor, box, cells and readout."""

from __future__ import annotations

from collections.abc import Iterator
from types import TracebackType
from typing import TYPE_CHECKING, Any

import numpy as np

from particlesim.constants import SPHERE
from particlesim.rendering import geometry, platform
from particlesim.rendering.camera import View, view_at
from particlesim.rendering.cells import cell_lines
from particlesim.rendering.colour import ParticleColours, encoded
from particlesim.rendering.lighting import key_light
from particlesim.rendering.outlook import Outlook, nearest_first
from particlesim.rendering.overlay import Readout
from particlesim.rendering.quality import PRESETS
from particlesim.scene import Scene
from particlesim.shapes import Shape
from particlesim.trajectory import Frame, Header

if TYPE_CHECKING:
    from particlesim.rendering.sky import Sky

# The floor fades out over this fraction of the world's longer horizontal side.
_FLOOR_RIM = 0.45

# How bright the floor is in the shadow, in sRGB.
_FLOOR_SHADOW = 0.78

# From this many particles on, finding the hidden ones costs less than drawing them.
_MANY = 2000

# Particles whose middle is at most so many of their radii above the floor shade it noticeably.
_NEAR_FLOOR = 4.0

# How pale the farthest corner of the world is: the share of the background in its colour.
_HAZE = 0.22


class Renderer:
    """Draws one movie's frames, all with the same scales. A context manager: it holds an OpenGL context.

    ``first`` is the frame that the readout's energy and the scale of speeds refer to, by default the first drawn.
    RenderError if this machine cannot draw.
    """

    def __init__(self, scene: Scene, header: Header, first: Frame | None = None) -> None:
        found = platform.choose()
        bridge = platform.open_bridge(found)
        quality = PRESETS[scene.movie.quality]
        self._scene = scene
        self._size = scene.movie.size
        self._header = header
        self._first = first
        self._colours: ParticleColours | None = None
        self._background = encoded(scene.movie.background)
        self._dark = bool(self._background.mean() < 0.5)
        # A shade off the background, so that the floor is seen, and a shadow on it even when that is black.
        self._floor = self._background * 0.97 + (0.06 if self._dark else 0.0)
        self._readout = Readout(self._size, self._dark) if scene.show.readout else None
        self._inner = np.array([shape.inradius for shape in header.shapes])[header.shape] * header.size
        self._outer = np.array([shape.radius for shape in header.shapes])[header.shape] * header.size
        self._canvas_size = (quality.samples * self._size[0], quality.samples * self._size[1])
        self._light = key_light(scene, round(quality.shadow * self._size[1]))
        self._sky = self._make_sky() if quality.sky else None
        self._shown = [_shape_layer(bridge, shape) for shape in header.shapes]
        self._casting = [_shadow_layer(bridge, shape) for shape in header.shapes]
        self._contacts = bridge.Layer(bridge.CONTACT, geometry.SQUARE)
        self._lines = bridge.Layer(bridge.LINE, geometry.STRIP)
        self._has_floor = scene.world.boundary[2] == "wall"
        floor = [bridge.Layer(bridge.FLOOR, geometry.SQUARE), self._contacts] if self._has_floor else []
        # Spheres come after hulls: their depth is computed, so they cannot be told hidden before they are shaded.
        hulls_first = sorted(self._shown, key=lambda layer: layer.kind is bridge.SPHERE)
        self._canvas = bridge.Canvas(
            found,
            self._size,
            [*self._casting, *hulls_first, *floor, self._lines],
            self._background,
            samples=quality.samples,
            smooth=quality.smooth,
            shadow_pixels=self._light.pixels,
        )

    def __enter__(self) -> Renderer:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Give back the OpenGL context. The renderer is of no use afterwards."""
        self._canvas.close()

    def draw(self, frame: Frame, cells: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None) -> np.ndarray:
        """The picture of a frame, (height, width, 3) uint8 sRGB.

        ``cells``: lower (k, 3) and upper (k, 3) corners [m] and depth (k,) of the octree's leaves, drawn as lines.
        """
        self._first = first = self._first or frame
        if self._colours is None:
            self._colours = ParticleColours(self._scene, self._header, first)
        view = view_at(self._scene, frame.time, self._size[0] / self._size[1])
        self._put_particles(frame, self._colours(frame), view)
        self._put_shadows(frame)
        self._put_lines(view, cells)
        image = self._canvas.draw(self._view_block(view))
        if self._readout is not None:
            self._readout.draw(image, frame, first)
        return image

    def _put_particles(self, frame: Frame, colours: np.ndarray, view: View) -> None:
        slope = float(np.tan(0.5 * view.field_of_view))
        axes = view.pose[:3, :3].T * np.array([[1.0], [1.0], [-1.0]])
        size = self._canvas_size
        outlook = Outlook(axes, view.pose[:3, 3], False, 0.5 * size[1] / slope, size)
        members = self._chosen(outlook, frame)
        paint = np.ones((len(members), 4), dtype=np.float32)
        paint[:, :3] = colours[members]
        if self._sky is not None:
            paint[:, 3] = self._sky.light(frame.position, members)
        for place, mine in self._by_shape(members):
            self._shown[place].put(np.hstack([*self._poses(frame, members[mine], place), paint[mine]]))

    def _put_shadows(self, frame: Frame) -> None:
        """What the light meets, and, of what is close above the floor, what hides the sky from it."""
        members = self._chosen(self._light.outlook, frame)
        for place, mine in self._by_shape(members):
            self._casting[place].put(np.hstack(self._poses(frame, members[mine], place)))
        if self._has_floor and self._sky is not None:
            height = frame.position[:, 2] + 0.5 * self._scene.world.size[2]
            low = height < _NEAR_FLOOR * self._outer
            # As much as a sphere between those within and about it.
            radius = 0.5 * (self._inner[low] + self._outer[low])
            self._contacts.put(np.column_stack([frame.position[low], radius]))

    def _chosen(self, outlook: Outlook, frame: Frame) -> np.ndarray:
        """The particles to draw, near ones first: what they hide is then not shaded."""
        if len(frame.position) < _MANY:
            return nearest_first(outlook, frame.position)
        from particlesim.rendering.culling import in_sight  # noqa: PLC0415  (numba is slow to import)

        return in_sight(outlook, np.ascontiguousarray(frame.position), self._inner, self._outer)

    def _make_sky(self) -> Sky:
        from particlesim.rendering.sky import Sky  # noqa: PLC0415  (numba is slow to import)

        return Sky(np.asarray(self._scene.world.size), self._outer)

    def _by_shape(self, members: np.ndarray) -> Iterator[tuple[int, np.ndarray]]:
        """Of each shape its number, and which of ``members`` have it."""
        if len(self._shown) == 1:
            yield 0, np.ones(len(members), dtype=np.bool_)
            return
        shape = self._header.shape[members]
        for place in range(len(self._shown)):
            yield place, shape == place

    def _poses(self, frame: Frame, members: np.ndarray, place: int) -> list[np.ndarray]:
        """Columns that say where particles of one shape are: place and radius, or place and size, and quaternion."""
        size = self._header.size[members, None]
        if self._header.shapes[place].kind == SPHERE:
            return [np.hstack([frame.position[members], 0.5 * size], dtype=np.float32, casting="same_kind")]
        columns = [frame.position[members], size, frame.orientation[members]]
        return [np.hstack(columns, dtype=np.float32, casting="same_kind")]

    def _put_lines(self, view: View, cells: tuple[np.ndarray, np.ndarray, np.ndarray] | None) -> None:
        width = max(1.0, self._size[1] / 720.0)
        rows = [np.zeros((0, 11), dtype=np.float32)]
        if cells is not None:
            rows.append(cell_lines(*cells, width=0.8 * width))
        if self._scene.show.box:
            upper = 0.5 * np.asarray(self._scene.world.size)
            start, end = (ends[0] for ends in geometry.box_edges(-upper[None], upper[None]))
            colour = np.full((12, 4), 0.75 if self._dark else 0.25)
            colour[:, 3] = 0.7 * geometry.edge_opacity(-upper, upper, view.pose[:3, 3])
            rows.append(geometry.lines(start, end, colour, 1.3 * width))
        self._lines.put(np.vstack(rows))

    def _view_block(self, view: View) -> np.ndarray:
        """The uniform block of shaders/common.glsl, float32."""
        width, height = self._canvas_size
        eye = view.pose[:3, 3]
        back = view.pose[:3, 2]
        slope = np.tan(0.5 * view.field_of_view)
        projection = np.zeros((4, 4))
        projection[0, 0] = height / (slope * width)
        projection[1, 1] = 1.0 / slope
        # Without a far plane: particles of an open world are drawn however far they fly.
        projection[2, 2:] = -1.0, -2.0 * view.near
        projection[3, 2] = -1.0
        turn = np.eye(4)
        turn[:3, :3] = view.pose[:3, :3].T
        size = np.asarray(self._scene.world.size)
        rim = _FLOOR_RIM * max(size[0], size[1])
        # Haze grows through the world, from its nearest corner to its farthest.
        depth = float(np.abs(back) @ size)
        vectors = [
            (*eye, 0.0),
            (*self._light.towards, 0.0),
            (1.0 / self._light.pixels[0], 1.0 / self._light.pixels[1], 0.0, 0.0),
            (*self._background, 1.0),
            (*self._floor, 1.0),
            (*(_FLOOR_SHADOW * self._floor), 1.0),
            (width, height, 1.0, -view.near),
            (*-back, 2.0 * slope / height),
            (0.5 * size[0], 0.5 * size[1], -0.5 * size[2], rim),
            (float(back @ eye) - 0.5 * depth, 1.0 / depth, _HAZE, 0.0),
        ]
        matrices = [(projection @ turn).T.ravel(), self._light.matrix(eye).T.ravel()]  # by columns, as OpenGL has them
        return np.concatenate([*matrices, np.ravel(vectors)], dtype=np.float32, casting="same_kind")


def _shape_layer(bridge: Any, shape: Shape) -> Any:
    if shape.kind == SPHERE:
        return bridge.Layer(bridge.SPHERE, geometry.SQUARE)
    return bridge.Layer(bridge.HULL, *geometry.hull_mesh(shape))


def _shadow_layer(bridge: Any, shape: Shape) -> Any:
    if shape.kind == SPHERE:
        return bridge.Layer(bridge.SPHERE_SHADOW, geometry.SQUARE)
    return bridge.Layer(bridge.HULL_SHADOW, *geometry.shadow_mesh(shape))
