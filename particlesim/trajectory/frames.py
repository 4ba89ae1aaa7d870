"""What a trajectory is made of: a header, what stays the same about its particles, and frame after frame."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from particlesim.geometry.shapes import Shape


@dataclass(frozen=True)
class Ledger:
    """Diagnostics: sums over all particles at one time, and counts since the start.

    Energies [J], momentum [kg m/s], angular momentum about the origin [kg m^2/s]; both vectors (3,).
    """

    time: float  # [s]
    time_step: float  # the last one [s]
    steps: int
    kinetic_translational: float
    kinetic_rotational: float
    potential: float  # in the field of gravity, zero at the corner of the world that it points to
    momentum: np.ndarray
    angular_momentum: np.ndarray
    impacts: int
    pairs_tested: int  # AABBs compared by the broad phase
    candidate_pairs: int  # pairs it handed to the narrow phase
    unresolved: int  # substeps in which more happened than was worked through (see MAX_IMPACTS)
    virial: float  # sum of r_ij . impulse over pair impacts [J s]
    wall_impulse: np.ndarray  # (6,) given to the walls -x, +x, -y, +y, -z, +z along their outward normals [N s]
    largest_overlap: float | None = None  # of two particles, or of one and a wall [m]; only recorded frames have it
    dissipated: np.ndarray | None = None  # (4,) by the causes in DISSIPATION [J]; older files do not have it
    wall_shear: np.ndarray | None = None  # (6, 3) given to the walls across their normals [N s]; nor this
    work: float | None = None  # that moving obstacles did in impacts, and fields [J]; nor this
    flow_mass: np.ndarray | None = None  # (2,) of particles that came and that went [kg]; nor this and what follows
    flow_energy: np.ndarray | None = None  # (2,) kinetic and potential energy that they had then [J]
    released: int | None = None  # particles that emitters put in
    removed: int | None = None  # and that sinks took out
    waiting: int | None = None  # particles that emitters have not found room for yet

    def __repr__(self) -> str:
        kinetic = f"kinetic {self.kinetic:.6g} J ({self.kinetic_rotational:.6g} of rotation)"
        px, py, pz = self.momentum
        return (
            f"<Ledger at {self.time:g} s: {kinetic}, potential {self.potential:.6g} J, "
            f"momentum [{px:.3g}, {py:.3g}, {pz:.3g}] kg m/s, {self.impacts:,} impacts>"
        )

    @property
    def kinetic(self) -> float:
        """Translational and rotational kinetic energy [J]."""
        return self.kinetic_translational + self.kinetic_rotational

    @property
    def given_to_walls(self) -> np.ndarray:
        """The impulse given to all walls, (3,) [N s]."""
        pressed = self.wall_impulse[1::2] - self.wall_impulse[::2]
        return pressed if self.wall_shear is None else pressed + self.wall_shear.sum(axis=0)

    @property
    def energy(self) -> float:
        """Kinetic and potential energy [J]."""
        return self.kinetic + self.potential

    @property
    def own_energy(self) -> float:
        """Kinetic and potential energy less what obstacles and fields worked and what came with particles."""
        came, went = (0.0, 0.0) if self.flow_energy is None else self.flow_energy.tolist()
        return self.energy - (self.work or 0.0) - came + went


def ledger_table(ledger: Ledger) -> dict[str, Any]:
    """A ledger as plain values, which JSON keeps to the last bit."""
    return {name: np.asarray(value).tolist() for name, value in vars(ledger).items() if value is not None}


def ledger_of(table: dict[str, Any]) -> Ledger:
    """The ledger of plain values."""
    values: dict[str, Any] = {name: np.array(v) if isinstance(v, list) else v for name, v in table.items()}
    return Ledger(**values)


@dataclass(frozen=True)
class Header:
    """What stays the same from frame to frame, of all particles that there are at any time, in the order of their ids.

    Attributes
    ----------
    scene_json
        The scene as JSON.
    shapes
        The shapes of size 1 that occur.
    shape : (n,) int64
        Index into ``shapes`` of each particle.
    size : (n,) float64
        The factor on its shape: metres, as these are 1 m.
    group : (n,) int64
        Its entry of the scene's particles.
    mass : (n,) float64
        [kg]
    inertia : (n, 3) float64
        Principal moments [kg m^2].
    obstacles
        What each obstacle of the scene is drawn as.
    """

    scene_json: str
    shapes: tuple[Shape, ...]
    shape: np.ndarray
    size: np.ndarray
    group: np.ndarray
    mass: np.ndarray
    inertia: np.ndarray
    obstacles: tuple[Shape, ...] = ()

    def __repr__(self) -> str:
        names = ", ".join(shape.name for shape in self.shapes)
        return f"<Header: {len(self.shape):,} particles ({names}), {self.mass.sum():.6g} kg>"

    def of(self, frame: Frame) -> Header:
        """The header of the particles of a frame alone."""
        if frame.present is None:
            return self
        names = "shape", "size", "group", "mass", "inertia"
        return replace(self, **{name: getattr(self, name)[frame.present] for name in names})

    @property
    def radius(self) -> np.ndarray:
        """Of the bounding spheres, (n,) [m]."""
        return np.array([shape.radius for shape in self.shapes])[self.shape] * self.size


@dataclass(frozen=True)
class Frame:
    """The particles at one time. What a file of it has not kept is not a number; orientations are as of nothing turned.

    Attributes
    ----------
    time
        [s]
    position : (n, 3) float64
        Of the centroids [m].
    orientation : (n, 4) float64
        Unit quaternions (w, x, y, z), body to world.
    velocity : (n, 3) float64
        [m/s]
    angular_momentum : (n, 3) float64
        About the centroids, world axes [kg m^2/s].
    image : (n, 3) int64
        Periods that each particle has crossed along each axis.
    impacts : (n,) int64
        Of each particle since the start.
    ledger
        The sums over all of them; None where they are not known.
    present : (n,) int64
        Their ids, rising; None where all are there.
    """

    time: float
    position: np.ndarray
    orientation: np.ndarray
    velocity: np.ndarray
    angular_momentum: np.ndarray
    image: np.ndarray
    impacts: np.ndarray
    ledger: Ledger | None = None
    present: np.ndarray | None = None

    def __repr__(self) -> str:
        return f"<Frame at {self.time:g} s: {len(self.position):,} particles>"

    @property
    def ids(self) -> np.ndarray:
        """Where in the header each of its particles is, (n,) int64."""
        return np.arange(len(self.position)) if self.present is None else self.present

    @property
    def nbytes(self) -> int:
        """Of memory; values that stand for all particles take none."""
        arrays = (value for value in vars(self).values() if isinstance(value, np.ndarray) and value.size)
        return sum(array.nbytes for array in arrays if array.strides[0])

    def some(self, most: int) -> Frame:
        """Every so manieth of its particles, so that there are ``most`` of them or fewer."""
        step = -(-len(self.position) // most)
        names = "position", "orientation", "velocity", "angular_momentum", "image", "impacts"
        return replace(self, present=self.ids[::step], **{name: getattr(self, name)[::step] for name in names})

    def rows(self, ids: np.ndarray) -> np.ndarray:
        """Where in the frame the particles with these ids (k,) are, (k,)."""
        return ids if self.present is None else np.searchsorted(self.present, ids)


def write_frame(path: Path, frame: Frame) -> None:
    """Write a frame with its ledger to a file of numpy's (.npz), to the last bit. OSError if it cannot be written."""
    assert frame.ledger is not None
    values = {name: value for name, value in vars(frame).items() if value is not None}
    np.savez(path, **{**values, "ledger": json.dumps(ledger_table(frame.ledger))})


def read_frame(path: Path) -> Frame:
    """What was written by ``write_frame``. OSError if it cannot be read."""
    with np.load(path, allow_pickle=False) as stored:
        values = {name: stored[name] for name in stored.files}
    return Frame(**{**values, "time": values["time"].item(), "ledger": ledger_of(json.loads(values["ledger"].item()))})
