"""Faces that are plane but for rounding made plane: corners that belong to three faces or more, moved together."""

from __future__ import annotations

import numpy as np
from scipy.sparse import block_array, coo_array, eye_array
from scipy.sparse.linalg import spsolve

from particlesim.geometry.faces import Faces, face_normals
from particlesim.geometry.tolerances import FLAT_FACE

# Newton steps in which the corners of faces come into their planes: each squares what they are off by.
_MAX_NEWTON_STEPS = 8

# Square of the singular value [1] of those equations below which it counts as 0: they are numbers of the order of 1.
_DEPENDENT = 1e-12


def made_plane(name: str, corners: np.ndarray, faces: Faces) -> np.ndarray:
    """Corners moved as little as possible so that those of each face lie in one plane.

    Newton's method on normal . corner = offset for every corner of every face that is not a triangle, in the least
    change of corners, normals and offsets: corners that are off by 1e-6 are in their planes after two steps.
    ValueError if they do not come to be.
    """
    loops = [loop for loop in faces if len(loop) > 3]
    if not loops:
        return corners
    centre, scale = corners.mean(axis=0), np.ptp(corners, axis=0).max()
    x = (corners - centre) / scale
    normals = face_normals(x, loops)
    face = np.repeat(np.arange(len(loops)), [len(loop) for loop in loops])
    corner = np.array([v for loop in loops for v in loop], dtype=np.int64)
    offsets = np.bincount(face, np.einsum("ij,ij->i", normals[face], x[corner])) / np.bincount(face)
    for _ in range(_MAX_NEWTON_STEPS):
        off = np.einsum("ij,ij->i", normals[face], x[corner]) - offsets[face]
        if np.abs(off).max(initial=0.0) <= FLAT_FACE:
            return x * scale + centre
        change = _least_change(_plane_equations(x, normals, face, corner), np.concatenate([-off, np.zeros(len(loops))]))
        of_x, of_normals, of_offsets = np.split(change, [x.size, x.size + normals.size])
        x, normals, offsets = x + of_x.reshape(-1, 3), normals + of_normals.reshape(-1, 3), offsets + of_offsets
    raise ValueError(f"the faces of '{name}' cannot be made plane")


def _plane_equations(x: np.ndarray, normals: np.ndarray, face: np.ndarray, corner: np.ndarray) -> coo_array:
    """How normal . corner - offset of each row (face, corner), and normal . normal / 2 of each face, change.

    With the coordinates of all corners, then those of all normals, then the offsets.
    """
    rows, planes, axes = np.arange(len(corner)), np.arange(len(normals)), np.arange(3)
    last = x.size + normals.size
    blocks = (
        (normals[face], rows, 3 * corner[:, None] + axes),
        (x[corner], rows, x.size + 3 * face[:, None] + axes),
        (np.full((len(rows), 1), -1.0), rows, last + face[:, None]),
        (normals, len(rows) + planes, x.size + 3 * planes[:, None] + axes),
    )
    values = np.concatenate([value.ravel() for value, _, _ in blocks])
    row = np.concatenate([np.repeat(row, value.shape[1]) for value, row, _ in blocks])
    column = np.concatenate([column.ravel() for _, _, column in blocks])
    return coo_array((values, (row, column)), shape=(len(rows) + len(planes), last + len(planes)))


def _least_change(system: coo_array, wanted: np.ndarray) -> np.ndarray:
    """The least vector c with ``system`` @ c = ``wanted``, from c = system^T y.

    Solved for c and y at once, which stays sparse where a face of many corners would make the product of the matrices
    full. Corners of more than three faces leave equations that depend on others: y is kept from growing without bound.
    """
    equations, unknowns = system.shape
    saddle = block_array([[eye_array(unknowns), system.T], [system, -_DEPENDENT * eye_array(equations)]], format="csc")
    return spsolve(saddle, np.concatenate([np.zeros(unknowns), wanted]))[:unknowns]
