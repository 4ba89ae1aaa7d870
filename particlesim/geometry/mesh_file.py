"""Mesh files: the points that their faces have, and their triangles as they are."""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import Any

import numpy as np

from particlesim.core.constants import UNITS
from particlesim.core.mesh_files import check_mesh_file

# A binary STL: a header, the number of its triangles (uint32), and so many bytes for each of them
# (https://www.loc.gov/preservation/digital/formats/fdd/fdd000505.shtml).
_STL_HEADER, _STL_COUNT, _STL_TRIANGLE = 80, 4, 50

_PLY_HEADER_END = b"end_header"


def mesh_vertices(path: Path, unit: str = "m") -> np.ndarray:
    """The corners of the faces of an STL, OBJ or PLY file, (v, 3) float64 [m].

    Parameters
    ----------
    path : Path
        The file.
    unit : str
        What its numbers are in, one of UNITS.

    Raises
    ------
    OSError
        If the file cannot be read.
    ValueError
        If it is no mesh: the path, and what is wrong.
    """
    return np.concatenate([vertices[np.unique(triangles)] for vertices, triangles in _solids(path, unit)])


def mesh_triangles(path: Path, unit: str = "m") -> tuple[np.ndarray, np.ndarray]:
    """All triangles of an STL, OBJ or PLY file: points (v, 3) float64 [m], and three of them for each (t, 3) int64.

    Parameters and exceptions are those of ``mesh_vertices``. Points may be there more than once.
    """
    solids = _solids(path, unit)
    ends = np.cumsum([len(vertices) for vertices, _ in solids])
    triangles = [rows + end - len(vertices) for (vertices, rows), end in zip(solids, ends, strict=True)]
    return np.concatenate([vertices for vertices, _ in solids]), np.concatenate(triangles)


def _solids(path: Path, unit: str) -> list[tuple[np.ndarray, np.ndarray]]:
    """Points [m] and triangles of each part of a file that has faces."""
    if unit not in UNITS:
        raise ValueError(f"the unit of a mesh must be one of {', '.join(UNITS)}, not {unit!r}")
    if not path.is_file():
        raise FileNotFoundError(f"{path}: {'is a folder' if path.is_dir() else 'no such file'}")
    try:
        check_mesh_file(path)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
    solids = _parts(path, _readable(path, path.read_bytes()))
    if not all(np.isfinite(vertices[triangles]).all() for vertices, triangles in solids):
        raise ValueError(f"{path}: holds numbers that are not finite")
    return [(vertices * UNITS[unit], triangles) for vertices, triangles in solids]


def _parts(path: Path, data: bytes) -> list[tuple[np.ndarray, np.ndarray]]:
    """Points and triangles of each part, in the units of the file. ValueError if it has none."""
    import trimesh  # noqa: PLC0415  (slow to import, needed for meshes only)

    ending = path.suffix.lower().removeprefix(".")
    try:
        scene: Any = trimesh.load(io.BytesIO(data), file_type=ending, force="scene", process=False)
        solids = [part for part in scene.dump() if len(getattr(part, "faces", ()))]
        parts = [(np.array(part.vertices, np.float64), np.array(part.faces, np.int64)) for part in solids]
    except Exception as error:
        # What is missing may be a module that guesses what a text is written in: the file is to blame all the same.
        words = "" if isinstance(error, ImportError) else f" ({' '.join(str(error).split()) or type(error).__name__})"
        raise ValueError(f"{path}: truncated, or not a mesh: it ends at byte {len(data):,}{words}") from error
    if not parts:
        raise ValueError(f"{path}: has no faces; points and lines are not a mesh")
    return parts


def _readable(path: Path, data: bytes) -> bytes:
    """A mesh file whose text is UTF-8 and whose triangles are all there. ValueError if they are not."""
    ending = path.suffix.lower()
    if not data:
        raise ValueError(f"{path}: is empty")
    if ending == ".ply":
        header, end, rest = data.partition(_PLY_HEADER_END)
        return _as_utf8(header) + end + rest
    if ending == ".stl":
        return _whole_stl(path, data)
    return _as_utf8(data)


def _as_utf8(text: bytes) -> bytes:
    """Text as UTF-8. Other text is taken for Latin-1, where any byte is a letter: only names and remarks have any."""
    try:
        text.decode()
    except UnicodeDecodeError:
        return text.decode("latin-1").encode()
    return text


def _whole_stl(path: Path, data: bytes) -> bytes:
    """An STL file without what follows its triangles. ValueError if it ends before them."""
    ends = f"{path}: truncated, or not a mesh: it ends at byte {len(data):,}"
    if re.match(rb"\s*solid[^\0]*?\b(facet|endsolid)\b", data[:4096]):
        lower = data.lower()
        if lower.rfind(b"facet") > lower.rfind(b"endsolid"):
            raise ValueError(f"{ends} without 'endsolid'")
        return _as_utf8(data)
    start = _STL_HEADER + _STL_COUNT
    if len(data) < start:
        raise ValueError(f"{ends} within its header")
    triangles = int.from_bytes(data[_STL_HEADER:start], "little")
    whole = start + _STL_TRIANGLE * triangles
    if len(data) < whole:
        raise ValueError(f"{ends} where {triangles:,} triangles take {whole:,}")
    return data[:whole]
