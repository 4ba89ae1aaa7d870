"""Compounds: bodies of several convex parts, which need not be convex themselves.

Parts move as one body. Where they overlap, each has its own mass: volume, centroid and inertia are sums over the parts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from particlesim.core.arguments import FARTHEST, real_numbers
from particlesim.core.constants import BALL, COMPOUND, SPHERE
from particlesim.core.rotations import quaternions_of, rotations_of
from particlesim.geometry.convex_hull import hull_polygons
from particlesim.geometry.faces import Polyhedron
from particlesim.geometry.mass_properties import MassProperties, principal_axes
from particlesim.geometry.shapes import Shape


class Part(NamedTuple):
    """A shape of the catalogue in a compound.

    Attributes
    ----------
    shape : Shape
    position : (3,) float64 [m]
        Of its centroid.
    orientation : (4,) float64
        Quaternion (w, x, y, z) that turns the axes in which it was described into those of the compound.
    size : float
        Factor on the shape.
    """

    shape: Shape
    position: np.ndarray
    orientation: np.ndarray
    size: float


def compound(parts: Sequence[Part]) -> Shape:
    """The body of these parts, about the common centroid.

    Raises
    ------
    ValueError
        If there are no parts, or one of them is not bounded and convex.
    """
    if not parts:
        raise ValueError("a compound has one part or more")
    for number, part in enumerate(parts):
        if not (part.shape.is_bounded and part.shape.is_convex):
            raise ValueError(f"part {number} of a compound must be a convex shape, not '{part.shape.name}'")
        if not (np.abs(real_numbers("the position of a part", part.position)) <= FARTHEST).all():
            raise ValueError(f"part {number} of a compound must be within {FARTHEST:g} m")
    whole = _mass(parts)
    _, axes = principal_axes(whole.inertia)
    inwards = Rotation.from_matrix(axes).inv()
    parts = [
        part._replace(
            position=(np.asarray(part.position) - whole.centroid) @ axes,
            orientation=quaternions_of(inwards * rotations_of(np.asarray(part.orientation))),
        )
        for part in parts
    ]
    # Again in the principal axes: what is small in others is a difference of what is large.
    whole = _mass(parts)
    placed = tuple(_placed(part) for part in parts)
    vertices, faces = _box_about(placed)
    return Shape(
        name="compound",
        kind=COMPOUND,
        vertices=vertices,
        faces=faces,
        rounding=0.0,
        volume=whole.volume,
        moments=np.diag(whole.inertia).copy(),
        radius=max(part.radius for part in placed),
        inradius=min(part.inradius for part in placed),
        orientation=quaternions_of(inwards.inv(), canonical=True),
        parts=placed,
    )


def _axes_of(part: Part) -> Rotation:
    """The rotation from the principal axes of a part to the axes of its compound."""
    return rotations_of(np.asarray(part.orientation)) * rotations_of(part.shape.orientation)


def _mass(parts: Sequence[Part]) -> MassProperties:
    """The sum of the mass properties of parts (Steiner's theorem)."""
    volumes = np.array([part.shape.volume * part.size**3 for part in parts])
    positions = np.array([part.position for part in parts])
    volume = float(volumes.sum())
    centroid = volumes @ positions / volume
    inertia = np.zeros((3, 3))
    for part, of_part, arm in zip(parts, volumes, positions - centroid, strict=True):
        axes = _axes_of(part).as_matrix()
        inertia += (axes * (part.shape.moments * part.size**5)) @ axes.T
        inertia += of_part * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return MassProperties(volume, centroid, inertia)


def _placed(part: Part) -> Shape:
    """A part as a shape whose vertices are where they are in its compound, at size 1."""
    shape, size = part.shape, part.size
    vertices = _axes_of(part).apply(shape.vertices * size) + part.position
    rounding = shape.rounding * size
    return replace(
        shape,
        kind=BALL if shape.kind == SPHERE else shape.kind,
        vertices=vertices,
        rounding=rounding,
        volume=shape.volume * size**3,
        moments=shape.moments * size**5,
        radius=float(np.linalg.norm(vertices, axis=1).max()) + rounding,
        inradius=shape.inradius * size,
    )


def _box_about(parts: Sequence[Shape]) -> Polyhedron:
    """The box about parts, in the axes of their compound."""
    lower = np.min([part.vertices.min(axis=0) - part.rounding for part in parts], axis=0)
    upper = np.max([part.vertices.max(axis=0) + part.rounding for part in parts], axis=0)
    try:
        return hull_polygons("compound", np.array(list(product(*zip(lower, upper, strict=True)))))
    except ValueError:
        raise ValueError("the parts of a compound are too far apart for their sizes") from None
