"""The quantities of particles in a GSD file: those that a run keeps, in its precision, and what stands for the rest."""

from __future__ import annotations

import json

import numpy as np

from particlesim.core.rotations import conjugates, quaternion_products
from particlesim.scene.recording import Recording
from particlesim.trajectory.frames import Frame, Header
from particlesim.trajectory.gsd_chunks import Chunks
from particlesim.trajectory.gsd_header import LOG

# Under this prefix OVITO finds quantities of the particles.
IMPACTS = "log/particles/impacts"

# Where quantities are that are real numbers, in single precision as the schema has it, and in double precision.
_REAL = {
    "position": "particles/position",
    "orientation": "particles/orientation",
    "velocity": "particles/velocity",
    "angular_momentum": "particles/angmom",
}
_DOUBLE = LOG + "double/"

# And those that are counted.
_COUNTED = {"image": "particles/image", "impacts": IMPACTS}

# What stands for what is not in the file (the schema's defaults), by the ends of chunks' names.
_TURNED = (1.0, 0.0, 0.0, 0.0)
_DEFAULTS: dict[str, tuple[float, ...]] = {"orientation": _TURNED, "angmom": (0.0,) * 4, "impacts": (0.0,)}
_VECTOR = (0.0, 0.0, 0.0)


def recording_of(header: Header) -> Recording:
    """What the run of a scene keeps. ValueError if the scene is damaged."""
    return Recording(**json.loads(header.scene_json).get("trajectory", {}))


def has_images(header: Header) -> bool:
    """Whether the world has a period along any axis."""
    return "periodic" in json.loads(header.scene_json)["world"]["boundary"]


def particle_chunks(frame: Frame, recording: Recording) -> dict[str, np.ndarray]:
    """What is kept of the particles of a frame, by the names of chunks."""
    kept, chunks = recording.fields, {}
    for name in (name for name in _REAL if name in kept):
        values = getattr(frame, name)
        chunks[_REAL[name]] = (_quaternions(frame) if name == "angular_momentum" else values).astype(np.float32)
        if recording.precision == "double":
            chunks[_DOUBLE + name] = values
    for name, kind in (("image", np.int32), ("impacts", np.uint32)):
        if name in kept:
            chunks[_COUNTED[name]] = getattr(frame, name).astype(kind)
    return chunks


def read_particles(chunks: Chunks, recording: Recording, count: int, frame: int, images: bool) -> dict[str, np.ndarray]:
    """The quantities of the ``count`` particles of a frame, by their names there.

    What is not kept is not a number, but for orientations, which are as of nothing turned, and images where the world
    ``has_images`` of nothing.
    """
    unknown = {
        "orientation": np.array(_TURNED),
        "image": np.full(3, np.nan) if images else np.zeros(3, np.int64),
        "impacts": np.full(1, np.nan),
    }
    values: dict[str, np.ndarray] = {}
    for name, chunk in {**_REAL, **_COUNTED}.items():
        default = _default(chunk)
        if name not in recording.fields:
            each = unknown.get(name, np.full(3, np.nan))
            values[name] = np.broadcast_to(each, (count, len(each)))
        elif name in _REAL and recording.precision == "double":
            values[name] = chunks.rows(_DOUBLE + name, count, _TURNED if name == "orientation" else _VECTOR, frame)
        elif name == "angular_momentum":
            values[name] = _momenta(chunks.rows(chunk, count, default, frame), values["orientation"])
        else:
            stored = chunks.rows(chunk, count, default, frame)
            values[name] = stored.astype(np.int64) if name in _COUNTED else stored
    return {**values, "impacts": values["impacts"][:, 0]}


def _default(chunk: str) -> tuple[float, ...]:
    return _DEFAULTS.get(chunk.rpartition("/")[2], _VECTOR)


def _quaternions(frame: Frame) -> np.ndarray:
    """Angular momenta as HOOMD stores them, 2 q (0, L_body) = 2 (0, L) q, (n, 4)."""
    momentum = np.hstack([np.zeros((len(frame.angular_momentum), 1)), frame.angular_momentum])
    return 2.0 * quaternion_products(momentum, frame.orientation)


def _momenta(stored: np.ndarray, orientation: np.ndarray) -> np.ndarray:
    """Angular momenta in world axes from HOOMD's quaternions, (n, 3)."""
    return 0.5 * quaternion_products(stored, conjugates(orientation))[:, 1:]
