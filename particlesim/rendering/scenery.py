"""The obstacles of a scene as a picture shows them, what hides and what is seen through; particles part by part."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from particlesim.core.constants import TRIANGLE
from particlesim.core.rotations import rotations_of
from particlesim.geometry.shape_table import stack_shapes
from particlesim.geometry.shapes import Shape
from particlesim.rendering.shading.colour import obstacle_colours
from particlesim.rendering.visibility.geometry_tables import BODY, GeometryTables, geometry_tables, joined
from particlesim.rendering.visibility.instances import Instances
from particlesim.rendering.visibility.rasterise import VisibilityBuffer
from particlesim.rendering.visibility.rims import rims_of
from particlesim.scene import Scene
from particlesim.setup.obstacles import poses_at
from particlesim.setup.scene_obstacles import obstacles_of
from particlesim.trajectory.frames import Header


class _Parts(NamedTuple):
    """What an obstacle is drawn as."""

    middle: np.ndarray  # (m, 3) of each part from the obstacle's position, in its axes [m]
    body: np.ndarray  # (m,) BODY
    radius: np.ndarray  # (m,) of the sphere about its middle [m]


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
        every = (*header.shapes, *header.obstacles)
        shapes = stack_shapes(every, drawn=True)
        self.tables = particles._replace(shapes=shapes, rims=rims_of(every, shapes))
        self._has_compounds = any(shape.parts for shape in header.shapes)
        self._middle = self.tables.rims.middle
        self._obstacles = obstacles_of(scene, header.obstacles)
        self._size = np.array([o.size if o.shape.is_bounded else 1.0 for o in self._obstacles])
        self._parts = [self._parts_of(k, shape, len(header.shapes) + k) for k, shape in enumerate(header.obstacles)]
        self._obstacle_shapes = np.unique(np.concatenate([[-1], *(part.body["shape"] for part in self._parts)]))
        self._moves = np.array([bool(o.pieces) for o in self._obstacles], dtype=bool)
        # The opaque and the clear ones of the last picture: those that stand are the same in the next.
        self._instances_at = lru_cache(maxsize=2)(self._placed)
        self._colour = obstacle_colours(scene)
        self._opacity = np.array([said.opacity for said in scene.obstacles])
        self.opaque = np.flatnonzero(self._opacity == 1.0)
        self.clear = np.flatnonzero((self._opacity > 0.0) & (self._opacity < 1.0))

    def _parts_of(self, k: int, shape: Shape, row: int) -> _Parts:
        """What obstacle ``k`` is drawn as, whose shape has a ``row`` of the table: that, or all that it consists of."""
        shapes, size, middle = self.tables.shapes.shape, self._size[k], np.zeros((1, 3))
        rows = np.array([row])
        if not shape.is_convex:
            rows = np.arange(shapes["first_part"][row], shapes["last_part"][row])
            middle = size * (self._middle[rows] if shape.parts else shape.vertices[shape.triangles].mean(axis=1))
        body = np.zeros(len(rows), dtype=BODY)
        body["shape"], body["size"] = rows, size
        return _Parts(middle, body, shapes["radius"][rows] * size)

    def instances(self, which: np.ndarray, time: float) -> Instances:
        """The obstacles ``which`` (k,) at a time [s]; each triangle of a mesh is one of them by itself."""
        return self._instances_at(tuple(which.tolist()), time if self._moves[which].any() else 0.0)

    def _placed(self, numbers: tuple[int, ...], time: float) -> Instances:
        """What ``instances`` are of the obstacles of these numbers."""
        which = np.array(numbers, dtype=np.int64)
        pose = poses_at(self._obstacles, time)[which]
        parts = [self._parts[k] for k in numbers]
        each = np.repeat(np.arange(len(which)), [len(part.body) for part in parts])
        body = np.concatenate([np.zeros(0, dtype=BODY), *(part.body for part in parts)])
        middle = np.concatenate([np.zeros((0, 3)), *(part.middle for part in parts)])
        radius = np.concatenate([np.zeros(0), *(part.radius for part in parts)])
        orientation = pose["orientation"][each]
        position = pose["position"][each] + (rotations_of(orientation).apply(middle) if len(each) else middle)
        tables = GeometryTables(self.tables.shapes, self.tables.rims, body, radius, np.zeros(len(each)))
        return Instances(position, orientation, tables, which[each])

    def in_parts(self, particles: Instances) -> tuple[Instances, np.ndarray]:
        """Particles as they are drawn, each part of a compound by itself; which of the particles each is of, (m,)."""
        each = np.arange(len(particles.position))
        if not self._has_compounds:
            return particles, each
        shapes, body = self.tables.shapes.shape, particles.tables.body
        first, last = shapes["first_part"][body["shape"]], shapes["last_part"][body["shape"]]
        compound = last > first
        count = np.where(compound, last - first, 1)
        each = np.repeat(each, count)
        number = np.arange(len(each)) - np.repeat(np.cumsum(count) - count, count)
        parts = body[each]
        parts["shape"] = np.where(compound, first, body["shape"])[each] + number
        orientation, of_size_1 = particles.orientation[each], shapes[["radius", "inradius"]][parts["shape"]]
        middle = self._middle[parts["shape"]] * parts["size"][:, None]
        radii = (of_size_1[name] * parts["size"] for name in ("radius", "inradius"))
        tables = GeometryTables(self.tables.shapes, self.tables.rims, parts, *radii)
        position = particles.position[each] + (rotations_of(orientation).apply(middle) if len(each) else middle)
        return Instances(position, orientation, tables, particles.bodies(each)), each

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
            np.concatenate([source, others.source]),
        )

    def bodies_in(self, instances: Instances) -> np.ndarray:
        """A number (m,) for each of instances that ``amid`` has made, the same for all parts of a body."""
        number = instances.bodies(np.arange(len(instances.position)))
        others = np.isin(instances.tables.body["shape"], self._obstacle_shapes)
        return np.where(others, -1 - number, number)

    def casting(self, instances: Instances, behind: np.ndarray) -> Instances:
        """Instances as they cast shadows: triangles, which have no thickness, from ``behind`` (3,) themselves [m]."""
        kind = self.tables.shapes.shape["kind"][instances.tables.body["shape"]]
        if not (kind == TRIANGLE).any():
            return instances
        return instances._replace(position=instances.position + (kind == TRIANGLE)[:, None] * behind)

    def colours(self, which: np.ndarray) -> np.ndarray:
        """Linear RGB (k, 3) of the obstacles ``which`` (k,)."""
        return self._colour[which]

    def seen_through(
        self,
        colours: np.ndarray,
        depth: np.ndarray,
        panes: Instances,
        seen: VisibilityBuffer,
        pane_colours: np.ndarray,
    ) -> np.ndarray:
        """A picture with the nearest of the clear obstacles before what is in it.

        Parameters
        ----------
        colours, pane_colours : (h, w, 4) uint8
            The picture without them, and of them.
        depth : (h, w) float32
            Inverse depth of what is in the picture [1/m].
        panes : Instances
            The ``clear`` ones.
        seen : VisibilityBuffer
            Which of them is seen where.
        """
        before = (seen.id >= 0) & (seen.inverse_depth > depth)
        share = self._opacity[panes.bodies(seen.id[before])][:, None]
        mixed = colours.copy()
        mixed[before] = np.rint(share * pane_colours[before] + (1.0 - share) * colours[before])
        return mixed
