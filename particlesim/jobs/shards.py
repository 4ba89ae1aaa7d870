"""A movie drawn in parts, by as many machines as there are, and joined: to the bytes that one machine gives.

A part is whole segments of the movie. Fades, scales of colours, readouts and the poster are those of the whole movie,
which each part reads off the whole trajectory.
"""

from __future__ import annotations

import hashlib
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from PIL import Image

from particlesim.core.arguments import checked_arguments
from particlesim.core.atomic_write import atomic_write
from particlesim.core.output_path import check_output
from particlesim.jobs.pictures import poster_place
from particlesim.jobs.provenance import ProvenanceError, as_tags, as_text, read_provenance
from particlesim.rendering import write_image
from particlesim.rendering.video.joining import join_files, pictures_in
from particlesim.rendering.video.segments import SEGMENT
from particlesim.scene import Scene
from particlesim.trajectory.gsd_file import Trajectory

# Missing parts that are named one by one.
_NAMED = 10


class ShardError(ValueError):
    """A part that there cannot be, or parts that make no movie; the message is one line."""


class Shard(NamedTuple):
    """Part ``number`` of a movie in ``of`` parts, 1 the first."""

    number: int
    of: int

    def places(self, pictures: int) -> range:
        """The pictures of a movie that the part has, by their places in it. ShardError if there is no such part."""
        segments = -(-pictures // SEGMENT)
        if not 1 <= self.number <= self.of:
            raise ShardError(f"shard {self.number}/{self.of}: must be 1/{self.of} to {self.of}/{self.of}")
        if self.of > segments:
            most = f"at most {segments:,} parts, of {SEGMENT} pictures each"
            raise ShardError(f"shard {self.number}/{self.of}: {pictures:,} pictures make {most}")
        first, last = (segments * k // self.of for k in (self.number - 1, self.number))
        return range(SEGMENT * first, min(SEGMENT * last, pictures))


def part_of(source: Scene | Trajectory, frames: range | None, shard: tuple[int, int]) -> range:
    """The pictures of a shard (k, n) of a movie of these frames, by their places in it. ShardError if it has none."""
    if isinstance(source, Scene):
        raise ShardError("a shard must be of a trajectory, not of a scene, which is simulated from its start")
    return Shard(*shard).places(len(source) if frames is None else len(frames))


def shard_table(shard: tuple[int, int], trajectory: Trajectory, look: Scene, frames: range) -> dict[str, Any]:
    """What a part says of the whole movie: ``frames`` are the numbers of all that are in that, the rest are hashes."""
    number, of = shard
    return {
        "number": number,
        "of": of,
        "run": _digest_of_run(trajectory),
        "frames": [frames.start, frames.stop, frames.step],
        "quality": look.movie.quality,
        "look": hashlib.sha256(look.model_dump_json().encode()).hexdigest(),
    }


@checked_arguments
def join(parts: Sequence[str | Path], path: str | Path) -> dict[str, Any]:
    """Make a movie (MP4) of its parts without encoding again, and the poster (PNG) that lies beside one of them.

    Parameters
    ----------
    parts
        All parts that ``render`` made with ``shard``, in any order.
    path
        The movie, which must end in .mp4; it appears when it is whole, and has the bytes of one drawn at once.

    Returns
    -------
    dict
        Where it comes from, as ``particlesim info`` says it.

    Raises
    ------
    ShardError
        If a part is missing, doubled, damaged or one of another movie.
    ProvenanceError
        If a file is no part.
    OutputError
        If no movie can be written to ``path``.
    RenderError
        If ffmpeg fails.
    OSError
        If a part cannot be read, or the movie cannot be written.
    """
    check_output(path, ".mp4", beside=(".png",))
    path, files = Path(path), [Path(part) for part in parts]
    if any(path.exists() and file.exists() and path.samefile(file) for file in files):
        raise ShardError(f"{path}: is one of the parts, which the movie would take the place of")
    found = {file: _read_part(file) for file in files}
    ordered = _in_order(found)
    whole = dict(found[ordered[0]])
    shard = whole.pop("shard")
    whole["frames"] = shard["frames"]
    count = len(range(*shard["frames"]))
    for part in ordered:
        _check_pictures(part, len(_places(found[part])))
    with_poster = next(part for part in ordered if poster_place(count) in _places(found[part]))
    poster = _poster(with_poster, found[with_poster])
    with tempfile.TemporaryDirectory() as folder, atomic_write(path) as hidden:
        names = [f"{k:06}.mp4" for k in range(len(ordered))]
        for name, part in zip(names, ordered, strict=True):
            Path(folder, name).symlink_to(part.absolute())
        join_files(Path(folder), names, hidden, as_tags(whole))
        write_image(path.with_suffix(".png"), poster, as_text(whole))
    return whole


def _read_part(path: Path) -> dict[str, Any]:
    """Where a part comes from. ProvenanceError if it is none."""
    found = read_provenance(path)
    if "shard" not in found:
        raise ProvenanceError(f"{path}: is not a part of a movie, such as 'particlesim render --shard' makes")
    return found


def _in_order(found: dict[Path, dict[str, Any]]) -> list[Path]:
    """The parts of a movie in their order. ShardError if they are not all parts of one movie, each once."""
    if not found:
        raise ShardError("there are no parts to join")
    first = next(iter(found))
    of_whole = _of_whole(found[first])
    by_number: dict[int, Path] = {}
    for part, values in found.items():
        differs = next((key for key, value in _of_whole(values).items() if value != of_whole[key]), None)
        if differs is not None:
            here, there = _of_whole(values)[differs], of_whole[differs]
            raise ShardError(f"{part}: is of another movie than {first}: its {differs} is {here}, not {there}")
        number, of = values["shard"]["number"], values["shard"]["of"]
        if number in by_number:
            raise ShardError(f"{part}: is part {number} of {of}, as {by_number[number]} is")
        by_number[number] = part
    missing = [str(number) for number in range(1, of + 1) if number not in by_number]
    if missing:
        named = ", ".join(missing[:_NAMED]) + (f" and {len(missing) - _NAMED} more" if missing[_NAMED:] else "")
        raise ShardError(f"part{'s'[: len(missing) > 1]} {named} of {of} {'are' if missing[1:] else 'is'} missing")
    return [by_number[number] for number in sorted(by_number)]


def _of_whole(values: dict[str, Any]) -> dict[str, Any]:
    """What all parts of a movie have in common."""
    own = {key: value for key, value in values.items() if key not in ("frames", "shard")}
    return {**own, **{key: value for key, value in values["shard"].items() if key != "number"}}


def _check_pictures(part: Path, expected: int) -> None:
    """ShardError if a part does not have the pictures that it should have."""
    there = pictures_in(part)
    if there != expected:
        raise ShardError(f"{part}: damaged: {there:,} of its {expected:,} pictures can be read")


def _places(values: dict[str, Any]) -> range:
    """The pictures of a part by their places in the movie."""
    shard = values["shard"]
    return Shard(shard["number"], shard["of"]).places(len(range(*shard["frames"])))


def _poster(part: Path, values: dict[str, Any]) -> np.ndarray:
    """The poster of a movie, which lies beside the part that has its picture. ShardError if it does not."""
    path = part.with_suffix(".png")
    if not path.exists():
        raise ShardError(f"{path}: is missing: the poster, which was written beside {part}")
    if read_provenance(path) != values:
        raise ShardError(f"{path}: is not the poster that was written beside {part}")
    with Image.open(path) as image:
        return np.asarray(image)


def _digest_of_run(trajectory: Trajectory) -> str:
    """SHA-256 of what tells a trajectory from others: its header, size, and the frames that it begins and ends with."""
    header = trajectory.header
    total = hashlib.sha256(header.scene_json.encode())
    total.update(f"{len(trajectory)} {trajectory.path.stat().st_size}".encode())
    for frame in (trajectory[0], trajectory[len(trajectory) - 1]):
        total.update(frame.position.tobytes())
        total.update(frame.velocity.tobytes())
    return total.hexdigest()
