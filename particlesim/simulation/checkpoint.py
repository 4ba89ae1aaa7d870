"""Checkpoints: a model and the state of its solver as one file, from which a simulation goes on bitwise."""

from __future__ import annotations

import importlib.metadata
import json
import zipfile
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from particlesim.core.atomic_write import atomic_write
from particlesim.core.records import as_records, cache_aligned
from particlesim.dynamics.solver_state import Counts, SolverState
from particlesim.geometry.mesh_table import MeshTable
from particlesim.geometry.shape_table import ShapeTable
from particlesim.geometry.shapes import Shape
from particlesim.model.system import Model, System
from particlesim.scene import Scene
from particlesim.scene.file import SceneError, stored_scene
from particlesim.simulation.flow import FlowState

_FORMAT = 6


class CheckpointError(ValueError):
    """A file is not a checkpoint that can be gone on from."""


class Checkpoint(NamedTuple):
    """What a checkpoint holds."""

    scene: Scene
    model: Model
    state: SolverState
    counts: Counts
    flow: FlowState
    done: dict[str, Any]  # steps, time_step [s], broad_phase


def write_checkpoint(path: str | Path, checkpoint: Checkpoint) -> None:
    """Write a checkpoint to ``path``, whole or not at all. OSError if it cannot be written."""
    scene, model, state, counts, flow, done = checkpoint
    system = model.system._asdict()
    text = {
        "format": _FORMAT,
        "version": importlib.metadata.version("particlesim"),
        "scene": scene.model_dump_json(),
        "shapes": [_described(shape) for shape in model.shapes],
        "obstacle_shapes": [_described(shape) for shape in model.obstacle_shapes],
        "particles": system.pop("particles"),
        "bounded": system.pop("bounded"),
        "done": done,
    }
    arrays = {f"shapes.{name}": array for name, array in system.pop("shapes")._asdict().items()}
    meshes = system.pop("meshes")
    if meshes is not None:
        arrays |= {f"meshes.{name}": array for name, array in meshes._asdict().items()}
    arrays |= {f"system.{name}": array for name, array in system.items()}
    arrays |= {f"state.{name}": array for name, array in state.arrays().items()}
    arrays |= {f"counts.{name}": np.asarray(value) for name, value in asdict(counts).items()}
    arrays |= {f"flow.{name}": array for name, array in flow.arrays().items()}
    arrays["restitution"], arrays["population"] = model.restitution, model.population
    arrays["fields"] = model.fields
    arrays["text"] = np.frombuffer(json.dumps(text).encode(), dtype=np.uint8)
    with atomic_write(path) as hidden, open(hidden, "wb") as file:
        np.savez(file, **arrays)


def read_checkpoint(path: str | Path) -> Checkpoint:
    """Read a checkpoint. CheckpointError if it is none, damaged or of another version; OSError if unreadable."""
    path = Path(path)
    with open(path, "rb") as file:
        try:
            with np.load(file, allow_pickle=False) as stored:
                arrays = {name: stored[name] for name in stored.files}
            text = json.loads(arrays.pop("text").tobytes())
        except (ValueError, KeyError, EOFError, zipfile.BadZipFile, NotImplementedError) as error:
            raise CheckpointError(f"{path}: not a checkpoint of particlesim, or damaged") from error
    if text.get("format") != _FORMAT:
        raise CheckpointError(f"{path}: this version cannot go on from what particlesim {text.get('version')} wrote")
    try:
        return _assembled(text, arrays)
    except (KeyError, TypeError, ValueError, SceneError) as error:
        raise CheckpointError(f"{path}: damaged: {' '.join(str(error).split())}") from error


def _assembled(text: dict[str, Any], arrays: dict[str, np.ndarray]) -> Checkpoint:
    """The checkpoint of what was stored."""
    arrays = {name: as_records(array) for name, array in arrays.items()}
    table = ShapeTable(**_under("shapes.", arrays))
    meshes = _under("meshes.", arrays)
    arrays["system.body"] = cache_aligned(arrays["system.body"])
    system = System(
        table,
        particles=text["particles"],
        bounded=text["bounded"],
        meshes=MeshTable(**meshes) if meshes else None,
        **_under("system.", arrays),
    )
    shapes, drawn = (tuple(_shape(each) for each in text[key]) for key in ("shapes", "obstacle_shapes"))
    model = Model(shapes, arrays["restitution"], system, drawn, arrays["fields"], arrays["population"])
    counted = _under("counts.", arrays)
    counts = Counts(**{f.name: _plain(counted[f.name]) for f in fields(Counts)})
    state = SolverState.of_arrays(_under("state.", arrays))
    flow = FlowState(**_under("flow.", arrays))
    return Checkpoint(stored_scene(json.loads(text["scene"])), model, state, counts, flow, text["done"])


def _under(prefix: str, arrays: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The arrays whose names begin with a prefix, by the rest of their names."""
    return {name.removeprefix(prefix): array for name, array in arrays.items() if name.startswith(prefix)}


def _plain(array: np.ndarray) -> Any:
    return array.item() if array.ndim == 0 else array


def _described(shape: Shape) -> dict[str, Any]:
    """A shape as JSON, which keeps every bit of a float64."""
    values = {f.name: getattr(shape, f.name) for f in fields(shape)}
    values["parts"] = [_described(part) for part in shape.parts]
    return {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in values.items()}


def _shape(described: dict[str, Any]) -> Shape:
    """The shape that was described."""
    arrays = {name: np.array(described[name], dtype=np.float64) for name in ("moments", "orientation")}
    vertices = np.array(described["vertices"], dtype=np.float64).reshape(-1, 3)
    faces = tuple(tuple(loop) for loop in described["faces"])
    triangles = np.array(described["triangles"], dtype=np.int64).reshape(-1, 3)
    parts = tuple(_shape(part) for part in described["parts"])
    listed = {"faces": faces, "remarks": tuple(described["remarks"]), "parts": parts}
    return Shape(**{**described, **arrays, **listed, "vertices": vertices, "triangles": triangles})
