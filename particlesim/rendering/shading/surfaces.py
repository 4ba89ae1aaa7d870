"""What a picture shows, spheres and faces of hulls, as the table from which OpenGL shades each pixel once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from particlesim.core.jit import kernel, without_refcounts
from particlesim.core.math3d import cross, dot, load_quat, load_vec3, mat_vec, norm, quat_to_matrix, scale, sub, to_vec3
from particlesim.core.parallel import ThreadTeam
from particlesim.rendering.visibility.geometry_tables import Bodies
from particlesim.rendering.visibility.projection import Outlook
from particlesim.rendering.visibility.rasterise import Sight

# Edge of the squares of the picture that are noted as showing spheres, or hulls [pixels].
TILE = 16

# Rows of a sphere; of a face there is one more for each of its edges.
_BALL_ROWS, _FACE_ROWS = 2, 3


class Surfaces(NamedTuple):
    """What is seen of particles at the pixels of a picture.

    ``seen`` (k,) int64: the particles; ``parts`` (s, 3) int32: of each surface its particle's place in ``seen``, its
    face, -1 for a sphere, and its first row in the table, of ``rows`` in all; ``balls`` and ``hulls`` bool: squares of
    TILE pixels that show some. ``first_row`` (height, width) int32: that of the sphere at each pixel, -2 minus that of
    the face of a hull, or -1.
    """

    seen: np.ndarray
    parts: np.ndarray
    rows: int
    balls: np.ndarray
    hulls: np.ndarray
    first_row: np.ndarray


def surfaces_of(sight: Sight, bodies: Bodies) -> Surfaces:
    """Number what is seen. The owners of ``sight`` become first rows: that array is taken over."""
    height, width = sight.owner.shape
    number = np.full(len(bodies.shape), -1, dtype=np.int32)
    seen = np.empty(min(len(number), sight.owner.size), dtype=np.int64)
    seen = seen[: _list_particles(sight.owner, number, seen)]
    faces = np.maximum(np.diff(bodies.first_plane)[bodies.shape[seen]], 1)
    # Of each face of each of them, one after the other, its first row.
    row_of = np.full(faces.sum(), -1, dtype=np.int32)
    parts = np.empty((len(row_of), 3), dtype=np.int32)
    balls, hulls = np.zeros((2, -(-height // TILE), -(-width // TILE)), dtype=np.bool_)
    found, rows = _list_surfaces(sight, bodies, number, np.cumsum(faces) - faces, row_of, parts, balls, hulls)
    return Surfaces(seen, parts[:found], rows, balls, hulls, sight.owner)


def table_of(
    surfaces: Surfaces,
    bodies: Bodies,
    outlook: Outlook,
    position: np.ndarray,
    orientation: np.ndarray,
    paint: np.ndarray,
) -> np.ndarray:
    """The table (rows, 4) float32 that shaders/surface.glsl describes.

    ``position`` (n, 3) and ``orientation`` (n, 4) of all particles; ``paint`` (k, 4) of those that are seen: linear
    colour, and share of the sky's light.
    """
    table = np.empty((surfaces.rows, 4), dtype=np.float32)
    eye, ahead = np.ascontiguousarray(outlook.eye), np.ascontiguousarray(outlook.axes[2])

    def fill(_: int, first: int, last: int) -> None:
        _fill(surfaces, bodies, eye, ahead, outlook.scale, position, orientation, paint, table, first, last)

    ThreadTeam(len(surfaces.parts)).each(fill, len(surfaces.parts))
    return table


@kernel
def _list_particles(owner, number, seen):
    """Number those who own pixels, and list them; returns how many they are."""
    found, last = 0, -1
    for y in range(owner.shape[0]):
        for x in range(owner.shape[1]):
            i = owner[y, x]
            # Most pixels show what the one before them shows.
            if i != last:
                last = i
                if i >= 0 and number[i] < 0:
                    number[i] = found
                    seen[found] = i
                    found += 1
    return found


@kernel
def _list_surfaces(sight, bodies, number, first_slot, row_of, parts, balls, hulls):
    """Write first rows in place of owners, tile by tile; returns how many surfaces and rows there are."""
    sight, bodies = without_refcounts(sight), without_refcounts(bodies)
    owner, face = sight.owner, sight.face
    height, width = owner.shape
    surfaces = rows = 0
    for tile in range(balls.size):
        down, across = tile // balls.shape[1], tile % balls.shape[1]
        any_ball = any_hull = False
        last, last_face, told = -1, -1, -1
        for y in range(down * TILE, min(down * TILE + TILE, height)):
            for x in range(across * TILE, min(across * TILE + TILE, width)):
                i = owner[y, x]
                if i < 0:
                    continue
                if i != last or (told < -1 and face[y, x] != last_face):
                    last, last_face = i, face[y, x]
                    first = bodies.first_plane[bodies.shape[i]]
                    is_hull = first < bodies.first_plane[bodies.shape[i] + 1]
                    f = last_face if is_hull else -1
                    slot = first_slot[number[i]] + max(f, 0)
                    if row_of[slot] < 0:
                        row_of[slot] = rows
                        parts[surfaces, 0], parts[surfaces, 1], parts[surfaces, 2] = number[i], f, rows
                        surfaces += 1
                        rows += _FACE_ROWS + bodies.corners[first + f] if is_hull else _BALL_ROWS
                    told = -2 - row_of[slot] if is_hull else row_of[slot]
                    any_ball, any_hull = any_ball or not is_hull, any_hull or is_hull
                owner[y, x] = told
        balls[down, across], hulls[down, across] = any_ball, any_hull
    return surfaces, rows


@kernel
def _fill(surfaces, bodies, eye, ahead, factor, position, orientation, paint, table, first, last):
    surfaces, bodies = without_refcounts(surfaces), without_refcounts(bodies)
    for k in range(first, last):
        number, f, start = surfaces.parts[k, 0], surfaces.parts[k, 1], surfaces.parts[k, 2]
        i = surfaces.seen[number]
        place = sub(load_vec3(position, i), to_vec3(eye))
        for channel in range(4):
            table[start + 1, channel] = paint[number, channel]
        if f < 0:
            _put_row(table, start, place, bodies.outer[i])
        else:
            depth = dot(to_vec3(ahead), place)
            _put_face(bodies, i, f, place, depth, load_quat(orientation, i), factor, table, start)


@kernel
def _put_face(bodies, i, f, place, depth, turn, factor, table, start):
    """All rows of a face but that of its paint."""
    m, size, shape = quat_to_matrix(turn), bodies.size[i], bodies.shape[i]
    first = bodies.first_plane[shape]
    normal, offset = _plane(bodies.planes, first + f, m, size, place)
    _put_row(table, start, normal, offset)
    facing, corners = -dot(normal, place) / norm(place), bodies.corners[first + f]
    _put_row(table, start + 2, (facing, depth, float(corners)), 0.0)
    start += _FACE_ROWS
    for edge in range(bodies.first_edge[shape], bodies.first_edge[shape + 1]):
        left, right = bodies.edges[edge, 0], bodies.edges[edge, 1]
        if f in (left, right):
            # How far the plane of the other face is, along this one, changes evenly over the picture too.
            other, beyond = _plane(bodies.planes, first + left + right - f, m, size, place)
            inward = sub(scale(normal, beyond / offset), other)
            _put_row(table, start, scale(inward, factor / norm(cross(normal, other))), 0.0)
            start += 1


@kernel
def _plane(planes, number, m, size, place):
    """Unit normal of a plane in world axes, and its distance from the eye along that."""
    normal = mat_vec(m, to_vec3(planes[number]))
    return normal, dot(normal, place) + planes[number, 3] * size


@kernel
def _put_row(table, number, v, w):
    table[number, 0], table[number, 1], table[number, 2], table[number, 3] = v[0], v[1], v[2], w
