"""Small scenes for tests."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from particlesim.scene import Scene
from particlesim.scene.file import load_scene
from particlesim.scene.overrides import scaled
from particlesim.trajectory.frames import Ledger

# Keys of surfaces.
SURFACE = "restitution", "friction", "static_friction", "rolling_friction", "tangential_restitution"

# A scene of more particles than this is tested by a twin with as many.
MOST = 4000


def listed(shape: Any, *poses: dict[str, Any], **group: Any) -> dict[str, Any]:
    """A group of particles exactly where the poses say."""
    return {"shape": shape, "placement": {"kind": "list", "poses": list(poses)}, **group}


def scene(*groups: dict[str, Any], size: Any = (20.0, 20.0, 20.0), step: Any = "auto", **settings: Any) -> Scene:
    """A scene of the given groups; ``settings`` that the world knows go there, others to the scene itself."""
    of_world = {key: settings.pop(key) for key in ("boundary", "gravity", *SURFACE) if key in settings}
    world = {"size": size, **of_world}
    solver = {"broad_phase": settings.pop("broad_phase", "octree"), "time_step": step}
    return Scene(world=world, particles=list(groups), solver=solver, **settings)


def off_a_blade(angular_velocity: float, distance: float, reach: float, start: float) -> tuple[float, np.ndarray]:
    """When a blade that turns about z strikes a ball at rest on the x axis [s], and the velocity that this one gets.

    The ball at distance d is touched on the flat side when the face is the ``reach`` r + h from its centre, the radius
    and half the blade's thickness: d sin(angle) = r + h. The face moves there at w d cos(angle), and the ball goes off
    at twice that, along the normal. The blade is at the angle ``start`` at time 0.
    """
    touching = -math.asin(reach / distance)
    speed = 2.0 * angular_velocity * distance * math.cos(touching)
    return (touching - start) / angular_velocity, speed * np.array([-math.sin(touching), math.cos(touching), 0.0])


def gas(count: int = 20, *, seed: int = 1, **settings: Any) -> Scene:
    """Spheres, cubes, pyramids and boxes of three different edges flying about in a box."""
    shapes = ["sphere", "cube", "pyramid", {"kind": "box", "edges": [1.0, 0.7, 0.4]}]
    motion = {"velocity": {"kind": "maxwell", "temperature": 20.0}, "spin": {"kind": "maxwell", "temperature": 20.0}}
    groups = [{"shape": shape, "count": count, "size": 0.3, **motion} for shape in shapes]
    return scene(*groups, **{"size": (2.5, 2.5, 2.5), "seed": seed, **settings})


def quick_twin(path: Path) -> Scene:
    """The scene of a file, with fewer and larger particles if it has very many."""
    loaded = load_scene(path)
    return loaded if loaded.number <= MOST else scaled(loaded, MOST / loaded.number)


def ledger(**values: Any) -> Ledger:
    """A ledger with these values and nothing else in it."""
    energies = dict.fromkeys(("kinetic_translational", "kinetic_rotational", "potential", "virial"), 0.0)
    counts = dict.fromkeys(("steps", "impacts", "pairs_tested", "candidate_pairs", "unresolved"), 0)
    vectors = {"momentum": np.zeros(3), "angular_momentum": np.zeros(3), "wall_impulse": np.zeros(6)}
    return Ledger(**{"time": 0.0, "time_step": 0.0, **energies, **counts, **vectors, **values})
