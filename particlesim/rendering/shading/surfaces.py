"""What a picture shows, primitive by primitive, as the table from which OpenGL shades each pixel once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from particlesim.core.jit import entry_kernel, kernel, without_refcounts
from particlesim.core.math3d import (
    add,
    axpy,
    cross,
    dot,
    load_quat,
    load_vec3,
    mat_vec,
    norm,
    quat_to_matrix,
    scale,
    sub,
    to_vec3,
)
from particlesim.core.parallel import ThreadTeam
from particlesim.core.records import record
from particlesim.rendering.visibility.geometry_tables import BALL, FACETED, ROUNDED, GeometryTables, drawn_as
from particlesim.rendering.visibility.instances import Instances
from particlesim.rendering.visibility.projection import Projection
from particlesim.rendering.visibility.rasterise import VisibilityBuffer

# Edge of the tiles of the picture that are noted as showing balls, polyhedra or rounded shapes [pixels].
TILE = 16

# Rows of a ball, and of a part of a rounded shape; of a face there is one more for each of its edges.
_BALL_ROWS, _ROUNDED_ROWS, _FACE_ROWS = 2, 3, 3

# A primitive that is seen: its instance's place in ``seen``, its number in the shape, -1 for a ball, and its first row.
PART = record([("seen", "i4"), ("primitive", "i4"), ("row", "i4")])


class Surfaces(NamedTuple):
    """What is seen at the pixels of a picture.

    Parameters
    ----------
    seen : (k,) int64
        The instances that are seen.
    part : (s,) PART
        Their primitives that are seen.
    rows : int
        Rows of the table.
    tiles : (kinds, tile rows, tile columns) bool
        Which squares of TILE pixels show some drawn as BALL, as FACETED, or as ROUNDED.
    pixel : (height, width) int32
        For each pixel -1, or 4 times the first row of what it sees, plus how that is drawn.
    """

    seen: np.ndarray
    part: np.ndarray
    rows: int
    tiles: np.ndarray
    pixel: np.ndarray


def surfaces_of(buffer: VisibilityBuffer, tables: GeometryTables) -> Surfaces:
    """Number what is seen. The ids of ``buffer`` become ``pixel``: that array is taken over."""
    height, width = buffer.id.shape
    number = np.full(len(tables.body), -1, dtype=np.int32)
    seen = np.empty(min(len(number), buffer.id.size), dtype=np.int64)
    seen = seen[: _list_instances(buffer.id, number, seen)]
    primitives = _primitives(tables)[tables.body["shape"][seen]]
    # Of each primitive of each of them, one after the other, its first row.
    row_of = np.full(primitives.sum(), -1, dtype=np.int32)
    part = np.empty(len(row_of), dtype=PART)
    tiles = np.zeros((3, -(-height // TILE), -(-width // TILE)), dtype=np.bool_)
    slots = number, np.cumsum(primitives) - primitives, row_of
    found, rows = _list_primitives(buffer, tables.body, tables.shapes, slots, part, tiles)
    return Surfaces(seen, part[:found], rows, tiles, buffer.id)


def _primitives(tables: GeometryTables) -> np.ndarray:
    """How many primitives each shape has, (s,)."""
    shape = tables.shapes.shape
    faces, edges, vertices = (shape[f"last_{part}"] - shape[f"first_{part}"] for part in ("face", "edge", "vertex"))
    return np.maximum(faces, 1) + np.where((edges > 0) & (shape["rounding"] > 0.0), edges + vertices, 0)


def surface_table(surfaces: Surfaces, instances: Instances, projection: Projection, paint: np.ndarray) -> np.ndarray:
    """The table (rows, 4) float32 that shaders/surface.glsl describes.

    ``paint`` (k, 4) of the instances that are seen: linear colour, and share of the ambient light.
    """
    table = np.empty((surfaces.rows, 4), dtype=np.float32)
    camera = np.ascontiguousarray(projection.eye), np.ascontiguousarray(projection.axes[2]), projection.scale
    world = instances.position, instances.orientation, instances.tables

    def fill(_: int, first: int, last: int) -> None:
        _fill(surfaces, world, camera, paint, table, first, last)

    ThreadTeam(len(surfaces.part)).each(fill, len(surfaces.part))
    return table


@entry_kernel
def _list_instances(ids, number, seen):
    """Number the instances that pixels see, and list them; returns how many they are."""
    found, last = 0, -1
    for y in range(ids.shape[0]):
        for x in range(ids.shape[1]):
            i = ids[y, x]
            # Most pixels show what the one before them shows.
            if i != last:
                last = i
                if i >= 0 and number[i] < 0:
                    number[i] = found
                    seen[found] = i
                    found += 1
    return found


@entry_kernel
def _list_primitives(buffer, body, shapes, slots, part, tiles):
    """Write ``pixel`` in place of ids, tile by tile; returns how many primitives and rows there are."""
    buffer, shapes, slots = without_refcounts(buffer), without_refcounts(shapes), without_refcounts(slots)
    ids, primitive = buffer.id, buffer.primitive
    number, first_slot, row_of = slots
    height, width = ids.shape
    parts = rows = 0
    for tile in range(tiles[0].size):
        down, across = tile // tiles.shape[2], tile % tiles.shape[2]
        last, last_primitive, kind, told = -1, -1, BALL, -1
        for y in range(down * TILE, min(down * TILE + TILE, height)):
            for x in range(across * TILE, min(across * TILE + TILE, width)):
                i = ids[y, x]
                if i < 0:
                    continue
                if i != last or (kind != BALL and primitive[y, x] != last_primitive):
                    last, last_primitive = i, primitive[y, x]
                    shape = shapes.shape[body[i].shape]
                    kind = drawn_as(shape)
                    p = -1 if kind == BALL else last_primitive
                    slot = first_slot[number[i]] + max(p, 0)
                    if row_of[slot] < 0:
                        row_of[slot] = rows
                        part[parts].seen, part[parts].primitive, part[parts].row = number[i], p, rows
                        parts += 1
                        rows += _rows_of(shapes, shape, kind, p)
                    told = 4 * row_of[slot] + kind
                    tiles[kind, down, across] = True
                ids[y, x] = told
    return parts, rows


@kernel
def _rows_of(shapes, shape, kind, p):
    """How many rows primitive ``p`` of a shape takes."""
    if kind != FACETED:
        return _BALL_ROWS if kind == BALL else _ROUNDED_ROWS
    face = shapes.face[shape.first_face + p]
    return _FACE_ROWS + face.last - face.first


@entry_kernel
def _fill(surfaces, world, camera, paint, table, first, last):
    surfaces, world, camera = without_refcounts(surfaces), without_refcounts(world), without_refcounts(camera)
    position, orientation, tables = world
    for k in range(first, last):
        part = surfaces.part[k]
        i, start = surfaces.seen[part.seen], part.row
        centre = sub(load_vec3(position, i), to_vec3(camera[0]))
        for channel in range(4):
            table[start + 1, channel] = paint[part.seen, channel]
        body = tables.body[i]
        shape = tables.shapes.shape[body.shape]
        kind = drawn_as(shape)
        if kind == BALL:
            _put_row(table, start, centre, tables.radius[i])
        else:
            placed = body.shape, body.size, centre, quat_to_matrix(load_quat(orientation, i))
            if kind == ROUNDED:
                _put_rounded(placed, part.primitive, tables.shapes, camera, table, start)
            else:
                _put_face(placed, part.primitive, tables.shapes, camera, table, start)


@kernel
def _put_face(placed, f, shapes, camera, table, start):
    """All rows of a face but that of its paint."""
    shape, centre = shapes.shape[placed[0]], placed[2]
    f += shape.first_face
    face = shapes.face[f]
    normal, offset = _plane(placed, face)
    _put_row(table, start, normal, offset)
    facing, depth = -dot(normal, centre) / norm(centre), dot(to_vec3(camera[1]), centre)
    _put_row(table, start + 2, (facing, depth, float(face.last - face.first)), 0.0)
    start += _FACE_ROWS
    for edge in range(shape.first_edge, shape.last_edge):
        left, right = shapes.edge[edge, 2], shapes.edge[edge, 3]
        if f in (left, right):
            # How far the plane of the other face is, along this one, changes evenly over the picture too.
            other, beyond = _plane(placed, shapes.face[left + right - f])
            inward = sub(scale(normal, beyond / offset), other)
            _put_row(table, start, scale(inward, camera[2] / norm(cross(normal, other))), 0.0)
            start += 1


@kernel
def _put_rounded(placed, p, shapes, camera, table, start):
    """All rows of a part of a rounded shape but that of its paint: an offset face, a cylinder or a sphere."""
    shape = shapes.shape[placed[0]]
    radius, faces, edges = (
        shape.rounding * placed[1],
        shape.last_face - shape.first_face,
        shape.last_edge - shape.first_edge,
    )
    axis = (0.0, 0.0, 0.0)
    if p < faces:
        normal, offset = _plane(placed, shapes.face[shape.first_face + p])
        _put_row(table, start, normal, offset + radius)
    elif p < faces + edges:
        edge = shapes.edge[shape.first_edge + p - faces]
        a, b = _vertex(placed, shapes, edge[0]), _vertex(placed, shapes, edge[1])
        axis = sub(b, a)
        axis = scale(axis, 1.0 / norm(axis))
        _put_row(table, start, scale(add(a, b), 0.5), radius)
    else:
        _put_row(table, start, _vertex(placed, shapes, shape.first_vertex + p - faces - edges), radius)
    _put_row(table, start + 2, axis, dot(to_vec3(camera[1]), placed[2]))


@kernel
def _vertex(placed, shapes, v):
    """A vertex of a core in world axes, from the eye."""
    return axpy(placed[2], mat_vec(placed[3], load_vec3(shapes.vertex, v)), placed[1])


@kernel
def _plane(placed, face):
    """Unit normal of a face's plane in world axes, and its distance from the eye along that."""
    _, size, centre, m = placed
    normal = mat_vec(m, to_vec3(face.normal))
    return normal, dot(normal, centre) + face.offset * size


@kernel
def _put_row(table, number, v, w):
    table[number, 0], table[number, 1], table[number, 2], table[number, 3] = v[0], v[1], v[2], w
