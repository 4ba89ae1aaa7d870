"""Binary glTF 2.0 (.glb) for viewers and the web: a node for each particle and obstacle, moved by one animation.

The format is that of the Khronos Group (glTF 2.0 Specification, sections 3 and 4): y is up, quaternions are
(x, y, z, w). What crosses a periodic boundary jumps from frame to frame and is not drawn on the way back; what is
not there has size 0.
"""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from particlesim.core.atomic_write import atomic_write
from particlesim.geometry.surface import Surface, surface_of
from particlesim.trajectory.drawn_obstacles import DrawnObstacle, poses_of
from particlesim.trajectory.export import Exported, ExportError

# More nodes than this no viewer moves fluently.
MAX_PARTICLES = 5000

_FLOAT, _UNSIGNED = 5126, 5125  # types of numbers
_SHAPE_OF = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}
_Z_UP = [-(0.5**0.5), 0.0, 0.0, 0.5**0.5]  # turns z into y


class _Buffer:
    """Arrays one after the other, with what glTF says of them."""

    def __init__(self) -> None:
        self.content = bytearray()
        self.views: list[dict[str, int]] = []
        self.accessors: list[dict[str, Any]] = []

    def add(self, values: np.ndarray, *, bounded: bool = False) -> int:
        """The number of an array (n,) or (n, k) of float32 or uint32; ``bounded``: with its least and most."""
        table = values.reshape(len(values), -1)
        self.views.append({"buffer": 0, "byteOffset": len(self.content), "byteLength": values.nbytes})
        said: dict[str, Any] = {
            "bufferView": len(self.views) - 1,
            "componentType": _FLOAT if values.dtype == np.float32 else _UNSIGNED,
            "count": len(values),
            "type": _SHAPE_OF[table.shape[1]],
        }
        if bounded:
            said |= {"min": table.min(axis=0).tolist(), "max": table.max(axis=0).tolist()}
        self.accessors.append(said)
        self.content += np.ascontiguousarray(values).tobytes()
        return len(self.accessors) - 1


def write_glb(path: Path, run: Exported) -> list[Path]:
    """Write one file. ExportError for too many particles; OSError if it cannot be written."""
    number = len(run.header.shape)
    if number > MAX_PARTICLES:
        raise ExportError(
            f"{path}: {number:,} particles; .glb takes up to {MAX_PARTICLES:,}, .usda and .pvd any number"
        )
    buffer = _Buffer()
    looks = np.column_stack([run.header.shape, run.colours])
    kinds, kind_of = np.unique(looks, axis=0, return_inverse=True)
    surfaces = [surface_of(run.header.shapes[int(kind[0])]) for kind in kinds]
    names = [run.header.shapes[int(kind[0])].name for kind in kinds]
    materials = [_material(kind[1:]) for kind in kinds]
    paths = _paths(run)
    moved = _Moved(buffer, paths.time)
    for k in range(number):
        _add_particle(moved, paths, k, int(kind_of.ravel()[k]))
    for number, each in enumerate(run.obstacles, len(kinds)):
        surfaces.append(each.surface)
        names.append(each.name)
        materials.append(_material(each.colour, each.opacity, each.has_two_sides))
        _add_obstacle(moved, each, number)
    nodes = [*moved.nodes, {"name": "run", "rotation": _Z_UP, "children": list(range(len(moved.nodes)))}]
    tree = {
        "asset": {"version": "2.0", "generator": "particlesim"},
        "scene": 0,
        "scenes": [{"nodes": [len(nodes) - 1]}],
        "nodes": nodes,
        "meshes": [_mesh(buffer, *named, k) for k, named in enumerate(zip(names, surfaces, strict=True))],
        "materials": materials,
        "animations": [{"samplers": moved.samplers, "channels": moved.channels}],
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [{"byteLength": len(buffer.content)}],
    }
    with atomic_write(path) as hidden:
        hidden.write_bytes(_container(tree, bytes(buffer.content)))
    return [path]


def _material(colour: np.ndarray, opacity: float = 1.0, has_two_sides: bool = False) -> dict[str, Any]:
    """What has a colour (3,), linear RGB, and is seen through unless its opacity is 1."""
    said: dict[str, Any] = {
        "pbrMetallicRoughness": {"baseColorFactor": [*colour.tolist(), opacity], "metallicFactor": 0.0}
    }
    if has_two_sides:
        said["doubleSided"] = True
    return said if opacity == 1.0 else {**said, "alphaMode": "BLEND"}


def _mesh(buffer: _Buffer, name: str, surface: Surface, material: int) -> dict[str, Any]:
    attributes = {
        "POSITION": buffer.add(surface.vertices.astype(np.float32), bounded=True),
        "NORMAL": buffer.add(surface.normals.astype(np.float32)),
    }
    indices = buffer.add(surface.triangles.astype(np.uint32).ravel())
    return {"name": name, "primitives": [{"attributes": attributes, "indices": indices, "material": material}]}


class _Moved:
    """Nodes, and the animation that moves them: a place, a turn and a size at each of the times (t,) [s]."""

    def __init__(self, buffer: _Buffer, times: np.ndarray) -> None:
        self._buffer, self.times = buffer, times
        self._input = buffer.add(times.astype(np.float32), bounded=True)
        self.nodes: list[dict[str, Any]] = []
        self.samplers: list[dict[str, Any]] = []
        self.channels: list[dict[str, Any]] = []

    def add(self, name: str, mesh: int, first: dict[str, np.ndarray]) -> None:
        """Add a node as it is at first: its ``translation`` (3,), ``rotation`` (4,) and ``scale`` (3,)."""
        self.nodes.append({"name": name, "mesh": mesh, **{what: value.tolist() for what, value in first.items()}})

    def move(self, what: str, values: np.ndarray, *, jumps: bool = False) -> None:
        """Let one of these follow ``values`` (t, 3) or (t, 4), of the node that was added last."""
        output = self._buffer.add(values.astype(np.float32))
        self.samplers.append({"input": self._input, "output": output, "interpolation": "STEP" if jumps else "LINEAR"})
        target = {"node": len(self.nodes) - 1, "path": what}
        self.channels.append({"sampler": len(self.samplers) - 1, "target": target})


class _Paths(NamedTuple):
    """Where all particles are at all times."""

    time: np.ndarray  # (t,) [s]
    place: np.ndarray  # (n, t, 3) float32 [m]
    turn: np.ndarray  # (n, t, 4) float32 (x, y, z, w)
    size: np.ndarray  # (n, t) float32, 0 of what is not there
    image: np.ndarray  # (n, t, 3) int64


def _paths(run: Exported) -> _Paths:
    number = len(run.header.shape)
    places: list[np.ndarray] = []
    turns: list[np.ndarray] = []
    sizes: list[np.ndarray] = []
    images: list[np.ndarray] = []
    times: list[float] = []
    for frame in run.frames:
        # What is not there keeps its last place.
        place = places[-1].copy() if places else np.zeros((number, 3), dtype=np.float32)
        turn = turns[-1].copy() if turns else np.tile(np.array([0, 0, 0, 1], dtype=np.float32), (number, 1))
        image = images[-1].copy() if images else np.zeros((number, 3), dtype=np.int64)
        size = np.zeros(number, dtype=np.float32)
        place[frame.ids], turn[frame.ids] = frame.position, np.roll(frame.orientation, -1, axis=1)
        image[frame.ids], size[frame.ids] = frame.image, run.header.size[frame.ids]
        for kept, now in ((places, place), (turns, turn), (images, image), (sizes, size)):
            kept.append(now)
        times.append(frame.time)
    place, turn, size, image = (np.stack(kept, axis=1) for kept in (places, turns, sizes, images))
    return _Paths(np.array(times), place, turn, size, image)


def _add_particle(moved: _Moved, paths: _Paths, k: int, mesh: int) -> None:
    place, turn, size, image = paths.place[k], paths.turn[k], paths.size[k], paths.image[k]
    comes_or_goes = bool((size != size[0]).any())
    jumps = comes_or_goes or bool((image != image[0]).any())
    scale = np.repeat(size[:, None], 3, axis=1)
    moved.add(f"particle {k}", mesh, {"translation": place[0], "rotation": turn[0], "scale": scale[0]})
    moved.move("translation", place, jumps=jumps)
    moved.move("rotation", turn)
    if comes_or_goes:
        moved.move("scale", scale, jumps=True)


def _add_obstacle(moved: _Moved, drawn: DrawnObstacle, mesh: int) -> None:
    poses = [poses_of([drawn], time) for time in moved.times.tolist()]
    place = np.concatenate([position for position, _ in poses])
    turn = np.roll(np.concatenate([orientation for _, orientation in poses]), -1, axis=1)
    moved.add(drawn.name, mesh, {"translation": place[0], "rotation": turn[0]})
    if drawn.moves:
        moved.move("translation", place)
        moved.move("rotation", turn)


def _container(tree: dict[str, Any], content: bytes) -> bytes:
    """The file: a header, the tree as JSON, the arrays; each part is filled up to four bytes."""
    text = json.dumps(tree, separators=(",", ":")).encode()
    parts = [(b"JSON", text + b" " * (-len(text) % 4)), (b"BIN\0", content + b"\0" * (-len(content) % 4))]
    chunks = b"".join(struct.pack("<I4s", len(part), kind) + part for kind, part in parts)
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks
