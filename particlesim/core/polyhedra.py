"""Polyhedra that have no parameters: the one place to add another, for scene files and for the catalogue of shapes.

Vertices of size 1 (edge 1) in any order; a shape is their convex hull about its centroid.
"""

from math import sqrt

import numpy as np

POLYHEDRA: dict[str, np.ndarray] = {
    "cube": np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]),
    "tetrahedron": np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]) / sqrt(8.0),
}
