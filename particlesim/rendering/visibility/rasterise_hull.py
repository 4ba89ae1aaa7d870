"""Hulls at the pixels of a picture: where they are the nearest so far (see visibility.py).

Along a row of pixels the closeness of a plane changes evenly. The planes that face the one who looks bound that of the
hull from above, the others from below. Its outline are the edges where one of these meets one of those: on the line
through such an edge both are as close.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from particlesim.core.jit import kernel
from particlesim.core.math3d import load_quat, mat_transposed_vec, quat_to_matrix, to_vec3
from particlesim.rendering.visibility.geometry_tables import Bodies
from particlesim.rendering.visibility.rasterise_sphere import pixels


class Hull(NamedTuple):
    """Room for what is worked out of one hull after the other, of at most p planes and e edges.

    ``sides`` (p, 3): closeness of each plane as right * column + up * row + there; ``facing`` (p,) whether it faces
    the one who looks; ``bound`` (p,) int64: the planes that are looked at; ``here`` (p, 2): how close these are in a
    row, as there + right * column; ``lines`` (e, 2): those that bound a row, at offset + slope * row: the left ones
    first, the right ones last.
    """

    sides: np.ndarray
    facing: np.ndarray
    bound: np.ndarray
    here: np.ndarray
    lines: np.ndarray


def room_for(bodies: Bodies) -> Hull:
    """Room for any of these particles."""
    p, e = len(bodies.planes), len(bodies.edges)
    return Hull(np.empty((p, 3)), np.empty(p, np.bool_), np.empty(p, np.int64), np.empty((p, 2)), np.empty((e, 2)))


@kernel
def turned(axes, orientation, i):
    """The matrix from a particle's own axes to those of the one who looks, row by row."""
    own = quat_to_matrix(load_quat(orientation, i))
    return (
        mat_transposed_vec(own, to_vec3(axes[0])),
        mat_transposed_vec(own, to_vec3(axes[1])),
        mat_transposed_vec(own, to_vec3(axes[2])),
    )


@kernel
def plane_of(m, planes, f):
    """Normal of a plane in the axes of the one who looks, and its distance from the middle for size 1."""
    a, b, c = planes[f, 0], planes[f, 1], planes[f, 2]
    return (
        m[0][0] * a + m[0][1] * b + m[0][2] * c,
        m[1][0] * a + m[1][1] * b + m[1][2] * c,
        m[2][0] * a + m[2][1] * b + m[2][2] * c,
        planes[f, 3],
    )


@kernel
def _put_sides(i, x, y, z, m, bodies, parallel, window, hull):
    """Fill in the sides of a hull; returns how many are looked at: those before it, in a parallel view behind."""
    middle_x, middle_y, scale, _, _ = window
    shape, size = bodies.shape[i], bodies.size[i]
    first, count, pixel = bodies.first_plane[shape], 0, 1.0 / scale
    for f in range(bodies.first_plane[shape + 1] - first):
        nx, ny, nz, h = plane_of(m, bodies.planes, first + f)
        offset = nx * x + ny * y + nz * z + h * size
        if parallel:
            # A plane seen from its edge is as good as one that turns away a little.
            nz = nz if abs(nz) > 1e-9 else 1e-9
            faces, per, there = nz < 0.0, 1.0 / nz, -offset / nz
        else:
            tiny = 1e-9 * size
            offset = offset if abs(offset) > tiny else tiny
            faces, per, there = offset < 0.0, 1.0 / offset, nz / offset
        right, up = nx * per * pixel, ny * per * pixel
        hull.sides[f, 0], hull.sides[f, 1] = right, up
        hull.sides[f, 2] = there + right * (0.5 - middle_x) + up * (0.5 - middle_y)
        hull.facing[f] = faces
        if faces != parallel:
            hull.bound[count] = f
            count += 1
    return count


@kernel
def _put_lines(bodies, shape, hull):
    """Fill in the lines of an outline; returns how many are left ones, and the first of the right ones."""
    left, right = 0, len(hull.lines)
    for edge in range(bodies.first_edge[shape], bodies.first_edge[shape + 1]):
        f, g = bodies.edges[edge, 0], bodies.edges[edge, 1]
        if hull.facing[f] != hull.facing[g]:
            if hull.facing[g]:
                f, g = g, f
            # Where this is not below 0 the hull may be.
            a = hull.sides[f, 0] - hull.sides[g, 0]
            b = hull.sides[f, 1] - hull.sides[g, 1]
            c = hull.sides[f, 2] - hull.sides[g, 2]
            per = -1.0 / (a if a != 0.0 else 1e-300)
            if per < 0.0:
                place = left
                left += 1
            else:
                right -= 1
                place = right
            hull.lines[place, 0], hull.lines[place, 1] = c * per, b * per
    return left, right


@kernel
def _put_outline(i, x, y, z, m, bodies, parallel, window, hull):
    """Fill in sides and lines of a hull: how many sides are looked at, how many left lines, the first right one."""
    count = _put_sides(i, x, y, z, m, bodies, parallel, window, hull)
    left, right = _put_lines(bodies, bodies.shape[i], hull)
    return count, left, right


@kernel
def _put_row(hull, outline, row, first, last):
    """Fill in how close the planes are in a row; the pixels whose middles see the hull: the first, past the last."""
    count, left, right = outline
    start, end = -np.inf, np.inf
    for line in range(left):
        start = max(start, hull.lines[line, 0] + hull.lines[line, 1] * row)
    for line in range(right, len(hull.lines)):
        end = min(end, hull.lines[line, 0] + hull.lines[line, 1] * row)
    begin, beyond = pixels(start, end, first, last) if start <= end else (first, first)
    for k in range(count if begin < beyond else 0):
        f = hull.bound[k]
        hull.here[k, 0], hull.here[k, 1] = hull.sides[f, 1] * row + hull.sides[f, 2], hull.sides[f, 0]
    return begin, beyond


@kernel
def trace_hull(i, x, y, z, m, bodies, window, box, hull, close, owner, face):
    """A hull before the eye."""
    outline = _put_outline(i, x, y, z, m, bodies, False, window, hull)
    for row in range(box[0], box[1]):
        start, end = _put_row(hull, outline, row, box[2], box[3])
        for column in range(start, end):
            most, nearest = np.inf, 0
            for k in range(outline[0]):
                q = hull.here[k, 0] + hull.here[k, 1] * column
                if q < most:
                    most, nearest = q, k
            if close[row, column] < most:
                close[row, column] = most
                owner[row, column] = i
                face[row, column] = hull.bound[nearest]


@kernel
def trace_hull_beside(i, x, y, z, m, bodies, window, hull, close, owner, face):
    """A hull that reaches beside the eye: any pixel may see it. None does from within."""
    planes = bodies.first_plane[bodies.shape[i] + 1] - bodies.first_plane[bodies.shape[i]]
    if not _put_sides(i, x, y, z, m, bodies, False, window, hull):
        return
    for row in range(len(close)):
        for column in range(window[3], window[4]):
            # Behind the eye closeness is below 0.
            most, least, nearest = np.inf, 0.0, 0
            for f in range(planes):
                q = hull.sides[f, 0] * column + hull.sides[f, 1] * row + hull.sides[f, 2]
                if not hull.facing[f]:
                    least = max(least, q)
                elif q < most:
                    most, nearest = q, f
            if least < most and close[row, column] < most:
                close[row, column] = most
                owner[row, column] = i
                face[row, column] = nearest


@kernel
def cast_hull(i, x, y, z, m, bodies, window, box, hull, close):
    """A hull in the light hides it from what is behind its rear."""
    outline = _put_outline(i, x, y, z, m, bodies, True, window, hull)
    for row in range(box[0], box[1]):
        start, end = _put_row(hull, outline, row, box[2], box[3])
        for column in range(start, end):
            rear = -np.inf
            for k in range(outline[0]):
                rear = max(rear, hull.here[k, 0] + hull.here[k, 1] * column)
            close[row, column] = max(close[row, column], rear)
