"""A series for ParaView and VTK: x.pvd, and beside it a folder x with a file for each frame and one for each shape.

The files are VTK XML (https://docs.vtk.org, "VTK XML formats"), with base64 arrays. A frame is points with the data of
the particles. Glyphs are drawn with ``orientation`` as quaternion (w, x, y, z), scaled by ``size``, of the shape
whose number is ``shape``: its surface is in shape_NUMBER.vtu. Obstacles are surfaces, where they are, with ``obstacle``
(the number in the scene), ``colour`` (sRGB) and ``opacity`` of their triangles: those that stand are part 1 of each
frame and one file, those that move are part 2 and a file for each frame.
"""

from __future__ import annotations

import base64
import os
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from particlesim.core.atomic_write import named
from particlesim.core.output_path import OutputError
from particlesim.geometry.surface import surface_of, together
from particlesim.trajectory.drawn_obstacles import DrawnObstacle, placed
from particlesim.trajectory.export import Exported
from particlesim.trajectory.frames import Frame, Header

_TYPES = {"f": "Float", "i": "Int", "u": "UInt"}
_VERTEX, _TRIANGLE = 1, 5  # kinds of cells


def write_pvd(path: Path, run: Exported) -> list[Path]:
    """Write a series; what names its files comes last, when all are there. OSError if it cannot be written."""
    try:
        return _write(path, run)
    except OSError as error:
        named(error, path)
        raise


def _write(path: Path, run: Exported) -> list[Path]:
    folder, entries = path.with_suffix(""), []
    with tempfile.TemporaryDirectory(dir=path.parent, prefix=f".{path.stem[:40]}.") as hidden:
        made = Path(hidden) / folder.name
        made.mkdir()
        for number, shape in enumerate(run.header.shapes):
            surface = surface_of(shape)
            text = _grid(surface.vertices, surface.triangles, _TRIANGLE, {"Normals": surface.normals})
            (made / f"shape_{number}.vtu").write_text(text, encoding="ascii")
        standing, moving = ([each for each in run.obstacles if each.moves == moves] for moves in (False, True))
        if standing:
            (made / "standing.vtu").write_text(_surfaces(standing, 0.0), encoding="ascii")
        for number, frame in enumerate(run.frames):
            parts = {0: f"frame_{number:05d}.vtu"}
            (made / parts[0]).write_text(_points(run.header.of(frame), frame), encoding="ascii")
            if standing:
                parts[1] = "standing.vtu"
            if moving:
                parts[2] = f"moving_{number:05d}.vtu"
                (made / parts[2]).write_text(_surfaces(moving, frame.time), encoding="ascii")
            for part, name in parts.items():
                entry = f'timestep="{frame.time:.17g}" part="{part}" file="{folder.name}/{name}"'
                entries.append(f"<DataSet {entry}/>")
        index = Path(hidden) / path.name
        index.write_text(_file("Collection", "\n".join(entries)), encoding="utf-8")
        former = Path(hidden) / "former"
        if folder.exists():
            os.rename(folder, former)
        try:
            os.rename(made, folder)
        except OSError:
            if former.exists():
                os.rename(former, folder)
            raise
        os.replace(index, path)
    return [path, folder]


def check_folder(path: Path) -> None:
    """OutputError if the folder of frames would take the place of what is no former series."""
    folder = path.with_suffix("")
    if folder.is_symlink() or (folder.exists() and not folder.is_dir()):
        raise OutputError(f"{path}: its frames go to a folder {folder}, where something else is")
    if folder.exists() and not path.exists():
        raise OutputError(f"{path}: its frames go to a folder {folder}, which is there and is of no {path.name}")


def _surfaces(obstacles: Sequence[DrawnObstacle], time: float) -> str:
    """The surfaces of obstacles where they are at a time [s]."""
    whole = together(placed(obstacles, time))
    # The root of the light, as pictures have it.
    colour = np.rint(255.0 * np.sqrt([each.colour for each in obstacles])).astype(np.uint8)
    values = {
        "obstacle": np.array([each.number for each in obstacles]),
        "colour": colour,
        "opacity": np.array([each.opacity for each in obstacles]),
    }
    count = [len(each.surface.triangles) for each in obstacles]
    data = {name: np.repeat(of_each, count, axis=0) for name, of_each in values.items()}
    return _grid(whole.vertices, whole.triangles, _TRIANGLE, {"Normals": whole.normals}, data)


def _points(header: Header, frame: Frame) -> str:
    """The particles of a frame, which the header is of."""
    data = {
        **{"id": frame.ids, "shape": header.shape, "group": header.group, "size": header.size, "mass": header.mass},
        **{"orientation": frame.orientation, "velocity": frame.velocity, "angular_momentum": frame.angular_momentum},
        "impacts": frame.impacts,
    }
    return _grid(frame.position, np.arange(len(frame.position))[:, None], _VERTEX, data)


def _grid(
    points: np.ndarray,
    cells: np.ndarray,
    kind: int,
    data: dict[str, np.ndarray],
    cell_data: dict[str, np.ndarray] | None = None,
) -> str:
    """Points with data, and cells of as many of them each, which may have data, too."""
    corners = cells.shape[1]
    parts = {
        "Points": [_array("Points", points)],
        "Cells": [
            _array("connectivity", cells.ravel()),
            _array("offsets", corners * np.arange(1, len(cells) + 1)),
            _array("types", np.full(len(cells), kind, dtype=np.uint8)),
        ],
        "PointData": [_array(name, values) for name, values in data.items()],
        "CellData": [_array(name, values) for name, values in (cell_data or {}).items()],
    }
    body = "\n".join(f"<{name}>\n{chr(10).join(arrays)}\n</{name}>" for name, arrays in parts.items())
    piece = f'<Piece NumberOfPoints="{len(points)}" NumberOfCells="{len(cells)}">\n{body}\n</Piece>'
    return _file("UnstructuredGrid", piece)


def _array(name: str, values: np.ndarray) -> str:
    """An array, little-endian, after the number of its bytes."""
    kind = f"{_TYPES[values.dtype.kind]}{8 * values.dtype.itemsize}"
    content = np.ascontiguousarray(values, dtype=values.dtype.newbyteorder("<")).tobytes()
    text = base64.b64encode(len(content).to_bytes(8, "little") + content).decode()
    wide = values.shape[1] if values.ndim > 1 else 1
    return f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{wide}" format="binary">{text}</DataArray>'


def _file(kind: str, body: str) -> str:
    return (
        f'<?xml version="1.0"?>\n<VTKFile type="{kind}" version="1.0" byte_order="LittleEndian" header_type="UInt64">\n'
        f"<{kind}>\n{body}\n</{kind}>\n</VTKFile>\n"
    )
