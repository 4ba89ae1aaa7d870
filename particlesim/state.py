"""The arrays a simulation works on: struct of arrays, float64, C-contiguous, checked once when they are built.

What never changes (``Constants``, ``ShapeTable``, ``World``) is apart from what every step changes (``State``).
Units are SI; axes right-handed, z up; quaternions (w, x, y, z); angular velocity in world axes.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from particlesim.constants import SINKING
from particlesim.shapes import Shape


class Constants(NamedTuple):
    """What a particle is."""

    shape: np.ndarray  # (n,) int64, row of the shape table
    group: np.ndarray  # (n,) int64, which entry of the scene's particles it came from
    size: np.ndarray  # (n,) factor on the shape of size 1
    mass: np.ndarray  # (n,) [kg]
    inertia: np.ndarray  # (n, 3) principal moments [kg m^2]
    restitution: np.ndarray  # (n,) of the particle; a pair takes the smaller of its two
    radius: np.ndarray  # (n,) bounding sphere [m]
    inradius: np.ndarray  # (n,) inscribed sphere [m]


class State(NamedTuple):
    """Where a particle is and how it moves."""

    position: np.ndarray  # (n, 3) centroid [m]
    orientation: np.ndarray  # (n, 4) unit quaternion, body to world
    velocity: np.ndarray  # (n, 3) [m/s]
    angular_momentum: np.ndarray  # (n, 3) about the centroid, world axes [kg m^2/s]
    image: np.ndarray  # (n, 3) int64, how often it left a periodic world by its upper faces


class Particles(NamedTuple):
    """Constants and state side by side, as a script sees them."""

    shape: np.ndarray
    group: np.ndarray
    size: np.ndarray
    mass: np.ndarray
    inertia: np.ndarray
    restitution: np.ndarray
    radius: np.ndarray
    inradius: np.ndarray
    position: np.ndarray
    orientation: np.ndarray
    velocity: np.ndarray
    angular_momentum: np.ndarray
    image: np.ndarray
    angular_velocity: np.ndarray  # (n, 3) world axes [rad/s], computed from the angular momentum
    impacts: np.ndarray  # (n,) int64, how many each has had since the start


class World(NamedTuple):
    """The space the particles move in."""

    lower: np.ndarray  # (3,) [m]
    upper: np.ndarray  # (3,) [m]
    boundary: np.ndarray  # (3,) int64: WALL, PERIODIC or OPEN
    period: np.ndarray  # (3,) edge of a periodic axis [m], 0 elsewhere
    gravity: np.ndarray  # (3,) [m/s^2]
    restitution: float  # of the walls
    still: float = 0.0  # speed below which nothing counts as approaching [m/s]
    sinking: float = SINKING  # how deep touches may go before they count again, as a fraction of sizes


class ShapeTable(NamedTuple):
    """All shapes of a scene end to end. ``x_start[s]:x_start[s + 1]`` are the rows of shape ``s``."""

    kind: np.ndarray  # (s,) int64: SPHERE or HULL
    radius: np.ndarray  # (s,) bounding sphere of size 1 [m]
    vertex: np.ndarray  # (v, 3) of size 1, body axes [m]
    vertex_start: np.ndarray  # (s + 1,)
    face_normal: np.ndarray  # (f, 3) outward, body axes
    face_offset: np.ndarray  # (f,) distance of the face's plane from the centroid at size 1 [m]
    face_start: np.ndarray  # (s + 1,)
    loop: np.ndarray  # (l,) vertices of the faces in order, counted from the shape's first
    loop_start: np.ndarray  # (f + 1,)
    edge: np.ndarray  # (e, 4): two vertices, then two faces, counted from the shape's first
    edge_start: np.ndarray  # (s + 1,)


def stack_shapes(shapes: Sequence[Shape]) -> ShapeTable:
    """The shapes as one table for the kernels."""
    normals = [shape.face_normals for shape in shapes]
    offsets = [
        [float(normal @ shape.vertices[loop[0]]) for normal, loop in zip(rows, shape.faces, strict=True)]
        for shape, rows in zip(shapes, normals, strict=True)
    ]
    edges = [shape.edges for shape in shapes]
    loops = [loop for shape in shapes for loop in shape.faces]
    return ShapeTable(
        kind=np.array([shape.kind for shape in shapes], dtype=np.int64),
        radius=np.array([shape.radius for shape in shapes], dtype=np.float64),
        vertex=np.concatenate([np.zeros((0, 3)), *(shape.vertices for shape in shapes)]),
        vertex_start=_starts([len(shape.vertices) for shape in shapes]),
        face_normal=np.concatenate([np.zeros((0, 3)), *normals]),
        face_offset=np.array([x for rows in offsets for x in rows], dtype=np.float64),
        face_start=_starts([len(shape.faces) for shape in shapes]),
        loop=np.array([v for loop in loops for v in loop], dtype=np.int64),
        loop_start=_starts([len(loop) for loop in loops]),
        edge=np.array([e for rows in edges for e in rows], dtype=np.int64).reshape(-1, 4),
        edge_start=_starts([len(rows) for rows in edges]),
    )


def particle_constants(
    shapes: Sequence[Shape],
    shape: np.ndarray,
    group: np.ndarray,
    size: np.ndarray,
    density: np.ndarray,
    restitution: np.ndarray,
) -> Constants:
    """Mass, inertia and radii of particles from their shape, size [-] and density [kg/m^3]; all (n,)."""
    volume = np.array([s.volume for s in shapes])[shape] * size**3
    moments = np.array([s.moments for s in shapes]).reshape(-1, 3)[shape] * (size**5)[:, None]
    return Constants(
        shape=np.ascontiguousarray(shape, dtype=np.int64),
        group=np.ascontiguousarray(group, dtype=np.int64),
        size=np.ascontiguousarray(size, dtype=np.float64),
        mass=density * volume,
        inertia=np.ascontiguousarray(density[:, None] * moments),
        restitution=np.ascontiguousarray(restitution, dtype=np.float64),
        radius=np.array([s.radius for s in shapes])[shape] * size,
        inradius=np.array([s.inradius for s in shapes])[shape] * size,
    )


def _starts(counts: Sequence[int]) -> np.ndarray:
    return np.concatenate([[0], np.cumsum(np.asarray(counts, dtype=np.int64))]).astype(np.int64)
