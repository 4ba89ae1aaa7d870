"""How much of the sky's light reaches each particle amidst the others: what gives a heap its depth.

The particles are taken as a fog: in each cell of a coarse grid their shadows' areas make an optical depth, which is
added up towards seventeen directions of the sky. The cells are as wide as particles are, so that light fades gently
into a crowd, and nothing flickers as particles go from cell to cell: each is shared between the eight about it.
"""

from __future__ import annotations

import math

import numpy as np

from particlesim.jit import kernel

# Cells along the world's longest side, if particles are not wider than these are.
_CELLS = 32

# Share of the sky's light under any number of particles: what they throw on each other.
_LEAST = 0.35

# How much of its own optical depth a particle meets where it is, half of the eight cells that share it: the mean over
# places in a cell and over directions, by experiment.
_OWN = 0.30

# Of more particles than this every second, third ... stands for the others too: the fog is the same.
_ENOUGH = 200_000

# Steps from cell to cell towards the sky, and to the horizon, of whose light half comes from above it.
_WAYS = np.array([(x, y, z, 1.0 if z else 0.5) for z in (1, 0) for y in (-1, 0, 1) for x in (-1, 0, 1) if x or y or z])


class Sky:
    """The sky's light in a world of ``size`` (3,) [m] about the origin, for particles of radii ``outer`` (n,) [m]."""

    def __init__(self, size: np.ndarray, outer: np.ndarray) -> None:
        typical = 2.0 * float(np.quantile(outer, 0.9)) if len(outer) else 0.0
        self._cell = max(float(np.max(size)) / _CELLS, typical)
        # One empty cell more on each side: there the light comes in.
        inside = np.ceil(np.asarray(size) / self._cell).astype(np.int64)
        self._shape = tuple(int(cells) + 3 for cells in inside)
        self._first = -0.5 * inside * self._cell - self._cell
        # Optical depth that a particle adds to one cell; a giant darkens its own cells, no more.
        self._depth = np.minimum(math.pi * outer**2 / self._cell**2, 2.0)

    def light(self, position: np.ndarray, members: np.ndarray) -> np.ndarray:
        """Share of the sky's light (k,) float64 that reaches ``members`` (k,) of the particles at ``position``."""
        fog = np.zeros(self._shape)
        places = np.ascontiguousarray(position)
        _spread(places, self._depth, self._first, self._cell, -(-len(places) // _ENOUGH) or 1, fog)
        light = np.zeros(self._shape)
        for x, y, z, weight in _WAYS:
            _shine(fog, int(x), int(y), int(z), weight / _WAYS[:, 3].sum(), light)
        return _LEAST + (1.0 - _LEAST) * _gather(places, self._depth, self._first, self._cell, light, members)


@kernel
def _cell_of(position, first, cell, i):
    """The lowest of the eight cells whose middles are about a particle, and its shares of low and high on each axis."""
    x, y, z = (
        (position[i, 0] - first[0]) / cell,
        (position[i, 1] - first[1]) / cell,
        (position[i, 2] - first[2]) / cell,
    )
    a, b, c = math.floor(x), math.floor(y), math.floor(z)
    x, y, z = x - a, y - b, z - c
    return (a, b, c), ((1.0 - x, x), (1.0 - y, y), (1.0 - z, z))


@kernel
def _spread(position, depth, first, cell, step, fog):
    """Share the optical depth of each ``step``-th particle, for all, between the eight cells that are about it."""
    for i in range(0, len(position), step):
        (a, b, c), shares = _cell_of(position, first, cell, i)
        for corner in range(8):
            right, up, high = corner & 1, corner >> 1 & 1, corner >> 2
            if _within(fog, a + right, b + up, c + high):
                share = shares[0][right] * shares[1][up] * shares[2][high]
                fog[a + right, b + up, c + high] += share * step * depth[i]


@kernel
def _within(cells, a, b, c):
    return 0 <= a < cells.shape[0] and 0 <= b < cells.shape[1] and 0 <= c < cells.shape[2]


@kernel
def _shine(fog, dx, dy, dz, weight, light):
    """Add to ``light`` what comes through the fog from one direction, cells being visited from there on."""
    nx, ny, nz = fog.shape
    length = 0.5 * math.sqrt(float(dx * dx + dy * dy + dz * dz))
    depth = np.zeros(fog.shape)
    for c in range(nz - 1, -1, -1) if dz > 0 else range(nz):
        for j in range(ny):
            b = ny - 1 - j if dy > 0 else j
            for i in range(nx):
                a = nx - 1 - i if dx > 0 else i
                p, q, r = a + dx, b + dy, c + dz
                if 0 <= p < nx and 0 <= q < ny and r < nz:
                    depth[a, b, c] = depth[p, q, r] + length * (fog[a, b, c] + fog[p, q, r])
                light[a, b, c] += weight * math.exp(-depth[a, b, c])


@kernel
def _gather(position, depth, first, cell, light, members):
    """The light at each member's place, without the shadow of its own."""
    out = np.empty(len(members))
    for k in range(len(members)):
        i = members[k]
        (a, b, c), shares = _cell_of(position, first, cell, i)
        here = 0.0
        for corner in range(8):
            right, up, high = corner & 1, corner >> 1 & 1, corner >> 2
            share = shares[0][right] * shares[1][up] * shares[2][high]
            # Outside all is light: what flies out of an open world comes into it within a cell, not at once.
            there = _within(light, a + right, b + up, c + high)
            here += share * (light[a + right, b + up, c + high] if there else 1.0)
        out[k] = min(here * math.exp(_OWN * depth[i]), 1.0)
    return out
