"""The benchmarks: whole time steps, heaps that come to rest, meshes, and pictures."""

from __future__ import annotations

from pathlib import Path

from particlesim.cli.tables import print_fields, print_heaps, print_pictures, print_speeds


def measure_steps(large: bool, figures: Path | None, quiet: bool, threads: int | None) -> None:
    """Measure, write the figures to a file if one is given, and print them."""
    from particlesim.benchmarks.steps import COUNTS, LARGE, run, write  # noqa: PLC0415
    from particlesim.cli.progress import shown_progress  # noqa: PLC0415

    with shown_progress(quiet, "measurement") as progress:
        speeds = list(run((*COUNTS, LARGE) if large else COUNTS, threads, progress))
    if figures is not None:
        write(figures, speeds)
    if not quiet:
        print_speeds(speeds)


def measure_drawing(large: bool, figures: Path | None, quiet: bool) -> None:
    """The same of drawing."""
    from particlesim.benchmarks.drawing import COUNTS, LARGE, run, write  # noqa: PLC0415
    from particlesim.cli.progress import shown_progress  # noqa: PLC0415

    with shown_progress(quiet, "measurement") as progress:
        pictures = list(run((*COUNTS, LARGE) if large else COUNTS, progress))
    if figures is not None:
        write(figures, pictures)
    if not quiet:
        print_pictures(pictures)


def measure_settling(large: bool, figures: Path | None, quiet: bool, threads: int | None) -> None:
    """The same of heaps that come to rest."""
    from particlesim.benchmarks.settling import COUNTS, LARGE, run, write  # noqa: PLC0415
    from particlesim.cli.progress import shown_progress  # noqa: PLC0415

    with shown_progress(quiet, "measurement") as progress:
        heaps = list(run((*COUNTS, LARGE) if large else COUNTS, threads, progress))
    if figures is not None:
        write(figures, heaps)
    if not quiet:
        print_heaps(heaps)


def measure_obstacles(figures: Path | None, quiet: bool, threads: int | None) -> None:
    """The same of meshes of more and more triangles."""
    from particlesim.benchmarks.obstacles import SQUARES, run, write  # noqa: PLC0415
    from particlesim.cli.progress import shown_progress  # noqa: PLC0415

    with shown_progress(quiet, "measurement") as progress:
        fields = list(run(SQUARES, threads, progress))
    if figures is not None:
        write(figures, fields)
    if not quiet:
        print_fields(fields)
