"""Surfaces from files: the triangles of a mesh as they are, and grids of heights."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, UnidentifiedImageError

from particlesim.geometry.mesh_file import mesh_triangles
from particlesim.geometry.shapes import Shape, triangle_mesh
from particlesim.geometry.tolerances import MAX_TRIANGLES


def surface(file: str | Path, unit: str = "m", scale: float = 1.0) -> Shape:
    """The triangles of an STL, OBJ or PLY file as they are, about the origin of its points.

    Parameters
    ----------
    file : str or Path
    unit : str
        What the numbers of the file are in: m, cm, mm, um or in.
    scale : float
        A factor on them.

    Raises
    ------
    OSError, ValueError
        If the file cannot be read, is no mesh, or has too many triangles.
    """
    path = Path(file)
    points, triangles = mesh_triangles(path, unit)
    return _named(path, scale * points, triangles)


def heightfield(file: str | Path, size: Any) -> Shape:
    """A grid of heights as triangles, two for each of its squares, about its middle.

    Columns of the grid run along x and rows, as those of a picture, against y: the first is at the far end.

    Parameters
    ----------
    file : str or Path
        A numpy array (rows, columns), or a PNG picture, in which black is 0 and white is 1.
    size : (3,) float [m]
        From the first column to the last, from the first row to the last, and the height of 1.

    Raises
    ------
    OSError, ValueError
        If the file cannot be read, or holds no grid of numbers.
    """
    path = Path(file)
    heights = _heights(path)
    rows, columns = heights.shape
    x, y = np.linspace(-0.5, 0.5, columns) * size[0], np.linspace(0.5, -0.5, rows) * size[1]
    points = np.stack([*np.meshgrid(x, y), heights * size[2]], axis=2).reshape(-1, 3)
    number = np.arange(rows * columns).reshape(rows, columns)
    far_left, far_right, left, right = (
        number[r, c].ravel() for r in (slice(-1), slice(1, None)) for c in (slice(-1), slice(1, None))
    )
    triangles = np.concatenate(
        [np.stack([left, right, far_right], axis=1), np.stack([left, far_right, far_left], axis=1)]
    )
    # That it has a border is not odd.
    return replace(_named(path, points, triangles), remarks=())


def _named(path: Path, points: np.ndarray, triangles: np.ndarray) -> Shape:
    try:
        return triangle_mesh(path.stem, points, triangles)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def _heights(path: Path) -> np.ndarray:
    """The grid of a file, (rows, columns) float64. ValueError if it holds none."""
    if not path.is_file():
        raise FileNotFoundError(f"{path}: {'is a folder' if path.is_dir() else 'no such file'}")
    ending = path.suffix.lower()
    if ending not in (".npy", ".png"):
        raise ValueError(f"{path}: must be an NPY or PNG file")
    grid = _array(path) if ending == ".npy" else _picture(path)
    if grid.ndim != 2 or min(grid.shape) < 2:
        raise ValueError(f"{path}: must hold rows and columns of heights, 2 at least, not {_dimensions(grid)}")
    if grid.size > MAX_TRIANGLES // 2:
        raise ValueError(f"{path}: has {_dimensions(grid)} heights; there may be up to {MAX_TRIANGLES // 2:,}")
    heights = grid.astype(np.float64)
    if not np.isfinite(heights).all():
        raise ValueError(f"{path}: holds numbers that are not finite")
    return heights


def _dimensions(grid: np.ndarray) -> str:
    return " x ".join(map(str, grid.shape)) or "one number"


def _array(path: Path) -> np.ndarray:
    try:
        grid = np.load(path, allow_pickle=False)
    except (ValueError, EOFError) as error:
        raise ValueError(f"{path}: is no numpy array, or damaged ({' '.join(str(error).split())})") from None
    if not isinstance(grid, np.ndarray) or grid.dtype.kind not in "biuf":
        raise ValueError(f"{path}: must hold an array of numbers")
    return grid


def _picture(path: Path) -> np.ndarray:
    """How bright a picture is, 0 to 1."""
    try:
        with Image.open(path, formats=["PNG"]) as picture:
            deep = picture.mode.startswith("I")
            grey = np.asarray(picture if deep else picture.convert("L"))
    except (UnidentifiedImageError, OSError, SyntaxError, Image.DecompressionBombError) as error:
        if isinstance(error, OSError) and error.errno is not None:
            raise
        raise ValueError(f"{path}: is no PNG picture, or damaged") from None
    return grey / (65535.0 if deep else 255.0)
