"""Draws the frames of a trajectory: particles with their shadows, floor, box, cells and readout."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from types import TracebackType

import numpy as np

from particlesim.rendering.camera import View, view_at
from particlesim.rendering.gl import geometry, platform
from particlesim.rendering.hud.history import History
from particlesim.rendering.hud.overlay import Overlay
from particlesim.rendering.look import Look
from particlesim.rendering.octree_cells import cell_lines, octree_cells
from particlesim.rendering.quality import PRESETS
from particlesim.rendering.shading.ambient_occlusion import AmbientOcclusion
from particlesim.rendering.shading.environment import Environment
from particlesim.rendering.shading.floor import FloorOcclusion
from particlesim.rendering.shading.fxaa import fxaa
from particlesim.rendering.shading.lighting import key_light
from particlesim.rendering.shading.surfaces import TILE, surface_table, surfaces_of
from particlesim.rendering.visibility.geometry_tables import geometry_tables
from particlesim.rendering.visibility.instances import Instances, instances_of
from particlesim.rendering.visibility.occlusion_clusters import OcclusionClusters, occlusion_clusters
from particlesim.rendering.visibility.projection import Projection
from particlesim.rendering.visibility.rasterise import VisibilityBuffer, rasterise
from particlesim.trajectory.frames import Frame

# Widths of lines [pixels] in a picture 720 pixels high: the edges of the world, and those of the octree's cells.
_BOX_LINE = 1.3
_CELL_LINE = 0.8


class Renderer:
    """Draws the frames of one movie, in any order. A context manager: it holds an OpenGL context.

    RenderError if this machine cannot draw.
    """

    def __init__(self, look: Look) -> None:
        found = platform.choose()
        self._bridge = bridge = platform.open_bridge(found)
        self._look, scene = look, look.scene
        self._beside = ThreadPoolExecutor(1)
        self._quality = quality = PRESETS[scene.movie.quality]
        self._size = scene.movie.size
        self._drawn_size = (quality.samples * self._size[0], quality.samples * self._size[1])
        self._environment = environment = Environment(scene)
        self._overlay = Overlay(look, environment.dark)
        self._tables = tables = geometry_tables(look.header)
        self._light = key_light(scene, round(quality.shadow * self._size[1]))
        self._ambient_occlusion = (
            AmbientOcclusion(np.asarray(scene.world.size), tables.radius) if quality.ambient_occlusion else None
        )
        shaded = environment.has_floor and quality.ambient_occlusion
        self._floor = FloorOcclusion(*environment.floor, tables.inradius, tables.radius) if shaded else None
        tile = np.array([(0.5 * TILE, 0.5 * TILE, 0.0)])
        self._surfaces = [bridge.Layer(kind, tile) for kind in bridge.SURFACES]
        floor = [bridge.Layer(bridge.FLOOR, geometry.SQUARE)] if environment.has_floor else []
        self._lines = bridge.Layer(bridge.LINE, geometry.STRIP)
        layers = [*self._surfaces, *floor, self._lines]
        self._canvas = bridge.Canvas(found, self._size, layers, environment.background, quality.samples)

    def __enter__(self) -> Renderer:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Give back the OpenGL context. The renderer is of no use afterwards."""
        self._beside.shutdown()
        self._canvas.close()

    def draw(self, frame: Frame, history: History | None = None) -> np.ndarray:
        """The picture of a frame: a function of the look, the frame and its history, and of nothing drawn before.

        Parameters
        ----------
        frame
            The particles at one time.
        history
            What has passed before the frame, for readouts over time; without it they are left out.

        Returns
        -------
        (height, width, 3) uint8, sRGB.
        """
        view = view_at(self._look.scene, frame.time, self._size[0] / self._size[1], self._look.subject)
        instances = instances_of(self._look.scene, self._look.header, frame, self._tables)
        clusters = occlusion_clusters(instances.position, instances.tables.radius)
        projection = self._projection(view)
        buffer = rasterise(projection, instances, clusters)
        # While the shadow map is made, what the camera sees is tabled: that leaves a core idle now and then.
        shadow = self._beside.submit(self._shadow_map, instances, clusters)
        pixel, surfaces = self._put_particles(frame, instances, projection, buffer)
        self._put_lines(view, frame)
        picture = self._bridge.Picture(
            view_block=self._view_block(view),
            shadow=shadow.result(),
            pixel=pixel,
            surfaces=surfaces,
            floor=np.ones((1, 1)) if self._floor is None else self._floor.light(instances.position, instances.source),
        )
        drawn = self._canvas.draw(picture)
        # OpenGL's first row is the lowest, and it has a fourth channel.
        image = fxaa(drawn) if self._quality.fxaa else np.ascontiguousarray(drawn[::-1, :, :3])
        self._overlay.draw(image, frame, history or History())
        return image

    def _projection(self, view: View) -> Projection:
        slope = float(np.tan(0.5 * view.field_of_view))
        axes = view.pose[:3, :3].T * np.array([[1.0], [1.0], [-1.0]])
        return Projection(axes, view.pose[:3, 3], False, 0.5 * self._drawn_size[1] / slope, self._drawn_size)

    def _put_particles(
        self, frame: Frame, instances: Instances, projection: Projection, buffer: VisibilityBuffer
    ) -> tuple[np.ndarray, np.ndarray]:
        """Tiles into the layers of surfaces; what is seen at each pixel, and its table (see Picture)."""
        surfaces = surfaces_of(buffer, instances.tables)
        for layer, tiles in zip(self._surfaces, surfaces.tiles, strict=True):
            layer.put(TILE * np.argwhere(tiles)[:, ::-1])
        paint = self._paint(frame, instances, surfaces.seen)
        return surfaces.pixel, surface_table(surfaces, instances, projection, paint)

    def _paint(self, frame: Frame, instances: Instances, indices: np.ndarray) -> np.ndarray:
        """Linear colour, and share of the ambient light, of some instances, (k, 4) float64."""
        light = np.ones(len(indices))
        if self._ambient_occlusion is not None:
            light = self._ambient_occlusion.light(instances.position, indices, instances.source)
        return np.column_stack([self._look.colours(frame, instances.bodies(indices)), light])

    def _shadow_map(self, instances: Instances, clusters: OcclusionClusters) -> np.ndarray:
        """The shadow map: closeness to the key light of the surface that it shines on, (h, w) float32 [m]."""
        return rasterise(self._light.projection, instances, clusters).inverse_depth

    def _put_lines(self, view: View, frame: Frame) -> None:
        """The edges of the world and, if they are shown, of the octree's cells."""
        scene = self._look.scene
        width = self._quality.samples * max(1.0, self._size[1] / 720.0)
        rows = [self._environment.box_lines(view, _BOX_LINE * width)]
        if scene.show.cells:
            rows.insert(0, cell_lines(*octree_cells(scene, frame), width=_CELL_LINE * width))
        self._lines.put(np.vstack(rows))

    def _view_block(self, view: View) -> np.ndarray:
        """The uniform block of shaders/common.glsl, float32."""
        width, height = self._drawn_size
        right, up, back, eye = view.pose[:3].T
        slope = np.tan(0.5 * view.field_of_view)
        projection = np.zeros((4, 4))
        projection[0, 0] = height / (slope * width)
        projection[1, 1] = 1.0 / slope
        # Without a far plane: particles of an open world are drawn however far they fly.
        projection[2, 2:] = -1.0, -2.0 * view.near
        projection[3, 2] = -1.0
        rotation = np.eye(4)
        rotation[:3, :3] = view.pose[:3, :3].T
        rows = [
            (*eye, 0.0),
            (*self._light.towards, 0.0),
            (1.0 / self._light.pixels[0], 1.0 / self._light.pixels[1], *self._light.pixels),
            *self._environment.colour_rows(),
            (width, height, 1.0, -view.near),
            (*-back, 2.0 * slope / height),
            (*right, 0.0),
            (*up, 0.0),
            (slope * width / height, slope, 0.0, 0.0),
            *self._environment.place_rows(view),
        ]
        # By columns, as OpenGL has them.
        matrices = [(projection @ rotation).T.ravel(), self._light.matrix(eye).T.ravel()]
        return np.concatenate([*matrices, np.ravel(rows)], dtype=np.float32, casting="same_kind")
