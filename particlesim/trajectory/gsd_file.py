"""A trajectory: what stays the same about its particles, then frame after frame, in memory or in a GSD file.

The file follows the HOOMD schema of GSD (https://gsd.readthedocs.io), so that OVITO, freud and others open it: types
with their shapes, positions, orientations, velocities, angular momenta. Under ``log/particlesim/`` it adds the scene,
the shape and size of every particle, and the ledger of every frame.
"""

from __future__ import annotations

import functools
import importlib.metadata
import json
from collections.abc import Iterator
from dataclasses import MISSING, Field, fields
from pathlib import Path
from typing import Any

import gsd.hoomd
import numpy as np

from particlesim.core.constants import CAPSULE, DISSIPATION, SPHERE, WALL_NAMES
from particlesim.core.rotations import conjugates, quaternion_products
from particlesim.geometry.convex_hull import hull_polygons
from particlesim.geometry.shapes import Shape, capsule, drawn_hull, principal_hull, sphere
from particlesim.scene import Scene
from particlesim.scene.file import stored_scene
from particlesim.trajectory.foreign_gsd import FRAME_RATE, Foreign, check_same_particles, read_foreign
from particlesim.trajectory.frames import Frame, Header, Ledger
from particlesim.trajectory.gsd_chunks import Chunks, TrajectoryError, cut, reading

# Other programs draw a shape for each type and do not scale it. Groups of more sizes than this get that many types,
# evenly spread; the exact sizes are in the file as well. All types of a group have no more corners than this, so that
# hulls of thousands do not fill the file.
_MAX_SIZES, _MAX_CORNERS = 64, 20_000

# What the schema does not have is among its logged quantities; text is stored as bytes. Under the second prefix OVITO
# finds quantities of the particles.
_LOG = "log/particlesim/"
_LEDGER = _LOG + "ledger/"
_IMPACTS = "log/particles/impacts"
_ID = "log/particles/id"

# Sides of the prism that stands for a capsule in other programs, and its radius as a fraction of the capsule's: the
# outline is off by 0.2 %.
_PRISM_SIDES = 16
_PRISM_RADIUS = 1e-3

# Quantities of a particle, with what stands for those that are not in the file (the schema's defaults).
_DEFAULTS: dict[str, tuple[float, ...]] = {
    "position": (0.0, 0.0, 0.0),
    "orientation": (1.0, 0.0, 0.0, 0.0),
    "velocity": (0.0, 0.0, 0.0),
    "angmom": (0.0, 0.0, 0.0, 0.0),
    "image": (0.0, 0.0, 0.0),
}

# How far the square of a quaternion's length may be from 1: rounding to single precision leaves 1e-6.
_UNIT = 1e-3

# What the arrays of a ledger are.
_SHAPES: dict[str, tuple[int, ...]] = {
    "momentum": (3,),
    "angular_momentum": (3,),
    "wall_impulse": (len(WALL_NAMES),),
    "dissipated": (len(DISSIPATION),),
    "wall_shear": (len(WALL_NAMES), 3),
    "flow_mass": (2,),
    "flow_energy": (2,),
}


_OLDER = "written by an older particlesim; simulate its scene again"


class TrajectoryWriter:
    """Writes frames to a GSD file, after the first ``kept`` that are in it. A context manager."""

    def __init__(self, path: Path, header: Header, kept: int = 0) -> None:
        self._header = header
        self._box = [*json.loads(header.scene_json)["world"]["size"], 0.0, 0.0, 0.0]
        self._types, self._type_of = _display_types(header)
        if kept:
            cut(path, kept)
        else:
            Path(path).touch()  # as other files are made: GSD would keep it from all others
        self._file = gsd.hoomd.open(str(path), "r+" if kept else "w")
        self._count = kept

    def __enter__(self) -> TrajectoryWriter:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def flush(self) -> None:
        """Let all frames so far be in the file."""
        self._file.flush()

    def append(self, frame: Frame) -> None:
        """Add a frame."""
        header, ids = self._header, frame.ids
        out = gsd.hoomd.Frame()
        out.configuration.step = self._count
        out.configuration.box = self._box
        particles = out.particles
        particles.N = len(ids)
        particles.position = frame.position.astype(np.float32)
        particles.orientation = frame.orientation.astype(np.float32)
        particles.velocity = frame.velocity.astype(np.float32)
        particles.angmom = _quaternion_momentum(frame).astype(np.float32)
        particles.image = frame.image.astype(np.int32)
        if self._count == 0:
            particles.types = [name for name, _ in self._types]
            particles.type_shapes = [shape for _, shape in self._types]
            out.log.update(_logged(_header_log(header, changing=frame.present is not None)))
        if self._count == 0 or frame.present is not None:
            particles.typeid = self._type_of[ids].astype(np.uint32)
            particles.mass = header.mass[ids].astype(np.float32)
            particles.moment_inertia = header.inertia[ids].astype(np.float32)
            particles.diameter = _display_diameters(header)[ids]
        own = {_IMPACTS: frame.impacts.astype(np.uint32), _LOG + "time": np.array([frame.time])}
        if frame.present is not None:
            own[_ID] = ids.astype(np.uint32)
        out.log.update(_logged({**own, **_ledger_log(frame.ledger)}))
        self._file.append(out)
        self._count += 1


class Trajectory:
    """A GSD file: a sequence of frames. A context manager. TrajectoryError if it is none, or damaged.

    Of files that other programs wrote, such as HOOMD-blue, ``assumed`` says line by line what they leave open.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self._chunks = chunks = Chunks(self.path)
        try:
            with reading(self.path):
                if not chunks.frames:
                    raise TrajectoryError(f"{path}: has no frames")
                self._is_own = chunks.has(_LOG + "scene")
                if self._is_own and not all(chunks.has(name) for name in (_IMPACTS, *_ledger_names())):
                    raise TrajectoryError(f"{path}: {_OLDER}")
                found = Foreign(_read_header(chunks), ()) if self._is_own else read_foreign(chunks)
                self.header, self.assumed = _checked(found.header), found.assumed
        except BaseException:
            chunks.close()
            raise

    def __enter__(self) -> Trajectory:
        return self

    def __exit__(self, *_: object) -> None:
        self._chunks.close()

    def __len__(self) -> int:
        return self._chunks.frames

    def __iter__(self) -> Iterator[Frame]:
        return (self[k] for k in range(len(self)))

    @functools.cached_property
    def scene(self) -> Scene:
        """The scene that the trajectory is of. SceneError if this version cannot read it."""
        with reading(self.path):
            table = json.loads(self.header.scene_json)
        scene = stored_scene(table)
        if len(self.header.group) != scene.number or (self.header.group >= len(scene.groups)).any():
            raise TrajectoryError(f"{self.path}: damaged: its particles are not those of its scene")
        return scene

    @property
    def version(self) -> str | None:
        """The version of particlesim that wrote it; None if it does not say."""
        name = _LOG + "version"
        with reading(self.path):
            return self._chunks.read(name).tobytes().decode() if self._chunks.has(name) else None

    def time(self, k: int) -> float:
        """The time of frame ``k`` [s]."""
        with reading(self.path):
            if not self._is_own:
                return k / FRAME_RATE
            return float(self._chunks.rows(_LOG + "time", 1, (0.0,), k)[0, 0])

    def __getitem__(self, k: int) -> Frame:
        """Frame ``k``, 0 the first; positions and motion as the file stores them, in single precision."""
        if not 0 <= k < len(self):
            raise IndexError(k)
        with reading(self.path):
            if not self._is_own:
                check_same_particles(self._chunks, self.header, k)
            present = self._chunks.read(_ID, k).astype(np.int64) if self._chunks.has(_ID) else None
            count = len(self.header.shape) if present is None else len(present)
            if present is not None and ((present >= len(self.header.shape)).any() or (np.diff(present) <= 0).any()):
                raise ValueError(f"ids of frame {k}")
            each = {
                name: self._chunks.rows("particles/" + name, count, default, k) for name, default in _DEFAULTS.items()
            }
            if (np.abs((each["orientation"] ** 2).sum(axis=1) - 1.0) > _UNIT).any():
                raise ValueError(f"orientations of frame {k}")
            return Frame(
                time=self.time(k),
                position=each["position"],
                orientation=each["orientation"],
                velocity=each["velocity"],
                angular_momentum=_world_momentum(each["angmom"], each["orientation"]),
                image=each["image"].astype(np.int64),
                impacts=self._chunks.rows(_IMPACTS, count, (0.0,), k)[:, 0].astype(np.int64),
                ledger=_read_ledger(self._chunks, k) if self._is_own else None,
                present=present,
            )


def _display_types(header: Header) -> tuple[list[tuple[str, dict[str, Any]]], np.ndarray]:
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


def _display_diameters(header: Header) -> np.ndarray:
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


def _header_log(header: Header, changing: bool) -> dict[str, np.ndarray]:
    """What the schema has no place for; where numbers are ``changing``, masses of all particles that there ever are."""
    constants = {"mass": header.mass.astype(np.float32), "inertia": header.inertia.astype(np.float32)}
    shapes = [
        {
            "name": s.name,
            "vertices": s.vertices.tolist(),
            "rounding": s.rounding,
            "orientation": s.orientation.tolist(),
            "volume": s.volume,
            "moments": s.moments.tolist(),
            "described_corners": s.described_corners,
        }
        for s in header.shapes
    ]
    drawn = "name", "vertices", "rounding", "orientation"
    obstacles = [{name: _plain(getattr(s, name)) for name in drawn} for s in header.obstacles]
    return {
        _LOG + "version": np.frombuffer(importlib.metadata.version("particlesim").encode(), dtype=np.uint8),
        _LOG + "scene": np.frombuffer(header.scene_json.encode(), dtype=np.uint8),
        _LOG + "shapes": np.frombuffer(json.dumps(shapes).encode(), dtype=np.uint8),
        _LOG + "obstacles": np.frombuffer(json.dumps(obstacles).encode(), dtype=np.uint8),
        _LOG + "shape": header.shape.astype(np.int32),
        _LOG + "size": header.size,
        _LOG + "group": header.group.astype(np.int32),
        **{_LOG + name: values for name, values in constants.items() if changing},
    }


def _read_header(chunks: Chunks) -> Header:
    described = json.loads(chunks.read(_LOG + "shapes").tobytes())
    if any("vertices" in shape and "described_corners" not in shape for shape in described):
        raise TrajectoryError(f"{chunks.path}: {_OLDER}")
    shape = chunks.read(_LOG + "shape").astype(np.int64)
    return Header(
        scene_json=chunks.read(_LOG + "scene").tobytes().decode(),
        shapes=tuple(_read_shape(s) for s in described),
        shape=shape,
        size=chunks.rows(_LOG + "size", len(shape), (1.0,))[:, 0],
        group=chunks.rows(_LOG + "group", len(shape), (0.0,))[:, 0].astype(np.int64),
        mass=chunks.rows(_either(chunks, "mass", "particles/mass"), len(shape), (1.0,))[:, 0],
        inertia=chunks.rows(_either(chunks, "inertia", "particles/moment_inertia"), len(shape), (0.0, 0.0, 0.0)),
        obstacles=tuple(_read_obstacle(s) for s in _read_obstacles(chunks)),
    )


def _either(chunks: Chunks, name: str, of_schema: str) -> str:
    """Where a constant of all particles is: where their number stays the same, only as the schema has it."""
    return _LOG + name if chunks.has(_LOG + name) else of_schema


def _read_obstacles(chunks: Chunks) -> list[dict[str, Any]]:
    """What is said of the obstacles' shapes; nothing in older files."""
    name = _LOG + "obstacles"
    found: list[dict[str, Any]] = json.loads(chunks.read(name).tobytes()) if chunks.has(name) else []
    return found


def _read_obstacle(described: dict[str, Any]) -> Shape:
    """A shape that is only drawn, from its core: a point, a segment or a polyhedron."""
    if len(described["vertices"]) <= 2:
        return _read_shape(described)
    return drawn_hull(**described)


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray) else value


def _read_shape(described: dict[str, Any]) -> Shape:
    """A shape from what _header_log says of it: its core is a point, a segment or a polyhedron."""
    vertices = described["vertices"]
    if len(vertices) < 2:
        return sphere()
    if len(vertices) == 2:
        return capsule(vertices[1][2] - vertices[0][2])
    name, rounding = described["name"], described["rounding"]
    core = hull_polygons(name, np.array(vertices, dtype=np.float64))
    arrays = {key: np.array(described[key], dtype=np.float64).reshape(-1) for key in ("moments", "orientation")}
    volume, corners = float(described["volume"]), int(described["described_corners"])
    return principal_hull(name, core, rounding, volume=volume, described_corners=corners, **arrays)


def _checked(header: Header) -> Header:
    """The header. ValueError if a particle is of a shape that there is not, or of no size or mass."""
    if not ((header.shape >= 0) & (header.shape < len(header.shapes)) & (header.group >= 0)).all():
        raise ValueError("particles of unknown shapes or groups")
    if not ((header.size > 0.0) & (header.mass > 0.0) & (header.inertia >= 0.0).all(axis=1)).all():
        raise ValueError("particles without size, mass or inertia")
    return header


def _logged(chunks: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Chunks by the names that the writer of the schema gives logged quantities: without their prefix."""
    return {name.removeprefix("log/"): values for name, values in chunks.items()}


def _ledger_log(ledger: Ledger | None) -> dict[str, np.ndarray]:
    """What is known of a ledger, each field under its name."""
    if ledger is None:
        return {}
    values = {field.name: getattr(ledger, field.name) for field in fields(Ledger)}
    return {_LEDGER + name: np.atleast_1d(value) for name, value in values.items() if value is not None}


def _ledger_names() -> list[str]:
    """The chunks that every ledger has."""
    return [_LEDGER + field.name for field in fields(Ledger) if field.default is MISSING]


def _read_ledger(chunks: Chunks, k: int) -> Ledger:
    """The ledger of a frame, by the names of its fields; those that may be unknown may be missing."""
    known = [field for field in fields(Ledger) if field.default is MISSING or chunks.has(_LEDGER + field.name)]
    return Ledger(**{field.name: _typed(chunks.read(_LEDGER + field.name, k), field) for field in known})


def _typed(value: np.ndarray, field: Field[Any]) -> Any:
    """The value of a field as its type says. ValueError if it is not as many numbers."""
    if field.name in _SHAPES:
        return value.astype(np.float64).reshape(_SHAPES[field.name])
    (number,) = value.reshape(-1)
    return int(number) if str(field.type).startswith("int") else float(number)


def _quaternion_momentum(frame: Frame) -> np.ndarray:
    """Angular momenta as HOOMD stores them, 2 q (0, L_body) = 2 (0, L) q, (n, 4)."""
    momentum = np.hstack([np.zeros((len(frame.angular_momentum), 1)), frame.angular_momentum])
    return 2.0 * quaternion_products(momentum, frame.orientation)


def _world_momentum(stored: np.ndarray, orientation: np.ndarray) -> np.ndarray:
    """Angular momenta in world axes from HOOMD's quaternions, (n, 3)."""
    return 0.5 * quaternion_products(stored, conjugates(orientation))[:, 1:]
