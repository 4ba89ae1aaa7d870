"""The obstacles of a scene as a picture shows them: what hides, and what is seen through."""

from __future__ import annotations

import numpy as np

from particlesim.geometry.shape_table import stack_shapes
from particlesim.rendering.shading.colour import parse
from particlesim.rendering.visibility.geometry_tables import BODY, GeometryTables, geometry_tables, joined
from particlesim.rendering.visibility.instances import Instances
from particlesim.rendering.visibility.rasterise import VisibilityBuffer
from particlesim.scene import Scene
from particlesim.setup.obstacles import poses_at
from particlesim.setup.scene_obstacles import obstacles_of
from particlesim.trajectory.frames import Header


class Scenery:
    """The obstacles of a movie.

    Attributes
    ----------
    tables : GeometryTables
        The particles, with the shapes of the obstacles after theirs.
    opaque, clear : (k,) int64
        The obstacles that nothing is seen behind, and those that one sees through.
    """

    def __init__(self, scene: Scene, header: Header) -> None:
        particles = geometry_tables(header)
        self.tables = particles._replace(shapes=stack_shapes((*header.shapes, *header.obstacles)))
        self._obstacles = obstacles_of(scene, header.obstacles)
        self._body = np.zeros(len(header.obstacles), dtype=BODY)
        self._body["shape"] = len(header.shapes) + np.arange(len(self._body))
        self._body["size"] = [o.size if o.shape.is_bounded else 1.0 for o in self._obstacles]
        self._radius = np.array([shape.radius for shape in header.obstacles]) * self._body["size"]
        self._colour = np.array([parse(said.colour) for said in scene.obstacles]).reshape(-1, 3)
        self._opacity = np.array([said.opacity for said in scene.obstacles])
        self.opaque = np.flatnonzero(self._opacity == 1.0)
        self.clear = np.flatnonzero((self._opacity > 0.0) & (self._opacity < 1.0))

    def instances(self, which: np.ndarray, time: float) -> Instances:
        """The obstacles ``which`` (k,) at a time [s]."""
        pose = poses_at(self._obstacles, time)[which]
        tables = GeometryTables(self.tables.shapes, self._body[which], self._radius[which], np.zeros(len(which)))
        position, orientation = (np.ascontiguousarray(pose[name]) for name in ("position", "orientation"))
        return Instances(position, orientation, tables, which)

    def amid(self, particles: Instances, time: float) -> Instances:
        """Instances of particles, and after them the opaque obstacles, whose source they are, at a time [s]."""
        if not len(self.opaque):
            return particles
        others = self.instances(self.opaque, time)
        source = particles.bodies(np.arange(len(particles.position)))
        return Instances(
            np.concatenate([particles.position, others.position]),
            np.concatenate([particles.orientation, others.orientation]),
            joined(particles.tables, others.tables),
            np.concatenate([source, self.opaque]),
        )

    def colours(self, which: np.ndarray) -> np.ndarray:
        """Linear RGB (k, 3) of the obstacles ``which`` (k,)."""
        return self._colour[which]

    def seen_through(
        self, colours: np.ndarray, depth: np.ndarray, panes: VisibilityBuffer, pane_colours: np.ndarray
    ) -> np.ndarray:
        """A picture with the nearest of the clear obstacles before what is in it.

        Parameters
        ----------
        colours, pane_colours : (h, w, 4) uint8
            The picture without them, and of them.
        depth : (h, w) float32
            Inverse depth of what is in the picture [1/m].
        panes : VisibilityBuffer
            Which of the ``clear`` is seen where.
        """
        before = (panes.id >= 0) & (panes.inverse_depth > depth)
        share = self._opacity[self.clear][panes.id[before]][:, None]
        mixed = colours.copy()
        mixed[before] = np.rint(share * pane_colours[before] + (1.0 - share) * colours[before])
        return mixed
