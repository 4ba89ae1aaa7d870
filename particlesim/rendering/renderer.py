"""Draws the frames of a trajectory: particles with their shadows, floor, box, cells and readout."""

from __future__ import annotations

from types import TracebackType

import numpy as np

from particlesim.constants import SPHERE
from particlesim.rendering import geometry, platform
from particlesim.rendering.camera import Box, View, subject_box, view_at
from particlesim.rendering.cells import cell_lines
from particlesim.rendering.colour import ParticleColours, encoded
from particlesim.rendering.ground import Ground
from particlesim.rendering.lighting import key_light
from particlesim.rendering.outlook import Outlook
from particlesim.rendering.overlay import Overlay
from particlesim.rendering.quality import PRESETS
from particlesim.rendering.sky import Sky
from particlesim.rendering.smoothing import smooth_edges
from particlesim.rendering.visibility import TILE, Bodies, look, renumber
from particlesim.scene import Scene
from particlesim.trajectory import Frame, Header

# The floor fades out over this fraction of the world's longer horizontal side.
_FLOOR_RIM = 0.45

# How bright the floor is in the shadow, in sRGB.
_FLOOR_SHADOW = 0.78

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
        self._subject: Box | None = None
        self._overlay: Overlay | None = None
        self._background = encoded(scene.movie.background)
        self._dark = bool(self._background.mean() < 0.5)
        # A shade off the background, so that the floor is seen, and a shadow on it even when that is black.
        self._floor = self._background * 0.97 + (0.06 if self._dark else 0.0)
        self._bodies = bodies = _bodies(header)
        self._samples = quality.samples
        self._canvas_size = (quality.samples * self._size[0], quality.samples * self._size[1])
        self._light = key_light(scene, round(quality.shadow * self._size[1]))
        self._sky = Sky(np.asarray(scene.world.size), bodies.outer) if quality.sky else None
        self._smooth = quality.smooth
        self._bridge = bridge
        corner = TILE * (0.5 + 0.5 * geometry.SQUARE)
        self._spheres = bridge.Layer(bridge.SPHERES, corner)
        hulls = {place: shape for place, shape in enumerate(header.shapes) if shape.kind != SPHERE}
        self._hulls = {k: bridge.Layer(bridge.HULL, *geometry.hull_mesh(shape)) for k, shape in hulls.items()}
        self._lines = bridge.Layer(bridge.LINE, geometry.STRIP)
        has_floor = scene.world.boundary[2] == "wall"
        floor = [bridge.Layer(bridge.FLOOR, geometry.SQUARE)] if has_floor else []
        size = np.asarray(scene.world.size)
        self._rim = _FLOOR_RIM * float(max(size[:2]))
        shaded = has_floor and quality.sky
        self._ground = (
            Ground(0.5 * size[:2] + self._rim, -0.5 * size[2], bodies.inner, bodies.outer) if shaded else None
        )
        self._canvas = bridge.Canvas(
            found,
            self._size,
            [self._spheres, *self._hulls.values(), *floor, self._lines],
            self._background,
            quality.samples,
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
            self._subject = subject_box(self._scene, self._header, first)
            self._overlay = Overlay(self._scene, self._header, first, self._colours, self._dark)
        view = view_at(self._scene, frame.time, self._size[0] / self._size[1], self._subject)
        owner, spheres = self._put_particles(frame, self._colours, view)
        self._put_lines(view, cells)
        ground = self._ground.light(frame.position) if self._ground is not None else np.ones((1, 1), dtype=np.float32)
        shadow = self._shadow_map(frame)
        image = self._canvas.draw(self._bridge.Picture(self._view_block(view), shadow, owner, spheres, ground))
        image = smooth_edges(image) if self._smooth else np.ascontiguousarray(image[::-1, :, :3])
        if self._overlay is not None:
            self._overlay.draw(image, frame)
        return image

    def _put_particles(self, frame: Frame, colours: ParticleColours, view: View) -> tuple[np.ndarray, np.ndarray]:
        """Hulls into their layers; of spheres, the number at each pixel, and their rows (see Picture)."""
        slope = float(np.tan(0.5 * view.field_of_view))
        axes = view.pose[:3, :3].T * np.array([[1.0], [1.0], [-1.0]])
        size = self._canvas_size
        outlook = Outlook(axes, view.pose[:3, 3], False, 0.5 * size[1] / slope, size)
        sight = look(outlook, self._bodies, *self._places(frame))
        for place, layer in self._hulls.items():
            members = sight.hulls[self._header.shape[sight.hulls] == place]
            pose = [frame.position[members], self._header.size[members, None], frame.orientation[members]]
            layer.put(np.hstack([*pose, self._paint(frame, colours, members)]))
        self._spheres.put(TILE * np.argwhere(sight.tiles)[:, ::-1])
        members = renumber(sight.owner, len(frame.position))
        place_radius = np.column_stack([frame.position[members], self._bodies.outer[members]])
        return sight.owner, np.hstack([place_radius, self._paint(frame, colours, members)], dtype=np.float32)

    def _paint(self, frame: Frame, colours: ParticleColours, members: np.ndarray) -> np.ndarray:
        """Linear colour, and share of the sky's light, of some particles, (k, 4) float64."""
        light = self._sky.light(frame.position, members) if self._sky is not None else np.ones(len(members))
        return np.column_stack([colours(frame, members), light])

    def _shadow_map(self, frame: Frame) -> np.ndarray:
        """How deep the key light goes into its box, (h, w) float32, 0 .. 1."""
        close = look(self._light.outlook, self._bodies, *self._places(frame)).close
        return np.clip(0.5 - (0.5 / np.float32(self._light.reach[2])) * close, 0.0, 1.0)

    @staticmethod
    def _places(frame: Frame) -> tuple[np.ndarray, np.ndarray]:
        return np.ascontiguousarray(frame.position), np.ascontiguousarray(frame.orientation)

    def _put_lines(self, view: View, cells: tuple[np.ndarray, np.ndarray, np.ndarray] | None) -> None:
        width = self._samples * max(1.0, self._size[1] / 720.0)
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
            (*view.pose[:3, 0], 0.0),
            (*view.pose[:3, 1], 0.0),
            (slope * width / height, slope, 0.0, 0.0),
            (0.5 * size[0], 0.5 * size[1], -0.5 * size[2], self._rim),
            (float(back @ eye) - 0.5 * depth, 1.0 / depth, _HAZE, 0.0),
        ]
        matrices = [(projection @ turn).T.ravel(), self._light.matrix(eye).T.ravel()]  # by columns, as OpenGL has them
        return np.concatenate([*matrices, np.ravel(vectors)], dtype=np.float32, casting="same_kind")


def _bodies(header: Header) -> Bodies:
    shapes, shape = header.shapes, header.shape
    planes = [
        [(*normal, normal @ hull.vertices[loop[0]]) for normal, loop in zip(hull.face_normals, hull.faces, strict=True)]
        for hull in shapes
    ]
    faces = np.array([len(of_one) for of_one in planes], dtype=np.int64)
    return Bodies(
        inner=np.array([hull.inradius for hull in shapes])[shape] * header.size,
        outer=np.array([hull.radius for hull in shapes])[shape] * header.size,
        size=np.ascontiguousarray(header.size, dtype=np.float64),
        start=(np.cumsum(faces) - faces)[shape],
        faces=faces[shape],
        planes=np.array([plane for of_one in planes for plane in of_one], dtype=np.float64).reshape(-1, 4),
    )
