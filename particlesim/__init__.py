"""particlesim: from a scene file to a movie of particles that bounce as physics says they do, without a screen.

    import particlesim as ps

    scene = ps.load_scene("scenes/mixed_box.toml")
    ps.render(scene, "movie.mp4")

Conventions, everywhere: SI units; right-handed axes, z up; quaternions (w, x, y, z) of unit length, from body to
world axes; angular velocity and momentum in world axes; contact normals point from the first body to the second; a
separation below 0 is an overlap; arrays are named by what they hold, such as ``position (n, 3) float64 [m]``.

Names are loaded when they are first used: a simulation does not need OpenGL, and ``--help`` needs neither.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from particlesim.broad_phase import find_pairs
    from particlesim.geometry.separation import Pose, Separation, separation
    from particlesim.geometry.shapes import CATALOGUE, Shape
    from particlesim.jobs.movie import render, simulate, still
    from particlesim.rendering import RenderError
    from particlesim.scene import Scene
    from particlesim.scene.file import SceneError, load_scene
    from particlesim.simulation.checkpoint import CheckpointError
    from particlesim.simulation.simulation import Simulation, SimulationError
    from particlesim.trajectory.frames import Ledger
    from particlesim.trajectory.gsd_file import Trajectory, TrajectoryError, open

_HOMES = {
    "CATALOGUE": "geometry.shapes",
    "CheckpointError": "simulation.checkpoint",
    "Ledger": "trajectory.frames",
    "Pose": "geometry.separation",
    "RenderError": "rendering",
    "Scene": "scene",
    "SceneError": "scene.file",
    "Separation": "geometry.separation",
    "Shape": "geometry.shapes",
    "Simulation": "simulation.simulation",
    "SimulationError": "simulation.simulation",
    "Trajectory": "trajectory.gsd_file",
    "TrajectoryError": "trajectory.gsd_file",
    "find_pairs": "broad_phase",
    "load_scene": "scene.file",
    "open": "trajectory.gsd_file",
    "render": "jobs.movie",
    "separation": "geometry.separation",
    "simulate": "jobs.movie",
    "still": "jobs.movie",
}

__all__ = [
    "CATALOGUE",
    "CheckpointError",
    "Ledger",
    "Pose",
    "RenderError",
    "Scene",
    "SceneError",
    "Separation",
    "Shape",
    "Simulation",
    "SimulationError",
    "Trajectory",
    "TrajectoryError",
    "find_pairs",
    "load_scene",
    "open",
    "render",
    "separation",
    "simulate",
    "still",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'particlesim' has no attribute '{name}'")
    value = getattr(importlib.import_module(f"particlesim.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*__all__, *(name for name in globals() if name.startswith("__"))})
