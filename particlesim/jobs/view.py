"""From a scene or a trajectory to a page that shows it in a browser."""

from __future__ import annotations

import html
from pathlib import Path

from particlesim.core.arguments import checked_arguments
from particlesim.core.atomic_write import atomic_write
from particlesim.core.output_path import check_output
from particlesim.jobs.compiling import compile_kernels
from particlesim.jobs.frame_source import Progress, frame_source, frames_ahead, opened, told
from particlesim.jobs.kept import check_kept, uses_of_pictures
from particlesim.rendering.shading.colour import ParticleColours
from particlesim.rendering.shading.fields import is_settled_by_frames
from particlesim.rendering.web.page import check_size, page
from particlesim.scene import Scene
from particlesim.trajectory.gsd_file import Trajectory


class Page:
    """A page of HTML that shows a run. A notebook shows it in place."""

    def __init__(self, text: str, frames: int) -> None:
        self.text, self._frames = text, frames

    def __repr__(self) -> str:
        return f"<Page: {self._frames:,} frames, {len(self.text) / 1e6:.1f} MB>"

    def _repr_html_(self) -> str:
        inside = html.escape(self.text)
        return f'<iframe srcdoc="{inside}" style="width: 100%; aspect-ratio: 16/9; border: 0"></iframe>'


@checked_arguments
def view(
    source: Scene | Trajectory | str | Path,
    path: str | Path | None = None,
    *,
    frames: range | None = None,
    progress: Progress | None = None,
    threads: int | None = None,
) -> Page:
    """Make a page of HTML that shows a scene, simulating it, or a trajectory: played, turned, asked for numbers.

    Parameters
    ----------
    source
        A scene, a trajectory, or the path of one of them (.toml, .gsd).
    path
        Where to write it, which must end in .html; nowhere if None.
    frames
        Numbers of the frames that it shows, all if None; a scene is simulated from its start to the last of them.
    progress, threads
        As for ``simulate``.

    Returns
    -------
    Page
        The page; in a notebook it shows itself.

    Raises
    ------
    PageError
        For more frames of more particles than a page holds, before any work.
    ValueError
        For frames that are not there.
    OutputError, TrajectoryError, SceneError, SimulationError, OSError
        As for ``simulate``.
    """
    if path is not None:
        check_output(path, ".html")
    with opened(source) as movable:
        if isinstance(movable, Scene):
            check_size(movable.number, len(frames) if frames is not None else movable.frames)
            compile_kernels(movable, None, progress)
        else:
            check_kept(movable, {**uses_of_pictures(movable.scene), "orientation": "a page", "velocity": "a page"})
        chosen = frame_source(movable, frames, threads, progress)
        check_size(len(chosen.header.shape), len(chosen.wanted))
        coming, sample = chosen.frames, [chosen.first]
        if is_settled_by_frames(chosen.scene):
            coming, sample = frames_ahead(chosen, coming, progress, 0)
        colours = ParticleColours(chosen.scene, chosen.header, sample)
        shown = list(told(chosen._replace(frames=coming), progress))
        made = Page(page(chosen.scene, chosen.header, chosen.first, shown, colours), len(shown))
    if path is not None:
        with atomic_write(path) as hidden:
            hidden.write_text(made.text)
    return made
