"""Rounded shapes at the pixels of a picture where they are the nearest so far (see rasterise.py).

The surface of a rounded polyhedron is that of its core moved out by the rounding radius: offset faces, parts of the
cylinders about its edges and of the spheres about its vertices. A capsule has one edge and no face. All of each such
cylinder and sphere lies within the body, so that the nearest of them all is the surface, exactly, and none need be cut
to its part. Drawn are those of which some part faces the eye; from within the body none does.
"""

from __future__ import annotations

import math

from particlesim.core.jit import kernel
from particlesim.core.math3d import axpy, cross, dot, load_vec3, norm, scale, store_vec3, sub, to_vec3
from particlesim.rendering.visibility.rasterise_polyhedron import rasterise_polyhedron_shadow
from particlesim.rendering.visibility.rasterise_sphere import rasterise_disc, rasterise_near_sphere, rasterise_sphere
from particlesim.rendering.visibility.scan_lines import add_line, no_lines, rotated, row_between
from particlesim.rendering.visibility.screen_bounds import screen_box, whole_strip


@kernel
def rasterise_rounded(i, placed, shapes, strip, box, scratch, buffer):
    """A rounded shape anywhere about the eye, that may cover the pixels ``box``."""
    shape = shapes.shape[placed[0]]
    radius = shape.rounding * placed[1]
    _place(placed, shapes, scratch)
    _find_seen(shape, shapes.edge, radius, scratch)
    first_edge = shape.last_face - shape.first_face  # number of that primitive
    first_vertex = first_edge + shape.last_edge - shape.first_edge
    for f in range(shape.first_face, shape.last_face):
        _rasterise_face((i, f - shape.first_face), f, radius, shapes, strip, (box, scratch), buffer)
    for e in range(shape.first_edge, shape.last_edge):
        if scratch.edge_seen[e]:
            ends = load_vec3(scratch.corner, shapes.edge[e, 0]), load_vec3(scratch.corner, shapes.edge[e, 1])
            _rasterise_cylinder((i, first_edge + e - shape.first_edge), ends, radius, strip, scratch, buffer)
    for v in range(shape.first_vertex, shape.last_vertex):
        if scratch.vertex_seen[v]:
            centre, primitive = load_vec3(scratch.corner, v), first_vertex + v - shape.first_vertex
            if centre[2] > radius:
                rasterise_sphere(i, primitive, centre, radius, strip, buffer)
            elif centre[2] > -radius:
                rasterise_near_sphere(i, primitive, centre, radius, strip, buffer)


@kernel
def rasterise_rounded_shadow(placed, shapes, strip, box, scratch, inverse_depth):
    """A rounded shape in a parallel projection: its core swept by a disc that faces the light."""
    shape = shapes.shape[placed[0]]
    radius = shape.rounding * placed[1]
    _place(placed, shapes, scratch)
    if shape.first_face < shape.last_face:
        rasterise_polyhedron_shadow(placed, shapes, strip, box, scratch, inverse_depth)
    for v in range(shape.first_vertex, shape.last_vertex):
        scratch.vertex_seen[v] = False
    for e in range(shape.first_edge, shape.last_edge):
        a, b, f, g = shapes.edge[e, 0], shapes.edge[e, 1], shapes.edge[e, 2], shapes.edge[e, 3]
        # The outline of the body is that of the core moved out.
        if f < 0 or scratch.facing[f] != scratch.facing[g]:
            ends = load_vec3(scratch.corner, a), load_vec3(scratch.corner, b)
            _rasterise_ribbon(ends, radius, strip, box, scratch, inverse_depth)
            scratch.vertex_seen[a] = scratch.vertex_seen[b] = True
    for v in range(shape.first_vertex, shape.last_vertex):
        if scratch.vertex_seen[v]:
            rasterise_disc(load_vec3(scratch.corner, v), radius, strip, inverse_depth)


@kernel
def _place(placed, shapes, scratch):
    """Fill in the core's vertices and normals in view coordinates."""
    number, size, centre, m = placed
    shape = shapes.shape[number]
    for v in range(shape.first_vertex, shape.last_vertex):
        store_vec3(scratch.corner, v, axpy(centre, rotated(m, load_vec3(shapes.vertex, v)), size))
    for f in range(shape.first_face, shape.last_face):
        store_vec3(scratch.normal, f, rotated(m, to_vec3(shapes.face[f].normal)))


@kernel
def _find_seen(shape, edges, radius, scratch):
    """Find the edges and vertices of which some part of the cylinder or sphere faces the eye, which is at the origin.

    The point of a part that faces the eye most is that of the normal nearest to the direction of the eye. That is this
    direction itself if it is a normal of the part, else it lies on the rim, which the part shares with another.
    """
    for v in range(shape.first_vertex, shape.last_vertex):
        scratch.vertex_seen[v] = norm(load_vec3(scratch.corner, v)) > radius
    for e in range(shape.first_edge, shape.last_edge):
        edge = edges[e]
        a, b = load_vec3(scratch.corner, edge[0]), load_vec3(scratch.corner, edge[1])
        axis = sub(b, a)
        # The sphere at an end has the directions that no edge from there turns to.
        if dot(axis, a) < 0.0:
            scratch.vertex_seen[edge[0]] = False
        if dot(axis, b) > 0.0:
            scratch.vertex_seen[edge[1]] = False
        scratch.edge_seen[e] = _edge_seen(edge, axpy(a, axis, -dot(a, axis) / dot(axis, axis)), radius, scratch)
    for e in range(shape.first_edge, shape.last_edge):
        if scratch.edge_seen[e]:
            scratch.vertex_seen[edges[e, 0]] = scratch.vertex_seen[edges[e, 1]] = True


@kernel
def _edge_seen(edge, foot, radius, scratch):
    """Whether some of the cylinder about an edge between its faces' normals faces the eye.

    ``foot`` is the point of the edge's line that is nearest to the eye.
    """
    distance = norm(foot)
    if edge[2] < 0 or distance <= radius:
        return distance > radius
    left, right = load_vec3(scratch.normal, edge[2]), load_vec3(scratch.normal, edge[3])
    along_left, along_right, between = -dot(left, foot), -dot(right, foot), dot(left, right)
    if along_left > between * along_right and along_right > between * along_left:
        return True  # the direction of the eye is a sum of the two normals
    return max(along_left, along_right) > radius


@kernel
def _pixel_form(form, strip):
    """A linear form of view coordinates at depth 1 as a * column + b * row + c: (a, b, c)."""
    pixel = 1.0 / strip.scale
    right, up = form[0] * pixel, form[1] * pixel
    return right, up, form[2] + right * (0.5 - strip.middle_x) + up * (0.5 - strip.middle_y)


@kernel
def _put(buffer, row, column, q, label):
    """Note what a pixel sees, ``label``: instance and primitive, if it is the nearest so far."""
    if buffer.inverse_depth[row, column] < q:
        buffer.inverse_depth[row, column] = q
        buffer.id[row, column], buffer.primitive[row, column] = label


@kernel
def _rasterise_face(label, f, radius, shapes, strip, room, buffer):
    """A face of the core moved out along its normal, if it faces the eye; ``room``: its pixels' box, and scratch."""
    box, scratch = room
    face = shapes.face[f]
    normal = load_vec3(scratch.normal, f)
    at = axpy(load_vec3(scratch.corner, shapes.loop[face.last - 1]), normal, radius)
    offset = dot(normal, at)
    if offset >= 0.0:
        return
    a, b, c = _pixel_form(scale(normal, 1.0 / offset), strip)
    ends = no_lines(scratch.line)
    for k in range(face.first, face.last):
        last, at = at, axpy(load_vec3(scratch.corner, shapes.loop[k]), normal, radius)
        # The plane through the eye and an edge bounds it.
        r, u, t = _pixel_form(cross(last, at), strip)
        ends = add_line(scratch.line, ends, r, u, t)
    for row in range(box[0], box[1]):
        start, end = row_between(scratch.line, ends, row, box[2], box[3])
        for column in range(start, end):
            _put(buffer, row, column, a * column + b * row + c, label)


@kernel
def _rasterise_cylinder(label, ends, radius, strip, scratch, buffer):
    """The cylinder about a segment, without caps. The eye is farther from its axis than the radius.

    Seen along the axis, the ray d t meets a circle of radius r at p: q = 1 / t is the larger root of
    (p.p - r^2) q^2 - 2 (d.p) q + d.d = 0. The root in it is that of the product of two linear forms in d, which are 0
    on the two planes through the eye that touch the cylinder.
    """
    axis = sub(ends[1], ends[0])
    length = norm(axis)
    axis = scale(axis, 1.0 / length)
    low = dot(ends[0], axis)
    foot = axpy(ends[0], axis, -low)
    distance = norm(foot)
    per = 1.0 / ((distance - radius) * (distance + radius))
    towards, aside = scale(foot, radius / distance), scale(cross(axis, foot), 1.0 / (distance * math.sqrt(per)))
    one, other = _pixel_form(axpy(towards, aside, 1.0), strip), _pixel_form(axpy(towards, aside, -1.0), strip)
    middle, along = _pixel_form(foot, strip), _pixel_form(axis, strip)
    box, rows = _box_about(ends, radius, strip), no_lines(scratch.line)
    rows = add_line(scratch.line, add_line(scratch.line, rows, one[0], one[1], one[2]), other[0], other[1], other[2])
    for row in range(box[0], box[1]):
        start, end = row_between(scratch.line, rows, row, box[2], box[3])
        for column in range(start, end):
            square = _at(one, row, column) * _at(other, row, column)
            q = (_at(middle, row, column) + math.sqrt(max(square, 0.0))) * per
            reach = _at(along, row, column)
            if low * q <= reach <= (low + length) * q:
                _put(buffer, row, column, q, label)


@kernel
def _at(form, row, column):
    return form[0] * column + (form[1] * row + form[2])


@kernel
def _box_about(ends, radius, strip):
    """The pixels that what is within ``radius`` of a segment may cover."""
    half = radius, radius, radius
    if min(ends[0][2], ends[1][2]) <= radius:
        return whole_strip(strip)
    a, b = screen_box(ends[0], half, strip)[0], screen_box(ends[1], half, strip)[0]
    return min(a[0], b[0]), max(a[1], b[1]), min(a[2], b[2]), max(a[3], b[3])


@kernel
def _rasterise_ribbon(ends, radius, strip, box, scratch, inverse_depth):
    """A flat ribbon about a segment in a parallel projection, as wide as a cylinder: a segment swept by a disc."""
    (x, y, z), (x2, y2, z2) = ends
    dx, dy, dz = x2 - x, y2 - y, z2 - z
    square = dx * dx + dy * dy
    if square <= 1e-24 * dz * dz:
        return  # seen along the segment: the discs at its ends are all
    slope, wide = -dz / square, radius / math.sqrt(square)
    a, b, c = _pixel_form((slope * dx, slope * dy, -z - slope * (dx * x + dy * y)), strip)
    u, v = -dy * wide, dx * wide
    corners = (x - u, y - v, 1.0), (x2 - u, y2 - v, 1.0), (x2 + u, y2 + v, 1.0), (x + u, y + v, 1.0)
    rows = no_lines(scratch.line)
    for k in range(4):
        r, s, t = _pixel_form(cross(corners[k - 1], corners[k]), strip)
        rows = add_line(scratch.line, rows, r, s, t)
    for row in range(box[0], box[1]):
        start, end = row_between(scratch.line, rows, row, box[2], box[3])
        for column in range(start, end):
            inverse_depth[row, column] = max(inverse_depth[row, column], a * column + b * row + c)
