"""Runs of pixels beside each other in a row that see the same primitive, and the surface that they see."""

from __future__ import annotations

from particlesim.core.jit import kernel
from particlesim.core.math3d import axpy, load_vec3, norm, scale, sub, to_vec3
from particlesim.rendering.visibility.geometry_tables import BALL, drawn_as
from particlesim.rendering.visibility.scan_lines import rotated, view_rotation

_NOWHERE = 0.0, 0.0, 0.0


@kernel
def seen_span(close):
    """The first pixel of a row that sees something, and past the last."""
    first, last = 0, len(close)
    while first < last and close[first] <= 0.0:
        first += 1
    while first < last and close[last - 1] <= 0.0:
        last -= 1
    return first, last


@kernel
def run_from(buffer, number, first, close, tables):
    """Past the last pixel of a row that sees the same as ``first``, and how that is drawn, -1 if by no instance."""
    ids, primitive = buffer.id[number], buffer.primitive[number]
    i, p, last = ids[first], primitive[first], first + 1
    if i < 0:
        nothing = close[first] <= 0.0
        while last < len(ids) and ids[last] < 0 and (close[last] <= 0.0) == nothing:
            last += 1
        return last, -1
    kind = drawn_as(tables.shapes.shape[tables.body[i].shape])
    if kind == BALL:  # of which there is one primitive
        while last < len(ids) and ids[last] == i:
            last += 1
    else:
        while last < len(ids) and ids[last] == i and primitive[last] == p:
            last += 1
    return last, kind


@kernel
def round_form(which, centre, strip, world):
    """What ``shade_round`` wants of a ball, or of a part of a rounded shape: an offset face, a cylinder or a sphere.

    ``which``: instance, primitive, and how it is drawn; ``centre`` of the instance in view coordinates.
    """
    i, p, kind = which
    orientation, tables = world[1], world[2]
    if kind == BALL:
        return centre, _NOWHERE, 1.0 / tables.radius[i], _NOWHERE
    size, shapes, m = tables.body[i].size, tables.shapes, view_rotation(strip.axes, orientation, i)
    shape = shapes.shape[tables.body[i].shape]
    faces, edges = shape.last_face - shape.first_face, shape.last_edge - shape.first_edge
    if p < faces:
        return centre, _NOWHERE, 0.0, rotated(m, to_vec3(shapes.face[shape.first_face + p].normal))
    bend, axis = 1.0 / (shape.rounding * size), _NOWHERE
    if p < faces + edges:
        edge = shapes.edge[shape.first_edge + p - faces]
        vertex = edge[0]
        axis = sub(rotated(m, load_vec3(shapes.vertex, edge[1])), rotated(m, load_vec3(shapes.vertex, vertex)))
        axis = scale(axis, 1.0 / norm(axis))
    else:
        vertex = shape.first_vertex + p - faces - edges
    return axpy(centre, rotated(m, load_vec3(shapes.vertex, vertex)), size), axis, bend, _NOWHERE
