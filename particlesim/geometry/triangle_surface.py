"""Surfaces made of triangles: what is odd about them, and which triangles lie beside each other."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from particlesim.geometry.tolerances import FLATTEST_TRIANGLE

# In place of a corner beyond a side: the surface ends there, or more than two triangles meet.
NONE_BEYOND = -1


class TriangleSurface(NamedTuple):
    """Triangles that may be open, closed or anything: what touches them touches either side."""

    vertices: np.ndarray  # (v, 3) float64 [m], each point once
    triangles: np.ndarray  # (t, 3) int64
    remarks: tuple[str, ...]  # what is odd about it, a line each


class Beside(NamedTuple):
    """What is beside what on a surface."""

    beyond: np.ndarray  # (t, 3) int64, the corner of the triangle beyond the side that begins at a corner
    ring_start: np.ndarray  # (v + 1,) int64, the neighbours of vertex k are ring[ring_start[k]:ring_start[k + 1]]
    ring: np.ndarray  # (2 e,) int64


def surface_of_triangles(points: np.ndarray, triangles: np.ndarray) -> TriangleSurface:
    """The surface of triangles (t, 3) between points (p, 3), which may be there more than once.

    Triangles without area, and those that are there twice, are left out. ValueError if none is left.
    """
    used, where = np.unique(triangles, return_inverse=True)
    # Adding 0 makes -0 and 0 the same.
    vertices, point = np.unique(points[used] + 0.0, axis=0, return_inverse=True)
    corners = point.reshape(-1)[where.reshape(triangles.shape)]
    flat = _are_flat(vertices[corners])
    corners = corners[~flat]
    kinds = np.sort(corners, axis=1)
    _, first = np.unique(kinds, axis=0, return_index=True)
    twice = len(corners) - len(first)
    corners = corners[np.sort(first)]
    if not len(corners):
        raise ValueError("none of its triangles has an area")
    kept, corner = np.unique(corners, return_inverse=True)
    corners = corner.reshape(corners.shape)
    said = [
        ("triangles without area, left out", int(flat.sum())),
        ("triangles that are there twice, left out once", twice),
        *_odd_sides(corners),
    ]
    return TriangleSurface(vertices[kept], corners, tuple(f"{what}: {count:,}" for what, count in said if count))


def _are_flat(corners: np.ndarray) -> np.ndarray:
    """Which of triangles (t, 3, 3) have no area but for rounding, (t,) bool."""
    sides = corners - np.roll(corners, 1, axis=1)
    longest = np.linalg.norm(sides, axis=2).max(axis=1)
    twice_area = np.linalg.norm(np.cross(sides[:, 1], sides[:, 2]), axis=1)
    return twice_area <= FLATTEST_TRIANGLE * longest * longest


def _sides(triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The sides of all triangles, (3 t, 2), and a number for the edge that each is on, (3 t,)."""
    sides = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2)
    _, edge = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True)
    return sides, edge.reshape(-1)


def _odd_sides(triangles: np.ndarray) -> list[tuple[str, int]]:
    """What may be odd about the sides of triangles, and how much of it there is."""
    sides, edge = _sides(triangles)
    count = np.bincount(edge)
    along = np.bincount(edge, weights=sides[:, 0] < sides[:, 1])
    flipped = (count == 2) & (along != 1.0)
    return [
        ("holes or borders, where the surface ends", _outlines(sides[count[edge] == 1])),
        ("edges at which more than two triangles meet", int((count > 2).sum())),
        ("edges at which one of two triangles is flipped, which does not matter", int(flipped.sum())),
    ]


def _outlines(sides: np.ndarray) -> int:
    """How many lines hang together that sides (k, 2) make."""
    from scipy.sparse import coo_array  # noqa: PLC0415
    from scipy.sparse.csgraph import connected_components  # noqa: PLC0415

    if not len(sides):
        return 0
    ends, number = np.unique(sides, return_inverse=True)
    start, end = number.reshape(-1, 2).T
    graph = coo_array((np.ones(len(sides)), (start, end)), shape=(len(ends), len(ends)))
    return int(connected_components(graph, directed=False)[0])


def beside(triangles: np.ndarray, vertices: int) -> Beside:
    """What is beside what among triangles (t, 3) of so many ``vertices``."""
    sides, edge = _sides(triangles)
    opposite = np.roll(triangles, 1, axis=1).reshape(-1)
    order = np.argsort(edge, kind="stable")
    count = np.bincount(edge)
    first = np.cumsum(count) - count
    beyond = np.full(len(sides), NONE_BEYOND)
    pairs = np.flatnonzero(count == 2)
    one, other = order[first[pairs]], order[first[pairs] + 1]
    beyond[one], beyond[other] = opposite[other], opposite[one]
    both_ways = np.unique(np.concatenate([sides, sides[:, ::-1]]), axis=0)
    ring_start = np.searchsorted(both_ways[:, 0], np.arange(vertices + 1))
    return Beside(beyond.reshape(-1, 3), ring_start, np.ascontiguousarray(both_ways[:, 1]))
