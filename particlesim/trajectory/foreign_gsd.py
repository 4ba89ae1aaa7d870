"""GSD files that other programs wrote, such as HOOMD-blue: what they leave open is assumed, and said.

The schema (https://gsd.readthedocs.io, "HOOMD Schema" and "Shape Visualization Specification") has no times and no
scene. Types become groups of a scene that is only drawn, with their shapes where they have any.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from particlesim.core.text import shortened
from particlesim.geometry.convex_hull import hull_polygons
from particlesim.geometry.shapes import Shape, principal_hull, sphere
from particlesim.scene import Scene
from particlesim.trajectory.frames import Header
from particlesim.trajectory.gsd_chunks import Chunks, TrajectoryError

# Frames a second of what has no times.
FRAME_RATE = 30.0

# Points of the hull that stands for an ellipsoid, and the thickness of the prism that stands for a flat polygon, as a
# fraction of its extent.
_ELLIPSOID_POINTS = 600
_POLYGON_THICKNESS = 0.1


class Foreign(NamedTuple):
    """What is known of a file, and what was assumed, a line each."""

    header: Header
    assumed: tuple[str, ...]


class _Drawn(NamedTuple):
    """How particles of a type are drawn: their shape of size 1, and their size, None for the particle's diameter."""

    shape: Shape
    size: float | None
    assumed: str = ""


def read_foreign(chunks: Chunks) -> Foreign:
    """The header of a file that another program wrote. TrajectoryError if there is nothing in it to draw."""
    count = _count(chunks, 0)
    if not count:
        raise TrajectoryError(f"{chunks.path}: has no particles to draw")
    chunks.rows("particles/position", count, (0.0, 0.0, 0.0))
    names, described = _types(chunks)
    group = chunks.rows("particles/typeid", count, (0.0,))[:, 0].astype(np.int64)
    if not ((group >= 0) & (group < len(names))).all():
        raise ValueError("particles of unknown types")
    drawn = [_drawn(chunks, name, shape) for name, shape in zip(names, described, strict=True)]
    diameter = chunks.rows("particles/diameter", count, (1.0,))[:, 0]
    sizes = np.array([np.nan if each.size is None else each.size for each in drawn])[group]
    size = np.where(np.isnan(sizes), diameter, sizes)
    box, of_box = _box(chunks)
    present = np.unique(group)
    header = Header(
        scene_json=_scene(chunks, names, np.bincount(group, minlength=len(names)), box).model_dump_json(),
        shapes=tuple(each.shape for each in drawn),
        shape=group,
        size=size,
        group=np.searchsorted(present, group),
        mass=chunks.rows("particles/mass", count, (1.0,))[:, 0],
        inertia=chunks.rows("particles/moment_inertia", count, (0.0, 0.0, 0.0)),
    )
    shapeless = [names[k] for k in present if drawn[k].size is None]
    as_spheres = f"{', '.join(shapeless)}: spheres of the diameters in the file" if shapeless else ""
    of_shapes = [drawn[k].assumed for k in present]
    time = f"a frame every 1/{FRAME_RATE:g} s, and lengths in metres"
    return Foreign(header, tuple(line for line in (as_spheres, *of_shapes, of_box, time) if line))


def check_same_particles(chunks: Chunks, header: Header, frame: int) -> None:
    """TrajectoryError if a frame has other particles than the first."""
    if _count(chunks, frame) != len(header.shape):
        raise TrajectoryError(f"{chunks.path}: particles come or go in frame {frame}, which cannot be drawn")
    if frame and chunks.has("particles/typeid", frame):
        types = chunks.rows("particles/typeid", len(header.shape), (0.0,), frame)[:, 0]
        if (types != header.shape).any():
            raise TrajectoryError(f"{chunks.path}: types of particles change in frame {frame}, which cannot be drawn")


def _count(chunks: Chunks, frame: int) -> int:
    """How many particles a frame has."""
    known = chunks.has("particles/N", frame) or chunks.has("particles/N")
    return int(chunks.read("particles/N", frame).reshape(-1)[0]) if known else 0


def _types(chunks: Chunks) -> tuple[list[str], list[Any]]:
    """The names of the types and what the file says of their shapes."""
    names = _texts(chunks, "particles/types") or ["A"]
    shapes = [json.loads(text) if text else {} for text in _texts(chunks, "particles/type_shapes")]
    shapes += [{}] * (len(names) - len(shapes))
    return names, shapes[: len(names)]


def _texts(chunks: Chunks, name: str) -> list[str]:
    """A chunk of texts, a row each, filled up with zeros; none if there is no such chunk."""
    if not chunks.has(name):
        return []
    rows = np.atleast_2d(chunks.read(name)).astype(np.uint8)
    return [row.tobytes().split(b"\0")[0].decode("utf-8", "replace") for row in rows]


def _drawn(chunks: Chunks, name: str, described: Any) -> _Drawn:
    """How a type is drawn that the file describes like this. TrajectoryError for what describes no shape."""
    kind = described.get("type", "") if isinstance(described, dict) else ""
    if kind not in _SHAPES:
        said = shortened(json.dumps(described), 40)
        return _Drawn(sphere(), None, f"{name}: spheres, as its shape {said} cannot be drawn" if described else "")
    try:
        return _SHAPES[kind](name, described)
    except KeyError as error:
        raise TrajectoryError(f"{chunks.path}: type '{name}' is a {kind} without the key {error}") from None
    except (TypeError, ValueError) as error:
        raise TrajectoryError(f"{chunks.path}: type '{name}' is no {kind} that can be drawn: {error}") from None


def _sphere(name: str, described: dict[str, Any]) -> _Drawn:
    return _Drawn(sphere(), _positive(described["diameter"]))


def _polyhedron(name: str, described: dict[str, Any]) -> _Drawn:
    return _Drawn(_hull(name, described["vertices"], described.get("rounding_radius", 0.0)), 1.0)


def _mesh(name: str, described: dict[str, Any]) -> _Drawn:
    return _Drawn(_hull(name, described["vertices"], 0.0), 1.0, f"{name}: the convex hull of its mesh")


def _polygon(name: str, described: dict[str, Any]) -> _Drawn:
    flat = np.array(described["vertices"], dtype=np.float64)[:, :2]
    half = 0.5 * _POLYGON_THICKNESS * float(np.ptp(flat, axis=0).max())
    prism = [(x, y, z) for x, y in flat.tolist() for z in (-half, half)]
    return _Drawn(_hull(name, prism, described.get("rounding_radius", 0.0)), 1.0, f"{name}: polygons as thin prisms")


def _ellipsoid(name: str, described: dict[str, Any]) -> _Drawn:
    axes = np.array([_positive(described[axis]) for axis in "abc"])
    # Evenly spread by the golden angle (R. Swinbank, R. J. Purser, Q. J. R. Meteorol. Soc. 132 (2006) 1769-1793).
    z = 1.0 - (2.0 * np.arange(_ELLIPSOID_POINTS) + 1.0) / _ELLIPSOID_POINTS
    angle = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(_ELLIPSOID_POINTS)
    points = np.stack([np.sqrt(1.0 - z * z) * np.cos(angle), np.sqrt(1.0 - z * z) * np.sin(angle), z], axis=1)
    if (axes == axes[0]).all():
        return _Drawn(sphere(), 2.0 * float(axes[0]))
    return _Drawn(_hull(name, points * axes, 0.0), 1.0, f"{name}: ellipsoids as hulls of {_ELLIPSOID_POINTS} points")


# How the kinds of shapes that the specification has are drawn.
_SHAPES: dict[str, Callable[[str, dict[str, Any]], _Drawn]] = {
    "Sphere": _sphere,
    "ConvexPolyhedron": _polyhedron,
    "Mesh": _mesh,
    "Polygon": _polygon,
    "Ellipsoid": _ellipsoid,
}


def _positive(value: Any) -> float:
    """A number above 0. ValueError for anything else."""
    number = float(value)
    if not 0.0 < number < np.inf:
        raise ValueError(f"its size is {value!r}")
    return number


def _hull(name: str, vertices: Any, rounding: Any) -> Shape:
    """The convex hull of points about a particle's position, in its axes; only drawn, so its mass does not matter."""
    points = np.array(vertices, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
        raise ValueError("its vertices are not rows of 3 finite numbers")
    return principal_hull(
        name, hull_polygons(name, points), float(rounding), volume=1.0, moments=np.ones(3), orientation=np.eye(4)[0]
    )


def _box(chunks: Chunks) -> tuple[np.ndarray, str]:
    """Edges of the box (3,) [m], and what is assumed of it."""
    stored = chunks.rows("configuration/box", 1, (1.0, 1.0, 1.0, 0.0, 0.0, 0.0))[0]
    # A world of two dimensions has no height, and no images above and below.
    edges = np.where(stored[:3] > 0.0, stored[:3], 1.0)
    if stored[3:].any():
        xy, xz, yz = np.abs(stored[3:])
        edges += np.array([xy * edges[1] + xz * edges[2], yz * edges[2], 0.0])
        return edges, "a tilted box: the straight one about it"
    changes = any(chunks.has("configuration/box", frame) for frame in range(1, chunks.frames))
    return edges, "the box of the first frame all through" if changes else ""


def _scene(chunks: Chunks, names: list[str], counts: np.ndarray, box: np.ndarray) -> Scene:
    """A scene to draw the file by: a group for each type that there are particles of."""
    stored = chunks.rows("configuration/box", 1, (1.0, 1.0, 1.0, 0.0, 0.0, 0.0))[0]
    periodic = ["periodic" if edge > 0.0 else "open" for edge in stored[:3]]
    present = np.flatnonzero(counts)
    colour = "by_group" if len(present) > 1 else "by_shape"
    return Scene(
        title=chunks.path.stem,
        duration=max(chunks.frames - 1, 1) / FRAME_RATE,
        world={"size": box.tolist(), "boundary": "open" if stored[3:].any() else periodic},
        particles=[
            {"name": names[k], "shape": "sphere", "count": int(counts[k]), "colour": colour} for k in present.tolist()
        ],
        movie={"fps": FRAME_RATE},
        # Nobody gave it the title, which is the name of the file.
        show={"box": True, "readout": ["time", "particles"], "title": False},
    )
