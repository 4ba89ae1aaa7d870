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


def mean_of(pictures: Iterable[np.ndarray]) -> np.ndarray:
    """The mean of pictures (h, w, 4) uint8."""
    coming = iter(pictures)
    first, count, total = next(coming), 1, None
    for picture in coming:
        total = (first.astype(np.uint32) if total is None else total) + picture
        count += 1
    return first if total is None else ((total + count // 2) // count).astype(np.uint8)
