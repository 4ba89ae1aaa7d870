"""What stays the same about the particles of a trajectory, as a GSD file keeps it: shapes, sizes, groups, obstacles."""

from __future__ import annotations

import importlib.metadata
import json
from typing import Any

import numpy as np

from particlesim.core.constants import BALL, CAPSULE, COMPOUND
from particlesim.geometry.convex_hull import hull_polygons
from particlesim.geometry.shapes import Shape, capsule, drawn_hull, principal_hull, sphere, tree_mesh
from particlesim.trajectory.frames import Header
from particlesim.trajectory.gsd_chunks import Chunks, TrajectoryError

# What the schema does not have is among its logged quantities; text is stored as bytes.
LOG = "log/particlesim/"

OLDER = "written by an older particlesim; simulate its scene again"


def header_log(header: Header, changing: bool) -> dict[str, np.ndarray]:
    """What the schema has no place for; where numbers are ``changing``, masses of all particles that there ever are."""
    constants = {"mass": header.mass.astype(np.float32), "inertia": header.inertia.astype(np.float32)}
    shapes = [_described(s) for s in header.shapes]
    obstacles = [
        _described(s) if s.parts else {name: _plain(getattr(s, name)) for name in _drawn(s)} for s in header.obstacles
    ]
    return {
        LOG + "version": np.frombuffer(importlib.metadata.version("particlesim").encode(), dtype=np.uint8),
        LOG + "scene": np.frombuffer(header.scene_json.encode(), dtype=np.uint8),
        LOG + "shapes": np.frombuffer(json.dumps(shapes).encode(), dtype=np.uint8),
        LOG + "obstacles": np.frombuffer(json.dumps(obstacles).encode(), dtype=np.uint8),
        LOG + "shape": header.shape.astype(np.int32),
        LOG + "size": header.size,
        LOG + "group": header.group.astype(np.int32),
        **{LOG + name: values for name, values in constants.items() if changing},
    }


def _described(shape: Shape) -> dict[str, Any]:
    """What is kept of a particle's shape."""
    described = {
        "name": shape.name,
        "vertices": shape.vertices.tolist(),
        "rounding": shape.rounding,
        "orientation": shape.orientation.tolist(),
        "volume": shape.volume,
        "moments": shape.moments.tolist(),
        "described_corners": shape.described_corners,
    }
    if not shape.parts:
        return described
    parts = [{name: _plain(getattr(part, name)) for name in _drawn(part)} for part in shape.parts]
    return described | {"inradius": shape.inradius, "parts": parts}


def read_header(chunks: Chunks) -> Header:
    described = json.loads(chunks.read(LOG + "shapes").tobytes())
    if any("vertices" in shape and "described_corners" not in shape for shape in described):
        raise TrajectoryError(f"{chunks.path}: {OLDER}")
    shape = chunks.read(LOG + "shape").astype(np.int64)
    return Header(
        scene_json=chunks.read(LOG + "scene").tobytes().decode(),
        shapes=tuple(_read_shape(s) for s in described),
        shape=shape,
        size=chunks.rows(LOG + "size", len(shape), (1.0,))[:, 0],
        group=chunks.rows(LOG + "group", len(shape), (0.0,))[:, 0].astype(np.int64),
        mass=chunks.rows(_either(chunks, "mass", "particles/mass"), len(shape), (1.0,))[:, 0],
        inertia=chunks.rows(_either(chunks, "inertia", "particles/moment_inertia"), len(shape), (0.0, 0.0, 0.0)),
        obstacles=tuple(_read_obstacle(s) for s in _read_obstacles(chunks)),
    )


def _either(chunks: Chunks, name: str, of_schema: str) -> str:
    """Where a constant of all particles is: where their number stays the same, only as the schema has it."""
    return LOG + name if chunks.has(LOG + name) else of_schema


def _read_obstacles(chunks: Chunks) -> list[dict[str, Any]]:
    """What is said of the obstacles' shapes; nothing in older files."""
    name = LOG + "obstacles"
    found: list[dict[str, Any]] = json.loads(chunks.read(name).tobytes()) if chunks.has(name) else []
    return found


def _read_obstacle(described: dict[str, Any]) -> Shape:
    """A shape that is only drawn, from its core: a point, a segment or a polyhedron; of a compound all of it."""
    if "parts" in described:
        return _read_compound(described)
    if "triangles" in described:
        return tree_mesh(
            described["name"], np.array(described["vertices"]), np.array(described["triangles"], dtype=np.int64)
        )
    if len(described["vertices"]) <= 2:
        return _read_shape(described)
    return drawn_hull(**described)


def _drawn(shape: Shape) -> tuple[str, ...]:
    """What is kept of a shape that is only drawn."""
    return ("name", "vertices", "rounding", "orientation") if shape.is_convex else ("name", "vertices", "triangles")


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray) else value


def _read_shape(described: dict[str, Any]) -> Shape:
    """A shape from what header_log says of it: its core is a point, a segment or a polyhedron."""
    vertices = described["vertices"]
    if "parts" in described:
        return _read_compound(described)
    if len(vertices) < 2:
        return sphere()
    if len(vertices) == 2:
        return capsule(vertices[1][2] - vertices[0][2])
    name, rounding = described["name"], described["rounding"]
    core = hull_polygons(name, np.array(vertices, dtype=np.float64))
    arrays = {key: np.array(described[key], dtype=np.float64).reshape(-1) for key in ("moments", "orientation")}
    volume, corners = float(described["volume"]), int(described["described_corners"])
    return principal_hull(name, core, rounding, volume=volume, described_corners=corners, **arrays)


def _read_compound(described: dict[str, Any]) -> Shape:
    """A compound from what header_log says of it."""
    parts = tuple(_read_part(part) for part in described["parts"])
    vertices, faces = hull_polygons(described["name"], np.array(described["vertices"], dtype=np.float64))
    return Shape(
        described["name"],
        COMPOUND,
        vertices,
        faces,
        0.0,
        float(described["volume"]),
        np.array(described["moments"], dtype=np.float64),
        max(part.radius for part in parts),
        float(described["inradius"]),
        np.array(described["orientation"], dtype=np.float64),
        parts=parts,
    )


def _read_part(described: dict[str, Any]) -> Shape:
    """A part of a compound, which is only drawn: a point, a segment or a polyhedron that need not be in its middle."""
    vertices, rounding = np.array(described["vertices"], dtype=np.float64), float(described["rounding"])
    if len(vertices) > 2:
        return drawn_hull(**described)
    kind = BALL if len(vertices) == 1 else CAPSULE
    radius, turn = float(np.linalg.norm(vertices, axis=1).max()) + rounding, np.array(described["orientation"])
    return Shape(described["name"], kind, vertices, (), rounding, 1.0, np.ones(3), radius, rounding, turn)


def checked_header(header: Header) -> Header:
    """The header. ValueError if a particle is of a shape that there is not, or of no size or mass."""
    if not ((header.shape >= 0) & (header.shape < len(header.shapes)) & (header.group >= 0)).all():
        raise ValueError("particles of unknown shapes or groups")
    if not ((header.size > 0.0) & (header.mass > 0.0) & (header.inertia >= 0.0).all(axis=1)).all():
        raise ValueError("particles without size, mass or inertia")
    return header
