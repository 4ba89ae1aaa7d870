"""What a mesh costs: bodies that fall onto a hilly field and come to rest there, of more and more triangles."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from particlesim.core.atomic_write import atomic_write
from particlesim.core.parallel import available_threads, use_threads
from particlesim.geometry.shapes import Shape, triangle_mesh
from particlesim.model.materials import Material
from particlesim.scene import Scene
from particlesim.setup.build import build
from particlesim.setup.obstacles import Obstacle
from particlesim.simulation.simulation import Simulation

# Squares along each side of the field, of two triangles each: 98 to 99,458 triangles.
SQUARES = (7, 22, 71, 223)

SHAPES = "sphere", "cube"
COUNT, SIZE, RESTITUTION, FRICTION = 100, 0.08, 0.3, 0.5

# Half the width of the field [m]. Simulated [s]: while the bodies fall onto it, and from then on.
_HALF = 1.0
FALLING, LYING = 0.6, 0.6

# A field of so few is run first, for kernels to be compiled and loaded.
_FEW = 3


@dataclass(frozen=True)
class OnField:
    """What was measured on a field."""

    triangles: int
    building: float  # of the model [s]
    falling: float  # a step while bodies fall onto the field [s]
    lying: float  # and when most of them lie [s]
    overlap: float  # the deepest in the end, as a fraction of the size


def field(squares: int) -> Shape:
    """Hills in a bowl, the same whatever they are divided into."""
    x, y = np.meshgrid(*2 * [np.linspace(-_HALF, _HALF, squares + 1)], indexing="ij")
    height = 0.05 * np.sin(9.0 * x) * np.cos(7.0 * y) + 0.3 * (x * x + y * y)
    number = np.arange(x.size).reshape(x.shape)
    a, b, c, d = (n.ravel() for n in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]))
    triangles = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return triangle_mesh("field", np.stack([x, y, height], axis=2).reshape(-1, 3), triangles)


def simulation_on(squares: int) -> Simulation:
    """Bodies above a field."""
    region = {"lower": [-0.6, -0.6, 0.4], "upper": [0.6, 0.6, 1.0]}
    groups = [
        {"shape": shape, "count": COUNT // len(SHAPES), "size": SIZE, "placement": {"kind": "random", "region": region}}
        for shape in SHAPES
    ]
    world = {
        "size": [4.0, 4.0, 4.0],
        "boundary": "open",
        "gravity": [0.0, 0.0, -9.81],
        "restitution": RESTITUTION,
        "friction": FRICTION,
    }
    scene = Scene.model_validate({"world": world, "particles": groups, "seed": 1})
    ground = Obstacle(field(squares), (0.0, 0.0, 0.0), material=Material(RESTITUTION, FRICTION))
    return Simulation.of_model(scene, build(scene, [ground]))


def run(
    squares: Sequence[int] = SQUARES,
    threads: int | None = None,
    progress: Callable[[str, int, int], None] | None = None,
) -> Iterator[OnField]:
    """Measure each field; ``progress`` is called with what is done, and how far."""
    use_threads(threads)
    simulation_on(_FEW).run(duration=FALLING)
    for k, number in enumerate(squares):
        if progress is not None:
            progress(f"{2 * number * number:,} triangles", k, len(squares))
        begun = time.perf_counter()
        simulation = simulation_on(number)
        building = time.perf_counter() - begun
        falling, lying = _seconds_of_step(simulation, FALLING), _seconds_of_step(simulation, LYING)
        yield OnField(2 * number * number, building, falling, lying, simulation.largest_overlap() / SIZE)


def _seconds_of_step(simulation: Simulation, duration: float) -> float:
    steps, begun = simulation.steps, time.perf_counter()
    simulation.run(duration=duration)
    return (time.perf_counter() - begun) / (simulation.steps - steps)


def write(path: Path, fields: Sequence[OnField]) -> None:
    """The figures as JSON, in a file that appears whole or not at all. OSError if it cannot be written."""
    what = {"threads": available_threads(), "bodies": COUNT, "fields": [asdict(measured) for measured in fields]}
    with atomic_write(path) as hidden:
        hidden.write_text(json.dumps(what, indent=2) + "\n", encoding="utf-8")
