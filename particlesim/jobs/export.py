"""From a scene or a trajectory to the formats of other programs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from particlesim.core.arguments import checked_arguments
from particlesim.core.constants import EXPORT_ENDINGS
from particlesim.core.output_path import check_output
from particlesim.jobs.compiling import compile_kernels
from particlesim.jobs.frame_source import Progress, frame_source, opened, told
from particlesim.jobs.kept import Uses, check_kept, uses_of_shapes
from particlesim.rendering.shading.colour import fixed_colours, obstacle_colours
from particlesim.scene import Scene
from particlesim.trajectory.drawn_obstacles import drawn_obstacles
from particlesim.trajectory.export import Exported
from particlesim.trajectory.export.gltf import write_glb
from particlesim.trajectory.export.usd import usd_modules, write_usd
from particlesim.trajectory.export.vtk import check_folder, write_pvd
from particlesim.trajectory.export.xyz import write_xyz
from particlesim.trajectory.gsd_file import Trajectory

_Writer = Callable[[Path, Exported], list[Path]]
_WRITERS: dict[str, _Writer] = dict(zip(EXPORT_ENDINGS, (write_pvd, write_glb, write_usd, write_xyz), strict=True))


@checked_arguments
def export(
    source: Scene | Trajectory | str | Path,
    path: str | Path,
    *,
    frames: range | None = None,
    progress: Progress | None = None,
    threads: int | None = None,
) -> list[Path]:
    """Write a scene, simulating it, or a trajectory for other programs.

    Parameters
    ----------
    source
        A scene, a trajectory, or the path of one of them (.toml, .gsd).
    path
        Its ending says the format: .pvd (VTK), .glb (glTF), .usda (USD) or .xyz (extended XYZ).
    frames
        Numbers of the frames to write, all if None; a scene is simulated from its start to the last of them.
    progress, threads
        As for ``simulate``.

    Returns
    -------
    list of Path
        What was written; beside x.pvd there is a folder x.

    Raises
    ------
    ValueError
        For frames that are not there.
    ExportError
        For more particles than the format holds.
    MissingExtraError
        For USD without usd-core, before any work.
    OutputError, TrajectoryError, SceneError, SimulationError, OSError
        As for ``simulate``.
    """
    path = Path(path)
    check_output(path, *EXPORT_ENDINGS)
    suffix = path.suffix.lower()
    if suffix == ".usda":
        usd_modules()
    if suffix == ".pvd":
        check_folder(path)
    with opened(source) as movable:
        if isinstance(movable, Scene):
            compile_kernels(movable, None, progress)
        else:
            check_kept(movable, _uses(movable.scene, suffix))
        chosen = frame_source(movable, frames, threads, progress)
        scene, header = chosen.scene, chosen.header
        obstacles = drawn_obstacles(scene, header, obstacle_colours(scene))
        run = Exported(scene, header, told(chosen, progress), fixed_colours(scene, header), obstacles)
        return _WRITERS[suffix](path, run)


def _uses(scene: Scene, suffix: str) -> Uses:
    """What a format needs to be of any use; what else is not known is not a number in it."""
    uses = uses_of_shapes(scene)
    if suffix == ".usda":
        uses |= {"velocity": "USD", "orientation": "USD"}
    if suffix == ".glb" and any(scene.world.period):
        uses |= {"image": "glTF of a periodic world"}
    return uses
