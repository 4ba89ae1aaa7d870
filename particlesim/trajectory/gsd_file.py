"""A trajectory: what stays the same about its particles, then frame after frame, in memory or in a GSD file.

The file follows the HOOMD schema of GSD (https://gsd.readthedocs.io), so that OVITO, freud and others open it: types
with their shapes, positions, orientations, velocities, angular momenta. Under ``log/particlesim/`` it adds the scene,
the shape and size of every particle, and the ledger of every frame.
"""

from __future__ import annotations

import functools
import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import gsd.hoomd
import numpy as np

from particlesim.core.arguments import checked_arguments, shown
from particlesim.scene import Scene
from particlesim.scene.file import stored_scene
from particlesim.trajectory.foreign_gsd import FRAME_RATE, Foreign, check_same_particles, read_foreign
from particlesim.trajectory.frames import Frame, Header, Ledger
from particlesim.trajectory.gsd_chunks import Chunks, TrajectoryError, cut, reading, room_in_index
from particlesim.trajectory.gsd_header import LOG, OLDER, checked_header, header_log, read_header
from particlesim.trajectory.gsd_ledger import ledger_log, ledger_names, read_ledger
from particlesim.trajectory.gsd_particles import IMPACTS, has_images, particle_chunks, read_particles, recording_of
from particlesim.trajectory.gsd_types import display_diameters, display_types

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from particlesim.trajectory.analysis.measurements import Measurements

# Ids, by OVITO's name of them: so it follows particles whose number changes. Version 0.1 had them under the other name.
_IDS, _FORMER_IDS = "log/particles/Particle Identifier", "log/particles/id"

# Under this prefix is what the schema has of particles.
_SCHEMA = "particles/"

# How far the square of a quaternion's length may be from 1: rounding to single precision leaves 1e-6.
_UNIT = 1e-3

# Chunks of a frame at most: what the schema has, what we add to the first one, and the ledger.
_CHUNKS = 40 + len(ledger_names())


class TrajectoryWriter:
    """Writes frames to a GSD file, after the first ``kept`` that are in it. A context manager."""

    def __init__(self, path: Path, header: Header, kept: int = 0) -> None:
        self._path, self._header = Path(path), header
        self._box = [*json.loads(header.scene_json)["world"]["size"], 0.0, 0.0, 0.0]
        self._recording = recording_of(header)
        self._types, self._type_of = display_types(header)
        if kept:
            cut(path, kept)
        else:
            self._path.touch()  # as other files are made: GSD would keep it from all others
        self._file = gsd.hoomd.open(str(path), "r+" if kept else "w")
        self._count, self._room = kept, 0

    def __enter__(self) -> TrajectoryWriter:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def flush(self) -> None:
        """Let all frames so far be in the file."""
        self._file.flush()

    def append(self, frame: Frame) -> None:
        """Add a frame."""
        self._make_room()
        header, ids = self._header, frame.ids
        out = gsd.hoomd.Frame()
        out.configuration.step = self._count
        out.configuration.box = self._box
        particles = out.particles
        particles.N = len(ids)
        own = {LOG + "time": np.array([frame.time])}
        for chunk, values in particle_chunks(frame, self._recording).items():
            if chunk.startswith(_SCHEMA):
                setattr(particles, chunk.removeprefix(_SCHEMA), values)
            else:
                own[chunk] = values
        if self._count == 0:
            particles.types = [name for name, _ in self._types]
            particles.type_shapes = [shape for _, shape in self._types]
            out.log.update(_logged(header_log(header, changing=frame.present is not None)))
        if self._count == 0 or frame.present is not None:
            particles.typeid = self._type_of[ids].astype(np.uint32)
            particles.mass = header.mass[ids].astype(np.float32)
            particles.moment_inertia = header.inertia[ids].astype(np.float32)
            particles.diameter = display_diameters(header)[ids]
        if frame.present is not None:
            own[_IDS] = ids.astype(np.uint32)
        out.log.update(_logged({**own, **ledger_log(frame.ledger)}))
        self._file.append(out)
        self._count += 1
        self._room -= _CHUNKS

    def _make_room(self) -> None:
        """Let the index of the file have room for the next frame."""
        if self._room < _CHUNKS:
            self._file.close()
            try:
                self._room = room_in_index(self._path, _CHUNKS)
            finally:
                self._file = gsd.hoomd.open(str(self._path), "r+")


class Trajectory:
    """A GSD file: a sequence of frames. A context manager. TrajectoryError if it is none, or damaged.

    Of files that other programs wrote, such as HOOMD-blue, ``assumed`` says line by line what they leave open.
    """

    @checked_arguments
    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self._chunks = chunks = Chunks(self.path)
        try:
            with reading(self.path):
                if not chunks.frames:
                    raise TrajectoryError(f"{path}: has no frames")
                self._is_own = chunks.has(LOG + "scene")
                self._check_has(*ledger_names())
                found = Foreign(read_header(chunks), ()) if self._is_own else read_foreign(chunks)
                self.header, self.assumed = checked_header(found.header), found.assumed
                self._recording, self._images = recording_of(self.header), has_images(self.header)
                self._check_has(*([IMPACTS] if "impacts" in self.fields else []))
        except BaseException:
            chunks.close()
            raise

    def __enter__(self) -> Trajectory:
        return self

    def __exit__(self, *_: object) -> None:
        self._chunks.close()

    def __repr__(self) -> str:
        span = "closed" if self._chunks.closed else f"{self.time(0):g} to {self.time(len(self) - 1):g} s"
        return f"<Trajectory {self.path}: {len(self):,} frames of {len(self.header.shape):,} particles, {span}>"

    def __len__(self) -> int:
        return self._chunks.frames

    def __iter__(self) -> Iterator[Frame]:
        return (self[k] for k in range(len(self)))

    @property
    def fields(self) -> list[str]:
        """Which quantities of the particles it keeps."""
        return self._recording.fields

    @functools.cached_property
    def scene(self) -> Scene:
        """The scene that the trajectory is of. SceneError if this version cannot read it."""
        with reading(self.path):
            table = json.loads(self.header.scene_json)
        scene = stored_scene(table)
        if len(self.header.group) != scene.number or (self.header.group >= len(scene.groups)).any():
            raise TrajectoryError(f"{self.path}: damaged: its particles are not those of its scene")
        return scene

    @checked_arguments
    def table(self, which: str = "time") -> np.ndarray:
        """The numbers of the run, as a structured array: of energies, momenta and so on, a row for each frame.

        Parameters
        ----------
        which : str
            ``"time"``, ``"radial"`` (the radial distribution) or ``"speeds"`` (beside Maxwell's distribution).

        Returns
        -------
        numpy.ndarray
            Structured, of float64 in SI units; ``pandas.DataFrame`` makes a frame of it. What is not known is not a
            number.

        Raises
        ------
        ValueError
            For a table that there is not.
        TrajectoryError, SceneError
            If the file is damaged, or its scene cannot be read.
        """
        return self._measurements.table(which)

    @checked_arguments
    def plot(self, what: str | None = None) -> Figure:
        """A figure of the run (matplotlib's): all panels on a page, or one.

        Parameters
        ----------
        what : str, optional
            ``"energy"``, ``"drift"``, ``"momentum"``, ``"impacts"``, ``"temperature"``, ``"pressure"``,
            ``"displacement"``, ``"radial"`` or ``"speeds"``.

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        ValueError
            For a panel that there is not, or of which nothing is known.
        TrajectoryError, SceneError
            If the file is damaged, or its scene cannot be read.
        """
        from particlesim.trajectory.analysis.panels import draw_panels  # noqa: PLC0415  (brings the broad phases)

        return draw_panels(self._measurements, what)

    @functools.cached_property
    def _measurements(self) -> Measurements:
        from particlesim.trajectory.analysis.measurements import measured  # noqa: PLC0415

        return measured(self.scene, self.header, self, len(self))

    @property
    def version(self) -> str | None:
        """The version of particlesim that wrote it; None if it does not say."""
        name = LOG + "version"
        with reading(self.path):
            return self._chunks.read(name).tobytes().decode() if self._chunks.has(name) else None

    def _check_has(self, *names: str) -> None:
        """TrajectoryError if a file of ours has not all of these chunks."""
        if self._is_own and not all(self._chunks.has(name) for name in names):
            raise TrajectoryError(f"{self.path}: {OLDER}")

    def _number(self, k: int) -> int:
        """The number of frame ``k``, which counts from the end if it is negative. IndexError if there is none."""
        count = len(self)
        if not -count <= k < count:
            raise IndexError(f"{self.path}: frames are 0 to {count - 1}, or {-count} to -1, there is no {shown(k)}")
        return k % count

    @checked_arguments
    def time(self, k: int) -> float:
        """The time of frame ``k`` [s], 0 the first, -1 the last."""
        k = self._number(k)
        with reading(self.path):
            if not self._is_own:
                return k / FRAME_RATE
            return float(self._chunks.rows(LOG + "time", 1, (0.0,), k)[0, 0])

    @checked_arguments
    def ledger(self, k: int) -> Ledger | None:
        """The ledger of frame ``k`` alone, 0 the first, -1 the last; None where the file has none."""
        k = self._number(k)
        with reading(self.path):
            return read_ledger(self._chunks, k) if self._is_own else None

    @checked_arguments
    def __getitem__(self, k: int) -> Frame:
        """Frame ``k``, 0 the first, -1 the last, in the precision of the file; what that has not is not a number."""
        k = self._number(k)
        with reading(self.path):
            if not self._is_own:
                check_same_particles(self._chunks, self.header, k)
            names = [name for name in (_IDS, _FORMER_IDS) if self._chunks.has(name)]
            present = self._chunks.read(names[0], k).astype(np.int64) if names else None
            count = len(self.header.shape) if present is None else len(present)
            if present is not None and ((present >= len(self.header.shape)).any() or (np.diff(present) <= 0).any()):
                raise ValueError(f"ids of frame {k}")
            values = read_particles(self._chunks, self._recording, count, k, self._images)
            if (np.abs((values["orientation"] ** 2).sum(axis=1) - 1.0) > _UNIT).any():
                raise ValueError(f"orientations of frame {k}")
            return Frame(time=self.time(k), **values, ledger=self.ledger(k), present=present)


@checked_arguments
def open(path: str | Path) -> Trajectory:
    """Open a trajectory: what ``particlesim simulate`` wrote, or a GSD file of HOOMD-blue and others.

    Parameters
    ----------
    path : str or Path
        The file (.gsd).

    Returns
    -------
    Trajectory
        A sequence of frames, with ``table`` and ``plot``. It is closed at the end of a ``with`` block, or with itself.

    Raises
    ------
    TrajectoryError
        If the file is no trajectory, or damaged.
    OSError
        If it cannot be read.
    """
    return Trajectory(path)


def _logged(chunks: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Chunks by the names that the writer of the schema gives logged quantities: without their prefix."""
    return {name.removeprefix("log/"): values for name, values in chunks.items()}
