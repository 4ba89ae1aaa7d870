"""A tree over the triangles of a mesh: which of them are near a box.

It is a complete binary tree: node 1 holds all, the children of node k are 2 k and 2 k + 1. The triangles of a node lie
in a row, and its children hold the halves of them that are lower and higher along the axis in which their middles
spread most. So neither pointers nor ranges are stored, only boxes, and what follows a node is told by its number.
"""

from __future__ import annotations

import numpy as np

from particlesim.core.jit import kernel
from particlesim.geometry.tolerances import TRIANGLES_OF_LEAF


def leaves_for(count: int) -> int:
    """How many leaves the tree of so many triangles has: a power of two."""
    leaves = 1
    while leaves * TRIANGLES_OF_LEAF < count:
        leaves *= 2
    return leaves


def tree_order(corners: np.ndarray) -> np.ndarray:
    """The order in which a tree holds triangles, (t,), that have ``corners`` (t, 3, 3)."""
    count = len(corners)
    middle, order, nodes = corners.mean(axis=1), np.arange(count), 1
    while nodes < leaves_for(count):
        starts = np.arange(nodes) * count // nodes
        node = np.repeat(np.arange(nodes), np.diff(np.append(starts, count)))
        there = middle[order]
        spread = np.maximum.reduceat(there, starts) - np.minimum.reduceat(there, starts)
        along = there[np.arange(count), spread.argmax(axis=1)[node]]
        order = order[np.lexsort((along, node))]
        nodes *= 2
    return order


def tree_boxes(corners: np.ndarray) -> np.ndarray:
    """The boxes of all nodes, (2 leaves, 6): lower and upper corners; of triangles (t, 3, 3) in the order of the tree.

    Row 0 is no node.
    """
    count, leaves = len(corners), leaves_for(len(corners))
    starts = np.arange(leaves) * count // leaves
    box = np.empty((2 * leaves, 6))
    box[0] = 0.0
    box[leaves:, :3] = np.minimum.reduceat(corners.min(axis=1), starts)
    box[leaves:, 3:] = np.maximum.reduceat(corners.max(axis=1), starts)
    level = leaves
    while level > 1:
        pairs = box[level : 2 * level].reshape(-1, 2, 6)
        level //= 2
        box[level : 2 * level, :3] = pairs[:, :, :3].min(axis=1)
        box[level : 2 * level, 3:] = pairs[:, :, 3:].max(axis=1)
    return box


@kernel
def boxes_meet(box, row, lower, upper):
    """Whether a row of ``box`` (n, 6) has a point in common with a box."""
    return (
        box[row, 0] <= upper[0]
        and lower[0] <= box[row, 3]
        and box[row, 1] <= upper[1]
        and lower[1] <= box[row, 4]
        and box[row, 2] <= upper[2]
        and lower[2] <= box[row, 5]
    )


@kernel
def _after(node):
    """The node after a node and all below it: its sibling, or that of the next one above; 0 if none is left."""
    node += 1
    while node & 1 == 0:
        node >>= 1
    return node if node > 1 else 0


@kernel
def next_leaf(box, tree, leaf, lower, upper):
    """The leaf after ``leaf`` whose box meets a box, the first if that is 0; 0 if there is none.

    ``tree`` is (row of node 1 in ``box`` less 1, leaves).
    """
    begin, leaves = tree
    node = _after(leaf) if leaf > 0 else 1
    while node > 0:
        if not boxes_meet(box, begin + node, lower, upper):
            node = _after(node)
        elif node >= leaves:
            break
        else:
            node *= 2
    return node


@kernel
def triangles_of(leaf, leaves, count):
    """The triangles of a leaf: the first, past the last."""
    k = leaf - leaves
    return k * count // leaves, (k + 1) * count // leaves
