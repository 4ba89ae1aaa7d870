"""Convex polyhedra at the pixels of a picture where they are the nearest so far (see rasterise.py).

Along a row of pixels the inverse depth of a plane changes evenly. The planes that face the eye bound that of the
polyhedron from above, the others from below. Its outline are the edges where one of these meets one of those: on the
line through such an edge both are as near.
"""

from __future__ import annotations

import numpy as np

from particlesim.core.jit import kernel
from particlesim.core.math3d import to_vec3
from particlesim.geometry.shape_links import faces_beside
from particlesim.rendering.visibility.scan_lines import add_line, no_lines, rotated, row_between

# So many planes are gone through at each pixel. Among more the one is sought from that of the pixel before, from face
# to face: where a ray meets a plane beyond the border of its face, it meets that of the face beside it later.
_FEW_PLANES = 16


@kernel
def rasterise_polyhedron(i, placed, shapes, strip, box, scratch, buffer):
    """A polyhedron before the eye."""
    outline, first = _project(placed, shapes, strip, scratch), shapes.shape[placed[0]].first_face
    if outline[0] > _FEW_PLANES:
        _walk_rows(i, placed[0], shapes, (True, outline), box, scratch, buffer)
        return
    for row in range(box[0], box[1]):
        start, end = _project_row(scratch, outline, row, box[2], box[3])
        for column in range(start, end):
            most, nearest = np.inf, 0
            for k in range(outline[0]):
                q = scratch.row_plane[k, 0] + scratch.row_plane[k, 1] * column
                if q < most:
                    most, nearest = q, k
            if buffer.inverse_depth[row, column] < most:
                buffer.inverse_depth[row, column] = most
                buffer.id[row, column] = i
                buffer.primitive[row, column] = scratch.bounding[nearest] - first


@kernel
def rasterise_near_polyhedron(i, placed, shapes, strip, scratch, buffer):
    """A polyhedron that reaches beside the eye: any pixel may see it. None does from within."""
    shape = shapes.shape[placed[0]]
    if not _project_planes(placed, shapes, strip, scratch):
        return
    for row in range(len(buffer.inverse_depth)):
        for column in range(strip.first, strip.last):
            # Behind the eye inverse depth is below 0.
            most, least, nearest = np.inf, 0.0, 0
            for f in range(shape.first_face, shape.last_face):
                q = scratch.plane[f, 0] * column + scratch.plane[f, 1] * row + scratch.plane[f, 2]
                if not scratch.facing[f]:
                    least = max(least, q)
                elif q < most:
                    most, nearest = q, f
            if least < most and buffer.inverse_depth[row, column] < most:
                buffer.inverse_depth[row, column] = most
                buffer.id[row, column] = i
                buffer.primitive[row, column] = nearest - shape.first_face


@kernel
def rasterise_polyhedron_shadow(placed, shapes, strip, box, scratch, inverse_depth):
    """A polyhedron in a parallel projection, by the faces that it turns away."""
    outline = _project(placed, shapes, strip, scratch)
    if outline[0] > _FEW_PLANES:
        _walk_rows_of_shadow(placed[0], shapes, (False, outline), box, scratch, inverse_depth)
        return
    for row in range(box[0], box[1]):
        start, end = _project_row(scratch, outline, row, box[2], box[3])
        for column in range(start, end):
            rear = -np.inf
            for k in range(outline[0]):
                rear = max(rear, scratch.row_plane[k, 0] + scratch.row_plane[k, 1] * column)
            inverse_depth[row, column] = max(inverse_depth[row, column], rear)


@kernel
def _project_planes(placed, shapes, strip, scratch):
    """Fill in the planes; returns how many bound it on the side looked at: the near one, in parallel the rear."""
    number, size, (x, y, z), m = placed
    shape = shapes.shape[number]
    count, pixel = 0, 1.0 / strip.scale
    for f in range(shape.first_face, shape.last_face):
        face = shapes.face[f]
        nx, ny, nz = rotated(m, to_vec3(face.normal))
        offset = nx * x + ny * y + nz * z + face.offset * size
        if strip.parallel:
            # A plane seen from its edge is as good as one that turns away a little.
            nz = nz if abs(nz) > 1e-9 else 1e-9
            faces, per, there = nz < 0.0, 1.0 / nz, -offset / nz
        else:
            tiny = 1e-9 * size
            offset = offset if abs(offset) > tiny else tiny
            faces, per, there = offset < 0.0, 1.0 / offset, nz / offset
        right, up = nx * per * pixel, ny * per * pixel
        scratch.plane[f, 0], scratch.plane[f, 1] = right, up
        scratch.plane[f, 2] = there + right * (0.5 - strip.middle_x) + up * (0.5 - strip.middle_y)
        scratch.facing[f] = faces
        if faces != strip.parallel:
            scratch.bounding[count] = f
            count += 1
    return count


@kernel
def _project(placed, shapes, strip, scratch):
    """Fill in planes and outline: how many planes bound the side looked at, and the ends of the lines."""
    count = _project_planes(placed, shapes, strip, scratch)
    shape, ends = shapes.shape[placed[0]], no_lines(scratch.line)
    for edge in range(shape.first_edge, shape.last_edge):
        f, g = shapes.edge[edge, 2], shapes.edge[edge, 3]
        if scratch.facing[f] != scratch.facing[g]:
            if scratch.facing[g]:
                f, g = g, f
            # Where the one that faces the eye is as near as the other or nearer the polyhedron may be.
            a = scratch.plane[f, 0] - scratch.plane[g, 0]
            b = scratch.plane[f, 1] - scratch.plane[g, 1]
            c = scratch.plane[f, 2] - scratch.plane[g, 2]
            ends = add_line(scratch.line, ends, a, b, c)
    return count, ends


@kernel
def _project_row(scratch, outline, row, first, last):
    """Fill in the planes in a row; the pixels whose middles see the polyhedron: the first, past the last."""
    count, ends = outline
    begin, beyond = row_between(scratch.line, ends, row, first, last)
    for k in range(count if begin < beyond else 0):
        f = scratch.bounding[k]
        scratch.row_plane[k, 0] = scratch.plane[f, 1] * row + scratch.plane[f, 2]
        scratch.row_plane[k, 1] = scratch.plane[f, 0]
    return begin, beyond


@kernel
def _at(plane, f, row, column):
    return plane[f, 0] * column + (plane[f, 1] * row + plane[f, 2])


@kernel
def _walk(shapes, beside, f, front, scratch, row, column):
    """The plane that bounds a polyhedron at a pixel, by a walk from face ``f``, and its inverse depth there.

    Of those that face the eye, ``front``, the farthest; of the others the nearest.
    """
    best, q = f, _at(scratch.plane, f, row, column)
    for _ in range(len(scratch.plane)):  # rounding could lead round in a circle
        here = best
        for k in range(shapes.face[here].first, shapes.face[here].last):
            other = shapes.link[beside + k]
            if scratch.facing[other] == front:
                there = _at(scratch.plane, other, row, column)
                if (there < q) == front and there != q:
                    best, q = other, there
        if best == here:
            break
    return best, q


@kernel
def _walk_rows(i, shape, shapes, outline, box, scratch, buffer):
    """As ``rasterise_polyhedron``, of one of many faces, which are projected."""
    front, (_, ends) = outline
    f, first, beside = scratch.bounding[0], shapes.shape[shape].first_face, faces_beside(shapes, shape)
    for row in range(box[0], box[1]):
        begin, beyond = row_between(scratch.line, ends, row, box[2], box[3])
        for column in range(begin, beyond):
            f, q = _walk(shapes, beside, f, front, scratch, row, column)
            if buffer.inverse_depth[row, column] < q:
                buffer.inverse_depth[row, column] = q
                buffer.id[row, column] = i
                buffer.primitive[row, column] = f - first


@kernel
def _walk_rows_of_shadow(shape, shapes, outline, box, scratch, inverse_depth):
    """As ``rasterise_polyhedron_shadow``, of one of many faces, which are projected."""
    front, (_, ends) = outline
    f, beside = scratch.bounding[0], faces_beside(shapes, shape)
    for row in range(box[0], box[1]):
        begin, beyond = row_between(scratch.line, ends, row, box[2], box[3])
        for column in range(begin, beyond):
            f, q = _walk(shapes, beside, f, front, scratch, row, column)
            inverse_depth[row, column] = max(inverse_depth[row, column], q)
