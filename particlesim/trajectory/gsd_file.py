"""A trajectory: what stays the same about its particles, then frame after frame, in memory or in a GSD file.

The file follows the HOOMD schema of GSD (https://gsd.readthedocs.io), so that OVITO, freud and others open it: types
with their shapes, positions, orientations, velocities, angular momenta. Under ``log/particlesim/`` it adds the scene,
the shape and size of every particle, and the ledger of every frame.
"""

from __future__ import annotations

import contextlib
import functools
import json
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path
from types import TracebackType
from typing import Any

import gsd.hoomd
import numpy as np

from particlesim.core.atomic_write import atomic_write
from particlesim.core.constants import SPHERE
from particlesim.geometry.shapes import Shape, hull, sphere
from particlesim.scene import Scene
from particlesim.scene.file import parse_scene
from particlesim.trajectory.frames import Frame, Header, Ledger

# Other programs draw a shape for each type and do not scale it. Groups of more sizes than this get that many types,
# evenly spread; the exact sizes are in the file as well.
_MAX_SIZES = 64

# GSD stores names of types in fixed-width fields and text as bytes.
_LOG = "particlesim/"
_LEDGER = _LOG + "ledger/"

# Under this prefix OVITO finds quantities of the particles that the schema does not have.
_IMPACTS = "particles/impacts"


class TrajectoryError(ValueError):
    """A file that is not a trajectory of ours; the message is one line."""


class TrajectoryWriter:
    """Writes frames to a GSD file, which appears when the ``with`` block ends well, and not otherwise."""

    def __init__(self, path: str | Path, header: Header) -> None:
        self._header = header
        self._box = [*json.loads(header.scene_json)["world"]["size"], 0.0, 0.0, 0.0]
        self._types, self._type_of = _display_types(header)
        self._files = contextlib.ExitStack()
        hidden = self._files.enter_context(atomic_write(path))
        self._file = self._files.enter_context(gsd.hoomd.open(str(hidden), "w"))
        self._count = 0

    def __enter__(self) -> TrajectoryWriter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._files.__exit__(kind, error, trace)

    def append(self, frame: Frame) -> None:
        """Add a frame."""
        header = self._header
        out = gsd.hoomd.Frame()
        out.configuration.step = self._count
        out.configuration.box = self._box
        particles = out.particles
        particles.N = len(header.shape)
        particles.position = frame.position.astype(np.float32)
        particles.orientation = frame.orientation.astype(np.float32)
        particles.velocity = frame.velocity.astype(np.float32)
        particles.angmom = _quaternion_momentum(frame).astype(np.float32)
        particles.image = frame.image.astype(np.int32)
        if self._count == 0:
            particles.types = [name for name, _ in self._types]
            particles.type_shapes = [shape for _, shape in self._types]
            particles.typeid = self._type_of.astype(np.uint32)
            particles.mass = header.mass.astype(np.float32)
            particles.moment_inertia = header.inertia.astype(np.float32)
            particles.diameter = _display_diameters(header)
            out.log.update(_header_log(header))
        out.log[_IMPACTS] = frame.impacts.astype(np.uint32)
        out.log[_LOG + "time"] = np.array([frame.time])
        out.log.update(_ledger_log(frame.ledger))
        self._file.append(out)
        self._count += 1


class Trajectory:
    """A GSD file written by particlesim: a sequence of frames. A context manager. TrajectoryError if it is not one."""

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        if not self.path.is_file():
            raise TrajectoryError(f"{path}: no such file")
        try:
            self._file = gsd.hoomd.open(str(path), "r")
        except (OSError, RuntimeError):
            raise TrajectoryError(f"{path}: not a GSD file, or cannot be read") from None
        try:
            self._first = self._file[0] if len(self._file) else None
            if self._first is None or _LOG + "scene" not in self._first.log:
                raise TrajectoryError(f"{path}: not written by particlesim, or without frames")
            if _IMPACTS not in self._first.log:
                raise TrajectoryError(f"{path}: written by an older particlesim; simulate its scene again")
            self.header = _read_header(self._first)
        except BaseException:
            self._file.close()
            raise

    def __enter__(self) -> Trajectory:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def __len__(self) -> int:
        return len(self._file)

    def __iter__(self) -> Iterator[Frame]:
        return (self[k] for k in range(len(self)))

    @functools.cached_property
    def scene(self) -> Scene:
        """The scene that the trajectory is of. SceneError if this version cannot read it."""
        return parse_scene(json.loads(self.header.scene_json))

    def time(self, k: int) -> float:
        """The time of frame ``k`` [s]."""
        return float(self._file[k].log[_LOG + "time"][0])

    def __getitem__(self, k: int) -> Frame:
        """Frame ``k``, 0 the first; positions and motion as the file stores them, in single precision."""
        stored = self._file[k]
        particles, log = stored.particles, stored.log
        orientation = particles.orientation.astype(np.float64)
        return Frame(
            time=float(log[_LOG + "time"][0]),
            position=particles.position.astype(np.float64),
            orientation=orientation,
            velocity=particles.velocity.astype(np.float64),
            angular_momentum=_world_momentum(particles.angmom.astype(np.float64), orientation),
            image=particles.image.astype(np.int64),
            impacts=log[_IMPACTS].astype(np.int64),
            ledger=_read_ledger(log),
        )


def _display_types(header: Header) -> tuple[list[tuple[str, dict[str, Any]]], np.ndarray]:
    """Types (name, shape as GSD describes it) for other programs, and the type of every particle (n,)."""
    types: list[tuple[str, dict[str, Any]]] = []
    type_of = np.zeros(len(header.shape), dtype=np.int64)
    for group in np.unique(header.group):
        members = np.flatnonzero(header.group == group)
        shape = header.shapes[int(header.shape[members[0]])]
        for rank in _size_classes(header.size[members]):
            size = float(np.mean(header.size[members[rank]]))
            type_of[members[rank]] = len(types)
            types.append((f"{shape.name}_{group}_{len(types)}", _gsd_shape(shape, size)))
    return types, type_of


def _display_diameters(header: Header) -> np.ndarray:
    """Diameters of spheres, (n,) float32 [m], and 2 for hulls, whose vertices OVITO stretches by half of it."""
    spheres = np.array([shape.kind == SPHERE for shape in header.shapes])[header.shape]
    return np.where(spheres, header.size, 2.0).astype(np.float32)


def _size_classes(size: np.ndarray) -> list[np.ndarray]:
    """Which particles share a displayed size: index arrays."""
    values, which = np.unique(size, return_inverse=True)
    if len(values) > _MAX_SIZES:
        return np.array_split(np.argsort(size, kind="stable"), _MAX_SIZES)
    return [np.flatnonzero(which == k) for k in range(len(values))]


def _gsd_shape(shape: Shape, size: float) -> dict[str, Any]:
    if shape.kind == SPHERE:
        return {"type": "Sphere", "diameter": size}
    return {"type": "ConvexPolyhedron", "rounding_radius": 0.0, "vertices": (shape.vertices * size).tolist()}


def _header_log(header: Header) -> dict[str, np.ndarray]:
    shapes = [
        {"name": s.name, "kind": s.kind, "vertices": s.vertices.tolist(), "orientation": s.orientation.tolist()}
        for s in header.shapes
    ]
    return {
        _LOG + "scene": np.frombuffer(header.scene_json.encode(), dtype=np.uint8),
        _LOG + "shapes": np.frombuffer(json.dumps(shapes).encode(), dtype=np.uint8),
        _LOG + "shape": header.shape.astype(np.int32),
        _LOG + "size": header.size,
        _LOG + "group": header.group.astype(np.int32),
    }


def _read_header(first: Any) -> Header:
    log = first.log
    described = json.loads(log[_LOG + "shapes"].tobytes())
    return Header(
        scene_json=log[_LOG + "scene"].tobytes().decode(),
        shapes=tuple(sphere() if s["kind"] == SPHERE else hull(s["name"], s["vertices"]) for s in described),
        shape=log[_LOG + "shape"].astype(np.int64),
        size=log[_LOG + "size"],
        group=log[_LOG + "group"].astype(np.int64),
        mass=first.particles.mass.astype(np.float64),
        inertia=first.particles.moment_inertia.astype(np.float64),
    )


def _ledger_log(ledger: Ledger | None) -> dict[str, np.ndarray]:
    """What is known of a ledger, each field under its name."""
    if ledger is None:
        return {}
    values = {field.name: getattr(ledger, field.name) for field in fields(Ledger)}
    return {_LEDGER + name: np.atleast_1d(value) for name, value in values.items() if value is not None}


def _read_ledger(log: dict[str, np.ndarray]) -> Ledger:
    """The ledger of a frame: of each field as many numbers as were written, one as a plain number."""
    names = [field.name for field in fields(Ledger) if _LEDGER + field.name in log]
    return Ledger(**{name: _plain(log[_LEDGER + name]) for name in names})


def _plain(value: np.ndarray) -> Any:
    return value[0].item() if len(value) == 1 else value


def _product(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Quaternion products of rows, (n, 4)."""
    # Column by column, which takes numpy a fifth of the time that rows do.
    (a, b, c, d), (e, f, g, h) = np.ascontiguousarray(p.T), np.ascontiguousarray(q.T)
    w, x = a * e - (b * f + c * g + d * h), a * f + b * e + (c * h - d * g)
    y, z = a * g + c * e + (d * f - b * h), a * h + d * e + (b * g - c * f)
    return np.stack([w, x, y, z], axis=1)


def _quaternion_momentum(frame: Frame) -> np.ndarray:
    """Angular momenta as HOOMD stores them, 2 q (0, L_body) = 2 (0, L) q, (n, 4)."""
    momentum = np.hstack([np.zeros((len(frame.angular_momentum), 1)), frame.angular_momentum])
    return 2.0 * _product(momentum, frame.orientation)


def _world_momentum(stored: np.ndarray, orientation: np.ndarray) -> np.ndarray:
    """Angular momenta in world axes from HOOMD's quaternions, (n, 3)."""
    return 0.5 * _product(stored, orientation * np.array([1.0, -1.0, -1.0, -1.0]))[:, 1:]
