"""Small scenes for tests."""

from __future__ import annotations

from typing import Any

from particlesim.scene import Scene


def listed(shape: Any, *poses: dict[str, Any], **group: Any) -> dict[str, Any]:
    """A group of particles exactly where the poses say."""
    return {"shape": shape, "placement": {"kind": "list", "poses": list(poses)}, **group}


def scene(*groups: dict[str, Any], size: Any = (20.0, 20.0, 20.0), step: Any = "auto", **settings: Any) -> Scene:
    """A scene of the given groups; ``settings`` that the world knows go there, others to the scene itself."""
    of_world = {key: settings.pop(key) for key in ("boundary", "gravity", "restitution") if key in settings}
    world = {"size": size, **of_world}
    solver = {"broad_phase": settings.pop("broad_phase", "octree"), "time_step": step}
    return Scene(world=world, particles=list(groups), solver=solver, **settings)


def gas(count: int = 20, *, seed: int = 1, **settings: Any) -> Scene:
    """Spheres, cubes, pyramids and boxes of three different edges flying about in a box."""
    shapes = ["sphere", "cube", "pyramid", {"kind": "box", "edges": [1.0, 0.7, 0.4]}]
    motion = {"velocity": {"kind": "maxwell", "temperature": 20.0}, "spin": {"kind": "maxwell", "temperature": 20.0}}
    groups = [{"shape": shape, "count": count, "size": 0.3, **motion} for shape in shapes]
    return scene(*groups, **{"size": (2.5, 2.5, 2.5), "seed": seed, **settings})
