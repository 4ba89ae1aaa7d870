"""How much of the sky's light reaches each particle amidst the others: what gives a heap its depth.

The particles are taken as a fog: in each cell of a coarse grid their shadows' areas make an optical depth, which is
added up towards seventeen directions of the sky. The cells are as wide as particles are, so that light fades gently
into a crowd, and nothing flickers as particles go from cell to cell: each is shared between the eight about it.
"""

from __future__ import annotations

import math

import numpy as np

from particlesim.core.jit import kernel
from particlesim.rendering.visibility.instances import EVERYONE

# Cells along the world's longest side, if particles are not wider than these are.
_CELLS = 32

# Share of the sky's light under any number of particles: what they throw on each other.
_LEAST = 0.35

# How much of its own optical depth a particle meets where it is, half of the eight cells that share it: the mean over
# places in a cell and over directions, by experiment.
_OWN = 0.30

# Of more particles than this every second, third ... stands for the others too: the fog is the same.
_ENOUGH = 200_000

# Steps from cell to cell towards the sky, and to the horizon, of whose light half comes from above it; their weights.
_STEPS = [(x, y, z) for z in (1, 0) for y in (-1, 0, 1) for x in (-1, 0, 1) if x or y or z]
_WAYS = [(x, y, z, (1.0 if z else 0.5) / 13.0) for x, y, z in _STEPS]


class Sky:
    """The sky's light in a world of ``size`` (3,) [m] about the origin, for particles of radii ``outer`` (n,) [m]."""

    def __init__(self, size: np.ndarray, outer: np.ndarray) -> None:
        typical = 2.0 * float(np.quantile(outer, 0.9)) if len(outer) else 0.0
        self._cell = max(float(np.max(size)) / _CELLS, typical)
        # Two empty cells more on each side, layer by layer from below: where light comes in, and where all is light.
        inside = np.ceil(np.asarray(size) / self._cell).astype(np.int64)
        self._shape = tuple(int(cells) + 5 for cells in inside[::-1])
        self._first = -0.5 * inside * self._cell - 2.0 * self._cell
        # Optical depth that a particle adds to one cell; a giant darkens its own cells, no more.
        self._depth = np.minimum(math.pi * outer**2 / self._cell**2, 2.0)

    def light(self, position: np.ndarray, members: np.ndarray, whose: slice | np.ndarray = EVERYONE) -> np.ndarray:
        """Share of the sky's light (k,) float64 that reaches ``members`` (k,) of those at ``position`` (m, 3).

        ``whose`` (m,) particle each is an image of (see cast.py).
        """
        depth = self._depth[whose]
        fog = np.zeros(self._shape)
        places = np.ascontiguousarray(position)
        _spread(places, depth, self._first, self._cell, -(-len(places) // _ENOUGH) or 1, fog)
        # What passes half a cell along the edges of cells, their faces' diagonals and their own.
        inner = (slice(1, -1),) * 3
        clear = [np.exp(-0.5 * math.sqrt(square) * fog[inner]) for square in (1, 2, 3)]
        light = np.ones(self._shape)
        light[inner] = sum(weight * _shine(clear[x * x + y * y + z * z - 1], (x, y, z)) for x, y, z, weight in _WAYS)
        return _LEAST + (1.0 - _LEAST) * _gather(places, depth, self._first, self._cell, light, members)


@kernel
def _cell_of(position, first, cell, i):
    """The lowest of the eight cells whose middles are about a particle, and how far it is on to the next, each axis."""
    x, y, z = (
        (position[i, 0] - first[0]) / cell,
        (position[i, 1] - first[1]) / cell,
        (position[i, 2] - first[2]) / cell,
    )
    a, b, c = math.floor(x), math.floor(y), math.floor(z)
    return (a, b, c), (x - a, y - b, z - c)


@kernel
def _share(way, corner):
    """Of a particle so far on its way between eight cells, the share of one: three bits, 1 for beyond."""
    right, up, high = corner & 1, corner >> 1 & 1, corner >> 2
    return (way[0] if right else 1.0 - way[0]) * (way[1] if up else 1.0 - way[1]) * (way[2] if high else 1.0 - way[2])


@kernel
def _within(cells, corner):
    """Whether this cell and the seven beyond it are there."""
    a, b, c = corner
    return 0 <= a < cells.shape[2] - 1 and 0 <= b < cells.shape[1] - 1 and 0 <= c < cells.shape[0] - 1


@kernel
def _spread(position, depth, first, cell, step, fog):
    """Share the optical depth of each ``step``-th particle, for all, between the eight cells that are about it."""
    for i in range(0, len(position), step):
        lowest, way = _cell_of(position, first, cell, i)
        if _within(fog, lowest):
            mine = step * depth[i]
            for corner in range(8):
                right, up, high = corner & 1, corner >> 1 & 1, corner >> 2
                fog[lowest[2] + high, lowest[1] + up, lowest[0] + right] += _share(way, corner) * mine


@kernel
def _shine(clear, way):
    """Share of the light from one direction that comes to each cell, these being visited from there on."""
    nz, ny, nx = clear.shape
    dx, dy, dz = way
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


@kernel
def _gather(position, depth, first, cell, light, members):
    """The light at each member's place, without the shadow of its own."""
    out = np.ones(len(members))
    for k in range(len(members)):
        i = members[k]
        lowest, way = _cell_of(position, first, cell, i)
        if _within(light, lowest):
            here = 0.0
            for corner in range(8):
                right, up, high = corner & 1, corner >> 1 & 1, corner >> 2
                here += _share(way, corner) * light[lowest[2] + high, lowest[1] + up, lowest[0] + right]
            out[k] = min(here * math.exp(_OWN * depth[i]), 1.0)
    return out
