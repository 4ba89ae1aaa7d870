"""What the rasterisers of polyhedra and rounded shapes share: placed shapes, scratch room, and rows between lines.

A shape is ``placed``: its number in the table, size [m], centroid in view coordinates [m], and its rotation, the rows
of the matrix from body axes to view axes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from particlesim.core.jit import kernel
from particlesim.core.math3d import dot, load_quat, mat_transposed_vec, quat_to_matrix, sub, to_vec3
from particlesim.geometry.shape_table import ShapeTable
from particlesim.rendering.visibility.screen_bounds import integer_range


class Scratch(NamedTuple):
    """Room for what is worked out of one shape after the other, at the rows that its faces ... have in the table.

    Parameters
    ----------
    plane : (f, 3) float64
        Inverse depth of each face's plane as plane[0] * column + plane[1] * row + plane[2].
    facing : (f,) bool
        Whether it faces the eye.
    bounding : (f,) int64
        The faces that bound a polyhedron on the side that is looked at.
    row_plane : (f, 2) float64
        Inverse depth of these in a row, as row_plane[0] + row_plane[1] * column.
    line : (e or more, 2) float64
        Lines that bound a row, at line[0] + line[1] * row: the left ones first, the right ones last.
    corner : (v, 3) float64
        Vertices of a rounded shape's core in view coordinates [m].
    normal : (f, 3) float64
        Outward normals of its faces in view coordinates.
    edge_seen : (e,) bool
        Whether the cylinder about each edge has a patch that faces the eye.
    vertex_seen : (v,) bool
        The same of the spheres about its vertices.
    """

    plane: np.ndarray
    facing: np.ndarray
    bounding: np.ndarray
    row_plane: np.ndarray
    line: np.ndarray
    corner: np.ndarray
    normal: np.ndarray
    edge_seen: np.ndarray
    vertex_seen: np.ndarray


def scratch_for(shapes: ShapeTable) -> Scratch:
    """Room for any of these shapes."""
    f, e, v = len(shapes.face), len(shapes.edge), len(shapes.vertex)
    return Scratch(
        plane=np.empty((f, 3)),
        facing=np.empty(f, np.bool_),
        bounding=np.empty(f, np.int64),
        row_plane=np.empty((f, 2)),
        line=np.empty((max(e, 4), 2)),  # a strip about an edge has four
        corner=np.empty((v, 3)),
        normal=np.empty((f, 3)),
        edge_seen=np.empty(e, np.bool_),
        vertex_seen=np.empty(v, np.bool_),
    )


@kernel
def in_view(strip, v):
    """A place in view coordinates."""
    v = sub(v, to_vec3(strip.eye))
    return dot(to_vec3(strip.axes[0]), v), dot(to_vec3(strip.axes[1]), v), dot(to_vec3(strip.axes[2]), v)


@kernel
def view_rotation(axes, orientation, i):
    """The matrix from an instance's body axes to view axes, row by row."""
    m = quat_to_matrix(load_quat(orientation, i))
    return (
        mat_transposed_vec(m, to_vec3(axes[0])),
        mat_transposed_vec(m, to_vec3(axes[1])),
        mat_transposed_vec(m, to_vec3(axes[2])),
    )


@kernel
def rotated(m, v):
    """A vector in body axes, seen in view axes."""
    a, b, c = v[0], v[1], v[2]
    return (
        m[0][0] * a + m[0][1] * b + m[0][2] * c,
        m[1][0] * a + m[1][1] * b + m[1][2] * c,
        m[2][0] * a + m[2][1] * b + m[2][2] * c,
    )


@kernel
def no_lines(line):
    """The ends of no lines yet (see ``add_line``)."""
    return 0, len(line)


@kernel
def add_line(line, ends, a, b, c):
    """Bound the rows to where a * column + b * row + c is not below 0; returns the new ends.

    ``ends``: how many left lines there are, and the first of the right ones.
    """
    left, right = ends
    per = -1.0 / (a if a != 0.0 else 1e-300)
    if per < 0.0:
        place = left
        left += 1
    else:
        right -= 1
        place = right
    line[place, 0], line[place, 1] = c * per, b * per
    return left, right


@kernel
def row_between(line, ends, row, first, last):
    """The columns of ``first .. last`` whose middles lie between the lines in a row: first, past last."""
    left, right = ends
    start, end = -np.inf, np.inf
    for k in range(left):
        start = max(start, line[k, 0] + line[k, 1] * row)
    for k in range(right, len(line)):
        end = min(end, line[k, 0] + line[k, 1] * row)
    return integer_range(start, end, first, last) if start <= end else (first, first)
