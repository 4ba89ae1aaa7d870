"""What a run takes of the disk, estimated before it begins. It is light to import: asked before all else."""

from __future__ import annotations

import math
import shutil
from pathlib import Path

from particlesim.core.constants import SEGMENT, TRANSPARENT_ENDINGS
from particlesim.core.output_path import OutputError, partial_folder
from particlesim.scene import Scene
from particlesim.scene.camera import Movie
from particlesim.scene.groups import SphereShape
from particlesim.setup.memory import check_memory

# Bytes of a frame of a trajectory: its ledger, and quantities of each particle in single precision and, if asked for,
# in double precision as well. Of what is 0 all the time nothing is written: angular momenta of smooth spheres, and how
# often each went round a world that is not periodic.
_LEDGER = 2400
_SINGLE = {"position": 12, "orientation": 16, "velocity": 12, "angular_momentum": 16, "image": 12, "impacts": 4}
_DOUBLE = {"position": 24, "orientation": 32, "velocity": 24, "angular_momentum": 24}

# Bytes of a checkpoint for each particle, where the one before goes when the next is whole; a movie has its first frame
# beside them.
_CHECKPOINT, _FIRST = 2 * 430, 144

# Bytes a pixel of a movie at crf 18, of which x264 doubles or halves six more or less: 0.03 to 0.07 in the movies
# in renders/. The least is what a movie takes in which next to nothing moves.
_PIXEL, _LEAST = 0.04, 0.001


def trajectory_bytes(scene: Scene) -> float:
    """Of a whole run."""
    nothing = {
        "angular_momentum": all(isinstance(group.shape, SphereShape) for group in scene.groups),
        "image": "periodic" not in scene.world.boundary,
    }
    kept = [name for name in scene.trajectory.fields if not nothing.get(name)]
    particle = sum(_SINGLE[name] for name in kept)
    if scene.trajectory.precision == "double":
        particle += sum(_DOUBLE.get(name, 0) for name in scene.trajectory.fields)
    return float(scene.trajectory.kept(scene.frames)) * (_LEDGER + particle * scene.number)


def movie_bytes(movie: Movie, pictures: int, at_crf_18: float = _PIXEL) -> float:
    """Of a movie of so many pictures."""
    return at_crf_18 * 2.0 ** ((18 - movie.crf) / 6.0) * pictures * math.prod(movie.size)


def check_simulation(scene: Scene, path: Path) -> None:
    """SceneError if a scene cannot be, or not in this memory; OutputError if its trajectory does not fit the disk."""
    check_memory(scene.number)
    _check_disk(path, trajectory_bytes(scene) + _CHECKPOINT * scene.number)
    _check_limits(scene)


def check_movie(scene: Scene, path: Path, pictures: int, simulated: bool) -> None:
    """As ``check_simulation``, of a movie: even one in which next to nothing moves does not fit."""
    state = 0
    if simulated:
        check_memory(scene.number)
        state = (_CHECKPOINT + _FIRST) * scene.number
    movie = scene.movie
    segment = 3 * math.prod(movie.size) * min(pictures, SEGMENT)
    # Segments are there until they are joined.
    _check_disk(path, 2.0 * movie_bytes(movie, pictures, _LEAST) + segment + state)
    if simulated:
        _check_limits(scene)


def check_transparency(path: Path, movie: Movie) -> None:
    """OutputError for a movie without a background in a format that has none such."""
    ending = path.suffix.lower()
    if movie.transparent and ending not in TRANSPARENT_ENDINGS:
        raise OutputError(f"{path}: {ending} has no transparent background; .webm and .png have")


def _check_limits(scene: Scene) -> None:
    """SceneError if a scene cannot be, as is known before kernels are compiled."""
    from particlesim.setup.limits import check_limits  # noqa: PLC0415  (after what is light)

    check_limits(scene)


def _check_disk(path: Path, needed: float) -> None:
    """OutputError if so many bytes do not fit beside those of the partial run that is there."""
    folder = partial_folder(path)
    kept = sum(file.stat().st_size for file in folder.iterdir()) if folder.is_dir() else 0
    free = shutil.disk_usage(path.parent).free + kept
    if needed > free:
        raise OutputError(
            f"{path}: takes {_size(needed)} on the disk, of which {_size(free)} are free: "
            "fewer frames or particles, smaller pictures, or another folder"
        )


def _size(count: float) -> str:
    """So many bytes, in words."""
    unit, size = next((each for each in (("GB", 1e9), ("MB", 1e6)) if count >= each[1]), ("kB", 1e3))
    return f"{count / size:,.1f} {unit}"
