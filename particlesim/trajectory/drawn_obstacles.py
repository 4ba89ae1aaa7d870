"""The obstacles of a run as surfaces and where these are, for programs that know no shapes of ours."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from particlesim.core.rotations import rotations_of
from particlesim.geometry.surface import Surface, surface_of
from particlesim.scene import Scene
from particlesim.setup.obstacles import Obstacle, poses_at
from particlesim.setup.scene_obstacles import obstacles_of
from particlesim.trajectory.frames import Header


class DrawnObstacle(NamedTuple):
    """An obstacle that there is something to see of."""

    number: int  # in the scene
    name: str
    obstacle: Obstacle
    surface: Surface  # about its position, in its axes, of its size [m]
    colour: np.ndarray  # (3,) linear RGB 0 .. 1
    opacity: float  # above 0

    @property
    def moves(self) -> bool:
        """Whether it is not always in the same place."""
        return bool(self.obstacle.pieces)

    @property
    def has_two_sides(self) -> bool:
        """Whether it may be seen from behind its triangles, as a mesh, which need not be closed."""
        return bool(len(self.obstacle.shape.triangles))


def drawn_obstacles(scene: Scene, header: Header, colours: np.ndarray) -> list[DrawnObstacle]:
    """The obstacles of a run that are drawn, in the order of the scene, whose ``colours`` (k, 3) are linear RGB."""
    drawn = []
    obstacles = obstacles_of(scene, header.obstacles)
    for number, (said, obstacle, shape) in enumerate(zip(scene.obstacles, obstacles, header.obstacles, strict=True)):
        if said.opacity:
            # The slab that a plane is drawn as has its size already.
            size = obstacle.size if obstacle.shape.is_bounded else 1.0
            surface = surface_of(shape)
            surface = surface._replace(vertices=size * surface.vertices)
            name = said.name or f"obstacle {number}"
            drawn.append(DrawnObstacle(number, name, obstacle, surface, colours[number], said.opacity))
    return drawn


def poses_of(drawn: Sequence[DrawnObstacle], time: float) -> tuple[np.ndarray, np.ndarray]:
    """Where obstacles are at a time [s]: positions (k, 3) float64 [m] and orientations (k, 4), (w, x, y, z)."""
    bodies = poses_at([each.obstacle for each in drawn], time)
    return bodies["position"], bodies["orientation"]


def placed(drawn: Sequence[DrawnObstacle], time: float) -> list[Surface]:
    """The surfaces of obstacles where they are at a time [s]."""
    surfaces = []
    for each, position, orientation in zip(drawn, *poses_of(drawn, time), strict=True):
        turned = rotations_of(orientation).apply
        vertices, normals, triangles = each.surface
        surfaces.append(Surface(position + turned(vertices), turned(normals), triangles))
    return surfaces
