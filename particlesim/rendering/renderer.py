"""Draws the frames of a trajectory: particles with their shadows, floor, box, cells and readout."""

from __future__ import annotations

from types import TracebackType

import numpy as np

from particlesim.rendering.camera import Camera, View
from particlesim.rendering.exposure import moments_of
from particlesim.rendering.gl import platform
from particlesim.rendering.hud.history import History
from particlesim.rendering.hud.labels import Labels
from particlesim.rendering.hud.overlay import Overlay
from particlesim.rendering.look import Look
from particlesim.rendering.octree_cells import cell_lines, octree_cells
from particlesim.rendering.passes import Pass, mean_of, passes_of
from particlesim.rendering.quality import quality_of
from particlesim.rendering.regions import region_lines
from particlesim.rendering.scenery import Scenery
from particlesim.rendering.shading.ambient_occlusion import AmbientOcclusion
from particlesim.rendering.shading.environment import Environment
from particlesim.rendering.shading.floor import FloorOcclusion
from particlesim.rendering.shading.fxaa import fxaa
from particlesim.rendering.shading.lighting import Light, Lighting, key_light, lights_from
from particlesim.rendering.shading.outlines import draw_outlines
from particlesim.rendering.shading.pixel_light import LightMaps, all_around, disc_of_lamps, light_maps
from particlesim.rendering.shading.shade import Paint, Seen, seen_instances, shade
from particlesim.rendering.shading.shadow import shadow_map
from particlesim.rendering.transparency import cut_out
from particlesim.rendering.visibility.instances import Instances, instances_of
from particlesim.rendering.visibility.occlusion_clusters import OcclusionClusters, occlusion_clusters
from particlesim.rendering.visibility.projection import Projection
from particlesim.rendering.visibility.rasterise import VisibilityBuffer, rasterise
from particlesim.trajectory.frames import Frame

# Widths of lines [pixels] in a picture 720 pixels high: the edges of the world, those of the octree's cells, and of
# bodies.
_BOX_LINE = 1.3
_CELL_LINE = 0.8
_OUTLINE = 1.5

# Triangles cast shadows from so many texels of the shadow map behind them: what is lit at a slant is looked for in
# some texels about it, and must not be in the shadow of itself.
_TRIANGLES_BEHIND = 4.0


# How wide the key light is [rad], where shadows are those of a lamp with a size: some ten times as wide as the sun.
_LAMP = 0.1

# Texels in a usual particle's radius of what the points of that lamp see, and of what directions of the sky see; along
# a side of the latter's maps there are at most so many, and of the former's as many as the picture is high.
_LAMP_TEXELS, _SKY_TEXELS, _SKY_MAP = 15.0, 6.0, 640


class Renderer:
    """Draws the frames of one movie, in any order. A context manager: it holds an OpenGL context.

    RenderError if this machine cannot draw.
    """

    def __init__(self, look: Look) -> None:
        found = platform.choose()
        self._bridge = bridge = platform.open_bridge(found)
        self._look, scene = look, look.scene
        self._quality = quality = quality_of(scene)
        self._size = scene.movie.size
        self._drawn_size = (quality.samples * self._size[0], quality.samples * self._size[1])
        self._environment = environment = Environment(scene)
        self._camera = Camera(scene, self._size[0] / self._size[1], look.subject, look.window)
        self._overlay = Overlay(look, environment.dark)
        self._labels = Labels(scene, look.header, environment.dark)
        self._scenery = Scenery(scene, look.header)
        tables = self._scenery.tables
        self._inradius = tables.inradius
        usual = float(np.median(tables.radius)) if len(tables.radius) else 0.0
        self._light = key_light(scene, round(quality.shadow * self._size[1]), usual)
        self._usual = usual
        # Where each pixel asks the sky, bodies and the floor need not.
        shaded = quality.ambient_occlusion and not quality.sky
        self._ambient_occlusion = AmbientOcclusion(np.asarray(scene.world.size), tables.radius) if shaded else None
        shaded = shaded and environment.has_floor
        self._floor = FloorOcclusion(*environment.floor, tables.inradius, tables.radius) if shaded else None
        self._lines = bridge.Lines()
        self._canvas = bridge.Canvas(found, self._size, self._lines, quality.samples)

    def __enter__(self) -> Renderer:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Give back the OpenGL context. The renderer is of no use afterwards."""
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
        (height, width, 3) uint8, sRGB; (height, width, 4) without a background, as transparency.py has it.
        """
        moments = moments_of(self._look.scene, self._look.header, frame, self._inradius)
        # What is no more than half there is half as much of the picture: in light, but for what hides what is behind.
        picture = mean_of(map(self._moment, moments), of_light=not self._look.scene.movie.transparent)
        # OpenGL's first row is the lowest, and it has a fourth channel.
        channels = self._look.scene.movie.channels
        image = fxaa(picture) if self._quality.fxaa else np.ascontiguousarray(picture[::-1, :, :channels])
        self._labels.draw(image, self._camera.view(frame.time), frame)
        self._overlay.draw(image, frame, history or History())
        return image

    def _moment(self, frame: Frame) -> np.ndarray:
        """The picture of particles at one time, (h, w, 4) uint8 sRGB, its first row the lowest."""
        view = self._camera.view(frame.time)
        particles = instances_of(self._look.scene, self._look.header, frame, self._scenery.tables)
        parts, whole = self._scenery.in_parts(particles)
        instances = self._scenery.amid(parts, frame.time)
        clusters = occlusion_clusters(instances.position, instances.tables.radius)
        shadow = shadow_map(self._seen_by(self._light, instances, clusters))
        ground = self._environment.ground(self._floor_light(particles))
        self._put_lines(view, frame)

        def drawn(one: Pass) -> np.ndarray:
            through = self._camera.through_lens(view, one.lens)
            projection = self._projection(through, one)
            buffer = rasterise(projection, instances, clusters)
            seen = seen_instances(buffer, len(instances.position))
            paint = self._paint(view, frame, (particles, instances), whole, seen)
            lighting = self._light.in_view(projection, shadow)
            maps = self._light_maps(projection, instances, clusters, one) if self._quality.sky else None
            colours = shade(projection, buffer, instances, paint, lighting, ground, maps)
            if self._look.scene.movie.transparent:
                colours = cut_out(colours, buffer.id)
            if self._look.scene.show.outlines:
                body, radius = self._scenery.bodies_in(instances), projection.scale * instances.tables.radius
                draw_outlines(colours, buffer, body, radius, _OUTLINE * self._line_scale)
            if len(self._scenery.clear):
                colours = self._behind_panes(colours, buffer, view, frame.time, lighting, projection)
            # The floor, which is seen from above only, hides no line: those on it would be dashes.
            depth = np.maximum(buffer.inverse_depth, 0.0)
            depth *= np.float32(-view.near)
            depth += np.float32(1.0)
            return self._canvas.draw(self._bridge.Picture(self._view_block(through, projection), colours, depth))

        return mean_of(map(drawn, passes_of(self._quality.passes)))

    def _light_maps(
        self, view: Projection, instances: Instances, clusters: OcclusionClusters, one: Pass
    ) -> tuple[LightMaps, LightMaps]:
        """What the points of the lamp see, and the directions of the sky."""
        quality, scene = self._quality, self._look.scene
        lamps = disc_of_lamps(self._light.towards, quality.lamps, _LAMP, one.turn)
        sky = all_around(quality.sky, one.lift, one.turn)
        each = [
            lights_from(towards, scene, pixels, self._usual / texels)
            for towards, pixels, texels in ((lamps, self._size[1], _LAMP_TEXELS), (sky, _SKY_MAP, _SKY_TEXELS))
        ]
        of_lamps, of_sky = (
            light_maps(lights, [self._seen_by(light, instances, clusters) for light in lights], view) for lights in each
        )
        return of_lamps, of_sky

    def _seen_by(self, light: Light, instances: Instances, clusters: OcclusionClusters) -> np.ndarray:
        """How close to a light what its map shows is, (h, w) float32 [m]."""
        casting = self._scenery.casting(instances, _TRIANGLES_BEHIND / light.projection.scale * light.axes[2])
        if casting is not instances:
            clusters = occlusion_clusters(casting.position, casting.tables.radius)
        return rasterise(light.projection, casting, clusters).inverse_depth

    def _projection(self, view: View, one: Pass) -> Projection:
        slope = float(np.tan(0.5 * view.field_of_view))
        axes = view.pose[:3, :3].T * np.array([[1.0], [1.0], [-1.0]])
        scale = 0.5 * self._drawn_size[1] / slope
        shift = one.shift[0] + scale * view.skew[0], one.shift[1] + scale * view.skew[1]
        return Projection(axes, view.pose[:3, 3], False, scale, self._drawn_size, shift)

    def _behind_panes(
        self,
        colours: np.ndarray,
        buffer: VisibilityBuffer,
        view: View,
        time: float,
        lighting: Lighting,
        projection: Projection,
    ) -> np.ndarray:
        """The picture with the obstacles that one sees through before it; they cast no shadows."""
        scenery = self._scenery
        panes = scenery.instances(scenery.clear, time)
        seen = rasterise(projection, panes, occlusion_clusters(panes.position, panes.tables.radius))
        which = seen_instances(seen, len(panes.position))
        light = np.ones((len(which.indices), 1))
        colour = np.hstack([scenery.colours(panes.bodies(which.indices)), light])
        paint = Paint(which, colour, self._environment.haze(view))
        nothing = self._environment.ground(np.zeros((0, 0), dtype=np.float32))
        lit = shade(projection, seen, panes, paint, lighting, nothing)
        return scenery.seen_through(colours, buffer.inverse_depth, panes, seen, lit)

    def _paint(
        self, view: View, frame: Frame, shown: tuple[Instances, Instances], whole: np.ndarray, seen: Seen
    ) -> Paint:
        """What those that are seen of the particles, and of these and obstacles, are coloured with.

        ``whole`` (m,) says which of the particles the first of the instances are of.
        """
        particles, instances = shown
        of_particles = seen.indices < len(whole)
        indices = whole[seen.indices[of_particles]]
        light = np.ones(len(seen.indices))
        if self._ambient_occlusion is not None:
            light[of_particles] = self._ambient_occlusion.light(particles.position, indices, particles.source)
        colours = np.empty((len(light), 3))
        colours[of_particles] = self._look.colours(frame, particles.bodies(indices))
        colours[~of_particles] = self._scenery.colours(instances.bodies(seen.indices[~of_particles]))
        return Paint(seen, np.column_stack([colours, light]).astype(np.float64), self._environment.haze(view))

    def _floor_light(self, instances: Instances) -> np.ndarray:
        """Share of the light that reaches the floor, (b, a) float32; (0, 0) if there is none."""
        if self._floor is not None:
            return self._floor.light(instances.position, instances.source)
        return np.ones((2, 2) if self._environment.has_floor else (0, 0), dtype=np.float32)

    @property
    def _line_scale(self) -> float:
        """Drawn pixels for each of a picture 720 pixels high."""
        return self._quality.samples * max(1.0, self._size[1] / 720.0)

    def _put_lines(self, view: View, frame: Frame) -> None:
        """The edges of the world, of regions in drafts and, if they are shown, of the octree's cells."""
        scene = self._look.scene
        width = self._line_scale
        rows = [self._environment.box_lines(view, _BOX_LINE * width)]
        if scene.movie.quality == "draft" and scene.is_open:
            rows.append(region_lines(scene, width=_CELL_LINE * width))
        if scene.show.cells:
            cells = octree_cells(scene, frame)
            rows.insert(0, cell_lines(*cells, width=_CELL_LINE * width, background=self._environment.background))
        self._lines.put(np.vstack(rows))

    def _view_block(self, view: View, through: Projection) -> np.ndarray:
        """The uniform block of shaders/line.vert, float32."""
        width, height = self._drawn_size
        _, _, back, eye = view.pose[:3].T
        slope = np.tan(0.5 * view.field_of_view)
        projection = np.zeros((4, 4))
        projection[0, 0] = height / (slope * width)
        projection[1, 1] = 1.0 / slope
        projection[:2, 2] = np.multiply(-2.0, through.shift) / self._drawn_size
        # Without a far plane: particles of an open world are drawn however far they fly.
        projection[2, 2:] = -1.0, -2.0 * view.near
        projection[3, 2] = -1.0
        rotation = np.eye(4)
        rotation[:3, :3] = view.pose[:3, :3].T
        rows = [(*eye, 0.0), (*-back, 0.0), (width, height, 0.0, 0.0)]
        # By columns, as OpenGL has them.
        numbers = [(projection @ rotation).T.ravel(), np.ravel(rows)]
        return np.concatenate(numbers, dtype=np.float32, casting="same_kind")
