"""The pictures that one is the mean of: each through other points of its pixels, with other points of lights.

The idea is that of P. Haeberli and K. Akeley, "The Accumulation Buffer", SIGGRAPH 1990.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np


class Pass(NamedTuple):
    """One of these pictures.

    Parameters
    ----------
    shift : (float, float)
        From the middle of a pixel to where it is looked through, across and up [pixels], -0.5 .. 0.5.
    lens : (float, float)
        The place on a lens of radius 1.
    turn, lift : float
        By how much lamps and directions of the sky are turned, and directions lifted, 0 .. 1.
    """

    shift: tuple[float, float]
    lens: tuple[float, float]
    turn: float
    lift: float


def passes_of(count: int) -> list[Pass]:
    """So many passes, spread evenly; one alone goes through the middle."""
    if count == 1:
        return [Pass((0.0, 0.0), (0.0, 0.0), 0.0, 0.5)]
    from scipy.stats import qmc  # noqa: PLC0415  (slow to import)

    places = qmc.Halton(6, scramble=False).random(count + 1)[1:]  # the first is a corner
    # Equal areas of a disc for equal steps.
    radius, angle = np.sqrt(places[:, 2]), 2.0 * np.pi * places[:, 3]
    lens = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
    # About the middle, so that a mean of a few stays where it is.
    shift, lens = (values - values.mean(axis=0) for values in (places[:, :2], lens))
    return [
        Pass(tuple(shift[k].tolist()), tuple(lens[k].tolist()), float(places[k, 4]), float(places[k, 5]))
        for k in range(count)
    ]


def mean_of(pictures: Iterable[np.ndarray], *, of_light: bool = False) -> np.ndarray:
    """The mean of pictures (h, w, 4) uint8: of their numbers, or of the light that these are the roots of."""
    coming = iter(pictures)
    first, count, total = next(coming), 1, None
    for picture in coming:
        if total is None:
            total = _light(first) if of_light else first.astype(np.uint32)
        total += _light(picture) if of_light else picture
        count += 1
    if total is None:
        return first
    mean = np.rint(np.sqrt(total / count)) if of_light else (total + count // 2) // count
    return mean.astype(np.uint8)


def _light(picture: np.ndarray) -> np.ndarray:
    """What a picture is the root of, uint32: see ``light.py``."""
    return np.square(picture, dtype=np.uint32)
