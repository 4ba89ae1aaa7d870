"""Extended XYZ, a text of a line for each particle: ASE, OVITO and others read it.

Names of columns are those that OVITO knows (https://docs.ovito.org, "XYZ file reader"); quaternions are (x, y, z, w),
as it has them. No particle is an atom: all are of the species X.
"""

from __future__ import annotations

from pathlib import Path
from typing import TextIO

import numpy as np

from particlesim.core.atomic_write import atomic_write
from particlesim.scene import Scene
from particlesim.trajectory.export import Exported
from particlesim.trajectory.frames import Frame, Header

_COLUMNS = "species:S:1:pos:R:3:id:I:1:shape:I:1:group:I:1:radius:R:1:mass:R:1:velo:R:3:orientation:R:4"
_ROW = ["X", *["%.9g"] * 3, *["%d"] * 3, *["%.9g"] * 9]


def write_xyz(path: Path, run: Exported) -> list[Path]:
    """Write all frames to one file. OSError if it cannot be written."""
    with atomic_write(path) as hidden, hidden.open("w", encoding="ascii") as file:
        for frame in run.frames:
            _write_frame(file, run.scene, run.header.of(frame), frame)
    return [path]


def _write_frame(file: TextIO, scene: Scene, header: Header, frame: Frame) -> None:
    lattice = np.diag(scene.world.size)
    origin = -0.5 * np.asarray(scene.world.size)
    periodic = " ".join("T" if edge else "F" for edge in scene.world.period)
    file.write(
        f'{len(frame.position)}\nLattice="{_words(lattice)}" Origin="{_words(origin)}" Properties={_COLUMNS} '
        f'pbc="{periodic}" Time={frame.time:.17g}\n'
    )
    numbers = np.column_stack(
        [
            *(frame.position, frame.ids, header.shape, header.group, header.radius, header.mass),
            *(frame.velocity, np.roll(frame.orientation, -1, axis=1)),
        ]
    )
    np.savetxt(file, numbers, fmt=" ".join(_ROW))


def _words(numbers: np.ndarray) -> str:
    return " ".join(f"{number:.17g}" for number in numbers.ravel())
