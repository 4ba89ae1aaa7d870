"""Ambient occlusion: how much of the light from everywhere reaches each body amidst the others.

The bodies are taken as a fog: in each cell of a coarse grid their cross-sections make an optical depth, which is
added up towards seventeen directions. The cells are as wide as bodies are, so that light fades gently into a heap, and
nothing flickers as bodies go from cell to cell: each is shared between the eight about it.
"""

from __future__ import annotations

import math

import numpy as np

from particlesim.core.jit import entry_kernel, kernel
from particlesim.rendering.visibility.instances import ALL_BODIES

# Cells along the world's longest side, if bodies are not wider than these are.
_CELLS = 32

# Share of the ambient light under any number of bodies: what they reflect on each other.
_LEAST = 0.5

# Share of its own optical depth that a body adds at its centroid, from half of the eight cells that share it: the mean
# over places in a cell and over directions, by experiment.
_OWN = 0.30

# Of more bodies than this every second, third ... stands for the others too: the fog is the same.
_ENOUGH = 200_000

# Steps from cell to cell upwards, and to the horizon, of whose light half comes from above it; their weights.
_STEPS = [(x, y, z) for z in (1, 0) for y in (-1, 0, 1) for x in (-1, 0, 1) if x or y or z]
_DIRECTIONS = [(x, y, z, (1.0 if z else 0.5) / 13.0) for x, y, z in _STEPS]


class AmbientOcclusion:
    """The ambient light in a world about the origin.

    Parameters
    ----------
    size : (3,) float64
        Edges of the world [m].
    radius : (n,) float64
        Bounding radii of the bodies [m].
    """

    def __init__(self, size: np.ndarray, radius: np.ndarray) -> None:
        typical = 2.0 * float(np.quantile(radius, 0.9)) if len(radius) else 0.0
        self._cell = max(float(np.max(size)) / _CELLS, typical)
        # Two empty cells more on each side, layer by layer from below: where light comes in, and where all is light.
        inside = np.ceil(np.asarray(size) / self._cell).astype(np.int64)
        self._shape = tuple(int(cells) + 5 for cells in inside[::-1])
        self._first = -0.5 * inside * self._cell - 2.0 * self._cell
        # Optical depth that a body adds to one cell; a giant darkens its own cells, no more.
        self._depth = np.minimum(math.pi * radius**2 / self._cell**2, 2.0)

    def light(self, position: np.ndarray, indices: np.ndarray, source: slice | np.ndarray = ALL_BODIES) -> np.ndarray:
        """Share of the ambient light, (k,) float64, that reaches the instances ``indices`` (k,).

        Parameters
        ----------
        position : (m, 3) float64
            Centroids of all instances [m].
        indices : (k,) int64
        source : slice or (m,) int64
            The body that each is an image of (see instances.py).
        """
        depth = self._depth[source]
        fog = np.zeros(self._shape)
        places = np.ascontiguousarray(position)
        _spread(places, depth, self._first, self._cell, -(-len(places) // _ENOUGH) or 1, fog)
        # What passes half a cell along the edges of cells, their faces' diagonals and their own.
        inner = (slice(1, -1),) * 3
        clear = [np.exp(-0.5 * math.sqrt(square) * fog[inner]) for square in (1, 2, 3)]
        light = np.ones(self._shape)
        light[inner] = sum(
            weight * _shine(clear[x * x + y * y + z * z - 1], (x, y, z)) for x, y, z, weight in _DIRECTIONS
        )
        return _LEAST + (1.0 - _LEAST) * _gather(places, depth, self._first, self._cell, light, indices)


@kernel
def _cell_of(position, first, cell, i):
    """The lowest of the eight cells whose middles are about a body, and how far it is on to the next, each axis."""
    x, y, z = (
        (position[i, 0] - first[0]) / cell,
        (position[i, 1] - first[1]) / cell,
        (position[i, 2] - first[2]) / cell,
    )
    a, b, c = math.floor(x), math.floor(y), math.floor(z)
    return (a, b, c), (x - a, y - b, z - c)


@kernel
def _weight(part, corner):
    """Trilinear weight of one of eight cells, ``part`` of the way from the lowest; ``corner``: a bit an axis."""
    right, up, high = corner & 1, corner >> 1 & 1, corner >> 2
    x, y, z = part
    return (x if right else 1.0 - x) * (y if up else 1.0 - y) * (z if high else 1.0 - z)


@kernel
def _within(cells, corner):
    """Whether this cell and the seven beyond it are there."""
    a, b, c = corner
    return 0 <= a < cells.shape[2] - 1 and 0 <= b < cells.shape[1] - 1 and 0 <= c < cells.shape[0] - 1


@entry_kernel
def _spread(position, depth, first, cell, step, fog):
    """Share the optical depth of each ``step``-th body, for all, between the eight cells that are about it."""
    for i in range(0, len(position), step):
        lowest, part = _cell_of(position, first, cell, i)
        if _within(fog, lowest):
            own = step * depth[i]
            for corner in range(8):
                right, up, high = corner & 1, corner >> 1 & 1, corner >> 2
                fog[lowest[2] + high, lowest[1] + up, lowest[0] + right] += _weight(part, corner) * own


@entry_kernel
def _shine(clear, direction):
    """Share of the light from one direction that comes to each cell, these being visited from there on."""
    nz, ny, nx = clear.shape
    dx, dy, dz = direction
    share = np.ones(clear.shape)
    for k in range(dz, nz):
        c = nz - 1 - k
        for j in range(abs(dy), ny):
            b = ny - 1 - j if dy > 0 else j
            for i in range(abs(dx), nx):
                a = nx - 1 - i if dx > 0 else i
                p, q, r = a + dx, b + dy, c + dz
                share[c, b, a] = share[r, q, p] * clear[c, b, a] * clear[r, q, p]
    return share


@entry_kernel
def _gather(position, depth, first, cell, light, indices):
    """The light at each of the instances ``indices``, without its own shadow."""
    out = np.ones(len(indices))
    for k in range(len(indices)):
        i = indices[k]
        lowest, part = _cell_of(position, first, cell, i)
        if _within(light, lowest):
            here = 0.0
            for corner in range(8):
                right, up, high = corner & 1, corner >> 1 & 1, corner >> 2
                here += _weight(part, corner) * light[lowest[2] + high, lowest[1] + up, lowest[0] + right]
            out[k] = min(here * math.exp(_OWN * depth[i]), 1.0)
    return out
