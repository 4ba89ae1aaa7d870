"""What a scene cannot be, as far as that is known without any kernel: found out before they are compiled."""

from __future__ import annotations

import math

import numpy as np

from particlesim.scene import Scene
from particlesim.scene.errors import SceneError
from particlesim.scene.groups import (
    CompoundShape,
    FixedSize,
    FixedVelocity,
    Group,
    Maxwell,
    MeshShape,
    UniformSpeed,
)
from particlesim.scene.placements import ListPlacement
from particlesim.setup.placement import unit_hint
from particlesim.setup.shape_reading import shape_of

# Density of particles that give neither density nor mass: water [kg/m^3].
DEFAULT_DENSITY = 1000.0

# A run of more time steps than this is refused: it would take years.
MOST_STEPS = 1e12

# In a time step particles move less than their diameter. The speed of one that is thrown may be below the usual one of
# its group, but for one in a million not by this factor.
_SLOW = 0.01


def check_limits(scene: Scene) -> None:
    """SceneError if particles cannot have room in a closed world, or go so fast that time steps come to no end.

    Shapes that are read, or made of others, take time: they are looked at when the scene is built.
    """
    given = scene.solver.time_step
    if given != "auto":
        check_steps(scene, scene.duration / given, "about")
    least = 0.0
    for g, group in enumerate(scene.particles):
        if not group.number or isinstance(group.shape, MeshShape | CompoundShape):
            continue
        shape = shape_of(group.shape, f"{scene.key(g)}.shape")
        small, large = _sizes(group)
        if 2.0 * shape.inradius * small > min(scene.world.size):
            return  # the build says which particles are too large, and for what
        least += shape.volume * small**3 * group.number
        if given == "auto":
            speed = _SLOW * _usual_speed(group, shape.volume * large**3)
            check_steps(scene, speed * scene.duration / (2.0 * shape.radius * large), "more than")
    check_fill(scene, least / math.prod(scene.world.size))


def check_fill(scene: Scene, fill: float) -> None:
    """SceneError if the volumes of particles add up to more than that of a closed world: ``fill`` times that."""
    if fill > 1.0 and "open" not in scene.world.boundary:
        hints = [unit_hint(group) for group in scene.particles]
        raise SceneError(f"do not fit: their volumes add up to {fill:.3g} times the world's" + max(hints), "particles")


def check_steps(scene: Scene, steps: float, about: str) -> None:
    """SceneError if a scene takes ("about" or "more than") so many time steps that there is no end to it."""
    if steps > MOST_STEPS:
        key = "duration" if scene.solver.time_step == "auto" else "solver.time_step"
        value = scene.duration if scene.solver.time_step == "auto" else scene.solver.time_step
        raise SceneError(f"takes {about} {steps:.0e} time steps; there may be up to {MOST_STEPS:.0e}", key, value)


def _sizes(group: Group) -> tuple[float, float]:
    """The least and the largest size of a group."""
    size = group.size
    return (size.value, size.value) if isinstance(size, FixedSize) else (size.low, size.high)


def _usual_speed(group: Group, volume: float) -> float:
    """How fast particles of a group start that have this volume [m^3], as far as their law says; 0 for others [m/s]."""
    law = group.velocity
    if isinstance(group.placement, ListPlacement):  # whose poses may say another
        return 0.0
    if isinstance(law, Maxwell):
        density = DEFAULT_DENSITY if group.density is None else group.density
        return math.sqrt(law.temperature / (density * volume if group.mass is None else group.mass))
    if isinstance(law, UniformSpeed):
        return law.speed
    return float(np.linalg.norm(law.vector)) if isinstance(law, FixedVelocity) else 0.0
