"""Types of particles with their shapes, as the HOOMD schema of GSD has them for other programs."""

from __future__ import annotations

from typing import Any

import numpy as np

from particlesim.core.constants import CAPSULE, SPHERE
from particlesim.geometry.shapes import Shape
from particlesim.geometry.surface import surface_of
from particlesim.trajectory.frames import Header

# Other programs draw a shape for each type and do not scale it. Groups of more sizes than this get that many types,
# evenly spread; the exact sizes are in the file as well. All types of a group have no more corners than this, so that
# hulls of thousands do not fill the file.
_MAX_SIZES, _MAX_CORNERS = 64, 20_000

# Sides of the prism that stands for a capsule in other programs, and its radius as a fraction of the capsule's: the
# outline is off by 0.2 %.
_PRISM_SIDES = 16
_PRISM_RADIUS = 1e-3


def display_types(header: Header) -> tuple[list[tuple[str, dict[str, Any]]], np.ndarray]:
    """Types (name, shape as GSD describes it) for other programs, and the type of every particle (n,)."""
    types: list[tuple[str, dict[str, Any]]] = []
    type_of = np.zeros(len(header.shape), dtype=np.int64)
    for group in np.unique(header.group):
        members = np.flatnonzero(header.group == group)
        shape = header.shapes[int(header.shape[members[0]])]
        most = max(1, min(_MAX_SIZES, _MAX_CORNERS // len(shape.vertices)))
        for rank in _size_classes(header.size[members], most):
            size = float(np.mean(header.size[members[rank]]))
            type_of[members[rank]] = len(types)
            types.append((f"{shape.name}_{group}_{len(types)}", _gsd_shape(shape, size)))
    return types, type_of


def display_diameters(header: Header) -> np.ndarray:
    """Diameters of spheres, (n,) float32 [m], and 2 for others, whose shape OVITO stretches by half of it."""
    spheres = np.array([shape.kind == SPHERE for shape in header.shapes])[header.shape]
    return np.where(spheres, header.size, 2.0).astype(np.float32)


def _size_classes(size: np.ndarray, most: int) -> list[np.ndarray]:
    """Which particles share a displayed size, of which there are ``most`` at the most: index arrays."""
    values, which = np.unique(size, return_inverse=True)
    if len(values) > most:
        return np.array_split(np.argsort(size, kind="stable"), most)
    return [np.flatnonzero(which == k) for k in range(len(values))]


def _gsd_shape(shape: Shape, size: float) -> dict[str, Any]:
    if shape.kind == SPHERE:
        return {"type": "Sphere", "diameter": size}
    if shape.parts:
        surface = surface_of(shape)
        return {
            "type": "Mesh",
            "vertices": (surface.vertices * size).tolist(),
            "indices": surface.triangles.tolist(),
        }
    core, rounding = shape.vertices, shape.rounding
    if shape.kind == CAPSULE:
        core, rounding = _thin_prism(shape)
    return {"type": "ConvexPolyhedron", "rounding_radius": rounding * size, "vertices": (core * size).tolist()}


def _thin_prism(shape: Shape) -> tuple[np.ndarray, float]:
    """Vertices and rounding of a thin prism that looks like a capsule: the core of a polyhedron must enclose volume.

    OVITO draws one flat face for every edge of a rounded polyhedron, so the prism has many.
    """
    thin = _PRISM_RADIUS * shape.rounding
    angle = 2.0 * np.pi / _PRISM_SIDES * np.arange(_PRISM_SIDES)
    ring = thin * np.stack([np.cos(angle), np.sin(angle), np.zeros(_PRISM_SIDES)], axis=1)
    return np.concatenate([end + ring for end in shape.vertices]), shape.rounding - thin
