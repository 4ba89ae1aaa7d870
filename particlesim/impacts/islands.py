"""Islands: particles whose impacts hang together. What happens in one does not touch the others."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from particlesim.jit import kernel


class Islands(NamedTuple):
    """The members of island ``k`` are ``member[start[k]:start[k + 1]]``, in ascending order, as are the islands."""

    start: np.ndarray  # (k + 1,) int64
    member: np.ndarray  # (m,) int64


@kernel
def _island_of(island, i):
    """The smallest particle of an island; on the way each particle is led there more directly."""
    while island[i] != i:
        island[i] = island[island[i]]
        i = island[i]
    return i


@kernel
def _unite(island, met):
    """Join the islands of particles that meet; ``island`` (n,) leads from each to a smaller one or itself.

    (R. E. Tarjan, Journal of the ACM 22 (1975) 215-225.)
    """
    for k in range(len(met)):
        i, j = met[k, 0], met[k, 1]
        if j >= 0:
            a, b = _island_of(island, i), _island_of(island, j)
            island[max(a, b)] = min(a, b)


@kernel
def _settle(island, particles):
    """Let each of the particles point to the smallest of its island itself."""
    for i in particles:
        island[i] = _island_of(island, i)


def unite(island: np.ndarray, met: np.ndarray, particles: np.ndarray) -> Islands:
    """Join the islands of pairs that meet, and gather all those of the ``particles`` (ascending) that these concern.

    ``island`` (n,) is brought up to date for all ``particles``, which must hold all that ever met anything.
    """
    _unite(island, met)
    _settle(island, particles)
    concerned = np.unique(island[met[:, 0]])
    roots = island[particles]
    chosen = np.isin(roots, concerned) if len(concerned) < len(roots) else np.ones(len(roots), dtype=np.bool_)
    roots, member = roots[chosen], particles[chosen]
    order = np.argsort(roots, kind="stable")
    roots, member = roots[order], member[order]
    edges = np.flatnonzero(np.diff(roots, prepend=-1, append=-1))
    return Islands(edges, member)
