"""A run as one page of HTML that needs nothing else: its frames packed, and a viewer (three.js) that shows them."""

from __future__ import annotations

import base64
import html
import json
import string
import zlib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from particlesim.geometry.shapes import Shape
from particlesim.geometry.surface import SPLITS, surface_of
from particlesim.rendering.camera import subject_box
from particlesim.rendering.hud.panel import Style
from particlesim.rendering.shading.colour import ParticleColours, obstacle_colours
from particlesim.rendering.shading.environment import Environment
from particlesim.scene import Scene
from particlesim.trajectory.drawn_obstacles import DrawnObstacle, drawn_obstacles, poses_of
from particlesim.trajectory.frames import Frame, Header

# Numbers of a page at the most [bytes], before they are compressed: browsers hold several times as much.
LARGEST = 200_000_000

# Bytes of a particle in a frame: position and velocity in 16 bits an axis, orientation, colour, whether it is there.
_PARTICLE = 6 + 6 + 8 + 3 + 1

# Of more particles than this the round ones have a quarter of the triangles: 100,000 of them make eight million.
_MANY = 20_000

_HERE = Path(__file__).parent


class PageError(ValueError):
    """A run that a page cannot hold; the message is one line."""


def check_size(particles: int, frames: int) -> None:
    """PageError if so many frames are too much for a page."""
    needed = _PARTICLE * particles * frames
    if needed > LARGEST:
        most = LARGEST // (_PARTICLE * particles)
        fewer = f"one frame in {-(-frames // most):,} goes into it" if most else "even one frame is too much"
        raise PageError(
            f"{frames:,} frames of {particles:,} particles take {needed / 1e6:,.0f} MB in a page, "
            f"which holds {LARGEST / 1e6:,.0f} MB: {fewer}"
        )


def page(scene: Scene, header: Header, first: Frame, frames: Iterable[Frame], colours: ParticleColours) -> str:
    """The page of some frames of a run, whose first frame of all says what the camera frames.

    Positions are true to 1/65,535 of the box that all of them are in, velocities to 1/32,767 of the fastest along an
    axis, orientations to 1/32,767; masses, sizes and obstacles are in single precision.
    """
    packed = _Packed(header, colours)
    for frame in frames:
        packed.add(frame)
    arrays, ranges = packed.arrays()
    obstacles = drawn_obstacles(scene, header, obstacle_colours(scene))
    content, listed = _bytes_of({**arrays, **_obstacle_arrays(obstacles, packed.times)})
    around = Environment(scene)
    style = Style(scene.movie.size, around.dark)
    camera = scene.camera
    run = {
        **ranges,
        "arrays": listed,
        "times": packed.times,
        "rate": scene.movie.fps,
        "world": list(scene.world.size),
        "box": scene.box_shown,
        "background": _hex(255.0 * around.background),
        "lines": _hex(style.faint),
        "subject": [edge.tolist() for edge in subject_box(scene, header, first)],
        "seen": [getattr(camera, "azimuth", 35.0), getattr(camera, "elevation", 18.0)],
        "groups": [group.name or f"group {number + 1}" for number, group in enumerate(scene.groups)],
        "obstacles": [_described(each) for each in obstacles],
        "shapes": [_surface(shape, SPLITS - (len(header.shape) > _MANY)) for shape in header.shapes],
    }
    template = string.Template((_HERE / "page.html").read_text())
    return template.substitute(
        title=html.escape(scene.title),
        background=run["background"],
        plate=_hex(style.plate),
        strong=_hex(style.strong),
        run=json.dumps(run).replace("<", "\\u003c"),  # or a name could end the script that it is in
        arrays=base64.b64encode(zlib.compress(content)).decode(),
        three=(_HERE / "three.js").read_text(),
        viewer=(_HERE / "viewer.js").read_text(),
    )


class _Packed:
    """Gathers frames, of all particles that there ever are."""

    def __init__(self, header: Header, colours: ParticleColours) -> None:
        self._header, self._colours = header, colours
        self.times: list[float] = []
        self._position: list[np.ndarray] = []
        self._velocity: list[np.ndarray] = []
        self._orientation: list[np.ndarray] = []
        self._colour: list[np.ndarray] = []
        self._there: list[np.ndarray] = []

    def add(self, frame: Frame) -> None:
        number, ids = len(self._header.shape), frame.ids
        self.times.append(frame.time)
        for kept, values in ((self._position, frame.position), (self._velocity, frame.velocity)):
            whole = np.full((number, 3), np.nan, dtype=np.float32)
            whole[ids] = values
            kept.append(whole)
        turned = np.zeros((number, 4), dtype=np.int16)
        turned[ids] = np.rint(32767.0 * np.clip(frame.orientation, -1.0, 1.0))
        self._orientation.append(turned)
        there = np.zeros(number, dtype=np.uint8)
        there[ids] = 1
        self._there.append(there)
        if self._colours.fields or not self._colour:
            seen = ids if self._colours.fields else np.arange(number)
            colour = np.zeros((number, 3), dtype=np.uint8)
            # In sRGB, as pictures have it: the root of the light.
            colour[seen] = np.rint(255.0 * np.sqrt(np.clip(self._colours(frame, seen), 0.0, 1.0)))
            self._colour.append(colour)

    def arrays(self) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        """All numbers, and the ranges that whole ones stand for."""
        header = self._header
        position, velocity, there = np.array(self._position), np.array(self._velocity), np.array(self._there)
        known = np.isfinite(position)
        lower = np.nanmin(np.where(known, position, np.inf), axis=(0, 1), initial=np.inf)
        upper = np.nanmax(np.where(known, position, -np.inf), axis=(0, 1), initial=-np.inf)
        if not known.any():
            lower = upper = np.zeros(3)
        span = np.where(upper > lower, upper - lower, 1.0)
        fastest = float(np.nanmax(np.abs(velocity), initial=0.0)) or 1.0
        arrays = {
            "position": np.rint(65535.0 * np.nan_to_num((position - lower) / span)).astype(np.uint16),
            "velocity": np.rint(32767.0 * np.nan_to_num(velocity / fastest)).astype(np.int16),
            "orientation": np.array(self._orientation),
            "colour": np.array(self._colour),
            "there": np.zeros(0, dtype=np.uint8) if there.all() else there,
            "shape": header.shape.astype(np.uint16),
            "group": header.group.astype(np.uint16),
            "size": header.size.astype(np.float32),
            "mass": header.mass.astype(np.float32),
        }
        return arrays, {"lower": lower.tolist(), "upper": (lower + span).tolist(), "fastest": fastest}


def _bytes_of(arrays: dict[str, np.ndarray]) -> tuple[bytes, list[dict[str, Any]]]:
    """Arrays one after the other, little-endian, and where each is."""
    content, listed = bytearray(), []
    for name, values in arrays.items():
        listed.append({"name": name, "type": values.dtype.name, "start": len(content), "count": values.size})
        content += values.astype(values.dtype.newbyteorder("<")).tobytes()
        content += bytes(-len(content) % 4)
    return bytes(content), listed


def _obstacle_arrays(obstacles: list[DrawnObstacle], times: list[float]) -> dict[str, np.ndarray]:
    """The surfaces of obstacles, and their poses at these times [s]: position, then x, y, z, w."""
    arrays: dict[str, np.ndarray] = {}
    for number, each in enumerate(obstacles):
        name = f"obstacle_{number}"
        arrays[f"{name}_position"] = each.surface.vertices.astype(np.float32)
        arrays[f"{name}_normal"] = each.surface.normals.astype(np.float32)
        arrays[f"{name}_triangles"] = each.surface.triangles.astype(np.uint32)
    poses = [poses_of(obstacles, time) for time in times]
    rows = [np.hstack([position, np.roll(orientation, -1, axis=1)]) for position, orientation in poses]
    return {**arrays, "obstacle_pose": np.array(rows, dtype=np.float32)}


def _described(drawn: DrawnObstacle) -> dict[str, Any]:
    colour = _hex(255.0 * np.sqrt(drawn.colour))
    return {"name": drawn.name, "colour": colour, "opacity": drawn.opacity, "two_sided": drawn.has_two_sides}


def _surface(shape: Shape, splits: int) -> dict[str, Any]:
    surface = surface_of(shape, splits)
    return {
        "name": shape.name,
        "position": np.round(surface.vertices, 7).ravel().tolist(),
        "normal": np.round(surface.normals, 5).ravel().tolist(),
        "triangles": surface.triangles.ravel().tolist(),
    }


def _hex(colour: np.ndarray) -> str:
    return "#" + "".join(f"{round(float(part)):02x}" for part in colour)
