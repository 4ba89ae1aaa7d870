"""How fast pictures are drawn here, beside VTK where it is installed, so that the figures can be repeated anywhere.

Each measurement is made in a process of its own: two libraries that open OpenGL contexts need not bear each other.
"""

from __future__ import annotations

import importlib.util
import itertools
import json
import math
import multiprocessing
import statistics
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from particlesim.core.atomic_write import atomic_write
from particlesim.geometry.shapes import CATALOGUE
from particlesim.rendering import RenderError
from particlesim.scene import Scene
from particlesim.trajectory.frames import Frame, Header

COUNTS = 1_000, 10_000, 100_000
LARGE = 1_000_000
KINDS = {"spheres": ("sphere",), "cubes": ("cube",), "pyramids": ("pyramid",), "mixed": ("sphere", "cube", "pyramid")}
SIZE = 1280, 720  # pixels

# Pictures a measurement; the first ones, in which libraries prepare what they keep, do not count.
_PICTURES = 9
_NOT_COUNTED = 2

# The particles fill this fraction of a cube, and jitter is this fraction of the distance to their neighbours.
_FILL = 0.2
_JITTER = 0.3

# They move by this fraction of their radius from picture to picture, and the camera by so many seconds of a minute.
_DISPLACEMENT = 0.1
_TURN = 0.1


class Crowd(NamedTuple):
    """Particles of unit volume a cell about the points of a lattice, in random order and orientation.

    ``number`` (n,) of their shape, ``size`` (n,) [m], ``position`` (n, 3) [m], ``orientation`` (n, 4), ``velocity``
    (n, 3) [m/s]; ``edge`` [m] of the cube about the origin that they are in.
    """

    shapes: tuple[str, ...]
    edge: float
    number: np.ndarray
    size: np.ndarray
    position: np.ndarray
    orientation: np.ndarray
    velocity: np.ndarray


@dataclass(frozen=True)
class Drawn:
    """What was measured."""

    kind: str
    particles: int
    drawer: str
    seconds: list[float]  # of each picture

    @property
    def median(self) -> float:
        """The median of the seconds a picture."""
        return statistics.median(self.seconds)


def crowd(kind: str, count: int, seed: int = 0) -> Crowd:
    """``count`` particles of one of KINDS, the same for the same seed."""
    random = np.random.default_rng(seed)
    shapes = KINDS[kind]
    along = math.ceil(count ** (1.0 / 3.0) - 1e-9)
    cells = random.permutation(along**3)[:count]
    lattice = np.column_stack([cells % along, cells // along % along, cells // along**2])
    position = lattice + 0.5 * (1.0 - along) + _JITTER * random.uniform(-0.5, 0.5, (count, 3))
    orientation = random.normal(size=(count, 4))
    number = np.arange(count) % len(shapes)
    size = np.array([(_FILL / CATALOGUE[shape]().volume) ** (1.0 / 3.0) for shape in shapes])[number]
    orientation /= np.linalg.norm(orientation, axis=1, keepdims=True)
    return Crowd(shapes, float(along), number, size, position, orientation, random.normal(size=(count, 3)))


def run(
    counts: Sequence[int], progress: Callable[[str, int, int], None] | None = None, drawers: Sequence[str] | None = None
) -> Iterator[Drawn]:
    """Measure each kind of particles with each number of them, by one drawer after the other.

    ``progress`` is called with what is measured, how many are done, and how many there will be. RenderError if this
    machine cannot draw.
    """
    tasks = [(kind, count, name) for kind in KINDS for count in counts for name in drawers or available_drawers()]
    for done, (kind, count, name) in enumerate(tasks):
        if progress is not None:
            progress(f"{count:,} {kind} by {name}", done, len(tasks))
        yield _measured_apart(kind, count, name)


def available_drawers() -> list[str]:
    """Names of what can draw here: particlesim, and VTK if it is installed and can draw such a crowd."""
    return ["particlesim", *(["VTK"] if importlib.util.find_spec("vtkmodules") else [])]


def write(path: Path, pictures: Sequence[Drawn]) -> None:
    """The figures as JSON, in a file that appears whole or not at all. OSError if it cannot be written."""
    rows = [asdict(drawn) | {"median": drawn.median} for drawn in pictures]
    with atomic_write(path) as hidden:
        hidden.write_text(json.dumps({"size": SIZE, "pictures": rows}, indent=2) + "\n", encoding="utf-8")


def _measured_apart(kind: str, count: int, name: str) -> Drawn:
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        try:
            return pool.submit(measured, kind, count, name).result()
        except BrokenProcessPool:
            raise RenderError(f"drawing {count:,} {kind} by {name} has failed") from None


def measured(kind: str, count: int, name: str) -> Drawn:
    """Measure in this process."""
    drawn = crowd(kind, count)
    if name == "particlesim":
        pictures = own_pictures(drawn)
    else:
        from particlesim.benchmarks.vtk_drawing import vtk_pictures  # noqa: PLC0415  (need not be installed)

        pictures = vtk_pictures(drawn, SIZE, _moved)
    seconds = []
    for _ in range(_NOT_COUNTED + _PICTURES):
        begun = time.perf_counter()
        next(pictures)
        seconds.append(time.perf_counter() - begun)
    return Drawn(kind, count, name, seconds[_NOT_COUNTED:])


def own_pictures(drawn: Crowd) -> Iterator[np.ndarray]:
    """Picture after picture as movies have them: with shadows, smooth edges, and colours by speed."""
    from particlesim.rendering import Renderer  # noqa: PLC0415  (brings kernels)
    from particlesim.rendering.look import look_of  # noqa: PLC0415

    scene = Scene.model_validate(
        {
            "world": {"size": [drawn.edge] * 3},
            "movie": {"resolution": SIZE},
            "camera": {"kind": "orbit", "period": 60.0},
            "show": {"readout": False},
            "particles": [{"shape": shape, "count": 1, "colour": "by_speed"} for shape in drawn.shapes],
        }
    )
    n = len(drawn.size)
    kinds = tuple(CATALOGUE[shape]() for shape in drawn.shapes)
    header = Header("", kinds, drawn.number, drawn.size, drawn.number, np.ones(n), np.ones((n, 3)))
    still, home, unhurt = np.zeros((n, 3)), np.zeros((n, 3), dtype=np.int64), np.zeros(n, dtype=np.int64)

    def frame(k: int) -> Frame:
        return Frame(_TURN * k, _moved(drawn, k), drawn.orientation, drawn.velocity, still, home, unhurt)

    with Renderer(look_of(scene, header, frame(0))) as renderer:
        yield from (renderer.draw(frame(k)) for k in itertools.count())


def _moved(drawn: Crowd, k: int) -> np.ndarray:
    """Where the particles are in picture ``k``: to and fro."""
    amplitude = _DISPLACEMENT * 0.5 * float(drawn.size.min())
    return drawn.position + amplitude * math.sin(k) * drawn.velocity
