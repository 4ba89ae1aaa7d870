"""Binary glTF 2.0 (.glb) for viewers and the web: a node for each particle, moved by one animation.

The format is that of the Khronos Group (glTF 2.0 Specification, sections 3 and 4): y is up, quaternions are
(x, y, z, w). What crosses a periodic boundary jumps from frame to frame and is not drawn on the way back; what is
not there has size 0.
"""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np

from particlesim.core.atomic_write import atomic_write
from particlesim.geometry.surface import surface_of
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
    nodes, animation = _moved(buffer, run, kind_of.ravel())
    nodes.append({"name": "run", "rotation": _Z_UP, "children": list(range(len(nodes)))})
    tree = {
        "asset": {"version": "2.0", "generator": "particlesim"},
        "scene": 0,
        "scenes": [{"nodes": [len(nodes) - 1]}],
        "nodes": nodes,
        "meshes": [_mesh(buffer, run, int(kind[0]), k) for k, kind in enumerate(kinds)],
        "materials": [
            {"pbrMetallicRoughness": {"baseColorFactor": [*kind[1:], 1.0], "metallicFactor": 0.0}}
            for kind in kinds.tolist()
        ],
        "animations": [animation],
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [{"byteLength": len(buffer.content)}],
    }
    with atomic_write(path) as hidden:
        hidden.write_bytes(_container(tree, bytes(buffer.content)))
    return [path]


def _mesh(buffer: _Buffer, run: Exported, shape: int, material: int) -> dict[str, Any]:
    surface = surface_of(run.header.shapes[shape])
    attributes = {
        "POSITION": buffer.add(surface.vertices.astype(np.float32), bounded=True),
        "NORMAL": buffer.add(surface.normals.astype(np.float32)),
    }
    indices = buffer.add(surface.triangles.astype(np.uint32).ravel())
    return {
        "name": run.header.shapes[shape].name,
        "primitives": [{"attributes": attributes, "indices": indices, "material": material}],
    }


def _moved(buffer: _Buffer, run: Exported, mesh_of: np.ndarray) -> tuple[list[dict[str, Any]], dict[str, Any]]:
    """A node for each particle, and the animation that moves them."""
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
    place, turn, image, size = (np.stack(kept, axis=1) for kept in (places, turns, images, sizes))
    time = buffer.add(np.array(times, dtype=np.float32), bounded=True)
    jumps = (image != image[:, :1]).any(axis=(1, 2)) | (size != size[:, :1]).any(axis=1)
    nodes, samplers, channels = [], [], []
    for k in range(number):
        nodes.append(
            {
                "name": f"particle {k}",
                "mesh": int(mesh_of[k]),
                "translation": place[k, 0].tolist(),
                "rotation": turn[k, 0].tolist(),
                "scale": [float(size[k, 0])] * 3,
            }
        )
        moved = {"translation": place[k], "rotation": turn[k]}
        if (size[k] != size[k, 0]).any():
            moved["scale"] = np.repeat(size[k][:, None], 3, axis=1)
        for what, values in moved.items():
            way = "STEP" if jumps[k] and what != "rotation" else "LINEAR"
            samplers.append({"input": time, "output": buffer.add(values), "interpolation": way})
            channels.append({"sampler": len(samplers) - 1, "target": {"node": k, "path": what}})
    return nodes, {"samplers": samplers, "channels": channels}


def _container(tree: dict[str, Any], content: bytes) -> bytes:
    """The file: a header, the tree as JSON, the arrays; each part is filled up to four bytes."""
    text = json.dumps(tree, separators=(",", ":")).encode()
    parts = [(b"JSON", text + b" " * (-len(text) % 4)), (b"BIN\0", content + b"\0" * (-len(content) % 4))]
    chunks = b"".join(struct.pack("<I4s", len(part), kind) + part for kind, part in parts)
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks
