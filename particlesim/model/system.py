"""What is simulated, as arrays: the model that a scene is built into, and what the solver's kernels take of it."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from particlesim.core.records import cache_aligned
from particlesim.geometry.mesh_table import MeshTable
from particlesim.geometry.shape_table import ShapeTable
from particlesim.geometry.shapes import Shape
from particlesim.model.bodies import BODY
from particlesim.model.fields import FIELD


class System(NamedTuple):
    """Bodies and what they are made of, as the kernels take them.

    Rows ``0 .. particles`` of ``body`` are dynamic, ``particles .. bounded`` convex obstacles of bounded extent, and
    ``bounded ..`` surroundings, half-spaces and meshes, which the broad phase knows nothing of: each particle is looked
    at with each of them. Code for meshes is compiled only where there are any.
    """

    shapes: ShapeTable
    body: np.ndarray  # (n,) BODY
    law: np.ndarray  # (m, m) CONTACT_LAW of materials
    motion: np.ndarray  # (k,) MOTION
    domain: np.ndarray  # (1,) DOMAIN
    particles: int
    bounded: int
    meshes: MeshTable | None = None


class Model(NamedTuple):
    """A scene as arrays: the system, and what scripts and files want to know of it."""

    shapes: tuple[Shape, ...]  # of the rows of the shape table, but for the half-spaces of walls
    restitution: np.ndarray  # (m,) of each material
    system: System
    obstacle_shapes: tuple[Shape, ...] = ()  # that the scene's obstacles are drawn as, in their order
    fields: np.ndarray = np.zeros(0, dtype=FIELD)  # (f,) FIELD
    population: np.ndarray = np.zeros(0, dtype=BODY)  # (m,) BODY, all particles that there ever are, if some come or go

    @property
    def particles(self) -> np.ndarray:
        """The records of the dynamic bodies, (n,) BODY, a view."""
        return self.system.body[: self.system.particles]

    def with_particles(self, particles: np.ndarray) -> Model:
        """The model with other particles, (n,) BODY, in place of those that it has."""
        old = self.system
        body = cache_aligned(np.concatenate([particles, old.body[old.particles :]]))
        count = len(particles)
        system = old._replace(body=body, particles=count, bounded=old.bounded - old.particles + count)
        return self._replace(system=system)

    @property
    def has_polyhedra(self) -> bool:
        """Whether any body of bounded extent is more than a sphere."""
        return not all(shape.is_sphere for shape in self.shapes) or self.system.bounded > self.system.particles


def make_system(
    shapes: ShapeTable, particles: np.ndarray, obstacles: np.ndarray, surroundings: np.ndarray, **rest: Any
) -> System:
    """The system of these bodies, in the order that its rows have; ``rest`` are law, motion, domain and meshes."""
    body = cache_aligned(np.concatenate([particles, obstacles, surroundings]))
    bounded = len(particles) + len(obstacles)
    return System(shapes, body, particles=len(particles), bounded=bounded, **rest)
