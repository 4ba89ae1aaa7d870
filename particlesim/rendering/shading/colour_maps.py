"""Maps of colours whose lightness grows evenly from one end to the other, on any background."""

from __future__ import annotations

import numpy as np
from PIL import ImageColor

# Seventeen evenly spaced colours of each of these maps of matplotlib's: viridis, plasma, inferno and magma of S. van
# der Walt and N. Smith (2015, public domain), cividis of J. Nunez, C. Anderton and R. Renslow (PLOS ONE 13, e0199239,
# 2018). They stand here because importing matplotlib takes as long as drawing some ten pictures.
_MAPS = {
    "viridis": (
        "#440154", "#48186a", "#472d7b", "#424086", "#3b528b", "#33638d", "#2c728e", "#26818e", "#21908c",
        "#1f9f88", "#28ae80", "#3ebc74", "#5dc963", "#82d34c", "#abdc32", "#d5e21a", "#fde725",
    ),
    "plasma": (
        "#0d0887", "#310596", "#4c02a1", "#6600a7", "#7e03a8", "#9511a2", "#a92396", "#bb3587", "#cb4778",
        "#d9596a", "#e66c5c", "#f07f4f", "#f89441", "#fdab33", "#fdc328", "#f9dd25", "#f0f921",
    ),
    "inferno": (
        "#000004", "#0b0724", "#210c4a", "#3c0965", "#57106d", "#70196e", "#89226a", "#a32b61", "#bb3755",
        "#d14644", "#e35932", "#f1711e", "#f98d0a", "#fcab0f", "#f9ca32", "#f2e865", "#fcffa4",
    ),
    "magma": (
        "#000004", "#0a0822", "#1d1146", "#36106a", "#50127c", "#691c81", "#822681", "#9c2e7f", "#b63779",
        "#cf4170", "#e65163", "#f5695c", "#fb8761", "#fea571", "#fec387", "#fde0a2", "#fcfdbf",
    ),
    "cividis": (
        "#00224e", "#002e6a", "#1a386f", "#32436d", "#434e6c", "#52596d", "#61656f", "#6f7073", "#7c7b78",
        "#8b8778", "#9b9376", "#aba072", "#bbad6c", "#ccba64", "#ddc958", "#efd748", "#fee838",
    ),
}  # fmt: skip

# Colours of a map have at least this contrast with a dark background: (L + 0.05) / (L' + 0.05), as in WCAG 2.2.
_CONTRAST, _FLARE = 2.5, 0.05

# More of a map than this is not left out for it.
_MOST_LEFT_OUT = 0.6


def encoded(colour: str) -> np.ndarray:
    """A colour name or '#rrggbb' as sRGB 0 .. 1, (3,) float64."""
    return np.array(ImageColor.getrgb(colour)[:3]) / 255.0


def map_colours(fraction: np.ndarray, name: str, background: np.ndarray) -> np.ndarray:
    """sRGB 0 .. 1 (n, 3) of numbers (n,) 0 .. 1, in colours whose lightness grows with the number.

    The first part of the map ``name`` is left out where it could hardly be seen on the ``background``, sRGB (3,).
    """
    begin = _begin(name, background)
    return _of_whole(begin + (1.0 - begin) * np.asarray(fraction), name)


def _of_whole(fraction: np.ndarray, name: str) -> np.ndarray:
    colours = np.array([encoded(colour) for colour in _MAPS[name]])
    place = np.linspace(0.0, 1.0, len(colours))
    return np.column_stack([np.interp(fraction, place, channel) for channel in colours.T])


def _begin(name: str, background: np.ndarray) -> float:
    """How much of a map is to be left out."""
    part = np.linspace(0.0, _MOST_LEFT_OUT, 64)
    contrast = (luminance(_of_whole(part, name)) + _FLARE) / (luminance(background[None]) + _FLARE)
    # On what is light all of the map is seen; on what is as light as its middle no part of it would help.
    return float(part[np.argmax(contrast >= _CONTRAST)]) if contrast[-1] >= _CONTRAST else 0.0


def luminance(colours: np.ndarray) -> np.ndarray:
    """Relative luminance 0 .. 1 (n,) of sRGB colours 0 .. 1 (n, 3), as WCAG 2.2 has it."""
    linear = np.where(colours <= 0.04045, colours / 12.92, ((colours + 0.055) / 1.055) ** 2.4)
    return linear @ np.array([0.2126, 0.7152, 0.0722])
