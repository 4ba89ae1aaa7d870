"""What commands on scenes share: reading the scene, doing the work with progress, judging what came of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from particlesim.cli.errors import fail
from particlesim.cli.render_options import frames_asked
from particlesim.cli.tables import print_summary
from particlesim.core.constants import MOVIE_ENDINGS

if TYPE_CHECKING:
    from particlesim.jobs.summary import Summary
    from particlesim.scene import Scene
    from particlesim.trajectory.gsd_file import Trajectory


def load(source: Path) -> Scene:
    """The scene of a file. SceneError if it is wrong."""
    from particlesim.scene.file import SceneError, load_scene  # noqa: PLC0415

    if source.suffix.lower() in MOVIE_ENDINGS and source.is_file():
        what = "holds pictures, not the run that they are of: give its scene (.toml) or trajectory (.gsd)"
        raise SceneError(what, file=source)
    if source.suffix.lower() == ".gsd":
        raise SceneError("must be a scene file (TOML)", file=source)
    return load_scene(source)


@contextmanager
def run_asked(source: Path, frames: str | None, every: str | None) -> Iterator[tuple[Scene | Trajectory, range]]:
    """The scene or the trajectory of a file, and the numbers of the frames asked for.

    SceneError or TrajectoryError if it cannot be read, OptionError for frames that there are not.
    """
    subject = source if source.suffix.lower() == ".gsd" else load(source)
    from particlesim.jobs.frame_source import opened  # noqa: PLC0415
    from particlesim.scene import Scene  # noqa: PLC0415

    with opened(subject) as run:
        yield run, frames_asked(run.frames if isinstance(run, Scene) else len(run), frames, every)


def make_file(
    make: Callable[..., Summary], source: Any, path: Path, quiet: bool, threads: int | None, max_drift: float | None
) -> None:
    """Make a movie or a trajectory, showing progress and what it amounted to."""
    from particlesim.cli.progress import shown_progress  # noqa: PLC0415

    with shown_progress(quiet) as progress:
        summary = make(source, path, progress=progress, threads=threads)
    if not quiet:
        print_summary(summary, path)
    _check_drift(summary, path, max_drift)


def _check_drift(summary: Summary, path: Path, allowed: float | None) -> None:
    """Exit with a line if more energy came or went than is allowed. The output stays: it shows what went wrong."""
    drift = summary.forbidden_energy_drift
    # The other way round a drift that is not a number would pass.
    if allowed is not None and not drift <= allowed:
        way = "drifted" if summary.elastic else "rose"
        fail(f"{path}: written, but its energy {way} by {drift:.1e} of all of it, more than {allowed:g}", 3)
