"""Where frames come from: a scene as it is simulated, or a trajectory as it is read."""

from __future__ import annotations

import bisect
import itertools
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import numpy as np

from particlesim.jobs.partial_run import PartialRun
from particlesim.scene import Scene
from particlesim.scene.file import load_scene
from particlesim.simulation.estimate import check_end
from particlesim.simulation.simulation import Simulation
from particlesim.simulation.soundness import check_energy
from particlesim.trajectory.frames import Frame, Header, Ledger, read_frame, write_frame
from particlesim.trajectory.gsd_file import Trajectory

# Memory for frames that are simulated before the first is drawn [bytes], and how many are looked at.
_AHEAD = 2**28
_SPREAD = 33

# Particles of a stored frame that are looked at for it: what few go beyond is told by these.
_LOOKED_AT = 250_000

# Where a run of a scene keeps its first frame, which scales and changes refer to.
_FIRST = "first.npz"

# Called with what is going on, how many frames are done, and how many there will be.
Progress = Callable[[str, int, int], None]


# Frames with their numbers; None in place of one that is still being simulated, where a run may be left.
Frames = Iterator[tuple[int, Frame | None]]


class FrameSource(NamedTuple):
    """A scene, what stays the same about its particles, and their frames."""

    scene: Scene
    header: Header
    first: Frame  # of the whole run: what scales and changes refer to
    frames: Frames  # all that are simulated or read
    total: int  # how many there are of them
    wanted: range  # numbers of those that are to be drawn
    phase: str  # what takes the time until the next
    simulation: Simulation | None = None  # where it is, while it gives frames
    trajectory: Trajectory | None = None  # that they are read from, if they are
    begin: int = 0  # how many of the wanted ones lie before, in other parts of a movie; others may lie after ``total``

    @property
    def drawn(self) -> range:
        """Numbers of the frames that are drawn here: the wanted ones, or the part of them."""
        part = self.wanted[self.begin : self.total]
        return part if len(part) < len(self.wanted) else self.wanted


def frames_ahead(
    source: FrameSource, frames: Frames, progress: Progress | None, kept: int
) -> tuple[Frames, list[Frame]]:
    """The frames of a source but the ``kept`` first, and those that tell how particles fare in the whole run.

    They are spread over the whole of a trajectory; a scene is simulated ahead, as far as memory is to be had.
    """
    if source.trajectory is not None:
        stored = source.trajectory
        return frames, [stored[k].some(_LOOKED_AT) for k in _spread_over(len(stored))]
    whole = ((number, frame) for number, frame in frames if frame is not None)
    held = []
    for number, frame in itertools.islice(whole, max(1, _AHEAD // max(source.first.nbytes, 1))):
        held.append((number, frame))
        tell(progress, source.phase, number + 1, source.total)
    sample = [held[k][1] for k in _spread_over(len(held))]
    return frames_after(itertools.chain(held, whole), kept), sample


def frames_after(frames: Frames, kept: int) -> Frames:
    """The frames of a simulation but the ``kept`` first: one that begins anew gives these again."""
    return itertools.dropwhile(lambda numbered: numbered[0] < kept, frames)


@contextmanager
def opened(source: Scene | Trajectory | str | Path) -> Iterator[Scene | Trajectory]:
    """A scene or a trajectory, which is read, or opened for the block, if its path is given: scenes end in .toml.

    SceneError or TrajectoryError if it is none.
    """
    if not isinstance(source, str | Path):
        yield source
    elif Path(source).suffix.lower() == ".toml":
        yield load_scene(source)
    else:
        with Trajectory(source) as trajectory:
            yield trajectory


def frame_source(
    source: Scene | Trajectory,
    wanted: range | None,
    threads: int | None,
    progress: Progress | None,
    run: PartialRun | None = None,
    part: range | None = None,
) -> FrameSource:
    """All frames of a scene up to the last wanted one; of a trajectory those alone. None stands for all.

    Those that ``run`` kept are left out, unless it kept no state of the simulation that gives them. ``part``: places
    among the wanted frames of a trajectory of those that are drawn here. ValueError for frames that are not there.
    """
    kept = run.kept["done"] if run is not None and run.kept else 0
    if isinstance(source, Trajectory):
        wanted = _among(wanted, len(source))
        part = part or range(len(wanted))
        stored = ((k, source[k]) for k in wanted[max(kept, part.start) : part.stop])
        header, first = source.header, source[0]
        return FrameSource(
            source.scene,
            header,
            first,
            stored,
            part.stop,
            wanted,
            "reading",
            trajectory=source,
            begin=part.start,
        )
    wanted = _among(wanted, source.frames)
    if run is not None and run.state:
        simulation, first = Simulation.load(run.state, threads=threads), read_frame(run.folder / _FIRST)
    else:
        simulation, kept = start(source, threads, progress), 0
        first = simulation.frame()
        if run is not None:
            write_frame(run.folder / _FIRST, first)
    total = max(wanted) + 1
    frames = frames_of(simulation, first.ledger, total, kept)
    return FrameSource(source, simulation.header, first, frames, total, wanted, "simulating", simulation)


def frame_source_until(
    time: float, source: Scene | Trajectory, threads: int | None, progress: Progress | None
) -> FrameSource:
    """The frames of a scene up to ``time`` [s] and the particles at that very time; or a trajectory's nearest frame."""
    if isinstance(source, Trajectory):
        nearest = _nearest(source, time)
        return frame_source(source, range(nearest, nearest + 1), threads, progress)
    simulation = start(source, threads, progress)
    before = source.frame_at(time) + 1

    def frames() -> Frames:
        yield from frames_of(simulation, first.ledger, before)
        simulation.run_until(time)
        yield before, simulation.frame()

    last, first = range(before, before + 1), simulation.frame()
    return FrameSource(source, simulation.header, first, frames(), before + 1, last, "simulating")


def start(scene: Scene, threads: int | None, progress: Progress | None) -> Simulation:
    """The simulation of a scene. SceneError if it cannot be built."""
    tell(progress, "preparing", 0, scene.frames)
    simulation = Simulation(scene, threads=threads)
    check_end(simulation)
    return simulation


def frames_of(simulation: Simulation, first: Ledger | None, total: int, begin: int = 0) -> Frames:
    """Frames ``begin`` to ``total`` - 1 of a scene and their numbers: at time zero and at every tick of its movie.

    SimulationError where one cannot be, such as for its energy after that of the ``first``.
    """
    for k in range(begin, total):
        end = simulation.scene.time_of(k)
        while simulation.time < end:
            simulation.step_towards(end)
            if simulation.time < end:
                yield k, None
        frame = simulation.frame()
        if first is not None and frame.ledger is not None:
            check_energy(simulation.scene, simulation.model, first, frame.ledger)
        yield k, frame
        del frame  # millions of particles need the memory


def told(source: FrameSource, progress: Progress | None) -> Iterator[Frame]:
    """The wanted frames of a source; all are told as they pass."""
    for number, frame in source.frames:
        if frame is not None:
            if number in source.wanted:
                yield frame
            tell(progress, source.phase, number + 1, source.total)


def tell(progress: Progress | None, phase: str, done: int, total: int) -> None:
    """Say how far the work is, if it is to be said."""
    if progress is not None:
        progress(phase, done, total)


def _spread_over(count: int) -> list[int]:
    """Some of ``count`` numbers, the first and the last among them."""
    return [int(k) for k in np.unique(np.linspace(0, count - 1, _SPREAD).round())]


def _among(wanted: range | None, total: int) -> range:
    """The wanted ones of ``total`` frames. ValueError if there are none, or no such ones."""
    if wanted is None:
        return range(total)
    if not wanted or min(wanted) < 0 or max(wanted) >= total:
        raise ValueError(f"frames must be some of 0 to {total - 1}, not {wanted}")
    return wanted


def _nearest(trajectory: Trajectory, time: float) -> int:
    """The frame whose time is nearest to ``time`` [s]."""
    after = bisect.bisect_left(range(len(trajectory) - 1), time, key=trajectory.time)
    return min(range(max(after - 1, 0), after + 1), key=lambda k: abs(trajectory.time(k) - time))
