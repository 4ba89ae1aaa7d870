"""Figures, drawn without a screen: SVG and PNG."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from particlesim.core.atomic_write import atomic_write

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Colours that people who confuse red and green can tell apart: M. Okabe, K. Ito, "Color Universal Design", 2008.
BLUE, ORANGE, GREEN, PURPLE = "#0072B2", "#D55E00", "#009E73", "#CC79A7"
AMBER, SKY, YELLOW = "#E69F00", "#56B4E9", "#F0E442"
GREYS = ("#7F7F7F", "#B0B0B0", "#E6E6E6")

# The two files of a figure, and what keeps the time at which it was made out of them.
_SUFFIXES = {".svg": {"Date": None}, ".png": {}}


def new_figure(width: float, height: float) -> Figure:
    """An empty figure of this size [inch], apart from any window; notebooks show it."""
    from particlesim.core.notebook_figure import NotebookFigure  # noqa: PLC0415  (matplotlib is slow to import)

    return NotebookFigure(figsize=(width, height), layout="constrained")


def save_figure(figure: Figure, path: Path) -> list[Path]:
    """Write SVG, with text as text and nothing of this moment in it, and PNG; each appears whole or not at all.

    ``path`` is that of either; the other lies beside it. Both are returned.
    """
    from matplotlib import rc_context  # noqa: PLC0415

    written = []
    for suffix, metadata in _SUFFIXES.items():
        with (
            rc_context({"svg.fonttype": "none", "svg.hashsalt": "particlesim"}),
            atomic_write(path.with_suffix(suffix)) as hidden,
        ):
            figure.savefig(hidden, dpi=110, metadata=metadata)
        written.append(path.with_suffix(suffix))
    return written
