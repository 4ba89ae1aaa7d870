"""Other libraries on the same boxes, where they are installed: scipy always is."""

from __future__ import annotations

import importlib.util

import numpy as np

from particlesim.benchmarks.broad_phase.boxes import Boxes
from particlesim.benchmarks.broad_phase.measure import Found, Search

# Pairs that coal makes room for, for each box.
_PAIRS_PER_BOX = 16


def peers(kind: str) -> list[str]:
    """Names of the installed libraries that can search boxes of this kind.

    scipy's cKDTree finds points within a distance of each other: with the largest coordinate difference for the
    distance, these are the overlaps of cubes, if they are equal.
    """
    names = [] if kind == "mixed" else ["scipy cKDTree"]
    if importlib.util.find_spec("coal"):
        names.append("coal AABB tree")
    return names


def peer_search(name: str, boxes: Boxes) -> Search:
    """A search by the library ``name`` of ``peers``; the boxes are in its own form already."""
    return _scipy_search(boxes) if name == "scipy cKDTree" else _coal_search(boxes)


def _scipy_search(boxes: Boxes) -> Search:
    from scipy.spatial import cKDTree  # noqa: PLC0415  (slow to import)

    width = 2.0 * float(boxes.half[0])

    def search() -> Found:
        return Found(len(cKDTree(boxes.centre).query_pairs(width, p=np.inf, output_type="ndarray")))

    return search


def _coal_search(boxes: Boxes) -> Search:
    import coal  # noqa: PLC0415  (need not be installed)

    unturned = np.eye(3)
    objects = [
        coal.CollisionObject(coal.Box(*(2.0 * half,) * 3), unturned, centre)
        for half, centre in zip(boxes.half.tolist(), boxes.centre, strict=True)
    ]

    def search() -> Found:
        manager = coal.DynamicAABBTreeCollisionManager()
        for item in objects:
            manager.registerObject(item)
        manager.setup()
        found = coal.CollisionCallBackCollect(_PAIRS_PER_BOX * len(objects))
        manager.collide(found)
        pairs = found.numCollisionPairs()
        manager.clear()  # it refers to objects that Python may free first
        return Found(pairs)

    return search
