"""Compounds for tests, and what is known of them part by part."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from particlesim.core.constants import BALL, SPHERE
from particlesim.geometry.separation import separation
from particlesim.geometry.shapes import Shape
from particlesim.scene import Scene
from particlesim.setup.build import build


def compound(*parts: dict[str, Any]) -> dict[str, Any]:
    """The table of a compound of these parts."""
    return {"kind": "compound", "parts": list(parts)}


def part(shape: Any, *position: float, size: float = 1.0, **more: Any) -> dict[str, Any]:
    """The table of a part."""
    return {"shape": shape, "position": position, "size": size, **more}


def block(edges: tuple[float, float, float], *position: float) -> dict[str, Any]:
    """The table of a part that is a box."""
    return part({"kind": "box", "edges": edges}, *position)


# A cube of two halves.
HALVES = compound(block((0.5, 1, 1), -0.25, 0, 0), block((0.5, 1, 1), 0.25, 0, 0))

# Three cubes in the corner of an L.
L = compound(part("cube", 0, 0, 0), part("cube", 1, 0, 0), part("cube", 0, 1, 0))

# A trough with two walls; the room between them is half a metre wide.
U = compound(block((1, 1, 0.25), 0, 0, 0), block((0.25, 1, 1), -0.375, 0, 0.5), block((0.25, 1, 1), 0.375, 0, 0.5))

# Something of everything.
MIXED = compound(
    part("cube", 0, 0, 0, size=0.5),
    part("sphere", 0.5, 0, 0, size=0.6),
    part({"kind": "capsule", "length": 2.0}, 0, 0.5, 0, size=0.2, orientation={"axis": [1, 0, 0], "angle": 60}),
    part("tetrahedron", 0, -0.3, 0.3, size=0.6),
)


def ring(radius: float, thickness: float, sides: int = 12) -> dict[str, Any]:
    """A ring of capsules about z, whose middles are at a radius."""
    angle, along = 2.0 * math.pi / sides, 2.0 * radius * math.tan(math.pi / sides)
    capsule = {"kind": "capsule", "length": along / thickness}
    parts = []
    for k in range(sides):
        at = radius * np.array([math.cos(k * angle), math.sin(k * angle), 0.0])
        across = Rotation.from_euler("z", k * angle) * Rotation.from_euler("x", math.pi / 2)
        turn = np.roll(across.as_quat(), 1).tolist()
        parts.append(part(capsule, *at.tolist(), size=thickness, orientation=turn))
    return compound(*parts)


def shape_of(table: dict[str, Any]) -> Shape:
    """The shape that a scene's table makes."""
    world = {"size": [20.0, 20.0, 20.0]}
    group = {"shape": table, "placement": {"kind": "list", "poses": [{"position": [0, 0, 0]}]}}
    return build(Scene(world=world, particles=[group])).shapes[0]


def apart(shape: Shape, pose_a: tuple[Any, Any, float], other: Shape, pose_b: tuple[Any, Any, float]) -> float:
    """The separation of two compounds at poses of their body axes, part by part, each a shape of its own [m]."""
    least = math.inf
    for one in _parts(shape, *pose_a):
        for two in _parts(other, *pose_b):
            least = min(least, separation(*one, *two).distance)
    return least


def _parts(shape: Shape, position: Any, orientation: Any, size: float) -> list[tuple[Shape, tuple[Any, Any, float]]]:
    """Each part of a shape as a hull of its corners, or the sphere that it is, and its pose in space."""
    turn = Rotation.from_quat(np.roll(orientation, -1))
    found = []
    for each in shape.parts or (shape,):
        middle = each.vertices.mean(axis=0)
        found.append((_about(each, middle), (turn.apply(middle * size) + position, orientation, size)))
    return found


def _about(each: Shape, middle: np.ndarray) -> Shape:
    """A part of a compound as a shape about its own middle."""
    vertices = each.vertices - middle
    radius = float(np.linalg.norm(vertices, axis=1).max()) + each.rounding
    kind = SPHERE if each.kind == BALL else each.kind
    return replace(each, kind=kind, vertices=vertices, radius=radius, orientation=np.array([1.0, 0.0, 0.0, 0.0]))
