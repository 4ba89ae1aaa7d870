"""Where a movie, a picture or a trajectory comes from: written into it, and read from it again."""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
import subprocess
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, UnidentifiedImageError

from particlesim.jobs.frame_source import Progress, start, tell
from particlesim.jobs.pictures import summary_of
from particlesim.jobs.summary import Summary
from particlesim.rendering.gl.platform import ffmpeg
from particlesim.scene import Scene
from particlesim.scene.file import stored_scene
from particlesim.trajectory.frames import Frame, Header, ledger_table
from particlesim.trajectory.gsd_file import Trajectory

# The name of the text in PNG files, and of the tag in movies: the one that every player and ffmpeg knows.
_TEXT, _TAG = "particlesim", "comment"


# The keys of a scene go along up to so many letters of JSON: a tag is handed to ffmpeg as one argument, which the
# system limits to 131,072 bytes (MAX_ARG_STRLEN, execve(2)), and letters that JSON escapes are escaped once more.
_LONGEST_KEYS = 60_000


class ProvenanceError(ValueError):
    """A file that does not say where it comes from; the message is one line."""


def provenance(header: Header, summary: Summary, frames: range) -> dict[str, Any]:
    """What a result is of, as plain values.

    Parameters
    ----------
    header
        Of its particles.
    summary
        Of all frames up to the last that is in it.
    frames
        Numbers of those that are in it.

    Returns
    -------
    ``version`` of particlesim, ``scene`` (SHA-256 of the scene as JSON), ``title``, ``seed``, ``energy_drift`` (the
    largest, as a fraction of all energy; None where particles come and go, and with them what it would be a fraction
    of), ``frames`` (first, end, step); ``keys``, those of the scene, unless they are very many, or the run is another
    program's, which no scene gives.
    """
    scene = json.loads(header.scene_json)
    comes_and_goes = scene.get("emitters") or scene.get("sinks")
    drift = {"energy_drift": None if comes_and_goes else summary.worst_energy_drift}
    known = summary.has_ledger and len(header.scene_json) <= _LONGEST_KEYS
    keys = {"keys": scene} if known else {}
    return {**_of_scene(header), **drift, "frames": [frames.start, frames.stop, frames.step], **keys}


def texts_of_pictures(header: Header, frames: range) -> Callable[[int], dict[str, str]]:
    """What each picture of a sequence is of, by its number, as texts of its file: as a movie of its frame alone.

    But for the drift of energy, which is that of a run, and the keys of its scene, of which one copy will do.
    """
    of_scene = _of_scene(header)
    return lambda k: as_text({**of_scene, "frames": [frames[k], frames[k] + 1, 1]})


def _of_scene(header: Header) -> dict[str, Any]:
    scene = json.loads(header.scene_json)
    return {
        "version": importlib.metadata.version("particlesim"),
        "scene": hashlib.sha256(header.scene_json.encode()).hexdigest(),
        "title": scene["title"],
        "seed": scene["seed"],
    }


def as_tags(values: dict[str, Any]) -> dict[str, str]:
    """Provenance as tags of a movie."""
    return {"title": values["title"], _TAG: json.dumps({_TEXT: values})}


def as_text(values: dict[str, Any]) -> dict[str, str]:
    """Provenance as texts of a PNG file."""
    return {_TEXT: json.dumps(values)}


def read_provenance(path: str | Path) -> dict[str, Any]:
    """Where a movie, picture or trajectory comes from, as ``provenance`` says it.

    ProvenanceError if it does not say; TrajectoryError for a damaged trajectory; OSError if it cannot be read.
    """
    path = Path(path)
    read = _READERS.get(path.suffix.lower())
    if read is None:
        raise ProvenanceError(f"{path}: must be a movie (.mp4, .webm, .gif), a picture (.png) or a trajectory (.gsd)")
    with path.open("rb"):  # or the system says why not
        pass
    values = read(path)
    if not isinstance(values, dict):
        raise ProvenanceError(f"{path}: does not say where it comes from")
    return values


def scene_of(path: str | Path) -> Scene:
    """The scene that a movie or a picture is of.

    ProvenanceError if it does not say; SceneError if this version cannot read it; OSError if the file cannot be read.
    """
    values = read_provenance(path)
    if "keys" not in values:
        raise ProvenanceError(f"{path}: does not hold its scene: give that (.toml), or a trajectory (.gsd)")
    return stored_scene(values["keys"])


def replayed(trajectory: Trajectory, number: int, threads: int | None, progress: Progress | None) -> tuple[str, str]:
    """Hashes of a frame as it is in a trajectory, and as its scene gives it when it is simulated again.

    They cover the time, all that is stored of the particles, and the ledger. IndexError if there is no such frame.
    """
    stored, scene = trajectory[number], trajectory.scene
    simulation = start(scene, threads, progress)
    total = scene.trajectory.every * number + 1
    for k in range(total):
        simulation.run_until(scene.time_of(k))
        tell(progress, "simulating", k, total)
    return _digest(stored, trajectory.fields), _digest(simulation.frame(), trajectory.fields)


def _digest(frame: Frame, fields: Sequence[str]) -> str:
    """SHA-256 of what a file with these ``fields`` keeps of a frame."""
    total = hashlib.sha256()
    for single in (name for name in ("position", "orientation", "velocity") if name in fields):
        total.update(getattr(frame, single).astype(np.float32).tobytes())
    for whole in (name for name in ("image", "impacts") if name in fields):
        total.update(getattr(frame, whole).astype(np.int64).tobytes())
    assert frame.ledger is not None
    total.update(json.dumps([frame.time, ledger_table(frame.ledger)], sort_keys=True).encode())
    return total.hexdigest()


def _of_trajectory(path: Path) -> Any:
    with Trajectory(path) as trajectory:
        summary = summary_of(trajectory.scene, trajectory.header)
        for k in range(len(trajectory)):
            summary.add_moment(trajectory.time(k), trajectory.ledger(k))
        return {**provenance(trajectory.header, summary, range(len(trajectory))), "version": trajectory.version}


def _of_movie(path: Path) -> Any:
    command = [ffmpeg(), "-v", "error", "-i", f"file:{path}", "-f", "ffmetadata", "-"]
    done = subprocess.run(command, capture_output=True, check=False)
    # One tag a line; what would end it stands behind a backslash.
    text = done.stdout.decode(errors="replace").replace("\\\n", "\n")
    tag = next((line for line in text.split("\n") if line.lower().startswith(f"{_TAG}=")), "")
    for letter in "=;#\\":
        tag = tag.replace(f"\\{letter}", letter)
    return _parsed(tag[len(_TAG) + 1 :], _TEXT)


def _of_gif(path: Path) -> Any:
    try:
        with Image.open(path) as image:
            comment = image.info.get(_TAG, b"")
            return _parsed(bytes(comment).decode(errors="replace"), _TEXT)
    except UnidentifiedImageError:
        raise ProvenanceError(f"{path}: not a picture") from None


def _of_picture(path: Path) -> Any:
    try:
        with Image.open(path) as image:
            return _parsed(str(image.info.get(_TEXT, "")))
    except UnidentifiedImageError:
        raise ProvenanceError(f"{path}: not a picture") from None


def _parsed(text: str, *keys: str) -> Any:
    try:
        value = json.loads(text)
        for key in keys:
            value = value[key]
        return value
    except (ValueError, KeyError, TypeError):
        return None


_READERS: dict[str, Callable[[Path], Any]] = {
    ".gsd": _of_trajectory,
    ".mp4": _of_movie,
    ".webm": _of_movie,
    ".gif": _of_gif,
    ".png": _of_picture,
}
