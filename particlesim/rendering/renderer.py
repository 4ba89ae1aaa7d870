"""Draws the frames of a trajectory: particles with their shadows, floor, box, cells and readout."""

from __future__ import annotations

from types import TracebackType

import numpy as np

from particlesim.constants import SPHERE
from particlesim.rendering import geometry, platform
from particlesim.rendering.camera import Box, View, light_azimuth, subject_box, view_at
from particlesim.rendering.cells import cell_lines
from particlesim.rendering.colour import ParticleColours, encoded
from particlesim.rendering.overlay import Overlay
from particlesim.scene import Scene
from particlesim.trajectory import Frame, Header

# Height of the key light above the horizon [degrees]: shadows stay short and under their particles.
_LIGHT_ELEVATION = 58.0

# The floor fades out over this fraction of the world's longer horizontal side.
_FLOOR_RIM = 0.45

# How bright the floor is in the shadow, in sRGB.
_FLOOR_SHADOW = 0.78

# From this many particles on, finding the hidden ones costs less than drawing them.
_MANY = 2000


class Renderer:
    """Draws one movie's frames, all with the same scales. A context manager: it holds an OpenGL context.

    ``first`` is the frame that the readout's energy and the scale of speeds refer to, by default the first drawn.
    RenderError if this machine cannot draw.
    """

    def __init__(self, scene: Scene, header: Header, first: Frame | None = None) -> None:
        found = platform.choose()
        bridge = platform.open_bridge(found)
        self._scene = scene
        self._size = scene.movie.size
        self._header = header
        self._first = first
        self._colours: ParticleColours | None = None
        self._subject: Box | None = None
        self._overlay: Overlay | None = None
        self._background = encoded(scene.movie.background)
        self._dark = bool(self._background.mean() < 0.5)
        # A shade off the background, so that the floor is seen, and a shadow on it even when that is black.
        self._floor = self._background * 0.97 + (0.06 if self._dark else 0.0)
        self._inner = np.array([shape.inradius for shape in header.shapes])[header.shape] * header.size
        self._outer = np.array([shape.radius for shape in header.shapes])[header.shape] * header.size
        self._particles = [
            bridge.Layer(bridge.SPHERE, geometry.SQUARE)
            if shape.kind == SPHERE
            else bridge.Layer(bridge.HULL, *geometry.hull_mesh(shape))
            for shape in header.shapes
        ]
        floor = [bridge.Layer(bridge.FLOOR, geometry.SQUARE)] if scene.world.boundary[2] == "wall" else []
        self._lines = bridge.Layer(bridge.LINE, geometry.STRIP)
        # Spheres come after hulls: their depth is computed, so they cannot be told hidden before they are shaded.
        hulls_first = sorted(self._particles, key=lambda layer: layer.kind is bridge.SPHERE)
        layers = [*hulls_first, *floor, self._lines]
        self._canvas = bridge.Canvas(found, self._size, layers, self._background)

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
            self._subject = subject_box(self._scene, self._header, first)
            self._overlay = Overlay(self._scene, self._header, first, self._colours, self._dark)
        view = view_at(self._scene, frame.time, self._size[0] / self._size[1], self._subject)
        self._put_particles(frame, self._colours(frame), view)
        self._put_lines(view, cells)
        image = self._canvas.draw(self._view_block(view))
        if self._overlay is not None:
            self._overlay.draw(image, frame)
        return image

    def _put_particles(self, frame: Frame, colours: np.ndarray, view: View) -> None:
        # Near ones first: what they hide is then not shaded.
        seen = (frame.position - view.pose[:3, 3]) @ view.pose[:3, :3]
        order = np.argsort(-seen[:, 2], kind="stable")
        visible = self._in_sight(seen[order], order, view)
        # Those in sight first, so that each layer draws the start of its rows.
        order = np.concatenate([order[visible], order[~visible]])
        hidden = np.arange(len(order)) >= np.count_nonzero(visible)
        size = self._header.size
        for number, (shape, layer) in enumerate(zip(self._header.shapes, self._particles, strict=True)):
            mine = self._header.shape[order] == number
            members = order[mine]
            columns = [frame.position[members], size[members, None], colours[members]]
            if shape.kind == SPHERE:
                columns[1] = 0.5 * columns[1]
            else:
                columns.insert(2, frame.orientation[members])
            rows = np.hstack(columns, dtype=np.float32, casting="same_kind")
            layer.put(rows, visible=int(np.count_nonzero(mine & ~hidden)))

    def _in_sight(self, seen: np.ndarray, order: np.ndarray, view: View) -> np.ndarray:
        """Which of the particles, given in camera axes and nearest first, are not hidden behind others, (n,) bool."""
        if len(seen) < _MANY:
            return np.ones(len(seen), dtype=np.bool_)
        from particlesim.rendering.culling import in_sight  # noqa: PLC0415  (numba is slow to import)

        slope = float(np.tan(0.5 * view.field_of_view))
        return in_sight(seen, self._inner[order], self._outer[order], slope, self._size)

    def _put_lines(self, view: View, cells: tuple[np.ndarray, np.ndarray, np.ndarray] | None) -> None:
        width = max(1.0, self._size[1] / 720.0)
        rows = [np.zeros((0, 11), dtype=np.float32)]
        if cells is not None:
            rows.append(cell_lines(*cells, width=0.8 * width))
        if self._scene.box_shown:
            upper = 0.5 * np.asarray(self._scene.world.size)
            start, end = (ends[0] for ends in geometry.box_edges(-upper[None], upper[None]))
            colour = np.full((12, 4), 0.75 if self._dark else 0.25)
            colour[:, 3] = 0.7 * geometry.edge_opacity(-upper, upper, view.pose[:3, 3])
            rows.append(geometry.lines(start, end, colour, 1.3 * width))
        self._lines.put(np.vstack(rows))

    def _view_block(self, view: View) -> np.ndarray:
        """The uniform block of shaders/common.glsl, float32."""
        width, height = self._size
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
        light, shadow = self._light(eye)
        size = np.asarray(self._scene.world.size)
        rim = _FLOOR_RIM * max(size[0], size[1])
        vectors = [
            (*eye, 0.0),
            (*light, 1.0 / self._canvas.shadow_pixels),
            (*self._background, 1.0),
            (*self._floor, 1.0),
            (*(_FLOOR_SHADOW * self._floor), 1.0),
            (width, height, 1.0, -view.near),
            (*-back, 2.0 * slope / height),
            (0.5 * size[0], 0.5 * size[1], -0.5 * size[2], rim),
            (*self._canvas.samples[0], *self._canvas.samples[1]),
            (*self._canvas.samples[2], *self._canvas.samples[3]),
        ]
        # OpenGL stores matrices by columns.
        return np.concatenate(
            [(projection @ turn).T.ravel(), shadow.T.ravel(), np.ravel(vectors)], dtype=np.float32, casting="same_kind"
        )

    def _light(self, eye: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Unit vector towards the key light, and the matrix from places seen from the eye to the shadow map."""
        a, e = np.radians([light_azimuth(self._scene), _LIGHT_ELEVATION])
        light = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
        right = np.array([-np.sin(a), np.cos(a), 0.0])
        axes = np.array([right, np.cross(light, right), -light])
        # The box about the world in the light's axes, a little larger for what leans out of it.
        reach = 1.04 * np.abs(axes) @ (0.5 * np.asarray(self._scene.world.size))
        matrix = np.eye(4)
        matrix[:3, :3] = 0.5 * axes / reach[:, None]
        matrix[:3, 3] = 0.5 + matrix[:3, :3] @ eye
        return light, matrix
